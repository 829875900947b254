//! Spectra to linear sRGB, by the CIE 1931 standard observer (2°), as Mitsuba's RGB modes convert them.

use drt_math::{Rgb, vec3};

/// First and last wavelength of the table, in nanometres.
const RANGE: [f64; 2] = [360.0, 830.0];
/// Steps of the sum that stands for the integral over wavelengths: as many as Mitsuba takes, and
/// spaced as there, so that colours agree to more digits than the sum itself is exact to.
const STEPS: u32 = 1000;
/// Luminance of an equal-energy spectrum of power one, over all wavelengths, as Mitsuba divides by it.
const LUMINANCE: f64 = 106.750_259_399_414_06;
/// Brings the luminance of D65 to that of an equal-energy spectrum of power one.
const WHITE: f64 = 0.471_106_26 / 46.6383;

/// Values at increasing wavelengths, in nanometres; linear in between, zero beyond.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Spectrum {
    samples: Vec<[f64; 2]>,
}

impl Spectrum {
    /// A spectrum of pairs of wavelength and value; `None` unless there is one, the wavelengths
    /// increase and all numbers are finite.
    pub(crate) fn new(samples: Vec<[f64; 2]>) -> Option<Self> {
        let increasing = samples.windows(2).all(|w| w[0][0] < w[1][0]);
        let finite = samples.iter().flatten().all(|v| v.is_finite());
        (!samples.is_empty() && increasing && finite).then_some(Self { samples })
    }

    /// The radiance of a black body at a temperature in kelvin, in watts per square metre, steradian
    /// and nanometre (Planck's law).
    pub(crate) fn black_body(kelvin: f64) -> Self {
        // 2 h c² and h c / k, with lengths in metres (SI, exact since 2019).
        const FIRST: f64 = 1.191_042_972_397_188_4e-16;
        const SECOND: f64 = 1.438_776_877_503_933e-2;
        let radiance = |nm: f64| {
            let lambda = nm * 1e-9;
            1e-9 * FIRST / (lambda.powi(5) * (SECOND / (lambda * kelvin)).exp_m1())
        };
        let [from, to] = RANGE.map(|w| w as u32);
        Self { samples: (from..=to).map(f64::from).map(|w| [w, radiance(w)]).collect() }
    }

    /// The colour of light with this spectrum.
    pub(crate) fn emitted(&self) -> Rgb {
        self.observed(|_| 1.0)
    }

    /// The colour of what reflects (or refracts, or absorbs) so, under daylight (D65).
    pub(crate) fn reflected(&self) -> Rgb {
        self.observed(|[_, _, _, daylight]| daylight * WHITE)
    }

    /// Colours beyond those of the screen come out negative, and are black there.
    fn observed(&self, light: impl Fn([f64; 4]) -> f64) -> Rgb {
        let [from, to] = RANGE;
        let mut xyz = vec3(0.0, 0.0, 0.0);
        for i in 0..STEPS {
            let wavelength = from + (to - from) * f64::from(i) / f64::from(STEPS - 1);
            let seen = observer(wavelength);
            let [x, y, z, _] = seen;
            xyz += vec3(x, y, z) * (self.at(wavelength) * light(seen));
        }
        let xyz = xyz * ((to - from) / (f64::from(STEPS) * LUMINANCE));
        // ITU-R BT.709's primaries.
        let row = |r, g, b| vec3(r, g, b).dot(xyz).max(0.0);
        Rgb::new(
            row(3.240_479, -1.537_150, -0.498_535),
            row(-0.969_256, 1.875_991, 0.041_556),
            row(0.055_648, -0.204_043, 1.057_311),
        )
    }

    fn at(&self, wavelength: f64) -> f64 {
        let after = self.samples.partition_point(|s| s[0] < wavelength);
        match (after.checked_sub(1).map(|i| self.samples[i]), self.samples.get(after)) {
            (Some([a, at_a]), Some([b, at_b])) => at_a + (at_b - at_a) * (wavelength - a) / (b - a),
            (None, Some([b, at_b])) if *b == wavelength => *at_b,
            _ => 0.0,
        }
    }
}

/// The row of [`OBSERVER`] at a wavelength of its range.
fn observer(wavelength: f64) -> [f64; 4] {
    let at = (wavelength - RANGE[0]) / 5.0;
    let i = (at as usize).min(OBSERVER.len() - 2);
    let t = at - i as f64;
    core::array::from_fn(|c| OBSERVER[i][c] + t * (OBSERVER[i + 1][c] - OBSERVER[i][c]))
}

