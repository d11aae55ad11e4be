//! Solvers on frozen problems: exact rates, the floor of f32, capture and replay.

use simpulse::cli::converge::{ConvergeArgs, run as command};
use simpulse::engine::bodies::BodyKind;
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::params::Budget;
use simpulse::engine::solvers::{self, Guarantee, VARIANTS, Variant};
use simpulse::engine::world::{Order, World};
use simpulse::lab::capture::capture;
use simpulse::lab::chart::Style;
use simpulse::lab::converge::replay::{Replay, Replayed, Sequence, Start};
use simpulse::lab::converge::{ConvergeOptions, ConvergeReport, ReplayCurve, converge, plot, table};
use simpulse::lab::reference::certify::{Uniqueness, reference};
use simpulse::lab::reference::frozen::Frozen;
use simpulse::lab::reference::gallery::{
    self, column, disc_column, hanging_chain, heavy_on_light, machine, sliding_box,
};
use simpulse::lab::reference::iterate::{Iteration, Stop, iterate};
use simpulse::lab::reference::residual::natural_map;
use simpulse::lab::reference::{ContactProblem, DPair, Target, Velocity};
use std::f64::consts::PI;
use std::path::Path;

const ORDERS: [Sequence; 3] = [Sequence::Natural, Sequence::Colored, Sequence::Shuffled(1)];

fn frozen(name: &str) -> Frozen {
    Frozen::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/frozen/{name}.frozen"))).unwrap()
}

/// Runs of these solvers without timing.
fn options(solvers: &[&str], max_iterations: u32) -> ConvergeOptions {
    let solvers = solvers.iter().map(|name| solvers::find(name).unwrap()).collect();
    ConvergeOptions { solvers, rounds: 0, max_iterations, ..ConvergeOptions::default() }
}

fn run(problem: &ContactProblem, solvers: &[&str]) -> ConvergeReport {
    converge(problem, Some(&reference(problem).unwrap()), &options(solvers, 1000)).unwrap()
}

/// Curves of the simulation's code, from zero or all.
fn own(report: &ConvergeReport, cold: bool) -> impl Iterator<Item = &ReplayCurve> {
    report.curves.iter().filter(move |c| c.arithmetic == "f32" && !(cold && c.start == Start::Warm))
}

/// The curve of a solver.
fn of<'a>(report: &'a ConvergeReport, name: &str, order: Sequence, start: Start) -> &'a ReplayCurve {
    let is_it = |c: &&ReplayCurve| c.solver == name && c.order == order && c.start == start;
    report.curves.iter().find(is_it).unwrap_or_else(|| panic!("no curve of {name} {order} {start}"))
}

/// Rates are fitted over one decade that ends 100 times above the rounding floor. There, rounding may change
/// a residual by 1 %. A line fitted through a decade, where the ends count 1.5 times their share, is then off
/// by 1.5 · 0.01/ln 10 = 0.7 % of ln ρ, about 0.7 % of 1 − ρ.
fn assert_rate(curve: &ReplayCurve, exact: f64) {
    let (measured, name, order) = (curve.rigid.rate.unwrap(), &curve.solver, curve.order);
    assert!((measured - exact).abs() < 0.007 * (1.0 - exact), "{name} {order}: {measured} is not {exact}");
}

fn replay<'a>(problem: &'a ContactProblem, order: Sequence, variant: &Variant) -> Replay<'a> {
    Replay::new(problem, order, LaneWidth::W8, variant.defaults()).unwrap()
}

fn sweeps(k: u32) -> Budget {
    Budget { substeps: 1, velocity_iterations: k, relax_iterations: 0, position_iterations: 0 }
}

/// A scene after some steps.
fn world(name: &str, variant: &'static Variant, budget: Budget, order: Order, steps: u32) -> World {
    let mut settings = crate::common::settings(variant);
    (settings.budget, settings.order) = (budget, order);
    if order == Order::Natural {
        settings.width = LaneWidth::W1;
    }
    crate::common::run(&crate::common::scene(name), settings, steps)
}

