//! From radiance and derivatives to colours on a screen.

use drt_math::Rgb;

/// Part of the pixels that may be overexposed.
const BRIGHTEST: f64 = 0.01;

/// Eight bits per channel, in sRGB.
pub(crate) type Pixel = [u8; 3];

/// The value to show as white, so that all but the brightest pixels fit.
pub(crate) fn white_of(image: &[Rgb]) -> f64 {
    let white = quantile(image, |c| c.max_channel());
    if white > 0.0 { white } else { 1.0 }
}

/// An image with `white` as white.
pub(crate) fn exposed(image: &[Rgb], white: f64) -> Vec<Pixel> {
    image.iter().map(|c| (*c * (1.0 / white)).to_array().map(encode)).collect()
}

/// Blue for negative, white for zero, red for positive; full colour at the image's own range.
pub(crate) fn diverging(image: &[Rgb]) -> Vec<Pixel> {
    let range = quantile(image, |c| c.mean().abs());
    let scale = if range > 0.0 { 1.0 / range } else { 0.0 };
    let negative = Rgb::new(0.02, 0.12, 0.55);
    let positive = Rgb::new(0.55, 0.03, 0.04);
    let color = |v: f64| {
        let end = if v < 0.0 { negative } else { positive };
        let t = v.abs().min(1.0);
        Rgb::ONE * (1.0 - t) + end * t
    };
    image.iter().map(|c| color(c.mean() * scale).to_array().map(encode)).collect()
}

/// The value that only the brightest pixels exceed.
fn quantile(image: &[Rgb], measure: impl Fn(Rgb) -> f64) -> f64 {
    let mut values: Vec<f64> =
        image.iter().map(|c| measure(*c)).filter(|v| v.is_finite()).collect();
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
    fn gray(values: &[f64]) -> Vec<Rgb> {
        values.iter().copied().map(Rgb::splat).collect()
    }

    #[test]
    fn zero_is_white_and_signs_are_told_apart() {
        let [minus, zero, plus] = diverging(&gray(&[-2.0, 0.0, 2.0]))[..] else { panic!() };
        assert_eq!(zero, [255; 3]);
        assert!(minus[2] > minus[0] && plus[0] > plus[2]);
    }

    #[test]
    fn black_images_stay_black() {
        let black = gray(&[0.0, 0.0]);
        assert_eq!(exposed(&black, white_of(&black)), [[0; 3]; 2]);
        assert_eq!(diverging(&gray(&[0.0])), [[255; 3]]);
    }

    #[test]
    fn the_brightest_pixel_of_a_dark_image_shows() {
        let mut values = vec![0.0; 1000];
        values[7] = 1e-6;
        let image = gray(&values);
        assert_eq!(exposed(&image, white_of(&image))[7], [255; 3]);
    }
}
