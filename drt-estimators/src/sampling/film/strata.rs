//! Sums over parts of the samples, which are kept apart where they come from several machines.

use alloc::vec::Vec;

use drt_math::Rgb;

use crate::model::rendering::BLOCKS;
use crate::sampling::film::Events;

/// Groups of the pixels whose paths are splatted, along one axis.
pub(super) const GROUPS: u32 = 8;

/// Sums of a group: blocks, and the whole.
pub(super) const OF_GROUP: usize = BLOCKS * BLOCKS + 1;

/// Sums of samples for many numbers at once.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct SampleSums {
    pub(super) values: Vec<Rgb>,
    /// Of the weights of samples; empty where these have none.
    pub(super) weights: Vec<f64>,
}

impl SampleSums {
    pub(super) fn new(n: usize) -> Self {
        Self { values: alloc::vec![Rgb::ZERO; n], weights: Vec::new() }
    }

    pub(super) fn weighted(n: usize) -> Self {
        Self { weights: alloc::vec![0.0; n], ..Self::new(n) }
    }

    /// Zeros for as many numbers.
    pub(super) fn empty(&self) -> Self {
        let (n, weights) = (self.values.len(), self.weights.len());
        Self { values: alloc::vec![Rgb::ZERO; n], weights: alloc::vec![0.0; weights] }
    }

    pub(super) fn clear(&mut self) {
        self.values.fill(Rgb::ZERO);
        self.weights.fill(0.0);
    }

    pub(super) fn add(&mut self, other: &Self) {
        for (sum, v) in self.values.iter_mut().zip(&other.values) {
            *sum += *v;
        }
        for (sum, w) in self.weights.iter_mut().zip(&other.weights) {
            *sum += *w;
        }
    }

    /// The same, and zeros the other sums.
    pub(super) fn take(&mut self, other: &mut Self) {
        take_all(&mut self.values, &mut other.values);
        for (sum, w) in self.weights.iter_mut().zip(&mut other.weights) {
            *sum += core::mem::take(w);
        }
    }

    pub(super) fn add_to(&mut self, i: usize, (value, weight): (Rgb, f64)) {
        self.values[i] += value;
        self.weights[i] += weight;
    }

    /// True for weights of all `n` numbers, or of none.
    fn is_of(&self, n: u64, weighted: bool) -> bool {
        let weights = if weighted { n } else { 0 };
        self.values.len() as u64 == n && self.weights.len() as u64 == weights
    }
}

/// Adds sums to others, and zeros them.
pub(super) fn take_all(sums: &mut [Rgb], others: &mut [Rgb]) {
    for (sum, v) in sums.iter_mut().zip(others) {
        *sum += core::mem::replace(v, Rgb::ZERO);
    }
}

/// What splats add to an image.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct SplatSums {
    pub(super) pixels: SampleSums,
    /// Blocks and the whole, by groups.
    pub(super) groups: SampleSums,
    pub(super) events: Events,
}

impl SplatSums {
    pub(super) fn new(pixels: usize) -> Self {
        Self {
            pixels: SampleSums::weighted(pixels),
            groups: SampleSums::weighted((GROUPS * GROUPS) as usize * OF_GROUP),
            events: Events::NONE,
        }
    }

    pub(super) fn clear(&mut self) {
        self.pixels.clear();
        self.groups.clear();
        self.events = Events::NONE;
    }

    fn is_of(&self, pixels: u64) -> bool {
        self.pixels.is_of(pixels, true)
            && self.groups.is_of(u64::from(GROUPS * GROUPS) * OF_GROUP as u64, true)
    }
}

/// What the samples of one stratum add to every pixel and layer.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Stratum {
    pub(super) sums: SampleSums,
    /// Per layer.
    pub(super) events: Vec<Events>,
    /// To the first layer, where that is splatted.
    pub(super) image: Option<SplatSums>,
}

impl Stratum {
    /// True for one of so many pixels and layers, of which the first is splatted or not.
    pub(crate) fn is_of(&self, [w, h]: [u32; 2], layers: usize, splatted: bool) -> bool {
        let pixels = u64::from(w) * u64::from(h);
        self.sums.is_of(pixels * layers as u64, false)
            && self.events.len() == layers
            && self.image.is_some() == splatted
            && self.image.iter().all(|image| image.is_of(pixels))
    }
}