/// The graph of a column is a tree: all orders are consistent, so all have the same rate. Mass ratios have
/// R/(1 + R), cold and warm.
#[test]
fn columns_and_mass_ratios_converge_at_their_rates_in_every_order() {
    for n in [5, 10, 15, 20] {
        let report = run(&disc_column(n), &["pgs"]);
        // Three orders, cold and warm.
        assert_eq!(own(&report, false).count(), 6);
        for curve in own(&report, false) {
            // With a warm start, the remainder of the slowest mode may still be smaller than that of other
            // modes.
            if curve.start == Start::Cold {
                assert_rate(curve, (PI / (2 * n) as f64).cos().powi(2));
            }
            // The same iteration count as f64 in the same order, as long as f32 is exact enough. From a cold
            // start, all orders begin with the same smooth error; a warm start has errors of every
            // wavelength. f64 goes in every other order.
            let order = if curve.start == Start::Cold { Sequence::Natural } else { curve.order };
            if order != Sequence::Colored {
                let scalar = of(&report, "Gauss-Seidel", order, curve.start);
                for (one, other) in curve.rigid.iterations.iter().zip(scalar.rigid.iterations).take(3) {
                    assert!(one.unwrap().abs_diff(other.unwrap()) <= 1, "n {n}, {order} {}", curve.start);
                }
            }
        }
    }
    for ratio in [10.0, 30.0, 100.0] {
        let report = run(&heavy_on_light(ratio), &["pgs"]);
        own(&report, false).for_each(|curve| assert_rate(curve, ratio / (1.0 + ratio)));
    }
}

/// See [`hanging_chain`]: the residual falls by cos²(π/2n) per sweep, so a decade takes
/// ln 10/−ln cos²(π/2n) ≈ 0.933 n² sweeps. The chain is a tree, so every order has the same rate.
#[test]
fn sweeps_of_a_chain_of_joints_grow_with_the_square_of_its_links() {
    let decades = [5, 10, 20].map(|n| {
        let problem = hanging_chain(n);
        let report =
            converge(&problem, Some(&reference(&problem).unwrap()), &options(&["pgs"], 4000)).unwrap();
        assert_eq!((report.contacts, report.joint_rows), (0, 2 * n));
        let rate = (PI / (2 * n) as f64).cos().powi(2);
        for curve in own(&report, true) {
            assert!(curve.own_is_rigid);
            assert_rate(curve, rate);
        }
        let to = of(&report, "Gauss-Seidel", Sequence::Natural, Start::Cold).rigid.iterations;
        let (decade, exact) = (f64::from(to[4].unwrap() - to[3].unwrap()), 10.0_f64.ln() / -rate.ln());
        assert!((decade - exact).abs() < 1.0 + 0.01 * exact, "{n}: {decade} is not {exact}");
        decade
    });
    assert!((decades[2] / decades[0] - 16.0).abs() < 1.5, "{decades:?}");
}

/// Contacts and joints of every law at once. Each solver must reach its own law, down to the floor; solvers
/// of the rigid law end at the certified velocities, whatever their method.
#[test]
fn every_solver_converges_on_a_machine_with_contacts_motors_limits_and_springs() {
    const RIGID: [&str; 9] =
        ["pgs", "nncg", "anderson", "symmetric_gs", "random_order", "apgd", "admm", "direct", "tgs_ngs"];
    let problem = machine();
    let settings = ConvergeOptions { solvers: VARIANTS.to_vec(), ..options(&[], 100) };
    let report = converge(&problem, Some(&reference(&problem).unwrap()), &settings).unwrap();
    for curve in own(&report, false) {
        let (name, order, own) = (&curve.solver, curve.order, curve.own.smallest);
        let converges = solvers::find(name).is_ok_and(|v| v.promises(Guarantee::Converges));
        if curve.start == Start::Cold && own.is_finite() && converges {
            assert!(own < 1e-4, "{name} {order}: {own:e}");
        }
        if RIGID.contains(&name.as_str()) {
            let last = curve.points.last().unwrap();
            let error = last.velocity_error.unwrap();
            assert!(last.rigid < 1e-4 && error < 1e-4, "{name} {order}: {:e}, {error:e}", last.rigid);
        }
    }
}

