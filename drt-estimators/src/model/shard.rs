//! Parts of the samples of a run, for as many machines.

use core::fmt;
use core::ops::Range;

/// One of several disjoint parts of the samples of a run, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Shard {
    index: u32,
    count: u32,
}

impl Shard {
    /// Shard `index` of `count`; `None` unless 1 ≤ `index` ≤ `count`.
    #[must_use]
    pub fn new(index: u32, count: u32) -> Option<Self> {
        (1..=count).contains(&index).then_some(Self { index, count })
    }

    /// Which one it is, from 1.
    #[must_use]
    pub fn index(self) -> u32 {
        self.index
    }

    /// How many there are.
    #[must_use]
    pub fn count(self) -> u32 {
        self.count
    }

    /// Its part of `n` things.
    pub(crate) fn of(self, n: u32) -> Range<u32> {
        let at = |k: u32| (u64::from(n) * u64::from(k) / u64::from(self.count)) as u32;
        at(self.index - 1)..at(self.index)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

/// True for one of `n` things that a shard has, or a run in one piece.
pub(crate) fn has(shard: Option<Shard>, n: u32, i: u32) -> bool {
    shard.is_none_or(|shard| shard.of(n).contains(&i))
}
