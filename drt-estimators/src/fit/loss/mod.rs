//! Losses, which measure how far an image is from its target, and their derivatives with respect to every pixel.
//!
//! Images are lists of linear RGB, row by row from the top left.

mod pyramid;
#[cfg(test)]
mod tests;

use alloc::vec::Vec;

use drt_math::{Rgb, fm};

use crate::fit::loss::pyramid::Pyramid;
use crate::model::error::{Error, SettingError};

/// A distance between images. In the variants, d is the difference of two images, times the mask where there is one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Loss {
    /// Σ d², over pixels and channels.
    #[default]
    L2,
    /// Σ |d|, over pixels and channels.
    L1,
    /// The square root of the mean of d² over pixels and channels. Pixels that a mask takes out count
    /// in the mean as zeros.
    Rmse,
    /// Σᵢ weightⁱ Σ (Dⁱ d)², where D halves an image by means over 2×2 pixels: Zhang et al. 2019,
    /// "A differential theory of radiative transfer", footnote 7. Coarse levels have a gradient for features that are
    /// far from where they should be, where fine levels do not have one yet.
    ///
    /// Where a side is odd, its last pixels make narrower cells with means of their own. The smallest
    /// level has one pixel.
    PyramidL2 {
        /// Number of levels, the image itself included; those beyond the smallest are left out.
        levels: u32,
        /// Weight of each level relative to the next finer one. With 4, each pixel counts the same on
        /// every level as in the image.
        weight: f64,
    },
}

/// A target image, and the pixels at which it counts.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reference {
    size: [u32; 2],
    pixels: Vec<Rgb>,
    mask: Option<Vec<f64>>,
}

impl Reference {
    /// An image of `size` (columns and rows) that counts everywhere.
    ///
    /// # Errors
    /// When there are not as many pixels, or one is not finite.
    pub fn new(size: [u32; 2], pixels: Vec<Rgb>) -> Result<Self, Error> {
        check_length("target", size, pixels.len())?;
        match pixels.iter().position(|p| !p.is_finite()) {
            None => Ok(Self { size, pixels, mask: None }),
            Some(i) => {
                let [column, row] = at(size, i);
                Err(unusable("target", SettingError::PixelNotFinite { column, row }))
            }
        }
    }

    /// This reference with a factor for each pixel's difference; a factor of 0 leaves the pixel out.
    ///
    /// # Errors
    /// When there are not as many factors, or one is negative or not finite, or all are zero.
    pub fn with_mask(self, mask: Vec<f64>) -> Result<Self, Error> {
        check_length("mask", self.size, mask.len())?;
        if let Some(i) = mask.iter().position(|m| !(*m >= 0.0 && m.is_finite())) {
            let [column, row] = at(self.size, i);
            let reason = SettingError::MaskPixel { column, row, value: mask[i] };
            return Err(unusable("mask", reason));
        }
        if mask.iter().all(|m| *m == 0.0) {
            return Err(unusable("mask", SettingError::EmptyMask));
        }
        Ok(Self { mask: Some(mask), ..self })
    }

    /// This reference with each pixel's difference divided by the sum of the pixel's brightness (the mean of its
    /// channels) and `part` times the image's mean brightness. The divisors are in units of that mean, and the mask so
    /// far still applies. Where both noise and signal grow with brightness, dark pixels then contribute as much
    /// information as bright ones.
    ///
    /// # Errors
    /// When the part is not positive, or the image is black or has negative pixels.
    pub fn relative(self, part: f64) -> Result<Self, Error> {
        if !(part > 0.0 && part.is_finite()) {
            return Err(unusable("relative", SettingError::NotPositive(part)));
        }
        let mean = self.pixels.iter().map(|p| p.mean()).sum::<f64>() / self.pixels.len() as f64;
        if let Some(i) = self.pixels.iter().position(|p| p.mean() < 0.0) {
            let [column, row] = at(self.size, i);
            return Err(unusable("relative", SettingError::NegativePixel { column, row }));
        }
        if mean == 0.0 {
            return Err(unusable("relative", SettingError::BlackTarget));
        }
        let pixels = self.pixels.iter().enumerate();
        let factors = pixels.map(|(i, p)| self.factor(i) * mean / (p.mean() + part * mean));
        let mask = factors.collect();
        self.with_mask(mask)
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The pixels.
    #[must_use]
    pub fn pixels(&self) -> &[Rgb] {
        &self.pixels
    }

    /// This reference reduced to the means over `factor`×`factor` pixels.
    ///
    /// # Errors
    /// When the sides are not multiples of the factor, or the mask then leaves nothing.
    pub fn reduced(&self, factor: u32) -> Result<Self, Error> {
        let [w, h] = self.size;
        if factor == 0 || w % factor != 0 || h % factor != 0 {
            let reason = SettingError::Indivisible { size: self.size, factor };
            return Err(unusable("target", reason));
        }
        let size = [w / factor, h / factor];
        let scale = 1.0 / f64::from(factor * factor);
        let cells = |i: usize| {
            let [x, y] = [i as u32 % size[0] * factor, i as u32 / size[0] * factor];
            (y..y + factor).flat_map(move |y| (x..x + factor).map(move |x| (y * w + x) as usize))
        };
        let n = (size[0] * size[1]) as usize;
        let mean = |i| cells(i).fold(Rgb::ZERO, |sum, j| sum + self.pixels[j]) * scale;
        let reduced = Self::new(size, (0..n).map(mean).collect())?;
        match &self.mask {
            None => Ok(reduced),
            Some(mask) => {
                let mean = |i| cells(i).map(|j| mask[j]).sum::<f64>() * scale;
                reduced.with_mask((0..n).map(mean).collect())
            }
        }
    }

    fn factor(&self, i: usize) -> f64 {
        self.mask.as_ref().map_or(1.0, |m| m[i])
    }
}

impl Loss {
    /// Checks what cannot be meant.
    ///
    /// # Errors
    /// Names the number.
    pub fn check(&self) -> Result<(), Error> {
        match *self {
            Self::PyramidL2 { levels: 0, .. } => Err(unusable("loss", SettingError::NoLevels)),
            Self::PyramidL2 { weight, .. } if !(weight > 0.0 && weight.is_finite()) => {
                Err(unusable("loss", SettingError::Weight(weight)))
            }
            _ => Ok(()),
        }
    }

