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
    let last: Vec<[f32; 3]> = passes.with_system(Phase::Solve, |system| {
        system.rows().iter().map(|row| [0, 1, 2].map(|k| row.velocity[k])).collect()
    });
    passes.integrate_velocities();
    let (h, most) = (passes.h(), MOST_WORK.with_borrow(|most| *most));
    passes.with_system(Phase::Solve, |system| {
        let mut problem = Convex::new(system, &rule, [1e-4; 2], h, most);
        problem.begin(&last);
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

/// Residual after each Newton step of the first step of these bodies, without warm starting.
fn first_step(bodies: impl Iterator<Item = BodyDef>) -> Vec<f64> {
    let mut world = World::new(Settings::new(&WATCHED));
    world.add_body(&BodyDef::fixed([0.0, -1.0]).with(ShapeDef::rectangle(50.0, 1.0).unwrap())).unwrap();
    for body in bodies {
        world.add_body(&body.with(ShapeDef::rectangle(0.5, 0.5).unwrap())).unwrap();
    }
    world.step().unwrap();
    HISTORY.with_borrow(Clone::clone)
}

/// A pyramid of boxes thrown obliquely onto the ground.
fn thrown_pyramid(base: u32) -> Vec<f64> {
    let places = (0..base).flat_map(|row| (0..base - row).map(move |i| (row, i)));
    first_step(places.map(|(row, i)| {
        let x = 1.1 * (f64::from(i) + 0.5 * f64::from(row));
        BodyDef::dynamic([x, f64::from(row) + 0.5]).with_velocity([1.0, -2.0])
    }))
}

/// `todorov2014` reports a few iterations, whatever the size. A thrown pyramid takes more: contacts open and close
/// one level per step, with one more step per level where friction changes direction.
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

/// At the velocities of rest all contacts are on the edge of their cones, and the edge sticks: one factorization with
/// all of them finds the loads. With the edge open, a stack of n boxes takes n steps (`castro2022` sticks there).
#[test]
fn a_stack_takes_one_step_however_high_it_is() {
    for height in [10, 20, 40] {
        // A micrometer of overlap: no contact starts apart.
        let history = first_step(
            (0..height).map(|i| BodyDef::dynamic([0.0, f64::from(i) * (1.0 - 1e-6) + 0.5 - 1e-6])),
        );
        assert!(history.len() == 2 && history[1] < 1e-9, "{height}: {history:?}");
    }
}

#[test]
fn conjugate_gradients_come_to_the_same() {
    MOST_WORK.set(0.0);
    let history = thrown_pyramid(5);
    assert!(*history.last().unwrap() < 1e-9, "{history:?}");
}