#[test]
fn mass_splitting_on_a_column_is_a_lazy_walk() {
    // Rows x ← x/2 + (neighbors)/4 inside, x₀/2 + x₁/2 at the ground, x/3 + x₋₁/3 at the top, where the last
    // disc has only one contact. Modes are cos iθ with the eigenvalue (1 + cos θ)/2, and the top row requires
    // tan((n − 1)θ) tan(θ/2) = 1/2.
    let n = 10;
    let excess = |theta: f64| ((n - 1) as f64 * theta).tan() * (theta / 2.0).tan() - 0.5;
    let (mut low, mut high) = (0.0, PI / 2.0 / (n - 1) as f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if excess(middle) < 0.0 { low = middle } else { high = middle }
    }
    let exact = (1.0 + low.cos()) / 2.0;
    let report = run(&disc_column(n), &["pgs"]);
    let rate = |name| of(&report, name, Sequence::Natural, Start::Cold).rigid.rate.unwrap();
    // The next modes still hold about 1e-3 of the residual over the first thousand iterations.
    assert!((rate("Jacobi, mass splitting") - exact).abs() < 2e-5, "{exact}");
    assert!((rate("Jacobi") - (PI / (2 * n) as f64).cos()).abs() < 1e-3);
}

#[test]
fn files_converge_to_the_floor_and_to_their_certified_velocities() {
    for (file, _) in gallery::library() {
        let Frozen { problem, reference } = frozen(file);
        let reference = reference.unwrap();
        assert!(matches!(reference.certificate.uniqueness, Uniqueness::Proven | Uniqueness::Agreed));
        // Rounding of the largest impulse, in units of the residual.
        let largest = reference.impulses.iter().flatten().fold(0.0_f64, |m, l| m.max(l.abs()));
        let floor = 6e-8 * (largest / problem.impulse_unit()).max(1.0);
        let report = converge(&problem, Some(&reference), &options(&["pgs"], 2000)).unwrap();
        for curve in own(&report, false) {
            let last = curve.points.last().unwrap();
            // A row sums a handful of products of that size; 20 roundings are a generous bound.
            assert!(last.rigid < 20.0 * floor, "{file}: {} {:e}", curve.order, last.rigid);
            // A residual r that falls by ρ per sweep is followed by changes of r (1 + ρ + ρ² + …), so the
            // remaining error is r/(1 − ρ). Two bodies respond to each row. Where no rate could be fitted, a
            // decade took fewer than four sweeps: ρ < 0.6.
            let bound = 2.0 * (last.rigid + floor) / (1.0 - curve.rigid.rate.unwrap_or(0.6));
            let error = last.velocity_error.unwrap();
            assert!(error < bound, "{file}: {} {error:e} not within {bound:e}", curve.order);
            assert!(bound < 1e-3, "a bound that says something: {bound:e}");
        }
    }
}

#[test]
fn order_matters_until_convergence() {
    let Frozen { problem, .. } = frozen("box-pyramid-5");
    let pgs = solvers::find("pgs").unwrap();
    let velocities = |order, k| replay(&problem, order, pgs).run(pgs, sweeps(k), Start::Cold).velocities;
    let spread = |k: u32| {
        let natural: Vec<Velocity> = velocities(Sequence::Natural, k);
        let error = |seed| problem.velocity_error(&velocities(Sequence::Shuffled(seed), k), &natural);
        (0..32).map(error).fold(0.0, f64::max)
    };
    let (early, converged) = (spread(4), spread(600));
    assert!(early > 0.05, "{early}");
    // Where velocities are unique, only rounding is left: 6e-8 per operation, amplified by 1/(1 − ρ) = 30.
    assert!(converged < 2e-6, "{converged}");
}

