//! Profiling: counts match the work of the kernels, and the world is not affected.

use crate::common::{scene, settings, with_width};
use simpulse::engine::clock::Phase;
use simpulse::engine::constraints::{Features, Layout, OppositeKind};
use simpulse::engine::contacts::Contact;
use simpulse::engine::lanes::{LaneWidth, Operations};
use simpulse::engine::solvers::{DEFAULT, VARIANTS, find};
use simpulse::engine::world::{Component, HeldWorld, Order, Probe, Settings, World};
use simpulse::lab::profile::traffic;
use std::path::Path;
use std::process::{Command, Output};

fn settled(name: &str, settings: Settings, steps: u32) -> World {
    crate::common::run(&scene(name), settings, steps)
}

fn probe(frozen: &mut HeldWorld, phase: Phase) -> Probe {
    *frozen.probes().iter().find(|p| p.phase == phase).unwrap()
}

/// Sum of these counts, multiplied by `times`.
fn sum(all: &[Operations], times: u64) -> Operations {
    let of = |count: fn(&Operations) -> u64| times * all.iter().map(count).sum::<u64>();
    Operations {
        adds: of(|o| o.adds),
        multiplies: of(|o| o.multiplies),
        multiply_adds: of(|o| o.multiply_adds),
        divisions: of(|o| o.divisions),
        choices: of(|o| o.choices),
    }
}

/// One box on static ground, and one box on another on the ground. Operations per contact are counted by hand
/// in the kernel source, for two points with friction.
#[test]
fn operations_are_those_counted_by_hand() {
    // On static ground, body a has no part.
    //
    // warm start, per point and axis: an addition to the sum, and I r × u (a multiplication) applied by a
    // multiply-add. Then the sums are rotated back (2 multiplications, 2 multiply-adds) and applied to x and
    // y of b (2 multiply-adds).
    let warm_static =
        Operations { adds: 4, multiplies: 4 + 2, multiply_adds: 4 + 4, ..Operations::default() };
    // soft sweep:
    //   velocities and motions into the frame        4 multiplications, 4 multiply-adds
    //   sine and versine of both turns               6 multiplications, 4 multiply-adds
    //   per point: separation 1 addition, 2 multiply-adds; the rule's line 4 multiplications,
    //     1 multiply-add, 4 choices; vn, vt and the resulting impulses 4 multiply-adds
    //   normal rows: clamp 1 choice, increment and sum 2 additions each
    //   friction rows: bound 1 multiplication, clamp 2 choices, increment and sum 2 additions each
    //   response of a later row to an increment: I r × u times the other arm, times the slope,
    //     2 multiplications, 2 multiply-adds; normal to normal 1, normal to friction 4, friction to
    //     friction 1
    //   the spin of b after each of 4 increments     4 multiplications, 4 multiply-adds
    //   applied as above                             2 multiplications, 4 multiply-adds
    let answers = 1 + 4 + 1;
    let soft_static = Operations {
        adds: 2 * (1 + 2 + 2),
        multiplies: 4 + 6 + 2 * 4 + 2 + 2 * answers + 4 + 2,
        multiply_adds: 4 + 4 + 2 * (2 + 1 + 4) + 2 * answers + 4 + 4,
        divisions: 0,
        choices: 2 * (4 + 1 + 2),
    };
    // Against a dynamic body: differences of velocities and motions (4 additions), and the sum of the masses
    // (1). One more multiply-add for each use of an arm (4 per point). One more multiplication and
    // multiply-add for each response and each spin. 2 multiply-adds to apply.
    let soft_dynamic = Operations {
        adds: soft_static.adds + 5,
        multiplies: soft_static.multiplies + answers + 4,
        multiply_adds: soft_static.multiply_adds + 2 * 4 + answers + 4 + 2,
        ..soft_static
    };
    let warm_dynamic = Operations {
        multiplies: warm_static.multiplies + 4,
        multiply_adds: warm_static.multiply_adds + 4 + 2,
        ..warm_static
    };
    for (boxes, warm, soft) in [
        (1, vec![warm_static], vec![soft_static]),
        (2, vec![warm_static, warm_dynamic], vec![soft_static, soft_dynamic]),
    ] {
        let mut world = settled(&format!("stack:{boxes}"), settings(find("soft_step").unwrap()), 5);
        assert_eq!((world.counts.contacts, world.counts.points), (boxes, 2 * boxes));
        let mut frozen = world.hold();
        let found = probe(&mut frozen, Phase::WarmStart);
        assert_eq!(found.operations, Some(sum(&warm, 1)), "{boxes} boxes");
        let found = probe(&mut frozen, Phase::Solve);
        assert_eq!((found.passes, found.counted_contacts, found.rows), (4, boxes, 4 * boxes));
        assert_eq!(found.operations, Some(sum(&soft, 4)), "{boxes} boxes");
    }
}

