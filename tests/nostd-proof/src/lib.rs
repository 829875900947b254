//! Proof that the numeric crates of drt work without std.
//!
//! This library has its own panic handler. If any crate below links std, there are two, and the compiler
//! stops with E0152, "duplicate lang item `panic_impl`". It proves that no std is linked, not that every target has
//! the atomics and the memory that `alloc` asks for.

#![no_std]

use core::alloc::{GlobalAlloc, Layout};

// A dependency that no code names is not linked, and would pass unseen.
extern crate drt_estimators as _;
extern crate drt_geom as _;
extern crate drt_math as _;
extern crate drt_medium as _;
extern crate drt_motion as _;

/// `alloc` wants an allocator to exist; nothing here runs, so it may be out of memory.
struct Empty;

// SAFETY: a null pointer means failure, so no memory is handed out and none comes back.
unsafe impl GlobalAlloc for Empty {
    unsafe fn alloc(&self, _: Layout) -> *mut u8 {
        core::ptr::null_mut()
    }

    unsafe fn dealloc(&self, _: *mut u8, _: Layout) {}
}

#[global_allocator]
static ALLOCATOR: Empty = Empty;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