#[test]
fn soft_contacts_solve_their_own_law_and_not_the_rigid_one() {
    // Overlapping, touching and open contacts; the bottom one is against a static body.
    let mut problem = column(&[1.0, 2.0, 1.0, 3.0]);
    for (contact, gap) in problem.contacts.iter_mut().zip([-0.01, 0.0, 1e-4, -2e-4]) {
        contact.gap = gap;
    }
    let variant = solvers::find("soft_step").unwrap();
    let outcome = replay(&problem, Sequence::Natural, variant).run(variant, sweeps(400), Start::Cold);
    let target = Target::Own(&outcome.own.as_ref().unwrap().rows);
    let unit = problem.impulse_unit();
    let residual = |target| natural_map(&problem, target, &outcome.velocities, &outcome.impulses) / unit;
    // A handful of roundings of the largest impulse, in the sweep and in the law's coefficients.
    let floor = 6e-8 * outcome.impulses.iter().flatten().fold(0.0_f64, |m, l| m.max(l.abs())) / unit;
    assert!(residual(target) < 5.0 * floor && residual(Target::Rigid) > 0.1, "{:e}", residual(target));
    // The law alone, in f64, gives the same velocities. Its coefficients are accurate to a few roundings.
    let stop = Stop { tolerance: 1e-13, iterations: 10_000 };
    let exact = iterate(&problem, target, &problem.no_impulses(), Iteration::Forward, stop).velocities;
    let error = problem.velocity_error(&outcome.velocities, &exact);
    assert!(error < 2e-6, "{error:e}");
    let report = converge(&problem, None, &options(&["soft_step"], 1000)).unwrap();
    let soft = of(&report, "soft_step without relaxing", Sequence::Natural, Start::Cold);
    assert!(!soft.own_is_rigid && soft.own.first[5].is_some() && soft.rigid.first[1].is_none());
    assert!(soft.rigid.smallest > 0.05 && soft.points[0].own.is_none());
}

/// `anitescu2006`: where the convex relaxation slides, surfaces separate at un = µ |ut|. Every iterate is
/// farther from the rigid law than zero impulse, and the start is not the smallest residual.
#[test]
fn the_relaxation_parts_in_proportion_to_sliding() {
    let Frozen { problem, reference } = frozen("sliding-box");
    let apgd = solvers::find("apgd").unwrap();
    let Replayed { velocities, impulses, .. } =
        replay(&problem, Sequence::Natural, apgd).run(apgd, apgd.of_iterations(2000), Start::Cold);
    let speeds = problem.contact_velocities(&velocities);
    let pushing: Vec<usize> = (0..impulses.len()).filter(|&i| impulses[i][0] > 0.0).collect();
    assert!(!pushing.is_empty());
    for i in pushing {
        let [un, ut] = speeds[i];
        assert!(un > 0.1 && (un - problem.contacts[i].friction * ut.abs()).abs() < 1e-5, "{un} at {ut}");
    }
    let report = converge(&problem, reference.as_ref(), &options(&["apgd"], 1000)).unwrap();
    let curve = of(&report, "apgd", Sequence::Natural, Start::Cold);
    let least = curve.points[1..].iter().map(|p| p.rigid).fold(f64::INFINITY, f64::min);
    assert_eq!((curve.points[0].iterations, curve.rigid.smallest), (0, least));
    assert!(least > 2.0 * curve.points[0].rigid, "{least} {}", curve.points[0].rigid);
}

