//! Work of other modules by the widest registers there are, which need no unsafe code for it.

use super::lanes::{Lanes, Machine, Task};

/// Something to compute on which wide registers are worth their while.
pub(crate) trait Work {
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
pub(crate) struct Registers(Machine);

impl Registers {
    /// The widest there are.
    pub(crate) fn widest() -> Self {
        Self(Machine::detect())
    }

    /// Those that every machine of its kind has.
    #[cfg(test)]
    pub(crate) const fn portable() -> Self {
        Self(Machine::Portable)
    }

    /// Does some work with them.
    #[inline(always)]
    pub(crate) fn run<W: Work>(self, work: W) -> W::Output {
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

#[cfg(test)]
mod tests {
    use super::*;

    struct Double([f32; 8]);

    impl Work for Double {
        type Output = [f32; 8];
        #[inline(always)]
        fn run(self) -> [f32; 8] {
            self.0.map(|x| 2.0 * x)
        }
    }

    #[test]
    fn all_registers_compute_the_same() {
        for registers in [Registers::widest(), Registers::portable()] {
            assert_eq!(registers.run(Double([1.5; 8])), [3.0; 8]);
        }
    }
}
