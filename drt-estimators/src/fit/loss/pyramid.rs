//! Halving images, and the sum of squares over all halved ones.

use alloc::vec::Vec;

use drt_math::Rgb;

/// The quadratic form Σᵢ weightⁱ Dⁱᵀ Dⁱ of images of one size.
pub(super) struct Pyramid {
    /// Of each level, finest first.
    sizes: Vec<[usize; 2]>,
    weight: f64,
}

impl Pyramid {
    pub(super) fn new(size: [u32; 2], levels: u32, weight: f64) -> Self {
        let mut sizes = alloc::vec![size.map(|n| n as usize)];
        while sizes.len() < levels as usize
            && let Some([w, h]) = sizes.last().copied()
            && w * h > 1
        {
            sizes.push([w.div_ceil(2), h.div_ceil(2)]);
        }
        Self { sizes, weight }
    }

    /// The form applied to an image: an image of the same size.
    pub(super) fn apply(&self, image: &[Rgb]) -> Vec<Rgb> {
        let mut levels = alloc::vec![image.to_vec()];
        for sizes in self.sizes.windows(2) {
            let coarse = levels.last().map(|fine| halve(fine, sizes[0], sizes[1]));
            levels.extend(coarse);
        }
        // By Horner's rule: d + weight Dᵀ(Dd + weight Dᵀ(…)).
        let mut sum = Vec::new();
        for (i, mut level) in levels.into_iter().enumerate().rev() {
            if !sum.is_empty() {
                add_halved_transposed(&sum, self.weight, self.sizes[i], &mut level);
            }
            sum = level;
        }
        sum
    }
}

/// Means over 2×2 pixels; over as many as there are in the last column and row of odd sides.
fn halve(fine: &[Rgb], [w, h]: [usize; 2], [cw, ch]: [usize; 2]) -> Vec<Rgb> {
    let mut coarse = Vec::with_capacity(cw * ch);
    for y in 0..ch {
        for x in 0..cw {
            let mut sum = Rgb::ZERO;
            for row in 2 * y..usize::min(2 * y + 2, h) {
                for pixel in &fine[row * w + 2 * x..row * w + usize::min(2 * x + 2, w)] {
                    sum += *pixel;
                }
            }
            coarse.push(sum * share([x, y], [w, h]));
        }
    }
    coarse
}

/// Adds `weight` times the transpose of [`halve`].
fn add_halved_transposed(coarse: &[Rgb], weight: f64, [w, h]: [usize; 2], fine: &mut [Rgb]) {
    let cw = w.div_ceil(2);
    for (y, row) in fine.chunks_exact_mut(w).enumerate() {
        for (x, pixel) in row.iter_mut().enumerate() {
            let cell = [x / 2, y / 2];
            *pixel += coarse[cell[1] * cw + cell[0]] * (weight * share(cell, [w, h]));
        }
    }
}

/// The weight of each pixel in the mean of its cell.
fn share([x, y]: [usize; 2], [w, h]: [usize; 2]) -> f64 {
    let n = usize::min(2, w - 2 * x) * usize::min(2, h - 2 * y);
    1.0 / n as f64
}