#[test]
fn every_solver_reaches_its_own_law_on_a_pyramid() {
    let Frozen { problem, reference } = frozen("box-pyramid-5");
    let solvers = VARIANTS.iter().copied().filter(|v| v.promises(Guarantee::Converges)).collect();
    let settings = ConvergeOptions { solvers, ..options(&[], 4000) };
    let report = converge(&problem, reference.as_ref(), &settings).unwrap();
    for curve in own(&report, false) {
        assert!(curve.own.first[5].is_some(), "{} {} {:?}", curve.solver, curve.order, curve.own);
        // No earlier k is within the tolerance.
        for (first, tolerance) in curve.own.first.iter().zip(report.tolerances) {
            let at = curve.points[first.unwrap()];
            assert!(at.own.unwrap() <= tolerance);
            // The state before the iterations may already meet the first tolerances.
            let before = curve.points[..first.unwrap()].last().map_or(0, |before| before.iterations + 1);
            assert_eq!(before, at.iterations, "{} {}", curve.solver, curve.order);
        }
    }
}

#[test]
fn exchanged_sides_are_the_same_problem() {
    let problem = sliding_box();
    let mut exchanged = problem.clone();
    for c in &mut exchanged.contacts {
        (c.body_a, c.body_b) = (c.body_b, c.body_a);
        c.normal = c.normal.map(|x| -x);
        (c.arm_a, c.arm_b) = (c.arm_b.map(|x| -x), c.arm_a.map(|x| -x));
    }
    for variant in &VARIANTS {
        let [one, other] = [&problem, &exchanged]
            .map(|p| replay(p, Sequence::Natural, variant).run(variant, sweeps(5), Start::Cold));
        assert_eq!((one.velocities, one.impulses), (other.velocities, other.impulses), "{}", variant.name);
    }
}

/// Newton's steps cycle on the thrust of an arch, whatever the warm start. Small islands then fall back to
/// pivoting.
#[test]
fn newton_and_lemke_together_solve_an_arch_from_any_start() {
    let pgs = solvers::find("pgs").unwrap();
    let mut world = world("arch", pgs, pgs.budget, Order::Colored, 29);
    let report = run(&capture(&mut world, "arch"), &["direct"]);
    for curve in own(&report, false) {
        assert!(curve.own.smallest < 1e-5, "{} {}: {:e}", curve.order, curve.start, curve.own.smallest);
    }
}

#[test]
fn capture_looks_and_does_not_touch() {
    let standard = solvers::find("soft_step").unwrap();
    let make = || world("pyramid:5", standard, standard.budget, Order::Colored, 40);
    let (mut looked_at, mut left_alone) = (make(), make());
    let problem = capture(&mut looked_at, "pyramid");
    assert_eq!(capture(&mut looked_at, "pyramid"), problem);
    looked_at.step().unwrap();
    left_alone.step().unwrap();
    assert_eq!(looked_at.state_hash(), left_alone.state_hash());

    problem.validate().unwrap();
    assert_eq!((problem.bodies.len(), problem.h), (15, f64::from(1.0_f32 / 60.0)));
    let dynamic = (0..left_alone.bodies.len()).filter(|&i| left_alone.bodies.is_dynamic(i));
    for (body, i) in problem.bodies.iter().zip(dynamic) {
        assert_eq!(body.inv_mass, f64::from(left_alone.bodies.inv_mass[i]));
        assert_eq!(body.inv_inertia, f64::from(left_alone.bodies.inv_inertia[i]));
        assert_eq!(body.free_velocity[1], body.velocity[1] - 10.0 * problem.h);
    }
    // At rest, the warm-start impulses of the whole step carry the weight: 15 m g h on the ground.
    let ground = problem.contacts.iter().filter(|c| c.body_a.is_none());
    let on_ground: f64 = ground.map(|c| c.warm_impulse[0]).sum();
    let weight: f64 = problem.bodies.iter().map(|b| 10.0 * problem.h / b.inv_mass).sum();
    assert!((on_ground / weight - 1.0).abs() < 0.02, "{on_ground} carries {weight}");
}

