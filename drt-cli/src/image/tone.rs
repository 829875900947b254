//! From radiance and derivatives to colours on a screen.

use drt_estimators::Layer;
use drt_math::Rgb;

/// Part of the pixels that may be overexposed.
const BRIGHTEST: f64 = 0.01;

/// Eight bits per channel, in sRGB.
pub(super) type Pixel = [u8; 3];

/// An image exposed so that all but its brightest pixels fit.
pub(super) fn exposed(layer: &Layer) -> Vec<Pixel> {
    let white = quantile(layer, |c| c.max_channel());
    let scale = if white > 0.0 { 1.0 / white } else { 1.0 };
    layer.pixels.iter().map(|p| (p.mean * scale).to_array().map(encode)).collect()
}

/// Blue for negative, white for zero, red for positive; full colour at the image's own range.
pub(super) fn diverging(layer: &Layer) -> Vec<Pixel> {
    let range = quantile(layer, |c| c.mean().abs());
    let scale = if range > 0.0 { 1.0 / range } else { 0.0 };
    let negative = Rgb::new(0.02, 0.12, 0.55);
    let positive = Rgb::new(0.55, 0.03, 0.04);
    let color = |v: f64| {
        let end = if v < 0.0 { negative } else { positive };
        let t = v.abs().min(1.0);
        Rgb::ONE * (1.0 - t) + end * t
    };
    layer.pixels.iter().map(|p| color(p.mean.mean() * scale).to_array().map(encode)).collect()
}

/// The value that only the brightest pixels exceed.
fn quantile(layer: &Layer, measure: impl Fn(Rgb) -> f64) -> f64 {
    let mut values: Vec<f64> =
        layer.pixels.iter().map(|p| measure(p.mean)).filter(|v| v.is_finite()).collect();
    if values.is_empty() {
        return 0.0;
    }
    let rank = ((values.len() - 1) as f64 * (1.0 - BRIGHTEST)).round() as usize;
    let (_, at_rank, above) = values.select_nth_unstable_by(rank, f64::total_cmp);
    // Where nearly everything is zero, the few pixels that are not shall show.
    if *at_rank > 0.0 { *at_rank } else { above.iter().copied().fold(0.0, f64::max) }
}

/// The sRGB transfer curve (IEC 61966-2-1), to eight bits.
fn encode(v: f64) -> u8 {
    let v = v.clamp(0.0, 1.0);
    let s = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (s * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use drt_estimators::Estimate;

    fn layer(values: &[f64]) -> Layer {
        let estimate = |v: &f64| Estimate { mean: Rgb::splat(*v), ..Default::default() };
        Layer {
            size: [values.len() as u32, 1],
            pixels: values.iter().map(estimate).collect(),
            blocks: Vec::new(),
            total: Estimate::default(),
        }
    }

    #[test]
    fn zero_is_white_and_signs_are_told_apart() {
        let [minus, zero, plus] = diverging(&layer(&[-2.0, 0.0, 2.0]))[..] else { panic!() };
        assert_eq!(zero, [255; 3]);
        assert!(minus[2] > minus[0] && plus[0] > plus[2]);
    }

    #[test]
    fn black_images_stay_black() {
        assert_eq!(exposed(&layer(&[0.0, 0.0])), [[0; 3]; 2]);
        assert_eq!(diverging(&layer(&[0.0])), [[255; 3]]);
    }

    #[test]
    fn the_brightest_pixel_of_a_dark_image_shows() {
        let mut values = vec![0.0; 1000];
        values[7] = 1e-6;
        assert_eq!(exposed(&layer(&values))[7], [255; 3]);
    }
}
