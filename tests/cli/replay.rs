//! `run --picture` and `run --record`, and the page that plays recordings.

use crate::browser::drive;
use crate::{refused, simpulse, succeeds};
use std::path::{Path, PathBuf};

#[test]
fn a_picture_shows_a_frame() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let run = "run stack:4 --step 30 --solver pgs --set baumgarte=0.2 --picture a.svg --width 500";
    let text = succeeds(path, run);
    assert!(text.contains("stack:4") && text.contains("step 30") && text.contains("baumgarte 0.2"), "{text}");
    let svg = std::fs::read_to_string(path.join("a.svg")).unwrap();
    for part in ["<svg", "width=\"500\"", "body 4, deepest overlap", "N·s"] {
        assert!(svg.contains(part), "{part}");
    }
    for (options, parts) in [
        ("stack:4 --picture a.png", &["a.png", ".svg"][..]),
        ("stack:4 --picture b.svg --width 9", &["width", "9", "400"]),
        ("staack --picture b.svg", &["'staack'", "'stack'"]),
        ("stack:4 --picture b.svg --lanes 3", &["lanes", "3"]),
        ("stack:4 --picture b.svg --scale 0mm", &["--scale", "0mm"]),
        ("stack:4 --picture b.svg --state s.csv", &["--picture", "--state"]),
        ("stack:4 --step 9", &["--picture"]),
    ] {
        refused(path, &format!("run {options}"), parts);
    }
    // All pictures have the same scale: micrometers are invisible unless a scale of micrometers is requested.
    let colors = |options: &str| {
        succeeds(path, &format!("run stack:2 --without frames --picture c.svg {options}"));
        let text = std::fs::read_to_string(path.join("c.svg")).unwrap();
        let bodies = text.lines().filter(|line| line.contains("<title>body"));
        let fill = |line: &str| Some(line.split_once("fill=\"")?.1[..7].to_string());
        bodies.filter_map(fill).collect::<Vec<String>>()
    };
    let (coarse, fine) = (colors(""), colors("--scale 5um"));
    assert!(coarse[1..].iter().all(|color| *color == coarse[1]) && fine[1..] != coarse[1..], "{fine:?}");
    // The same frame is the same picture at every width, apart from the line that names the lanes.
    let at = |lanes: u32| succeeds(path, &format!("run arch --step 20 --picture - --lanes {lanes}"));
    let [one, eight] =
        [1, 8].map(|lanes| at(lanes).replace(&format!("{lanes} lane"), "lane").replace("lanes", "lane"));
    assert!(one.lines().count() > 100 && one == eight);
}

#[test]
fn bad_recordings_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    for (options, parts) in [
        ("--record no/such/a.html", &["no/such/a.html"][..]),
        ("--record a.html --state s.csv", &["--record", "--state"]),
        ("--record-contacts", &["--record"]),
        ("--solvers pgs,soft_step", &["--record"]),
        ("--record a.html --solvers pgs,soft_step --solver pgs", &["--solver"]),
        ("--record a.html --solvers pgs,sor,tgs_ngs,soft_step,shim", &["5", "4"]),
        ("--record a.html --solvers pgs,soft_step --relax-iterations 2", &["relax", "pgs"]),
    ] {
        refused(folder.path(), &format!("run stack:3 {options}"), parts);
    }
}

/// A page with two recordings of two seconds.
fn page(folder: &Path) -> PathBuf {
    let run = "run pyramid:8 --steps 120 --solvers pgs,soft_step --record-contacts --record r.html";
    let text = succeeds(folder, run);
    assert!(text.contains("pyramid:8: pgs, ") && text.contains("holds\nwrote r.html ("), "{text}");
    folder.join("r.html")
}

#[test]
fn every_k_th_step_is_recorded_and_a_run_that_diverges_up_to_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    succeeds(path, "run stack:3 --steps 60 --record some.html --every 6");
    let script = "return { frames: document.querySelector('.replay').player.recordings[0].frames.length };";
    let frames = |name: &str| Some(drive(&path.join(name), "", script)?["frames"].clone());
    assert!(frames("some.html").is_none_or(|n| n == 11));
    let scene = r#"{"name":"fast","bodies":[
        {"type":"dynamic","position":[5,0],"velocity":[200000,0],"shapes":[{"circle":{"radius":1}}]}]}"#;
    std::fs::write(path.join("fast.json"), scene).unwrap();
    let output = simpulse(path, "run fast.json --record fast.html");
    assert!(String::from_utf8_lossy(&output.stdout).contains("blew up at step 1"), "{output:?}");
    assert!(frames("fast.html").is_none_or(|n| n == 1));
}