/// A world and its captured problem give the same step; what is written is what is read.
#[test]
fn a_replayed_problem_is_the_step_of_the_world() {
    let folder = tempfile::tempdir().unwrap();
    let compare = |name: &str, variant: &'static Variant, budget, order, steps, bound: f64| {
        let mut world = world(name, variant, budget, order, steps);
        let problem = capture(&mut world, name);
        let sequence = if order == Order::Natural { Sequence::Natural } else { Sequence::Colored };
        let Replayed { velocities, sweeps, .. } =
            replay(&problem, sequence, variant).run(variant, budget, Start::Warm);
        world.frozen_step();
        assert_eq!(sweeps, world.counts().sweeps);
        let kinds = (0..world.bodies.len()).map(|i| world.bodies.kind(i)).collect::<Vec<_>>();
        let moving = (0..kinds.len()).filter(|&i| kinds[i] != BodyKind::Static);
        let rows = &world.workspace().rows;
        for (replayed, i) in velocities.iter().zip(moving) {
            for (replayed, stepped) in replayed.iter().zip(rows[i].velocity) {
                let difference = (replayed - f64::from(stepped)).abs();
                assert!(difference < bound, "{name} {} {order:?}, {i}: {difference:e}", variant.name);
            }
        }
    };
    for name in ["pyramid:5", "disc_column:8", "card_house"] {
        // Divergence would make any difference large.
        for variant in VARIANTS.iter().filter(|v| v.promises(Guarantee::Converges)) {
            // Arms and v* differ in their last bits, 6e-8 of numbers near 1. A step turns that into a few
            // 1e-7 per sweep. Anderson mixing divides by the change of the residuals from sweep to sweep, a
            // fraction 1 − ρ of them. Sweeps of five rows have the rate ρ = cos²(π/10) = 0.904.
            let bound = if variant.name == "anderson" { 1e-5 / (1.0 - 0.904) } else { 1e-5 };
            for order in [Order::Natural, Order::Colored] {
                compare(name, variant, Budget { substeps: 1, ..variant.budget }, order, 20, bound);
            }
        }
    }
    let pgs = solvers::find("pgs").unwrap();
    for name in ["pyramid:4", "friction_ramp", "circle_pile:30"] {
        let problem = capture(&mut world(name, pgs, pgs.budget, Order::Colored, 60), name);
        let frozen = Frozen { reference: reference(&problem).ok(), problem };
        let path = folder.path().join("problem.frozen");
        frozen.write(&path).unwrap();
        assert_eq!(Frozen::read(&path).unwrap(), frozen, "{name}");
    }
}

/// The rows of a captured scene are the rows that the step solves: sweeps on them end at the velocities of
/// the step itself.
#[test]
fn a_captured_step_with_joints_is_the_step() {
    let pgs = solvers::find("pgs").unwrap();
    let budget = Budget { velocity_iterations: 40, ..pgs.budget };
    for (scene, step) in [("crane", 29), ("ball_and_chain", 39)] {
        let mut world = world(scene, pgs, budget, Order::Natural, step);
        let problem = capture(&mut world, scene);
        assert!(problem.joint_rows() > 20 && problem.warm_impulses().iter().any(|l| l[0] != 0.0));
        let text = Frozen { problem: problem.clone(), reference: None }.to_text().unwrap();
        assert_eq!(Frozen::from_text(&text, Path::new("x")).unwrap().problem, problem);
        assert!(text.contains("\"version\":2"), "{}", &text[..80]);
        world.step().unwrap();
        let found = replay(&problem, Sequence::Natural, pgs).run(pgs, budget, Start::Warm);
        let b = &world.bodies;
        for (i, found) in (0..b.len()).filter(|&i| b.kind(i) != BodyKind::Static).zip(&found.velocities) {
            for (found, exact) in found.iter().zip([b.velocity_x[i], b.velocity_y[i], b.angular_velocity[i]])
            {
                // Free velocities round differently. Everything else is the same arithmetic.
                let difference = (found - f64::from(exact)).abs();
                assert!(difference < 2e-4 * (1.0 + found.abs()), "{scene} {i}: {found} {exact}");
            }
        }
    }
}

