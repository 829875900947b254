//! Work of other crates by the widest registers there are, which need no unsafe code for it.

use super::lanes::{Lanes, Machine, Task};

/// Something to compute on which wide registers are worth their while.
///
/// ```
/// use drt_geom::{Registers, Work};
///
/// struct Double([f32; 8]);
///
/// impl Work for Double {
///     type Output = [f32; 8];
///     #[inline(always)]
///     fn run(self) -> [f32; 8] {
///         self.0.map(|x| 2.0 * x)
///     }
/// }
///
/// assert_eq!(Registers::widest().run(Double([1.0; 8])), [2.0; 8]);
/// ```
pub trait Work {
    /// What comes out.
    type Output;

    /// Computes it. Only what is inlined here gains: mark this `#[inline(always)]`, and what it calls.
    fn run(self) -> Self::Output;
}

/// The registers to compute with.
///
/// On `x86_64` with `std`, those of AVX2 where the running program finds it. No operations are fused, so
/// all give the same bits.
#[derive(Clone, Copy, Debug)]
pub struct Registers(Machine);

impl Registers {
    /// The widest there are.
    #[must_use]
    pub fn widest() -> Self {
        Self(Machine::detect())
    }

    /// Those that every machine of its kind has.
    #[must_use]
    pub const fn portable() -> Self {
        Self(Machine::Portable)
    }

    /// Does some work with them.
    #[inline(always)]
    pub fn run<W: Work>(self, work: W) -> W::Output {
        self.0.run(Plain(work))
    }
}

/// Work that leaves vectors to the compiler.
struct Plain<W>(W);

impl<W: Work> Task for Plain<W> {
    type Output = W::Output;

    #[inline(always)]
    fn run<L: Lanes>(self, _: L) -> W::Output {
        self.0.run()
    }
}