/// A chain of 21 hinges, counted in the source of `constraints/joints/rows.rs`.
#[test]
fn operations_of_joints_are_those_counted_by_hand() {
    // Sine and versine of both turns: 6 multiplications, 4 multiply-adds. Rotation of both anchors: 4 and 4.
    // The arms and the offset between the anchors: 12 additions. Each row applied: 4 multiplications, 6
    // multiply-adds.
    let placed = Operations { adds: 12, multiplies: 6 + 4, multiply_adds: 4 + 4, ..Operations::default() };
    let warm = Operations { multiplies: 10 + 2 * 4, multiply_adds: 8 + 2 * 6, ..placed };
    // Per row: J v, 2 additions, 1 multiplication, 3 multiply-adds; the requested impulse, 1 of each; the new
    // impulse, 2 additions with its increment, 2 multiply-adds; applied as above. K: an addition, and for
    // each of 3 entries 4 multiplications and 3 multiply-adds. Solving by its determinant, which may be zero:
    // 5 and 3, a division and a choice.
    let sweep = Operations {
        adds: 12 + 2 * (2 + 1 + 2) + 1,
        multiplies: 10 + 2 * (1 + 1 + 4) + 3 * 4 + 5,
        multiply_adds: 8 + 2 * (3 + 1 + 2 + 6) + 3 * 3 + 3,
        divisions: 1,
        choices: 1,
    };
    let mut world = settled("hanging_chain", settings(find("soft_step").unwrap()), 5);
    let mut frozen = world.hold();
    for (phase, each) in [(Phase::WarmStart, warm), (Phase::Solve, sweep), (Phase::Relax, sweep)] {
        let found = probe(&mut frozen, phase);
        assert_eq!((found.passes, found.counted_contacts), (4, 0));
        assert_eq!(found.operations, Some(sum(&[each], 4 * 21)), "{phase:?}");
    }
}

#[test]
fn bytes_are_those_of_the_layout() {
    let solver = find("soft_step").unwrap();
    for (width, lanes) in [(LaneWidth::W1, 1.0), (LaneWidth::W8, 8.0)] {
        let mut world = settled("stack:2", with_width(solver, width), 5);
        let mut frozen = world.hold();
        let features = Features { restitution: false, damping: false, ..Features::FULL };
        assert_eq!(frozen.features(), features);
        let [on_ground, on_box] = [OppositeKind::Static, OppositeKind::Dynamic]
            .map(|kind| Layout::for_features(&features, kind).bytes(kind) as f64);
        let solve = probe(&mut frozen, Phase::Solve);
        let found = traffic::of(&frozen, &solve);
        // Reads: a whole record and its indices, one row or two. Writes: four impulses, and one half row or
        // two. A batch has all its lanes, filled or not.
        assert_eq!(found.read, lanes * (on_ground + 32.0 + on_box + 64.0));
        assert_eq!(found.written, lanes * (16.0 + 16.0 + 16.0 + 32.0));
        // Records and indices once, three bodies and the inert row.
        assert_eq!(found.working_set, lanes * (on_ground + on_box) + 4.0 * 32.0);
        // Without separation, friction coefficient and masses: 1 + 2 · 3 floats less.
        let [warm, collide] = [Phase::WarmStart, Phase::Collide].map(|phase| probe(&mut frozen, phase));
        let warm = traffic::of(&frozen, &warm);
        assert_eq!(warm.read, found.read - lanes * 2.0 * 4.0 * 7.0);
        let collide = traffic::of(&frozen, &collide);
        // Five quads of two contacts, and the poses of three bodies.
        assert_eq!(collide.written, 2.0 * 80.0 + 3.0 * 32.0);
    }
}

