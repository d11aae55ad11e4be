//! Law: a steady step allocates nothing.

#[path = "lab/common.rs"]
mod common;

use simpulse::engine::bodies::{BodyDef, ShapeDef};
use simpulse::engine::joints::Joint;
use simpulse::engine::solvers::{Guarantee, VARIANTS, find};
use simpulse::engine::world::{Settings, World};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system allocator, with a count of the current thread's allocations.
struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
    /// Bytes allocated, and bytes freed.
    static BYTES: Cell<[usize; 2]> = const { Cell::new([0; 2]) };
}

// SAFETY: every call is passed to the system allocator unchanged.
#[allow(unsafe_code, reason = "an allocator")]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        BYTES.with(|b| b.set([b.get()[0] + layout.size(), b.get()[1]]));
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        BYTES.with(|b| b.set([b.get()[0], b.get()[1] + layout.size()]));
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(work: impl FnOnce()) -> usize {
    let before = COUNT.with(Cell::get);
    work();
    COUNT.with(Cell::get) - before
}

#[test]
fn the_counter_counts() {
    assert_eq!(allocations(|| drop(std::hint::black_box(Box::new(1)))), 1);
}

#[test]
fn a_steady_step_allocates_nothing() {
    for name in ["pyramid:10", "disc_column:10", "bounce"] {
        for variant in &VARIANTS {
            if !variant.promises(Guarantee::NoAllocation) {
                continue;
            }
            // Without friction a pyramid flows apart, so none of its steps is steady.
            if (name, variant.name) == ("pyramid:10", "projection") {
                continue;
            }
            let mut world = common::run(&common::scene(name), common::settings(variant), 120);
            // Frozen steps search their pairs every time. Moving steps search only when bodies leave their
            // bounds. Neither may allocate.
            world.frozen_step();
            let count = allocations(|| {
                for _ in 0..10 {
                    world.frozen_step();
                    world.step().unwrap();
                }
            });
            assert_eq!(count, 0, "{name} {}", variant.name);
        }
    }
}

#[test]
fn a_steady_step_of_several_threads_allocates_nothing_in_the_first() {
    for name in ["large_pyramid", "many_pyramids"] {
        let settings = Settings { threads: 2, ..common::settings(find("soft_step").unwrap()) };
        let mut world = common::run(&common::scene(name), settings, 60);
        assert_eq!(allocations(|| (0..5).for_each(|_| world.step().unwrap())), 0, "{name}");
    }
}

/// Events and applied forces allocate in the first steps only.
#[test]
fn a_steady_step_with_events_allocates_nothing() {
    let settings = Settings { contact_events: true, ..common::settings(find("soft_step").unwrap()) };
    let mut world = common::run(&common::scene("pyramid:10"), settings, 120);
    let body = world.handle(3).unwrap();
    world.apply_force(body, [1.0, 0.0]).unwrap();
    world.step().unwrap();
    let count = allocations(|| {
        for _ in 0..10 {
            world.apply_force(body, [1.0, 0.0]).unwrap();
            world.step().unwrap();
            assert!(world.contact_events().is_empty() && world.body(body).unwrap().contacts().count() > 0);
        }
    });
    assert_eq!(count, 0);
}

/// A world without gravity, so that nothing meets.
fn empty() -> World {
    World::new(Settings { gravity: [0.0; 2], ..common::settings(find("soft_step").unwrap()) })
}

#[test]
fn shapes_that_come_and_go_leave_no_memory_behind() {
    let mut world = empty();
    let mut live = [0; 2];
    for round in 0..4000 {
        let shape = ShapeDef::circle(0.1 + 1e-4 * f64::from(round)).unwrap();
        let body = world.add_body(&BodyDef::dynamic([0.0; 2]).with(shape)).unwrap();
        world.step().unwrap();
        world.remove_body(body).unwrap();
        if [999, 3999].contains(&round) {
            let [allocated, freed] = BYTES.with(Cell::get);
            live[usize::from(round > 999)] = allocated - freed;
        }
    }
    assert!(live[1] <= live[0], "{} bytes more", live[1] - live[0]);
}

#[test]
fn removing_a_body_costs_the_same_whatever_joints_others_have() {
    let cost = |pairs: usize| {
        let mut world = empty();
        let body = BodyDef::dynamic([0.0; 2]).with(ShapeDef::circle(0.5).unwrap());
        let bodies: Vec<_> = (0..2 * pairs).map(|_| world.add_body(&body).unwrap()).collect();
        for pair in bodies.chunks_exact(2) {
            world.add_joint(&Joint::revolute(pair[0], pair[1])).unwrap();
        }
        world.find_contacts();
        let before = BYTES.with(Cell::get)[0];
        world.remove_body(bodies[0]).unwrap();
        BYTES.with(Cell::get)[0] - before
    };
    assert_eq!(cost(1000), cost(50));
}