#[test]
fn the_controls_do_what_they_say() {
    let folder = tempfile::tempdir().unwrap();
    let found = drive(
        &page(folder.path()),
        "t=0.5&zoom=2",
        r#"
        const root = document.querySelector(".replay"), { state } = root.player;
        const get = (name) => root.querySelector("." + name);
        const [scene, curves] = ["scene", "curves"].map(get);
        const out = { panels: root.querySelectorAll("canvas.scene").length, end: root.player.end,
            frames: root.player.recordings.map((r) => r.frames.length), t: state.time, zoom: state.zoom };
        const hash = () => [...root.querySelectorAll("canvas.scene")].map((c) => c.toDataURL().length + c.toDataURL().slice(-4000)).join();
        const color = (canvas) => getComputedStyle(canvas.parentElement).getPropertyValue("--own").match(/\w\w/g).map((v) => parseInt(v, 16));
        get("forth").click(); out.forth = state.time;
        get("back").click(); get("back").click(); out.back = state.time;
        const slider = root.querySelector("input[type=range]");
        slider.value = 0; slider.dispatchEvent(new Event("input")); out.start = state.time; const first = hash();
        slider.value = 100; slider.dispatchEvent(new Event("input")); out.late = state.time; out.moved = hash() !== first;
        get("fit").click(); out.fit = state.zoom; const plain = hash();
        out.ground = pixels(scene, [0xd3, 0xd8, 0xde]); out.arrows = pixels(scene, [0x00, 0x72, 0xb2]);
        out.curves = Math.min(...[...root.querySelectorAll("canvas.curves")].map((c) => pixels(c, color(c))));
        scene.dispatchEvent(new WheelEvent("wheel", { deltaY: -400, bubbles: true, cancelable: true }));
        out.wheel = state.zoom; out.zoomed = hash() !== plain;
        get("fit").click(); out.same = hash() === plain;
        scene.dispatchEvent(new PointerEvent("pointermove", { buttons: 1, movementX: 40, movementY: 10 }));
        out.panned = state.x < 0 && state.y > 0;
        get("fit").click();
        get("forces").click(); out.without = hash() !== plain;
        get("forces").click(); get("depths").click(); out.gray = hash() !== plain; get("depths").click();
        root.dispatchEvent(new KeyboardEvent("keydown", { key: "End" })); out.last = state.time;
        root.dispatchEvent(new KeyboardEvent("keydown", { key: "Home" })); out.home = state.time;
        get("play").click(); out.playing = state.playing;
        // However slow the machine; a browser that shows no frames plays none.
        let ticks = 0;
        const tick = () => { ticks += 1; requestAnimationFrame(tick); };
        requestAnimationFrame(tick);
        for (let i = 0; i < 200 && !(state.time > 0); i++) await pause(50);
        get("play").click(); out.played = state.time > 0 || ticks < 3; out.paused = !state.playing;
        curves.dispatchEvent(new PointerEvent("pointerdown", { clientX: curves.getBoundingClientRect().left + 0.5 * curves.clientWidth }));
        out.picked = Math.abs(state.time - 1) < 0.02;
        out.text = root.querySelector("output").textContent.includes("of 2.00 s");
        return out;
        "#,
    );
    let Some(found) = found else { return };
    assert_eq!(found["frames"], serde_json::json!([121, 121]), "{found}");
    let number = |name: &str| found[name].as_f64().unwrap_or_else(|| panic!("{name}: {found}"));
    let step = 1.0 / 60.0;
    for (name, value) in [("panels", 2.0), ("end", 2.0), ("t", 0.5), ("zoom", 2.0), ("forth", 0.5 + step)]
        .into_iter()
        .chain([("back", 0.5 - step), ("start", 0.0), ("late", 100.0 * step), ("fit", 1.0), ("last", 2.0)])
        .chain([("home", 0.0)])
    {
        assert!((number(name) - value).abs() < 1e-6, "{name}: {found}");
    }
    for (name, least) in [("wheel", 1.5), ("ground", 2000.0), ("arrows", 100.0), ("curves", 80.0)] {
        assert!(number(name) > least, "{name}: {found}");
    }
    for name in [
        "moved", "zoomed", "same", "panned", "without", "gray", "playing", "played", "paused", "picked",
        "text",
    ] {
        assert_eq!(found[name], true, "{name}: {found}");
    }
}

#[test]
fn a_damaged_page_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = page(folder.path());
    let text = std::fs::read_to_string(&path).unwrap();
    let stream = "<script type=\"application/octet-stream\">";
    std::fs::write(&path, text.replacen(stream, &format!("{stream}AAAA"), 1)).unwrap();
    let script = "return { text: document.querySelector('.replay .failed').textContent };";
    let Some(found) = drive(&path, "", script) else { return };
    assert!(found["text"].as_str().unwrap().contains("cannot be played"), "{found}");
}