/// Every phase of a solver requests bytes, and every pass over contacts counts its operations.
#[test]
fn every_pass_of_every_solver_has_its_traffic() {
    for solver in &VARIANTS {
        let mut world = settled("pyramid:6", settings(solver), 5);
        let mut frozen = world.hold();
        let probes = frozen.probes();
        assert!(probes.iter().any(|p| p.phase == Phase::Solve), "{}", solver.name);
        for probe in probes {
            let bytes = traffic::of(&frozen, &probe);
            let place = format!("{} {:?}: {probe:?}", solver.name, probe.phase);
            assert!(bytes.read > 0.0 && bytes.written > 0.0 && bytes.working_set > 0.0, "{place} {bytes:?}");
            if probe.phase.is_sweep() {
                // Bodies of two thirds of the contacts are gathered, or vectors are read.
                assert!(bytes.read > 32.0 * frozen.world().counts.contacts as f64, "{place} {bytes:?}");
                let by_contact = probe.per_contact.iter().flatten().any(|&each| each > 0.0);
                assert_eq!(by_contact, probe.operations.is_some_and(|o| o.flops() > 0), "{place}");
            }
        }
    }
}

/// Counted by hand: a Jacobi sweep gathers the bodies' sums in addition to their velocities, a position sweep
/// reads no impulses, and a block sweep is as wide as a plain one.
#[test]
fn passes_that_are_not_plain_sweeps_ask_for_what_they_read() {
    let per_contact = |solver: &str, phase: Phase| {
        let mut world = settled("stack:3", settings(find(solver).unwrap()), 5);
        probe(&mut world.hold(), phase).per_contact
    };
    let [dynamic, _, ground] = per_contact("pgs", Phase::Solve);
    // Normal, friction; eight arms, two separations, four masses and four impulses.
    assert_eq!(dynamic, [3.0 + 8.0 + 2.0 + 4.0 + 4.0, 4.0, 2.0, 2.0]);
    assert_eq!(ground, [3.0 + 4.0 + 2.0 + 4.0 + 4.0, 4.0, 1.0, 1.0]);
    assert_eq!(per_contact("pgs_ngs_block", Phase::Solve), [dynamic, [0.0; 4], ground]);
    let with_sums = |[read, written, rows, halves]: [f64; 4]| [read, written, 2.0 * rows, halves];
    assert_eq!(per_contact("jacobi", Phase::Solve), [with_sums(dynamic), [0.0; 4], with_sums(ground)]);
    // Normal; arms, separations and masses.
    let [dynamic, _, ground] = per_contact("pgs_ngs_block", Phase::Position);
    assert_eq!((dynamic, ground), ([2.0 + 8.0 + 4.0, 0.0, 2.0, 2.0], [2.0 + 4.0 + 4.0, 0.0, 1.0, 1.0]));
}

