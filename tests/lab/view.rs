//! The session of `simpulse view`, without a page: what a player does, and what is said about a run.

use clap::Parser;
use simpulse::cli::args::Cli;
use simpulse::engine::solvers::{VARIANTS, find};
use simpulse::engine::world::Settings;
use simpulse::lab::scenes::{self, Scene};
use simpulse::lab::trial::Trial;
use simpulse::lab::view::{Request, Session, Source};

fn session(scene: &str, solvers: &[&str]) -> Session {
    let settings = solvers.iter().map(|name| Settings::new(find(name).unwrap())).collect();
    Session::new(Source::named(scene), settings, None).unwrap()
}

fn act(session: &mut Session, request: &str) -> Option<String> {
    let request: Request = serde_json::from_str(request).unwrap_or_else(|e| panic!("{request}: {e}"));
    session.act(&request).unwrap_or_else(|e| panic!("{request:?}: {e}"))
}

fn steps(session: &mut Session, count: u32) {
    for _ in 0..count {
        session.step().unwrap();
    }
}

/// State of every pane.
fn hashes(session: &Session) -> Vec<u64> {
    session.panes().iter().map(|pane| pane.world.state_hash()).collect()
}

#[test]
fn a_crate_follows_the_pointer_under_every_solver() {
    for solvers in VARIANTS.map(|v| v.name).chunks(4) {
        let mut session = session("stack:2", solvers);
        steps(&mut session, 10);
        act(&mut session, r#"{"do":"grab","pane":0,"at":[0.2,2.6]}"#);
        act(&mut session, r#"{"do":"move","at":[3.0,4.0]}"#);
        steps(&mut session, 120);
        for pane in session.panes() {
            let solver = pane.world.settings.solver.name;
            let [x, y] = pane.world.bodies.center(2);
            // Held at (0.2, 0.1) from its center, it hangs below the pointer; the ground's center is at −1 m. Its weight
            // stretches the spring by g/ω² of an effective mass, g/(2π 4)² = 1.6 cm.
            let reach = (x - 3.0).hypot(y - 3.0);
            assert!(pane.failure.is_none() && (reach - 0.23).abs() < 0.1, "{solver}: {x} {y}");
        }
        act(&mut session, r#"{"do":"release"}"#);
        steps(&mut session, 120);
        assert!(session.panes().iter().all(|pane| pane.world.bodies.center(2)[1] < 1.8));
    }
}

#[test]
fn the_same_requests_give_the_same_bits_and_a_reset_the_start() {
    let run = |session: &mut Session| {
        steps(session, 5);
        act(session, r#"{"do":"grab","pane":1,"at":[0.0,3.5]}"#);
        act(session, r#"{"do":"move","at":[1.0,3.5]}"#);
        steps(session, 20);
        act(session, r#"{"do":"release"}"#);
        act(session, r#"{"do":"drop","at":[0.0,9.0]}"#);
        act(session, r#"{"do":"throw","at":[-6.0,3.0],"velocity":[12.0,2.0]}"#);
        act(session, r#"{"do":"poke","seed":4}"#);
        steps(session, 60);
        hashes(session)
    };
    let (mut one, mut other) = (session("stack:5", &["pgs", "shim"]), session("stack:5", &["pgs", "shim"]));
    let first = run(&mut one);
    assert_eq!(first, run(&mut other));
    assert_eq!(one.panes()[0].world.bodies.len(), 8);
    act(&mut one, r#"{"do":"poke","seed":null}"#);
    act(&mut one, r#"{"do":"reset"}"#);
    assert_eq!((one.step_index(), one.panes()[0].world.bodies.len()), (0, 6));
    assert_eq!(first, run(&mut one));
}

#[test]
fn untouched_a_pane_is_the_run_that_a_study_judges() {
    for (scene, solver) in [("stack:5", "shim"), ("stack:5", "pgs"), ("bounce", "soft_step")] {
        let mut loaded = scenes::load(scene).unwrap();
        let (count, tolerances) = (loaded.scene.steps, loaded.tolerances);
        let mut session = session(scene, &["sor", solver]);
        steps(&mut session, count);
        let settings = Settings { record_impulses: true, ..Settings::new(find(solver).unwrap()) };
        let found = Trial::of(&mut loaded, settings).run(&mut |_| Ok(())).unwrap();
        let pane = &session.panes()[1];
        assert_eq!(pane.world.state_hash(), found.world.state_hash());
        let (errors, (good, text)) = (found.errors.unwrap(), pane.verdict());
        let over = errors.penetration(tolerances.rest.is_some()) > tolerances.penetration.value
            || errors.law_rms_lighter() > tolerances.residual.value
            || tolerances.rest.is_some_and(|t| errors.rest_velocity() > t.value)
            || tolerances.truth.is_some_and(|t| found.truth.unwrap().error.unwrap() > t.value);
        assert_eq!(good, !over && found.broken.is_none(), "{scene} {solver}: {text}");
        assert!(!text.contains("so far") && text.starts_with(if good { "good" } else { "not" }), "{text}");
    }
}

#[test]
fn a_verdict_says_why() {
    let mut session = session("stack:12", &["pgs"]);
    steps(&mut session, 30);
    assert!(session.panes()[0].verdict().1.contains("so far"));
    // A crate of the middle is pulled out.
    act(&mut session, r#"{"do":"grab","pane":0,"at":[0.0,6.5]}"#);
    act(&mut session, r#"{"do":"move","at":[5.0,6.5]}"#);
    steps(&mut session, 120);
    let (good, text) = session.panes()[0].verdict();
    assert!(!good && text.contains("because body") && text.contains("fell at step"), "{text}");
}

#[test]
fn what_is_cut_comes_apart_in_all_panes() {
    let mut session = session("pendulum", &["soft_step", "shim"]);
    let refused: Request = serde_json::from_str(r#"{"do":"cut","pane":0,"at":[50,50],"reach":0.1}"#).unwrap();
    assert!(session.act(&refused).unwrap_err().to_string().contains("no joint"));
    let version = session.version();
    let joints = |session: &Session| session.panes().iter().map(|p| p.world.joints().count()).sum::<usize>();
    assert_eq!(joints(&session), 2);
    act(&mut session, r#"{"do":"cut","pane":1,"at":[0.0,0.0],"reach":0.1}"#);
    assert!(joints(&session) == 0 && session.version() > version);
    let height =
        |session: &Session| session.panes().iter().map(|p| p.world.bodies.center(1)[1]).collect::<Vec<_>>();
    let high = height(&session);
    steps(&mut session, 60);
    // In a second it falls by g/2, and by up to g Δt/2 more because time is in steps.
    assert!(height(&session).iter().zip(&high).all(|(now, high)| (5.0..5.1).contains(&(high - now))));
}

#[test]
fn settings_and_scenes_change_and_bad_values_change_nothing() {
    let mut session = session("stack:3", &["soft_step", "shim"]);
    act(&mut session, r#"{"do":"parameter","pane":0,"name":"contact_hertz","value":60}"#);
    let budget = r#"{"substeps":7,"velocity_iterations":2,"relax_iterations":1,"position_iterations":0}"#;
    act(&mut session, &format!(r#"{{"do":"budget","pane":1,"budget":{budget}}}"#));
    act(&mut session, r#"{"do":"treatment","pane":0,"frozen":"off","impacts":"waves","threads":2}"#);
    act(&mut session, r#"{"do":"scene","size":6,"friction":0.5}"#);
    act(&mut session, r#"{"do":"scene","gravity":5}"#);
    let settings = |session: &Session| {
        session.panes().iter().map(|p| format!("{:?}", p.world.settings)).collect::<String>()
    };
    let own = &session.panes()[1].world;
    assert_eq!((own.settings.budget.substeps, own.bodies.len(), own.settings.gravity), (7, 7, [0.0, -5.0]));
    steps(&mut session, 10);
    assert!((session.panes()[0].world.contacts[0].friction - 0.3).abs() < 1e-6);
    let before = (settings(&session), hashes(&session));
    for (request, part) in [
        (r#"{"do":"parameter","pane":0,"name":"contact_hertz","value":-1}"#.to_string(), "contact_hertz"),
        (r#"{"do":"parameter","pane":0,"name":"hertz","value":1}"#.to_string(), "hertz"),
        (format!(r#"{{"do":"budget","pane":9,"budget":{budget}}}"#), "9"),
        (r#"{"do":"scene","size":0}"#.to_string(), "'0'"),
        (r#"{"do":"scene","friction":-1}"#.to_string(), "friction"),
        (r#"{"do":"scene","gravity":1e9}"#.to_string(), "gravity"),
        (r#"{"do":"drop","at":[1e300,0]}"#.to_string(), "at"),
        (r#"{"do":"throw","at":[0,0],"velocity":[1e30,0]}"#.to_string(), "velocity"),
    ] {
        let error = session.act(&serde_json::from_str(&request).unwrap()).unwrap_err().to_string();
        assert!(error.contains(part), "{request}: {error}");
        assert_eq!((settings(&session), hashes(&session)), before, "{request}");
    }
}

#[test]
fn texts_run_the_same_elsewhere() {
    let mut session = session("stack:4", &["soft_step", "shim"]);
    act(&mut session, r#"{"do":"parameter","pane":0,"name":"contact_hertz","value":45}"#);
    steps(&mut session, 3);
    let command = act(&mut session, r#"{"do":"text","what":"command","pane":0}"#).unwrap();
    assert!(
        command.contains("stack:4 --solver soft_step") && command.contains("contact_hertz=45"),
        "{command}"
    );
    Cli::try_parse_from(command.split_whitespace()).unwrap();
    let rust = act(&mut session, r#"{"do":"text","what":"rust","pane":0}"#).unwrap();
    for part in ["find(\"soft_step\")?", "substeps: 4", "\"contact_hertz\", 45.0)?", "World::new(settings)"] {
        assert!(rust.contains(part), "{part}: {rust}");
    }
    act(&mut session, r#"{"do":"scene","friction":2}"#);
    let file = act(&mut session, r#"{"do":"text","what":"scene","pane":1}"#).unwrap();
    let scene = Scene::from_json(&file, "scene.json".as_ref()).unwrap();
    assert!(scene.bodies.iter().flat_map(|b| &b.shapes).all(|s| (s.friction - 1.2).abs() < 1e-9));
    let command = act(&mut session, r#"{"do":"text","what":"command","pane":1}"#).unwrap();
    assert!(command.starts_with("simpulse run scene.json"), "{command}");
}

#[test]
fn a_recording_has_a_panel_for_each_pane() {
    let mut session = session("stack:3", &["soft_step", "shim"]);
    assert!(session.replay().is_none());
    act(&mut session, r#"{"do":"record","on":true}"#);
    steps(&mut session, 20);
    // A body that joins ends it.
    act(&mut session, r#"{"do":"drop","at":[0.0,8.0]}"#);
    let page = session.replay().unwrap();
    assert_eq!(page.matches("<figure").count(), 2);
    steps(&mut session, 5);
}
