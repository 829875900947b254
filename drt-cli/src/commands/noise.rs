//! How noisy a result is.

use drt_estimators::{Layer, Rendering};

/// Rms standard error over rms value; for a derivative whose value drowns in its own error, over the
/// largest derivative of the same run.
pub(super) fn relative_noise(layer: &Layer, rendering: &Rendering) -> f64 {
    noise_of(layer.rms_value(), rms_error(layer), rendering)
}

/// Relative noise of the difference between a derivative and another estimate of it, over what [`relative_noise`] divides by.
pub(super) fn noise_of_difference(layer: &Layer, other: &Layer, rendering: &Rendering) -> f64 {
    let error = rms_error(layer).hypot(rms_error(other));
    noise_of(layer.rms_value(), error, rendering)
}

fn rms_error(layer: &Layer) -> f64 {
    layer.relative_noise(Some(1.0))
}

fn noise_of(value: f64, error: f64, rendering: &Rendering) -> f64 {
    if error == 0.0 {
        return 0.0;
    }
    if value > 2.0 * error {
        return error / value;
    }
    let largest = rendering.derivatives.iter().map(|d| d.total.rms_value());
    error / largest.fold(value, f64::max)
}

/// The largest relative noise among the image and its derivatives.
pub(super) fn largest_noise(rendering: &Rendering) -> f64 {
    let image = &rendering.image;
    let error = image.relative_noise(Some(1.0));
    let image_noise = if error == 0.0 { 0.0 } else { image.relative_noise(None) };
    let derivatives = rendering.derivatives.iter().map(|d| relative_noise(&d.total, rendering));
    derivatives.fold(image_noise, f64::max)
}
