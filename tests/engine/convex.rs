//! Convergence of Newton's method in `sap`.

use simpulse::engine::bodies::{BodyDef, ShapeDef};
use simpulse::engine::clock::Phase;
use simpulse::engine::constraints::kernels::velocity::rules::Baumgarte;
use simpulse::engine::constraints::{Passes, Schedule};
use simpulse::engine::solvers::Variant;
use simpulse::engine::solvers::sap::convex::Convex;
use simpulse::engine::world::{Settings, World};
use std::cell::RefCell;

thread_local! {
    static HISTORY: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
    static MOST_WORK: RefCell<f64> = const { RefCell::new(f64::INFINITY) };
}

static WATCHED: Variant = Variant { name: "watched", make: || Schedule::boxed(step), ..Variant::BASE };

fn step(passes: &mut Passes<'_>) {
    let rule = Baumgarte::new(0.3, passes.slop(), passes.push_speed(), passes.h());
    passes.integrate_velocities();
    let (h, most) = (passes.h(), MOST_WORK.with_borrow(|most| *most));
    passes.with_system(Phase::Solve, |system| {
        let mut problem = Convex::new(system, &rule, 1e-4, h, most);
        problem.begin(system.rows());
        HISTORY.with_borrow_mut(|history| {
            history.clear();
            history.push(problem.residual);
            while problem.step() {
                history.push(problem.residual);
                assert!(history.len() < 40, "{history:?}");
            }
        });
        problem.write(system);
    });
    passes.integrate_positions();
    passes.end_substep(0);
}

/// Residual after each Newton step for a pyramid of boxes thrown obliquely onto the ground, without warm
/// starting.
fn thrown_pyramid(base: u32) -> Vec<f64> {
    let mut world = World::new(Settings::new(&WATCHED));
    world.add_body(&BodyDef::fixed([0.0, -1.0]).with(ShapeDef::rectangle(50.0, 1.0).unwrap())).unwrap();
    for row in 0..base {
        for i in 0..base - row {
            let x = 1.1 * (f64::from(i) + 0.5 * f64::from(row));
            let cube = ShapeDef::rectangle(0.5, 0.5).unwrap();
            let body = BodyDef::dynamic([x, f64::from(row) + 0.5]).with(cube).with_velocity([1.0, -2.0]);
            world.add_body(&body).unwrap();
        }
    }
    world.step().unwrap();
    HISTORY.with_borrow(Clone::clone)
}

/// `todorov2014` reports a few iterations, whatever the size. Started from zero, the method takes more here:
/// contacts close one level per step, with one more step per level where friction changes direction.
#[test]
fn newton_s_method_ends_at_rounding_after_two_steps_per_level() {
    for base in [5, 10, 20] {
        let history = thrown_pyramid(base);
        assert!(
            history.len() as u32 <= 2 * base + 4 && *history.last().unwrap() < 1e-9,
            "{base}: {history:?}"
        );
    }
}

#[test]
fn conjugate_gradients_come_to_the_same() {
    MOST_WORK.set(0.0);
    let history = thrown_pyramid(5);
    assert!(*history.last().unwrap() < 1e-9, "{history:?}");
}