/// The colour-matching functions x̄, ȳ, z̄ and the power of the illuminant D65, every 5 nm from 360 nm
/// (CIE 15:2004, tables T.4 and T.1).
#[rustfmt::skip]
const OBSERVER: [[f64; 4]; 95] = [
    [0.0001299, 3.917e-06, 0.0006061, 46.6383],
    [0.0002321, 6.965e-06, 0.001086, 49.3637],
    [0.0004149, 1.239e-05, 0.001946, 52.0891],
    [0.0007416, 2.202e-05, 0.003486, 51.0323],
    [0.001368, 3.9e-05, 0.006450001, 49.9755],
    [0.002236, 6.4e-05, 0.01054999, 52.3118],
    [0.004243, 0.00012, 0.02005001, 54.6482],
    [0.00765, 0.000217, 0.03621, 68.7015],
    [0.01431, 0.000396, 0.06785001, 82.7549],
    [0.02319, 0.00064, 0.1102, 87.1204],
    [0.04351, 0.00121, 0.2074, 91.486],
    [0.07763, 0.00218, 0.3713, 92.4589],
    [0.13438, 0.004, 0.6456, 93.4318],
    [0.21477, 0.0073, 1.0390501, 90.057],
    [0.2839, 0.0116, 1.3856, 86.6823],
    [0.3285, 0.01684, 1.62296, 95.7736],
    [0.34828, 0.023, 1.74706, 104.865],
    [0.34806, 0.0298, 1.7826, 110.936],
    [0.3362, 0.038, 1.77211, 117.008],
    [0.3187, 0.048, 1.7441, 117.41],
    [0.2908, 0.06, 1.6692, 117.812],
    [0.2511, 0.0739, 1.5281, 116.336],
    [0.19536, 0.09098, 1.28764, 114.861],
    [0.1421, 0.1126, 1.0419, 115.392],
    [0.09564, 0.13902, 0.8129501, 115.923],
    [0.05795001, 0.1693, 0.6162, 112.367],
    [0.03201, 0.20802, 0.46518, 108.811],
    [0.0147, 0.2586, 0.3533, 109.082],
    [0.0049, 0.323, 0.272, 109.354],
    [0.0024, 0.4073, 0.2123, 108.578],
    [0.0093, 0.503, 0.1582, 107.802],
    [0.0291, 0.6082, 0.1117, 106.296],
    [0.06327, 0.71, 0.07824999, 104.79],
    [0.1096, 0.7932, 0.05725001, 106.239],
    [0.1655, 0.862, 0.04216, 107.689],
    [0.2257499, 0.9148501, 0.02984, 106.047],
    [0.2904, 0.954, 0.0203, 104.405],
    [0.3597, 0.9803, 0.0134, 104.225],
    [0.4334499, 0.9949501, 0.008749999, 104.046],
    [0.5120501, 1.0, 0.005749999, 102.023],
    [0.5945, 0.995, 0.0039, 100.0],
    [0.6784, 0.9786, 0.002749999, 98.1671],
    [0.7621, 0.952, 0.0021, 96.3342],
    [0.8425, 0.9154, 0.0018, 96.0611],
    [0.9163, 0.87, 0.001650001, 95.788],
    [0.9786, 0.8163, 0.0014, 92.2368],
    [1.0263, 0.757, 0.0011, 88.6856],
    [1.0567, 0.6949, 0.001, 89.3459],
    [1.0622, 0.631, 0.0008, 90.0062],
    [1.0456, 0.5668, 0.0006, 89.8026],
    [1.0026, 0.503, 0.00034, 89.5991],
    [0.9384, 0.4412, 0.00024, 88.6489],
    [0.8544499, 0.381, 0.00019, 87.6987],
    [0.7514, 0.321, 0.0001, 85.4936],
    [0.6424, 0.265, 4.999999e-05, 83.2886],
    [0.5419, 0.217, 3e-05, 83.4939],
    [0.4479, 0.175, 2e-05, 83.6992],
    [0.3608, 0.1382, 1e-05, 81.863],
    [0.2835, 0.107, 0.0, 80.0268],
    [0.2187, 0.0816, 0.0, 80.1207],
    [0.1649, 0.061, 0.0, 80.2146],
    [0.1212, 0.04458, 0.0, 81.2462],
    [0.0874, 0.032, 0.0, 82.2778],
    [0.0636, 0.0232, 0.0, 80.281],
    [0.04677, 0.017, 0.0, 78.2842],
    [0.0329, 0.01192, 0.0, 74.0027],
    [0.0227, 0.00821, 0.0, 69.7213],
    [0.01584, 0.005723, 0.0, 70.6652],
    [0.01135916, 0.004102, 0.0, 71.6091],
    [0.008110916, 0.002929, 0.0, 72.979],
    [0.005790346, 0.002091, 0.0, 74.349],
    [0.004109457, 0.001484, 0.0, 67.9765],
    [0.002899327, 0.001047, 0.0, 61.604],
    [0.00204919, 0.00074, 0.0, 65.7448],
    [0.001439971, 0.00052, 0.0, 69.8856],
    [0.0009999493, 0.0003611, 0.0, 72.4863],
    [0.0006900786, 0.0002492, 0.0, 75.087],
    [0.0004760213, 0.0001719, 0.0, 69.3398],
    [0.0003323011, 0.00012, 0.0, 63.5927],
    [0.0002348261, 8.48e-05, 0.0, 55.0054],
    [0.0001661505, 6e-05, 0.0, 46.4182],
    [0.000117413, 4.24e-05, 0.0, 56.6118],
    [8.307527e-05, 3e-05, 0.0, 66.8054],
    [5.870652e-05, 2.12e-05, 0.0, 65.0941],
    [4.150994e-05, 1.499e-05, 0.0, 63.3828],
    [2.935326e-05, 1.06e-05, 0.0, 63.8434],
    [2.067383e-05, 7.4657e-06, 0.0, 64.304],
    [1.455977e-05, 5.2578e-06, 0.0, 61.8779],
    [1.025398e-05, 3.7029e-06, 0.0, 59.4519],
    [7.221456e-06, 2.6078e-06, 0.0, 55.7054],
    [5.085868e-06, 1.8366e-06, 0.0, 51.959],
    [3.581652e-06, 1.2934e-06, 0.0, 54.6998],
    [2.522525e-06, 9.1093e-07, 0.0, 57.4406],
    [1.776509e-06, 6.4153e-07, 0.0, 58.8765],
    [1.251141e-06, 4.5181e-07, 0.0, 60.3125],
];

