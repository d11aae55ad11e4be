//! A solver defined outside the crate through the public API alone: it has its own rule and parameter, keeps
//! a number per contact point, and sweeps until the residual is small.

use simpulse::engine::bodies::{BodyDef, BodyKind, ShapeDef};
use simpulse::engine::clock::Phase;
use simpulse::engine::constraints::kernels::velocity::sweep::{NormalRule, Sweep};
use simpulse::engine::constraints::records::kept::StateSize;
use simpulse::engine::constraints::records::point_vector::{dot, scaled, update};
use simpulse::engine::constraints::{Passes, Schedule, System};
use simpulse::engine::lanes::{LaneWidth, Lanes};
use simpulse::engine::params::{Budget, Parameter};
use simpulse::engine::shapes::Shape;
use simpulse::engine::solvers::Variant;
use simpulse::engine::world::{Order, Settings, World};

/// λ ← max(0, λ − m_eff (v_n + max(s, β s)/h)): closes gaps and removes the fraction β of an overlap.
#[derive(Clone, Copy)]
struct Lift {
    inv_h: f32,
    share: f32,
}

impl NormalRule for Lift {
    const FRICTION: bool = true;

    fn line<L: Lanes>(&self, _against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        let wanted = separation.max(separation * L::splat(self.share));
        [mass.neg_mul_add(wanted * L::splat(self.inv_h), old), mass]
    }
}

/// Sweeps until the contact law holds to `tolerance`, or until the budget is spent.
static ADAPTIVE: Variant = Variant {
    name: "adaptive",
    source: "catto2006",
    summary: "sequential impulses until the residual is small",
    budget: Budget { substeps: 1, velocity_iterations: 64, relax_iterations: 0, position_iterations: 0 },
    parameters: &[Parameter {
        name: "tolerance",
        unit: "N·s",
        default: 1e-3,
        range: [0.0, 1e3],
        meaning: "residual of the contact law at which a step is solved",
        trials: &[],
    }],
    kept: StateSize { per_point: 1, ..StateSize::NONE },
    make: || Schedule::boxed(step),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let mut sweep = Sweep(Lift { inv_h: 1.0 / passes.h(), share: 0.2 });
    passes.integrate_velocities();
    passes.warm_start();
    for _ in 0..budget.velocity_iterations {
        passes.velocity_sweep(Phase::Solve, &mut sweep);
        passes.iteration_done();
        if passes.residual() <= f64::from(passes.parameter(0)) {
            break;
        }
    }
    passes.integrate_positions();
    passes.end_substep(0);
    // Age of each point in steps.
    passes.kept().points().iter_mut().for_each(|age| *age += 1.0);
}

/// `count` unit boxes on the ground.
fn stack(count: usize, width: LaneWidth) -> World {
    let mut world = World::new(Settings::new(&ADAPTIVE).exactly(width));
    let shape = |x, y| Shape::rectangle("box", glam::Vec2::new(x, y), glam::Vec2::ZERO, 0.0, 0.0).unwrap();
    let solid = |x, y| vec![ShapeDef::new(shape(x, y))];
    world.add_body(&BodyDef::new(BodyKind::Static, [0.0, -1.0], solid(20.0, 1.0))).unwrap();
    for i in 0..count {
        world.add_body(&BodyDef::new(BodyKind::Dynamic, [0.0, i as f64 + 0.5], solid(0.5, 0.5))).unwrap();
    }
    world
}

#[test]
#[cfg_attr(
    not(target_feature = "fma"),
    ignore = "its bound on the residual is near rounding, which plain multiplies and adds exceed"
)]
fn a_solver_from_outside_holds_a_stack_with_the_sweeps_that_it_needs() {
    let mut world = stack(5, LaneWidth::W8);
    let mut sweeps = Vec::new();
    for _ in 0..120 {
        world.step().unwrap();
        sweeps.push(world.counts().sweeps);
    }
    for i in 0..5 {
        let height = world.bodies.position_y[i + 1];
        assert!((height - (i as f32 + 0.5)).abs() < 0.01, "box {i} at {height}");
    }
    // Cold contacts need many sweeps, warm contacts few.
    assert!(sweeps[1] > 3 && *sweeps.last().unwrap() <= 2, "{sweeps:?}");
}

#[test]
fn its_bits_are_the_same_at_every_width() {
    let hash = |width| {
        let mut world = stack(4, width);
        (0..60).for_each(|_| world.step().unwrap());
        world.state_hash()
    };
    let one = hash(LaneWidth::W1);
    for width in LaneWidth::ALL {
        assert_eq!(hash(width), one, "{width:?}");
    }
}