#[test]
fn reports_say_what_was_measured() {
    let problem = disc_column(4);
    let report = run(&problem, &["pgs", "soft_step"]);
    let text = table::text(&report);
    assert!(text.contains("unique (no friction)") && text.contains("each changed by up to 10 %"), "{text}");
    // The answer first, then at most twenty rows.
    assert!(text.starts_with("Fewest sweeps to a force error of 1 %: "), "{text}");
    let rows = text.lines().skip_while(|line| !line.starts_with("sweeps to")).skip(2);
    let rows: Vec<&str> = rows.take_while(|line| !line.is_empty()).collect();
    assert!((6..=20).contains(&rows.len()) && rows[0].starts_with("pgs  "), "{text}");
    assert!(rows.iter().any(|row| row.starts_with("soft_step, own law")), "{text}");
    let csv = table::csv(&report).unwrap();
    let points: usize = report.curves.iter().map(|c| c.points.len()).sum();
    assert_eq!(csv.lines().count(), points + 1);
    let json: serde_json::Value = serde_json::from_str(&table::json(&report).unwrap()).unwrap();
    assert_eq!(
        (json["curves"].as_array().unwrap().len(), &json["contacts"]),
        (report.curves.len(), &4.into())
    );
    let svg = plot::svg(&report, &|_| Style::at(0));
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && !svg.contains("NaN"));

    // Without a reference, there is nothing to perturb into a warm start.
    let cold = converge(&problem, None, &options(&["pgs"], 1000)).unwrap();
    assert!(cold.curves.iter().all(|c| c.start == Start::Cold));
    assert!(table::text(&cold).contains("No warm starts"), "{}", table::text(&cold));

    // Impulses stored in the problem take precedence. Only solvers that use warm starts have warm rows.
    let mut warm = problem;
    warm.contacts.iter_mut().for_each(|c| c.warm_impulse = [0.1, 0.0]);
    let report = run(&warm, &["pgs", "projection", "avbd"]);
    let warm = |name: &str| report.curves.iter().any(|c| c.solver == name && c.start == Start::Warm);
    assert!(warm("pgs") && warm("avbd") && !warm("projection"));
    let text = table::text(&report);
    assert!(text.contains("stored in the problem"), "{text}");
    assert!(text.contains("no warm starting): projection."), "{text}");
    assert!(text.contains("bias and compliance of normal rows): avbd."), "{text}");
}

/// `mazhar2015`: f(λ_k) − f(λ*) ≤ 2 L |λ*|²/(k + 1)² from zero, with f = λᵀ G λ/2 + λᵀ b and L = ‖G‖ the
/// Lipschitz constant of its gradient. The solver's own step length replaces 1/L, and restarts only help.
#[test]
fn the_objective_of_accelerated_gradients_falls_with_the_square_of_iterations() {
    let problem = disc_column(20);
    let truth = reference(&problem).unwrap();
    let free = problem.contact_velocities(&problem.velocities(&problem.no_impulses()));
    let objective = |impulses: &[DPair]| {
        let product = problem.delassus_product(impulses);
        let one = |((l, g), b): ((&DPair, &DPair), &DPair)| l[0] * (0.5 * g[0] + b[0]);
        impulses.iter().zip(&product).zip(&free).map(one).sum::<f64>()
    };
    let least = objective(&truth.impulses);
    // Rows of G for equal discs: −1, 2, −1 over the mass, here 1 kg; ‖G‖ < 4.
    assert!(problem.bodies.iter().all(|b| b.inv_mass == 1.0));
    let square: f64 = truth.impulses.iter().map(|l| l[0] * l[0]).sum();
    let apgd = solvers::find("apgd").unwrap();
    let mut replay = replay(&problem, Sequence::Natural, apgd);
    for k in 1..200 {
        let Replayed { impulses, .. } = replay.run(apgd, apgd.of_iterations(k), Start::Cold);
        let bound = 2.0 * 4.0 * square / f64::from(k + 1).powi(2) + 1e-6 * least.abs();
        let gap = objective(&impulses) - least;
        assert!(gap < bound, "{k}: {gap:e} for {bound:e}");
    }
}