#[cfg(test)]
mod tests {
    use super::*;

    fn close(c: Rgb, expected: [f64; 3]) {
        for (a, b) in c.to_array().into_iter().zip(expected) {
            assert!((a - b).abs() < 2e-6 * b.abs().max(1.0), "{c:?}, expected {expected:?}");
        }
    }

    fn spectrum(samples: &[[f64; 2]]) -> Spectrum {
        Spectrum::new(samples.to_vec()).unwrap()
    }

    /// The numbers that Mitsuba 3.9.1 (scalar_rgb) holds for the same spectra.
    #[test]
    fn colours_are_mitsubas() {
        let reflector = spectrum(&[[400.0, 0.1], [500.0, 0.3], [600.0, 0.9], [700.0, 0.2]]);
        close(reflector.reflected(), [0.887_608_47, 0.562_839_39, 0.155_488_13]);
        let grey = spectrum(&[[400.0, 0.78], [700.0, 0.78]]);
        close(grey.reflected(), [0.776_366_77, 0.779_810_01, 0.776_029_11]);
        close(
            spectrum(&[[500.0, 1.0], [520.0, 1.0]]).reflected(),
            [0.0, 0.193_768_43, 0.014_586_08],
        );
        let lamp = spectrum(&[[400.0, 0.0], [500.0, 8.0], [600.0, 15.6], [700.0, 18.4]]);
        close(lamp.emitted(), [20.710_836_4, 10.854_634_3, 2.771_152_0]);
        close(
            spectrum(&[[300.0, 1.0], [900.0, 1.0]]).emitted(),
            [1.204_883_7, 0.948_228_2, 0.909_266_8],
        );
    }

    #[test]
    fn black_bodies_have_their_colours() {
        // Correlated colour temperatures on the Planckian locus in CIE xy, as tabulated.
        for (kelvin, x, y) in [(2856.0, 0.4476, 0.4074), (6500.0, 0.3135, 0.3237)] {
            let c = Spectrum::black_body(kelvin).emitted();
            let row = |m: [f64; 3]| m[0] * c.r + m[1] * c.g + m[2] * c.b;
            let xyz = [
                row([0.412_453, 0.357_580, 0.180_423]),
                row([0.212_671, 0.715_160, 0.072_169]),
                row([0.019_334, 0.119_193, 0.950_227]),
            ];
            let sum: f64 = xyz.iter().sum();
            assert!((xyz[0] / sum - x).abs() < 5e-4 && (xyz[1] / sum - y).abs() < 5e-4, "{xyz:?}");
        }
        // Wien: 5000 K peak at 579.6 nm, with 1.277e4 W/(m² sr nm) · 1e-3.
        let s = Spectrum::black_body(5000.0);
        let peak = s.samples.iter().copied().max_by(|a, b| a[1].total_cmp(&b[1])).unwrap();
        assert!(
            (peak[0] - 579.6).abs() < 1.0 && (peak[1] / 1.279e4 - 1.0).abs() < 0.01,
            "{peak:?}"
        );
    }

    #[test]
    fn only_increasing_finite_samples_are_spectra() {
        assert!(Spectrum::new(vec![]).is_none());
        assert!(Spectrum::new(vec![[500.0, 1.0], [500.0, 2.0]]).is_none());
        assert!(Spectrum::new(vec![[500.0, f64::NAN]]).is_none());
    }
}