#[test]
fn its_parameter_is_set_by_name() {
    let mut strict = stack(5, LaneWidth::W8);
    strict.settings.solver.set(&mut strict.settings.parameters, "tolerance", 0.0).unwrap();
    let mut loose = stack(5, LaneWidth::W8);
    loose.settings.solver.set(&mut loose.settings.parameters, "tolerance", 100.0).unwrap();
    strict.step().unwrap();
    loose.step().unwrap();
    assert_eq!((strict.counts().sweeps, loose.counts().sweeps), (64, 1));
    let refused = ADAPTIVE.set(&mut strict.settings.parameters, "tolerance", -1.0).unwrap_err();
    assert!(refused.to_string().contains("-1"), "{refused}");
}

#[test]
fn what_it_keeps_follows_the_contact_points() {
    let mut world = stack(3, LaneWidth::W4);
    (0..10).for_each(|_| world.step().unwrap());
    let contacts = world.contacts.len();
    let kept = &mut world.workspace().kept;
    assert_eq!(kept.points().len(), 2 * contacts);
    assert!(kept.points().iter().all(|&age| (9.0..=10.0).contains(&age)), "{:?}", kept.points());
}

#[test]
fn vectors_are_the_sweeps_problem() {
    // J v through the system, then impulses applied through it, as in a warm start.
    static PROBE: Variant = Variant { name: "probe", make: || Schedule::boxed(probe), ..Variant::BASE };
    fn probe(passes: &mut Passes<'_>) {
        let h = passes.h();
        passes.integrate_velocities();
        let (mut before, mut after, mut impulses) = (Vec::new(), Vec::new(), Vec::new());
        passes.system().relative_velocities(&mut before);
        passes.velocity_sweep(Phase::Solve, &mut Sweep(Lift { inv_h: 1.0 / h, share: 0.0 }));
        let mut system = passes.system();
        system.relative_velocities(&mut after);
        system.impulses(&mut impulses);
        assert!(!impulses.is_empty() && impulses.iter().any(|l| l[0] > 0.0));
        assert!(System::dot(&impulses, &after) >= System::dot(&impulses, &before), "impulses push apart");
        // After the impulses are undone by hand, the velocities are the earlier ones.
        let back: Vec<_> = impulses.iter().map(|l| [-l[0], -l[1]]).collect();
        system.apply(&back);
        let mut restored = Vec::new();
        system.relative_velocities(&mut restored);
        for (a, b) in restored.iter().flatten().zip(before.iter().flatten()) {
            assert!((a - b).abs() < 1e-5, "{a} for {b}");
        }
        system.apply(&impulses);
        in_lanes(passes, &impulses, &after);
        passes.integrate_positions();
        passes.end_substep(0);
    }
    /// The same vectors in lanes: products agree with those in contact order up to rounding.
    fn in_lanes(passes: &mut Passes<'_>, impulses: &[[f32; 2]], velocities: &[[f32; 2]]) {
        let [mut lambda, mut u] = [(); 2].map(|()| passes.vector());
        let mut system = passes.system();
        system.lane_impulses(&mut lambda);
        system.lane_velocities(&mut u);
        let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-5 * a.abs().max(1e-3), "{a} for {b}");
        close(dot(&lambda, &lambda), System::dot(impulses, impulses));
        close(dot(&lambda, &u), System::dot(impulses, velocities));
        // Undone and applied again in lanes, then read in contact order.
        update([&mut lambda], [], |[l], []| [scaled(-1.0, l)]);
        system.push_lanes(&mut lambda);
        system.apply(impulses);
        let mut restored = Vec::new();
        system.relative_velocities(&mut restored);
        for (a, b) in restored.iter().flatten().zip(velocities.iter().flatten()) {
            assert!((a - b).abs() < 1e-5, "{a} for {b}");
        }
        // Impulses and velocities stay as the sweep left them, whatever was written in between.
        system.set_lane_impulses(&mut lambda);
        update([&mut lambda], [], |[l], []| [scaled(-1.0, l)]);
        system.set_lane_impulses(&mut lambda);
        let mut read = Vec::new();
        system.impulses(&mut read);
        assert_eq!(read, impulses);
        passes.give_back([lambda, u]);
    }
    for (width, order) in LaneWidth::ALL
        .map(|width| (width, Order::Colored))
        .into_iter()
        .chain([(LaneWidth::W1, Order::Natural)])
    {
        let mut world = stack(2, width);
        world.settings = Settings { width, order, ..Settings::new(&PROBE) };
        world.step().unwrap();
    }
}
