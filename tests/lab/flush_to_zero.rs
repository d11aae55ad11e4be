//! Law: in a thread that treats subnormal floats as zero, as audio threads and some hosts do, scenes run as in any other.
//!
//! Lanes hold counts and feature ids as the bits of integers, and those of small integers are subnormal floats. The flag
//! may change arithmetic with subnormal numbers; these scenes compute with none, so they have to give the same bits.
#![cfg(target_arch = "x86_64")]

use crate::common::{scene, with_width};
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::VARIANTS;
use std::arch::asm;

/// Denormals are zero (bit 6), and results flush to zero (bit 15).
const FLAGS: u32 = 0x8040;

/// Runs `work` in a thread of its own with the flags set.
#[allow(unsafe_code, reason = "the control register of SSE has no safe access; its thread ends with `work`")]
fn flushed<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let flagged = || {
        let mut state = 0_u32;
        // SAFETY: writes the control register to `state`, which lives through the instruction.
        unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut state, options(nostack)) };
        let with_flags = state | FLAGS;
        // SAFETY: changes only how subnormal numbers are treated, in a thread that runs nothing else afterwards.
        unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const with_flags, options(nostack)) };
        assert_eq!(std::hint::black_box(1e-40_f32) * std::hint::black_box(2.0), 0.0);
        work()
    };
    std::thread::scope(|scope| scope.spawn(flagged).join().unwrap())
}

#[test]
fn scenes_run_with_the_same_bits() {
    for name in ["stack:6", "pyramid:4", "card_house", "circle_pile:30", "bounce"] {
        let scene = scene(name);
        for variant in &VARIANTS {
            for width in LaneWidth::ALL {
                let hash = || {
                    let mut world = scene.build(with_width(variant, width)).unwrap();
                    // Where a solver diverges, it does so with the flags as well.
                    let steps = (0..60).take_while(|_| world.step().is_ok()).count();
                    (steps, world.state_hash())
                };
                assert_eq!(flushed(hash), hash(), "{name} under {} at {width:?}", variant.name);
            }
        }
    }
}
