//! Stack frames aligned to cache lines.
//!
//! A kernel spills registers to the stack, 32 or 64 bytes at a time. The compiler aligns a frame to 16 bytes
//! unless a local variable needs more. It discovers that registers run out only when the frame pointer, which
//! it needs to align the frame, is no longer available. Every second 32-byte spill may then cross a cache
//! line, and every 64-byte spill may. If a page ends within the frame, a spill may cross the page, which
//! costs tens of cycles in every batch. Whether this happens depends on where the system places the stack
//! of the process.

use std::hint::black_box;

/// Forces its alignment on the stack frame that contains it.
#[repr(align(64))]
struct CacheLine(#[allow(dead_code, reason = "to have a place on the stack")] u8);

/// Aligns the frame of the calling function. To be called once before a kernel's loop, in the function that
/// the loop is inlined in.
#[inline(always)]
pub fn align_frame() {
    // Mutable: a constant would not be placed on the stack.
    black_box(&mut CacheLine(0));
}