/// `tonge2012`: the result does not depend on the order, and from zero the residual never rises.
#[test]
fn split_masses_converge_without_rising_and_in_any_order() {
    for file in ["box-pyramid-5", "disc-column-10", "plank-4-supports"] {
        let Frozen { problem, reference } = frozen(file);
        let report = converge(&problem, reference.as_ref(), &options(&["mass_splitting"], 500)).unwrap();
        let curves = ORDERS.map(|order| of(&report, "mass_splitting", order, Start::Cold));
        for curve in curves {
            for pair in curve.points.windows(2).filter(|pair| pair[1].rigid > 1e-5) {
                let [before, after] = [pair[0].rigid, pair[1].rigid];
                // f32 sums in a different order.
                assert!(after < 1.005 * before, "{file}: {before:e}, {after:e}");
            }
            for (x, y) in curve.points.iter().zip(&curves[0].points) {
                assert_eq!(x.iterations, y.iterations);
                let apart = (x.rigid - y.rigid).abs();
                assert!(apart < 1e-3 * y.rigid + 1e-6, "{} {}", curve.order, x.iterations);
            }
        }
    }
}

#[test]
fn bad_input_is_refused_with_its_value() {
    let refusal =
        |problem: &ContactProblem| converge(problem, None, &options(&["pgs"], 9)).unwrap_err().to_string();
    let void = ContactProblem { name: "void".into(), contacts: vec![], ..disc_column(2) };
    assert!(refusal(&void).contains("'void' has none"));
    let mut huge = disc_column(2);
    huge.bodies[1].free_velocity[0] = 1e200;
    assert!(refusal(&huge).contains("bodies[1]"));
    let wrong = reference(&disc_column(3)).unwrap();
    assert!(converge(&disc_column(2), Some(&wrong), &options(&["pgs"], 9)).is_err());
}

#[test]
fn the_command_freezes_and_converges() {
    use clap::Parser;
    #[derive(Parser)]
    enum Cli {
        Converge(ConvergeArgs),
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("stack.frozen");
    let run = |words: &[&str]| -> Result<(), String> {
        let words = ["simpulse", "converge"].iter().chain(words);
        let Cli::Converge(args) = Cli::try_parse_from(words).map_err(|e| e.to_string())?;
        command(&args).map(|_| ()).map_err(|e| e.to_string())
    };
    let (path, out) = (file.to_str().unwrap(), folder.path().join("out"));
    run(&["stack:3", "--step", "30", "--freeze", path, "--solver", "pgs"]).unwrap();
    assert!(Frozen::read(&file).unwrap().reference.is_some());
    run(&[path, "--out", out.to_str().unwrap(), "--repeats", "1", "--solvers", "pgs"]).unwrap();
    for name in ["converge.csv", "converge.json", "converge.svg"] {
        assert!(std::fs::metadata(out.join(name)).unwrap().len() > 1000, "{name}");
    }
    for (words, message) in [
        (&[path, "--solvers", "pgz"][..], "'pgs'"),
        (&["no/such.frozen"], "no/such.frozen"),
        (&[path, "--lanes", "3"], "'3'"),
        (&["stakc:3", "--freeze", path], "did you mean 'stack'"),
        (&["stack:3", "--step", "0", "--freeze", path], "0"),
        (&["free_fall", "--step", "2", "--freeze", path], "no contacts"),
        (&[path, "--freeze", "other.frozen"], "frozen problem already"),
        (&["stack:3", "--freeze", path, "--solvers", "pgs"], "cannot be used with"),
        (&["stack:3", "--substeps", "2"], "--freeze FILE"),
    ] {
        let refusal = run(words).unwrap_err();
        assert!(refusal.contains(message), "{words:?}: {refusal}");
    }
}