/// For several solvers, scenes and orders: every phase alone, counted and reset, then a whole step. The steps
/// after that must have the same bits as without profiling.
#[test]
fn the_next_step_does_not_notice() {
    let scenes = [("pyramid:6", 30), ("circle_pile:60", 40), ("bounce", 100), ("crowded_plate", 4)];
    for (name, steps) in scenes {
        for solver in &VARIANTS {
            for (width, order) in [
                (LaneWidth::W1, Order::Natural),
                (LaneWidth::W4, Order::Colored),
                (LaneWidth::W8, Order::Colored),
            ] {
                let settings = Settings { order, ..with_width(solver, width) };
                let mut plain = settled(name, settings.clone(), steps);
                let mut profiled = settled(name, settings, steps);
                let mut frozen = profiled.hold();
                for probe in frozen.probes() {
                    frozen.repeat(probe.phase, 3);
                    frozen.reset(probe.phase);
                    frozen.repeat(probe.phase, 1);
                }
                // Whole steps leave a state from which phases can continue.
                frozen.step(false);
                frozen.step(true);
                frozen.repeat(Phase::Collide, 2);
                frozen.repeat(Phase::Store, 2);
                drop(frozen);
                for step in 0..5 {
                    // A run that diverges does so in both worlds.
                    assert_eq!(plain.step().is_ok(), profiled.step().is_ok());
                    let place = format!("{name} {} {width:?} {order:?}, step {step}", solver.name);
                    assert_eq!(plain.state_hash(), profiled.state_hash(), "{place}");
                    assert_eq!(plain.contacts, profiled.contacts, "{place}");
                    assert_eq!(plain.counts, profiled.counts, "{place}");
                }
            }
        }
    }
}

#[test]
fn a_reset_brings_back_rows_and_records() {
    for phase in [Phase::WarmStart, Phase::Solve, Phase::Relax, Phase::Integrate, Phase::Store] {
        let mut world = settled("pyramid:5", settings(find(DEFAULT).unwrap()), 10);
        let mut frozen = world.hold();
        let state = |f: &HeldWorld| {
            let floats: &[f32] = bytemuck::cast_slice(f.workspace().lanes.records());
            (f.workspace().rows.clone(), floats.to_vec(), f.world().state_hash())
        };
        let before = state(&frozen);
        frozen.repeat(phase, 2);
        assert_ne!(state(&frozen), before, "{phase:?} does nothing");
        frozen.reset(phase);
        assert_eq!(state(&frozen), before, "{phase:?}");
    }
}

#[test]
fn each_solver_has_the_phases_of_its_schedule() {
    for (solver, has, has_not) in [
        (
            "soft_step",
            vec![Phase::Solve, Phase::Relax, Phase::WarmStart],
            vec![Phase::Position, Phase::Restitution],
        ),
        ("pgs", vec![Phase::Solve, Phase::WarmStart], vec![Phase::Relax, Phase::Position]),
        ("projection", vec![Phase::Solve, Phase::Position], vec![Phase::WarmStart, Phase::Relax]),
    ] {
        let mut world = settled("pyramid:4", settings(find(solver).unwrap()), 3);
        let probes = world.hold().probes();
        let passes = |phase: Phase| probes.iter().find(|p| p.phase == phase).map_or(0, |p| p.passes);
        assert!(has.iter().all(|&p| passes(p) > 0), "{solver}: {probes:?}");
        assert!(has_not.iter().all(|&p| passes(p) == 0), "{solver}: {probes:?}");
        let budget = world.settings.budget;
        assert_eq!(passes(Phase::Solve), budget.substeps * budget.velocity_iterations, "{solver}");
    }
    let mut world = settled("bounce", settings(find("box2d").unwrap()), 3);
    assert!(world.hold().probes().iter().any(|p| p.phase == Phase::Restitution && p.passes == 1));
}

#[test]
fn memory_is_what_arrays_hold() {
    let world = settled("pyramid:10", settings(find(DEFAULT).unwrap()), 3);
    let memory = world.memory();
    // Continuous collision is optional.
    let has = |c: &Component| c.used > 0 || c.name == "continuous collision";
    assert!(memory.components.iter().all(|c| c.used <= c.held && has(c)), "{memory:?}");
    let contact = size_of::<Contact>();
    assert!(memory.of("contacts").used >= world.counts.contacts * contact);
    assert!(memory.of("records").used >= world.counts.constraint_bytes);
    assert_eq!(memory.held(), memory.components.iter().map(|c| c.held).sum::<usize>());
    assert_eq!(memory.of("nothing").held, 0);
    let empty = World::new(settings(find(DEFAULT).unwrap()));
    assert_eq!(empty.memory().used(), 0);
}

