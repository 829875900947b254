//! Where lobes are along a line, to draw points there.
//!
//! Over an edge that is near, lobes are narrow: by the [kernel] alone few points would be where nearly all light
//! is scattered. In the angle φ from the line's nearest point, the squared distance of a direction to a lobe's axis is
//! about p² + (φ - φ₀)², p being the least there is along the line, at φ₀. So of a lobe of the width w
//! points have the density
//!
//! ```text
//! s / (s² + (φ - φ₀)²) / A,    s² = w² + p²,
//! ```
//!
//! A being the difference of atan((φ - φ₀) / s) between the ends. That is sampled exactly and has longer tails
//! than the [lobe](crate::edges::Lobe) itself. Kernel and lobes are mixed by what is scattered from them.
//!
//! [kernel]: super::kernel

use core::f64::consts::FRAC_2_PI;

use drt_math::{Real, Vec3, fm};

use crate::edges::Lobe;
use crate::edges::tree::kernel::Kernel;
use crate::edges::tree::view::Viewpoint;

/// The part of points that the kernel draws at least.
const LEAST_EVEN: f64 = 0.25;

/// Lobes this many times as wide as the line is seen are even along it.
const WIDE: f64 = 2.0;

/// Of lines that pass nearer than this part of their distance, angles are not known well enough.
const NEAREST: f64 = 1e-6;

/// The lobes along a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Glints {
    /// The part of the kernel.
    even: f64,
    glints: [Glint; 2],
    d: f64,
}

/// One lobe.
#[derive(Clone, Copy, Debug, Default)]
struct Glint {
    share: f64,
    /// φ₀ and s.
    middle: f64,
    width: f64,
    /// The arc tangent at the near end, and how much more it is at the far one.
    start: f64,
    over: f64,
}

impl Glints {
    /// Of a part of the line that goes along a unit `tangent` through `foot`, where it is nearest, from the
    /// viewpoint.
    pub(super) fn new(view: &Viewpoint, kernel: &Kernel, foot: Vec3, tangent: Vec3) -> Self {
        let none = Self { even: 1.0, glints: [Glint::default(); 2], d: foot.length() };
        let ends = [kernel.near, kernel.far];
        let farthest = f64::max(ends[0].abs(), ends[1].abs());
        if none.d.is_nan() || none.d <= NEAREST * farthest {
            return none;
        }
        // As seen, it is no longer than this.
        let most = (kernel.far - kernel.near) / kernel.distance();
        let narrow = |l: &Lobe| l.height > 0.0 && l.width2 < WIDE * WIDE * most * most;
        if !view.lobes.lobes.iter().any(narrow) {
            return none;
        }
        let line = Arc { unit: foot / none.d, tangent, ends: ends.map(|t| fm::atan2(t, none.d)) };
        let mut even = view.lobes.even * view.cosine(line.at(0.5 * (line.ends[0] + line.ends[1])));
        let glints = view.lobes.lobes.map(|lobe| {
            let (glint, amount) = line.glint(&lobe);
            glint.unwrap_or_else(|| {
                even += amount;
                Glint::default()
            })
        });
        let sum: f64 = glints.iter().map(|g| g.share).sum();
        if !sum.is_finite() || sum <= 0.0 {
            return none;
        }
        let even = f64::max(even / (even + sum), LEAST_EVEN);
        let glints = glints.map(|g| Glint { share: g.share / sum * (1.0 - even), ..g });
        Self { even, glints, ..none }
    }

    /// The point for a uniform number.
    pub(super) fn sample(&self, kernel: &Kernel, u: f64) -> f64 {
        if u < self.even {
            return kernel.sample(u / self.even);
        }
        let [first, second] = &self.glints;
        let u = u - self.even;
        let (glint, u) = match u < first.share || second.share == 0.0 {
            true => (first, u / first.share),
            false => (second, (u - first.share) / second.share),
        };
        let angle = glint.middle + glint.width * tangent(glint.start + glint.over * u.min(1.0));
        (self.d * tangent(angle)).clamp(kernel.near, kernel.far)
    }

    /// Density per length.
    pub(super) fn pdf(&self, kernel: &Kernel, t: f64) -> f64 {
        let mut pdf = self.even * kernel.pdf(t);
        if self.even < 1.0 {
            let angle = fm::atan2(t, self.d);
            let speed = self.d / (self.d * self.d + t * t);
            for g in self.glints.iter().filter(|g| g.share > 0.0) {
                let off = angle - g.middle;
                pdf += g.share * speed * g.width / (g.over * (g.width * g.width + off * off));
            }
        }
        pdf
    }
}

/// A line as it is seen: its nearest direction, and the angles at which it ends.
struct Arc {
    unit: Vec3,
    tangent: Vec3,
    ends: [f64; 2],
}

impl Arc {
    fn at(&self, angle: f64) -> Vec3 {
        self.unit * Real::cos(angle) + self.tangent * Real::sin(angle)
    }

