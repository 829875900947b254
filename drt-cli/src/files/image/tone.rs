//! From radiance and derivatives to colours on a screen.

use drt_math::Rgb;

/// Part of the pixels that may be overexposed.
const BRIGHTEST: f64 = 0.01;

/// Eight bits per channel, in sRGB.
pub(crate) type Pixel = [u8; 3];

/// How light becomes colours on a screen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tone {
    /// Stops by which light is made brighter, radiance 1 being white at zero stops; `None` where the image's own brightness
    /// decides, so that all but its brightest pixels fit.
    pub exposure: Option<f64>,
    /// What becomes of what is exposed.
    pub curve: ToneCurve,
}

/// From exposed light to what a screen shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// Straight, cut off at white.
    #[default]
    Srgb,
    /// The shape of film: K. Narkowicz's fit (*ACES filmic tone mapping curve*, 2016) to the Academy Color Encoding System's.
    Aces,
}

impl Tone {
    /// Light without any change: a PNG by it is the image itself, but for eight bits a channel and a cut at white.
    pub const PLAIN: Self = Self { exposure: Some(0.0), curve: ToneCurve::Srgb };

    /// An image as a screen shows it.
    pub(crate) fn shown(self, image: &[Rgb]) -> Vec<Pixel> {
        let white = self.exposure.map_or_else(|| white_of(image), |stops| (-stops).exp2());
        match self.curve {
            ToneCurve::Srgb => exposed(image, white),
            ToneCurve::Aces => {
                let film = |x: f64| {
                    let x = x.max(0.0);
                    x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
                };
                let light: Vec<Rgb> =
                    image.iter().map(|c| (*c * (1.0 / white)).map(film)).collect();
                exposed(&light, 1.0)
            }
        }
    }
}

/// The value to show as white, so that all but the brightest pixels fit.
pub(crate) fn white_of(image: &[Rgb]) -> f64 {
    let white = quantile(image, |c| c.max_channel());
    if white > 0.0 { white } else { 1.0 }
}

/// An image with `white` as white.
pub(crate) fn exposed(image: &[Rgb], white: f64) -> Vec<Pixel> {
    image.iter().map(|c| (*c * (1.0 / white)).to_array().map(encode)).collect()
}

/// The value at which a derivative has its full colour: all but the largest are below.
pub(crate) fn range_of(image: &[Rgb]) -> f64 {
    quantile(image, |c| c.mean().abs())
}

/// Blue for negative, white for zero, red for positive; full colour at the image's own [range](range_of).
pub(crate) fn diverging(image: &[Rgb]) -> Vec<Pixel> {
    let range = range_of(image);
    let scale = if range > 0.0 { 1.0 / range } else { 0.0 };
    image.iter().map(|c| signed(c.mean() * scale)).collect()
}

/// The colour of a part of the range, from -1 to 1.
pub(crate) fn signed(part: f64) -> Pixel {
    let negative = Rgb::new(0.02, 0.12, 0.55);
    let positive = Rgb::new(0.55, 0.03, 0.04);
    let end = if part < 0.0 { negative } else { positive };
    let t = part.abs().min(1.0);
    (Rgb::ONE * (1.0 - t) + end * t).to_array().map(encode)
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
    fn stops_double_light_and_film_is_never_full() {
        let image = gray(&[0.25, 1.0, 1e9, -1.0]);
        let at = |exposure, curve| Tone { exposure, curve }.shown(&image);
        assert_eq!(at(Some(0.0), ToneCurve::Srgb), exposed(&image, 1.0));
        assert_eq!(at(Some(2.0), ToneCurve::Srgb)[0], [255; 3]);
        assert_eq!(at(Some(-1.0), ToneCurve::Srgb)[1], [188; 3], "half of white");
        let film = at(Some(0.0), ToneCurve::Aces);
        assert!(film[0][0] < film[1][0] && film[1][0] < 255 && film[3] == [0; 3]);
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