    /// The distance of an image from the wanted one.
    ///
    /// # Panics
    /// When the image has another number of pixels.
    #[must_use]
    pub fn value(&self, image: &[Rgb], reference: &Reference) -> f64 {
        let d = masked_difference(image, reference);
        match *self {
            Self::L2 => inner(&d, &d),
            Self::L1 => d.iter().map(|d| d.abs().sum()).sum(),
            Self::Rmse => fm::sqrt(inner(&d, &d) / channels(reference)),
            Self::PyramidL2 { levels, weight } => {
                let along = Pyramid::new(reference.size, levels, weight).apply(&d);
                inner(&d, &along)
            }
        }
    }

    /// The derivative of [`value`](Self::value) by every pixel. Where it jumps, at d = 0 for L1 and at
    /// equal images for the root mean square, it is 0.
    ///
    /// For the squared losses it is linear in the image, and therefore as unbiased as that.
    ///
    /// # Panics
    /// When the image has another number of pixels.
    #[must_use]
    pub fn adjoint(&self, image: &[Rgb], reference: &Reference) -> Vec<Rgb> {
        let d = masked_difference(image, reference);
        let slope = match *self {
            Self::L1 => d.iter().map(|d| d.map(sign)).collect(),
            _ => self.curve(&d, reference, self.value(image, reference)),
        };
        times_mask(slope, reference)
    }

    /// The rate of the [`adjoint`](Self::adjoint) when the image changes by `change`, next to an image
    /// of loss `value`: the second derivative as far as it is positive for sure (Gauss and Newton's). L1
    /// has none.
    ///
    /// # Panics
    /// When the change has another number of pixels.
    #[must_use]
    pub fn curvature(&self, change: &[Rgb], value: f64, reference: &Reference) -> Vec<Rgb> {
        let masked = times_mask(change.to_vec(), reference);
        times_mask(self.curve(&masked, reference, value), reference)
    }

    /// True where [`curvature`](Self::curvature) says how the loss bends: for all but L1, whose bends are
    /// all at zero.
    #[must_use]
    pub fn is_curved(&self) -> bool {
        !matches!(self, Self::L1)
    }

    /// The quadratic form that the loss is made of, applied to `d`: twice that of squares; that of the
    /// root is this over the root.
    fn curve(&self, d: &[Rgb], reference: &Reference, value: f64) -> Vec<Rgb> {
        let scaled = |factor: f64| d.iter().map(|d| *d * factor).collect();
        match *self {
            Self::L2 => scaled(2.0),
            Self::L1 => scaled(0.0),
            Self::Rmse if value == 0.0 => scaled(0.0),
            Self::Rmse => scaled(1.0 / (channels(reference) * value)),
            Self::PyramidL2 { levels, weight } => {
                let mut sum = Pyramid::new(reference.size, levels, weight).apply(d);
                sum.iter_mut().for_each(|s| *s *= 2.0);
                sum
            }
        }
    }
}

fn masked_difference(image: &[Rgb], reference: &Reference) -> Vec<Rgb> {
    assert_eq!(image.len(), reference.pixels.len(), "an image of another size");
    let pairs = image.iter().zip(&reference.pixels).enumerate();
    pairs.map(|(i, (a, b))| (*a - *b) * reference.factor(i)).collect()
}

fn times_mask(mut image: Vec<Rgb>, reference: &Reference) -> Vec<Rgb> {
    assert_eq!(image.len(), reference.pixels.len(), "an image of another size");
    for (pixel, factor) in image.iter_mut().zip(reference.mask.iter().flatten()) {
        *pixel *= *factor;
    }
    image
}

fn channels(reference: &Reference) -> f64 {
    3.0 * reference.pixels.len() as f64
}

/// The product of two images, summed over pixels and channels.
pub(crate) fn inner(a: &[Rgb], b: &[Rgb]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn sign(v: f64) -> f64 {
    if v == 0.0 { 0.0 } else { v.signum() }
}

fn check_length(setting: &'static str, size: [u32; 2], found: usize) -> Result<(), Error> {
    let [w, h] = size;
    if found == w as usize * h as usize && found > 0 {
        return Ok(());
    }
    Err(unusable(setting, SettingError::PixelCount { found, expected: size }))
}

/// Column and row of a pixel.
fn at([w, _]: [u32; 2], i: usize) -> [u32; 2] {
    [i as u32 % w, i as u32 / w]
}

fn unusable(setting: &'static str, reason: SettingError) -> Error {
    Error::Setting { setting, reason }
}
