//! An image taken for the truth.

use std::path::Path;

use drt_estimators::Layer;

use crate::error::Place;
use crate::{CliError, ExrFile, read_exr};

/// Cells along each side of the grid on which images are compared.
const CELLS: usize = 8;

/// Block means of the reference, by layer.
pub(super) struct Reference {
    file: ExrFile,
    place: Place,
}

impl Reference {
    pub(super) fn read(path: &Path) -> Result<Self, CliError> {
        Ok(Self { file: read_exr(path)?, place: Place::file(path) })
    }

    /// Rms deviation of the block means of `image` from those of a layer: the plain image, or
    /// `d_NAME`. `None` where the reference lacks the layer.
    pub(super) fn error(&self, layer: &str, image: &Layer) -> Result<Option<f64>, CliError> {
        if image.size != self.file.size {
            let ([w, h], [rw, rh]) = (image.size, self.file.size);
            let reason = format!("the reference has {rw}x{rh} pixels, the job's image {w}x{h}");
            return Err(CliError::input(&self.place, &reason));
        }
        let Some(pixels) = self.file.layers.get(layer) else { return Ok(None) };
        let means = block_means(pixels, image.size);
        let mut squares = 0.0;
        for (block, mean) in image.blocks.iter().zip(&means) {
            for (a, b) in block.mean.to_array().into_iter().zip(mean) {
                squares += (a - b) * (a - b);
            }
        }
        Ok(Some((squares / (3 * means.len()) as f64).sqrt()))
    }
}

/// Means of 8×8 cells, row by row from the top left; of an empty cell, zero.
fn block_means(pixels: &[[f32; 3]], [w, h]: [u32; 2]) -> Vec<[f64; 3]> {
    let cuts = |n: u32| move |k: usize| k * n as usize / CELLS;
    let (x, y) = (cuts(w), cuts(h));
    let mut means = Vec::with_capacity(CELLS * CELLS);
    for cell in 0..CELLS * CELLS {
        let (i, j) = (cell % CELLS, cell / CELLS);
        let mut sum = [0.0; 3];
        let mut count = 0.0;
        for row in y(j)..y(j + 1) {
            for pixel in &pixels[row * w as usize + x(i)..row * w as usize + x(i + 1)] {
                for (s, v) in sum.iter_mut().zip(pixel) {
                    *s += f64::from(*v);
                }
                count += 1.0;
            }
        }
        means.push(sum.map(|s| s / f64::max(count, 1.0)));
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn block_means_are_those_of_the_digest() {
        let size = [13, 10];
        let value = |i: u32| (i * i % 97) as f32;
        let pixels: Vec<[f32; 3]> = (0..size[0] * size[1]).map(|i| [value(i); 3]).collect();
        let rendering = crate::files::image::tests::rendering(size);
        let means = block_means(&pixels, size);
        assert_eq!(means.len(), rendering.image.blocks.len());
        // Cell (7, 7): columns 11 and 12, rows 8 and 9.
        let of = |x: u32, y: u32| f64::from(value(y * 13 + x));
        let expected = (of(11, 8) + of(12, 8) + of(11, 9) + of(12, 9)) / 4.0;
        assert!((means[63][0] - expected).abs() < 1e-9);
    }
}
