use drt_math::fm;

use crate::optimize::OptimizeError;
use crate::optimize::checks::same_length;

/// The ε of [`total_variation`], in the units of the values.
pub const TOTAL_VARIATION_EPSILON: f64 = 1e-6;

/// The total variation of a grid, `weight` × Σ √(d² + ε²) over the differences d of neighbours along each axis, whose
/// derivatives by the values are added to `gradient`.
///
/// It makes values equal where they hardly differ, and leaves large differences as sharp as they are (Rudin, Osher
/// and Fatemi 1992, "Nonlinear total variation based noise removal algorithms", with the differences along the axes
/// taken one by one). The ε is [`TOTAL_VARIATION_EPSILON`]: it gives equal neighbours a derivative, and differences
/// that are not far above it count by their squares.
///
/// `shape` is the number of values along x, y and z; a texture has 1 along z. Values are stored x fastest, then y,
/// then z, with the `channels` of a place side by side; differences are taken within each channel.
///
/// # Errors
/// When the number of values or derivatives is not the product of the shape and the channels.
pub fn total_variation(
    shape: [usize; 3],
    channels: usize,
    values: &[f64],
    gradient: &mut [f64],
    weight: f64,
) -> Result<f64, OptimizeError> {
    let expected = shape.iter().fold(channels, |product, n| product.saturating_mul(*n));
    same_length("the values of the grid", expected, values)?;
    same_length("the gradient of the grid", expected, gradient)?;
    if expected == 0 {
        return Ok(0.0);
    }
    let mut sum = 0.0;
    let mut stride = channels;
    for count in shape {
        // Whatever varies faster than this axis is one piece of memory, and so is the axis with it.
        for line in (0..expected).step_by(stride * count) {
            for i in line..line + stride * (count - 1) {
                let difference = values[i + stride] - values[i];
                let length = fm::sqrt(
                    difference * difference + TOTAL_VARIATION_EPSILON * TOTAL_VARIATION_EPSILON,
                );
                sum += length;
                let slope = weight * difference / length;
                gradient[i + stride] += slope;
                gradient[i] -= slope;
            }
        }
        stride *= count;
    }
    Ok(weight * sum)
}