    /// A lobe along it, if it is narrow; and how much the kernel finds of it.
    fn glint(&self, lobe: &Lobe) -> (Option<Glint>, f64) {
        if lobe.height <= 0.0 {
            return (None, 0.0);
        }
        let [from, until] = self.ends;
        let middle = fm::atan2(lobe.axis.dot(self.tangent), lobe.axis.dot(self.unit));
        let near = |end: &f64| Real::cos(middle - end);
        let middle = match (from..=until).contains(&middle) {
            true => middle,
            false if near(&from) > near(&until) => from,
            false => until,
        };
        let off2 = (self.at(middle) - lobe.axis).length_squared();
        let width = Real::sqrt(lobe.width2 + off2);
        let angle = until - from;
        // The kernel is a cosine over these angles.
        let cosine = Real::cos(middle) * angle / (Real::sin(until) - Real::sin(from));
        let value = Lobe::value(lobe.height, lobe.width2, off2);
        let share = value * cosine / (1.0 + FRAC_2_PI * angle / width);
        let [start, end] = [from, until].map(|e| fm::atan2(e - middle, width));
        let glint = Glint { share, middle, width, start, over: end - start };
        ((angle * WIDE > width).then_some(glint), share)
    }
}

fn tangent(angle: f64) -> f64 {
    Real::sin(angle) / Real::cos(angle)
}

#[cfg(test)]
mod tests {
    use drt_math::{Rng, vec3};

    use super::*;
    use crate::edges::Lobes;

    /// Integrals over lines, by points drawn and their density.
    #[test]
    fn points_have_their_density() {
        let mut rng = Rng::new(3, 1, 4);
        let mut direction = || {
            let v = [(); 3].map(|()| 2.0 * rng.next_f64() - 1.0);
            vec3(v[0], v[1], v[2]).normalize()
        };
        let mut mixed = 0;
        for k in 0..400 {
            let [unit, axis, other] = [direction(), direction(), direction()];
            let tangent = direction().reject(unit).normalize();
            let width2 = [1e-4, 1e-2, 0.3][k % 3];
            let lobe = |axis, share| Lobe::new(axis, width2, share);
            let second = if k % 2 == 0 { lobe(other, 0.7) } else { Lobe::default() };
            let lobes = Lobes { even: 0.1, lobes: [lobe(axis, 0.4), second] };
            let view = Viewpoint::new(Vec3::ZERO, None).scattering(lobes);
            let d = [0.02, 0.5, 3.0][k / 3 % 3];
            let near = [-1.3, -0.2, 0.4][k / 9 % 3];
            let kernel = Kernel::new(d, near, 1.1);
            let glints = Glints::new(&view, &kernel, unit * d, tangent);
            mixed += u32::from(glints.even < 1.0);
            let n = 4000;
            let sine = |t: f64| t / Real::sqrt(t * t + d * d);
            let (mut all, mut sines) = (0.0, 0.0);
            for i in 0..n {
                let t = glints.sample(&kernel, (f64::from(i) + 0.5) / f64::from(n));
                let weight = kernel.pdf(t) / (glints.pdf(&kernel, t) * f64::from(n));
                all += weight;
                sines += weight * sine(t);
            }
            // The kernel is even in the sine.
            let expected = 0.5 * (sine(near) + sine(1.1));
            assert!((all - 1.0).abs() < 2e-3, "{k}: {all}");
            assert!((sines - expected).abs() < 2e-3, "{k}: {sines}, not {expected}");
        }
        assert!(mixed > 200, "{mixed}");
    }

    /// Where a lobe is narrow, most points are in it, and none counts for much.
    #[test]
    fn points_are_where_lobes_are() {
        let (unit, tangent) = (vec3(0.0, 0.0, 1.0), vec3(1.0, 0.0, 0.0));
        for at in [-1.2, 0.0, 0.7] {
            let axis = unit * Real::cos(at) + tangent * Real::sin(at);
            let lobe = Lobe::new(axis, 1e-4, 1.0);
            let lobes = Lobes { even: 0.01, lobes: [lobe, Lobe::default()] };
            let view = Viewpoint::new(Vec3::ZERO, None).scattering(lobes);
            let kernel = Kernel::new(1.0, -20.0, 20.0);
            let glints = Glints::new(&view, &kernel, unit, tangent);
            let n = 10_000;
            let (mut sum, mut squares) = (0.0, 0.0);
            for i in 0..n {
                let t = glints.sample(&kernel, (f64::from(i) + 0.5) / f64::from(n));
                let dir = (unit + tangent * t).normalize();
                let light =
                    0.01 + Lobe::value(lobe.height, lobe.width2, (dir - axis).length_squared());
                let sample = light * kernel.mass() * kernel.pdf(t) / glints.pdf(&kernel, t);
                sum += sample;
                squares += sample * sample;
            }
            let spread = squares * f64::from(n) / (sum * sum) - 1.0;
            assert!(spread < 1.0, "{at}: {spread}");
        }
    }
}
