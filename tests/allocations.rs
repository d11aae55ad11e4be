//! Law: a steady step allocates nothing.

#[path = "lab/common.rs"]
mod common;

use simpulse::engine::solvers::{Guarantee, VARIANTS, find};
use simpulse::engine::world::Settings;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system allocator, with a count of the current thread's allocations.
struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call is passed to the system allocator unchanged.
#[allow(unsafe_code, reason = "an allocator")]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
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
            assert!(world.contact_events().is_empty() && world.contacts_of(body).unwrap().count() > 0);
        }
    });
    assert_eq!(count, 0);
}
