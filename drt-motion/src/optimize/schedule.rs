use alloc::vec::Vec;

use drt_math::fm;

/// What learning rates are multiplied with as a run proceeds. Iterations are counted from 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Decay {
    /// 1 throughout.
    #[default]
    Constant,
    /// From 1 down to `end`, by the same ratio each iteration.
    Exponential {
        /// The factor after the last iteration; positive.
        end: f64,
    },
    /// From 1 down to `end` along half a period of a cosine (Loshchilov and Hutter 2017): slow at both
    /// ends, so that noise is averaged where the values matter.
    Cosine {
        /// The factor after the last iteration.
        end: f64,
    },
}

impl Decay {
    /// The factor of iteration `i` out of `count`.
    #[must_use]
    pub fn factor(&self, i: u32, count: u32) -> f64 {
        let t = f64::from(i) / f64::from(count.max(1));
        match *self {
            Self::Constant => 1.0,
            Self::Exponential { end } => fm::powf(end, t),
            Self::Cosine { end } => {
                end + (1.0 - end) * 0.5 * (1.0 + fm::cos(core::f64::consts::PI * t))
            }
        }
    }
}

/// Something that changes at given iterations, such as the number of samples.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Stages<T> {
    first: T,
    changes: Vec<(u32, T)>,
}

impl<T: Copy> Stages<T> {
    /// `first`, and from each of these iterations on another value; in any order.
    #[must_use]
    pub fn new(first: T, mut changes: Vec<(u32, T)>) -> Self {
        changes.sort_by_key(|(from, _)| *from);
        Self { first, changes }
    }

    /// The value of an iteration.
    #[must_use]
    pub fn at(&self, iteration: u32) -> T {
        let past = self.changes.iter().take_while(|(from, _)| *from <= iteration);
        past.last().map_or(self.first, |(_, value)| *value)
    }

    /// Every value that occurs.
    pub fn values(&self) -> impl Iterator<Item = T> + '_ {
        core::iter::once(self.first).chain(self.changes.iter().map(|(_, value)| *value))
    }
}