fn simpulse(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_simpulse")).current_dir(folder).args(args).output().unwrap()
}

fn entries(folder: &Path) -> Vec<String> {
    let names = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = names.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn bad_requests_name_the_value_and_what_there_is() {
    let folder = tempfile::tempdir().unwrap();
    let table: &[(&[&str], &[&str])] = &[
        (&["profile", "staack"], &["unknown scene 'staack'", "'stack'"]),
        (&["profile", "stack:2", "--phase", "solv"], &["'solv'", "pairs", "warm-start", "store", "all"]),
        (&["profile", "stack:2", "--phase", "position"], &["'position'", "shim", "solve", "relax"]),
        (&["profile", "stack:2", "--phase", "restitution"], &["'restitution'", "integrate"]),
        (&["profile", "stack:2", "--seconds", "0"], &["seconds", "0"]),
        (&["profile", "stack:2", "--seconds", "-1"], &["seconds", "-1"]),
        (&["profile", "stack:2", "--seconds", "nan"], &["seconds", "NaN"]),
        (&["profile", "stack:2", "--lanes", "5"], &["lanes", "5"]),
        (&["profile", "stack:2", "--substeps", "0"], &["substeps", "0"]),
        (&["profile", "stack:2", "--solver", "softstep"], &["'softstep'", "'soft_step'"]),
        (&["profile", "stack:2", "--roofline", "r.svg", "--no-ceilings"], &["roofline", "--no-ceilings"]),
        (&["profile", "stack:2", "--roofline", "no/such/r.svg"], &["no/such/r.svg"]),
        (&["growth", "--scene", "pyramidd"], &["'pyramidd'", "'pyramid'"]),
        (&["growth", "--scene", "free_fall"], &["free_fall", "no contacts"]),
        (&["growth", "--contacts", "1e3,many"], &["'many'"]),
        (&["growth", "--contacts", "0"], &["'0'"]),
        (&["growth", "--lanes", "3"], &["lanes", "3"]),
        (&["growth", "--repeats", "0"], &["repeats", "0"]),
        (&["growth", "--scene", "missing.json"], &["missing.json"]),
    ];
    for (args, parts) in table {
        let output = simpulse(folder.path(), args);
        let message = String::from_utf8(output.stderr).unwrap();
        // Progress may come before the error.
        let last = message.trim_end().lines().last().unwrap_or_default();
        assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
        assert!(last.starts_with("error: "), "{args:?}: {message}");
        for part in *parts {
            assert!(last.contains(part), "{args:?}: '{part}' is not in: {last}");
        }
        assert!(output.stdout.is_empty(), "{args:?}");
        assert!(entries(folder.path()).is_empty(), "{args:?}: {:?}", entries(folder.path()));
    }
}

#[test]
fn a_profile_prints_every_phase_and_draws_a_whole_picture() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["profile", "stack:5", "--seconds", "0.05", "--settle", "12", "--roofline", "roof.svg"];
    let output = simpulse(folder.path(), &args);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for part in
        ["pairs", "warm start", "relax", "integrate", "penetration", "GFLOP/s", "DRAM", "wrote roof.svg"]
    {
        assert!(text.contains(part), "'{part}' is not in\n{text}");
    }
    assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    let picture = std::fs::read_to_string(folder.path().join("roof.svg")).unwrap();
    assert!(picture.starts_with("<svg") && picture.trim_end().ends_with("</svg>"));
    assert!(picture.contains("solve") && picture.contains("not counted: pairs"));
    assert_eq!(entries(folder.path()), ["roof.svg"]);
    // One phase, nothing else.
    let args = ["profile", "stack:5", "--phase", "warm-start", "--seconds", "0.02", "--no-ceilings"];
    let output = simpulse(folder.path(), &args);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("warm start:") && !text.contains("DRAM"), "{text}");
    // A scene without contacts has phases that do no work.
    let args = ["profile", "free_fall", "--seconds", "0.02", "--settle", "0"];
    let output = simpulse(folder.path(), &args);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("0 contacts") && !text.contains("NaN") && !text.contains("inf"), "{text}");
}

