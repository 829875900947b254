//! What one batch of a splatted term adds to images.

use alloc::vec::Vec;

use drt_math::Rgb;

use crate::sampling::film::Events;

/// A list is kept while it has fewer entries than this part of the pixels.
const FEW: usize = 4;

/// One batch of a splatted term: a sum per pixel and layer.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Splats {
    pub(super) layers: Vec<Splatted>,
    pub(super) events: Vec<Events>,
}

/// Sums per pixel. Batches of few samples leave most pixels alone: then only what they touch costs.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Splatted {
    pixels: usize,
    /// What each sample added to which pixel; empty once there is a sum for every pixel.
    list: Vec<(u32, Rgb)>,
    sums: Vec<Rgb>,
}

impl Splatted {
    fn add(&mut self, pixel: u32, v: Rgb) {
        if self.sums.is_empty() {
            self.list.push((pixel, v));
            if self.list.len() * FEW >= self.pixels {
                self.spread();
            }
        } else {
            self.sums[pixel as usize] += v;
        }
    }

    fn spread(&mut self) {
        self.sums = alloc::vec![Rgb::ZERO; self.pixels];
        for (pixel, v) in core::mem::take(&mut self.list) {
            self.sums[pixel as usize] += v;
        }
    }

    /// Calls `each` for every pixel that something was added to, in order.
    pub(super) fn for_each(&self, mut each: impl FnMut(usize, Rgb)) {
        for (i, v) in self.sums.iter().enumerate().filter(|(_, v)| !v.is_zero()) {
            each(i, *v);
        }
        for of_pixel in self.list.chunk_by(|(a, _), (b, _)| a == b) {
            // As the sum of a pixel begins.
            let sum = of_pixel.iter().fold(Rgb::ZERO, |sum, (_, v)| sum + *v);
            each(of_pixel[0].0 as usize, sum);
        }
    }
}

impl Splats {
    pub(crate) fn new(size: [u32; 2], layers: usize) -> Self {
        let pixels = (size[0] * size[1]) as usize;
        let empty = || Splatted { pixels, list: Vec::new(), sums: Vec::new() };
        Self {
            layers: (0..layers).map(|_| empty()).collect(),
            events: alloc::vec![Events::NONE; layers],
        }
    }

    pub(crate) fn add(&mut self, layer: usize, pixel: u32, v: Rgb) {
        self.layers[layer].add(pixel, v);
        self.events[layer].push(v);
    }

    /// Calls `each` for every pixel of a layer that something was added to.
    pub(crate) fn for_each(&self, layer: usize, each: impl FnMut(usize, Rgb)) {
        self.layers[layer].for_each(each);
    }

    /// True for sums over so many pixels and layers.
    pub(crate) fn is_of(&self, [w, h]: [u32; 2], layers: usize) -> bool {
        let n = u64::from(w) * u64::from(h);
        let fits = |s: &Splatted| {
            s.pixels as u64 == n
                && (s.sums.is_empty() || s.sums.len() == s.pixels)
                && s.list.iter().all(|(pixel, _)| u64::from(*pixel) < n)
        };
        self.layers.len() == layers && self.events.len() == layers && self.layers.iter().all(fits)
    }

    /// To be called after the last sample.
    pub(crate) fn settled(mut self) -> Self {
        for layer in &mut self.layers {
            // Stable, so that every pixel's sum is taken in the samples' order.
            layer.list.sort_by_key(|(pixel, _)| *pixel);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_and_many_samples_make_the_same_sums() {
        let mut rng = drt_math::Rng::new(1, 2, 3);
        for samples in [0, 1, 17, 400] {
            let mut splats = Splats::new([9, 11], 1);
            let mut expected = alloc::vec![Rgb::ZERO; 99];
            for _ in 0..samples {
                let (pixel, v) = (rng.next_u32() % 99, Rgb::splat(rng.next_f64() - 0.3));
                splats.add(0, pixel, v);
                expected[pixel as usize] += v;
            }
            let mut found = alloc::vec![Rgb::ZERO; 99];
            splats.settled().layers[0].for_each(|i, v| found[i] = v);
            assert_eq!(found, expected, "{samples}");
        }
    }
}
