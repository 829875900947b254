//! Derivatives that must be equal, and faults that make them differ.

use std::fmt;

use drt_estimators::{Estimate, Layer, Session, Settings, Tail, Unattended, agreement};
use drt_math::Rgb;
use drt_motion::{Effect, Parameter};

use crate::Result;
use crate::judge::LIMIT;
use crate::scene::Built;

/// Two ways to change a scene that must have the same derivative, and one that must not.
#[derive(Clone, Debug)]
pub struct Claim {
    /// Of the scene.
    pub name: String,
    /// The scene.
    pub built: Built,
    /// A change.
    pub left: Vec<Effect>,
    /// Changes whose derivatives have the same sum.
    pub right: Vec<Vec<Effect>>,
    /// A change of another derivative, in place of `left`; none where the scene offers no fault.
    pub wrong: Option<Vec<Effect>>,
}

/// What came of a claim.
#[derive(Clone, Debug)]
pub struct Finding {
    /// Of the scene.
    pub name: String,
    /// Of the derivatives that must be equal.
    pub difference: Difference,
    /// Of those that must not.
    pub fault: Option<Difference>,
    /// Per pixel.
    pub samples: u32,
}

/// How two images, or numbers, differ, in standard errors.
#[derive(Clone, Copy, Debug)]
pub struct Difference {
    /// Mean of the first.
    pub left: f64,
    /// Mean of the second.
    pub right: f64,
    /// Standard error of the difference of the means.
    pub stderr: f64,
    /// Root mean square over blocks of pixels; of a single number, its size.
    pub rms_z: f64,
    /// Whether chance explains it.
    pub agrees: bool,
}

/// Deviations that do not count, relative to the sizes of what is compared: rounding, and the few
/// samples that reach nearly dark pixels.
const NEGLIGIBLE: f64 = 1e-6;
/// How clearly a fault has to stand out before sampling ends.
const CLEAR: f64 = 8.0;
/// Relative to the value, the error at which a scene without fault is precise enough.
const PRECISE: f64 = 0.02;

/// Samples a claim until its fault stands out, or `samples` per pixel are spent.
///
/// # Errors
/// When the library rejects the scene or a change.
pub fn examine(claim: &Claim, samples: u32) -> Result<Finding> {
    let fail = |e: drt_estimators::Error| format!("{}: {e}", claim.name);
    let parameter = |name: &str, effects: &[Effect]| Parameter {
        name: name.into(),
        value: 0.0,
        effects: effects.to_vec(),
    };
    let settings = |seed| Settings { threads: 1, seed, ..Settings::default() };
    let mut left = vec![parameter("left", &claim.left)];
    left.extend(claim.wrong.as_ref().map(|e| parameter("wrong", e)));
    let mut one = Session::new(&claim.built.scene, &left, &settings(7)).map_err(fail)?;
    // Other random numbers, so that the errors are independent.
    let right: Vec<Parameter> = claim.right.iter().map(|e| parameter("right", e)).collect();
    let mut other = Session::new(&claim.built.scene, &right, &settings(11)).map_err(fail)?;
    let mut next = if claim.built.single_pixel() { 1 << 13 } else { 1 << 9 };
    let mut done = 0;
    loop {
        one.run(next, &Unattended);
        done += next;
        let first = one.rendering();
        if !right.is_empty() {
            other.run(next, &Unattended);
        }
        let second = other.rendering().derivatives;
        let second = second.into_iter().fold(zero(&first.image), |sum, d| plus(sum, &d.total));
        let value = first.image.rms_value();
        let layer = |p: usize| &first.derivatives[p].total;
        let difference = compare(layer(0), &second, value);
        let fault = claim.wrong.as_ref().map(|_| compare(layer(1), &second, value));
        let enough = match &fault {
            Some(f) => f.rms_z > CLEAR,
            None => difference.stderr < PRECISE * first.image.total.mean.g,
        };
        if enough || done >= samples {
            return Ok(Finding { name: claim.name.clone(), difference, fault, samples: done });
        }
        next = done.min(samples - done);
    }
}

/// Compares a number where there is one pixel, and images by their blocks. Deviations below a
/// millionth of `value` or of either image do not count.
#[must_use]
pub fn compare(a: &Layer, b: &Layer, value: f64) -> Difference {
    let stderr = a.total.stderr.g.hypot(b.total.stderr.g);
    let negligible = NEGLIGIBLE * value.max(a.rms_value()).max(b.rms_value());
    let (rms_z, agrees) = if a.pixels.len() == 1 {
        let off = (a.total.mean.g - b.total.mean.g).abs();
        let z = if off <= negligible { 0.0 } else { off / stderr };
        (z, z <= LIMIT)
    } else {
        let mut close = b.clone();
        for (x, y) in a.blocks.iter().zip(&mut close.blocks) {
            if (x.mean - y.mean).max_abs() <= negligible {
                *y = *x;
            }
        }
        let result = agreement(a, &close, None);
        (result.rms_z, result.agrees)
    };
    Difference { left: a.total.mean.g, right: b.total.mean.g, stderr, rms_z, agrees }
}

fn zero(like: &Layer) -> Layer {
    let nothing = Estimate { mean: Rgb::ZERO, stderr: Rgb::ZERO };
    Layer {
        size: like.size,
        pixels: vec![nothing; like.pixels.len()],
        blocks: vec![nothing; like.blocks.len()],
        total: nothing,
        tail: Tail::default(),
    }
}

/// The sum of two images of one session, whose errors may go together.
fn plus(mut sum: Layer, other: &Layer) -> Layer {
    let add = |a: &mut Estimate, b: &Estimate| {
        a.mean += b.mean;
        a.stderr += b.stderr;
    };
    let pairs = [(&mut sum.pixels, &other.pixels), (&mut sum.blocks, &other.blocks)];
    for (a, b) in pairs {
        a.iter_mut().zip(b).for_each(|(a, b)| add(a, b));
    }
    add(&mut sum.total, &other.total);
    sum
}

impl Built {
    /// True where the image is a number.
    #[must_use]
    pub fn single_pixel(&self) -> bool {
        self.scene.sensors.iter().all(|s| s.item.sensor.film() == [1, 1])
    }
}

impl Finding {
    /// True when what must be equal is, and the fault was noticed.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.difference.agrees && self.fault.is_none_or(|f| !f.agrees)
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Difference { left, right, stderr, rms_z, .. } = self.difference;
        write!(
            f,
            "{:<40} {left:>12.4e} vs {right:>12.4e} ± {stderr:.1e}  z {rms_z:>5.2}",
            self.name
        )?;
        if let Some(fault) = &self.fault {
            write!(f, "   fault {:>12.4e}  z {:>7.2}", fault.left, fault.rms_z)?;
        }
        let verdict = if self.holds() { "" } else { "  <<< FAILS" };
        write!(f, "   {} spp{verdict}", self.samples)
    }
}