#[test]
fn growth_writes_a_row_per_size() {
    let folder = tempfile::tempdir().unwrap();
    for (scene, contacts, rows) in [("stack", "30,100,1e7", 2), ("stack:3", "9,30", 2)] {
        let args = [
            "growth",
            "--scene",
            scene,
            "--contacts",
            contacts,
            "--repeats",
            "2",
            "--settle",
            "3",
            "--out",
            "g",
        ];
        let output = simpulse(folder.path(), &args);
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(text.contains("whole step:") && text.contains("contacts^"), "{text}");
        // Size 10⁷ does not exist: reported, but not a failure.
        assert_eq!(text.contains("skipped: 10000000"), scene == "stack", "{text}");
        let csv = std::fs::read_to_string(folder.path().join("g/growth.csv")).unwrap();
        assert_eq!(csv.lines().count(), 1 + rows, "{csv}");
        let mut reader = csv::Reader::from_reader(csv.as_bytes());
        let at = reader.headers().unwrap().iter().position(|h| h == "contacts").unwrap();
        let found: Vec<f64> = reader.records().map(|r| r.unwrap()[at].parse().unwrap()).collect();
        assert_eq!(found, if scene == "stack" { [30.0, 100.0] } else { [9.0, 30.0] });
        assert!(std::fs::read_to_string(folder.path().join("g/growth.svg")).unwrap().contains("bytes held"));
        assert_eq!(entries(&folder.path().join("g")), ["growth.csv", "growth.svg"]);
    }
}

/// The file of each solver states the bytes that the sweeps of a step request at its standard budget, warm
/// start included: bytes per contact of a pyramid of ten, for contacts of two points with friction, at one
/// lane (no padding).
#[test]
fn files_of_solvers_say_how_many_bytes_a_step_requests() {
    let mut wrong = String::new();
    for variant in VARIANTS {
        let mut world = settled("pyramid:10", with_width(find("soft_step").unwrap(), LaneWidth::W1), 30);
        world.settings.solver = variant;
        world.settings.parameters = variant.defaults();
        world.settings.budget = variant.budget;
        let contacts = world.counts.contacts as f64;
        let mut frozen = world.hold();
        let sweeps = [Phase::WarmStart, Phase::Solve, Phase::Relax, Phase::Position];
        let probes = frozen.probes();
        let of_sweeps = probes.iter().filter(|p| sweeps.contains(&p.phase));
        let bytes: f64 = of_sweeps.map(|p| f64::from(p.passes) * traffic::of(&frozen, p).total()).sum();
        let path = format!("src/engine/solvers/{}.rs", variant.name);
        let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap();
        let header: Vec<&str> = text.lines().map_while(|line| line.strip_prefix("//!")).collect();
        let header = header.join(" ");
        let words: Vec<&str> = header.split_whitespace().collect();
        let unit = ["B", "per", "contact."];
        let at = words.windows(3).position(|w| w == unit);
        let said = at.and_then(|at| words.get(at.wrapping_sub(1))).and_then(|word| word.parse::<f64>().ok());
        let measured = bytes / contacts;
        // Rounding, which differs between CPUs, decides how many gradient steps are repeated.
        if said.is_none_or(|said| (said / measured - 1.0).abs() > 0.02) {
            wrong += &format!("{}: {measured:.0} B per contact, its file says {said:?}\n", variant.name);
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}
