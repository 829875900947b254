use drt_math::{Real, Vec3};

use crate::{MediumError, Phase};

/// Two phase functions in proportion: `(1 - w) p_0 + w p_1`.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "(f64, [Phase; 2])", try_from = "(f64, [Phase; 2])"))]
pub struct PhaseBlend {
    weight: f64,
    parts: [Phase; 2],
}

impl PhaseBlend {
    /// A blend with `weight` of the second part.
    ///
    /// # Errors
    /// When the weight does not lie in [0, 1].
    pub fn new(weight: f64, parts: [Phase; 2]) -> Result<Self, MediumError> {
        if (0.0..=1.0).contains(&weight) {
            Ok(Self { weight, parts })
        } else {
            let expected = "between 0 and 1";
            Err(MediumError::PhaseFunction { what: "weight", value: weight, expected })
        }
    }

    /// The part of the second one.
    #[must_use]
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// What it is made of.
    #[must_use]
    pub fn parts(&self) -> &[Phase; 2] {
        &self.parts
    }

    pub(super) fn eval<T: Real>(&self, c: T) -> T {
        let [a, b] = &self.parts;
        a.eval(c) * (1.0 - self.weight) + b.eval(c) * self.weight
    }

    pub(super) fn d_cos(&self, c: f64) -> f64 {
        let [a, b] = self.parts.each_ref().map(|p| p.d_cos(c));
        a * (1.0 - self.weight) + b * self.weight
    }

    /// From one of the parts, with the density of both. The first number also says which.
    pub(super) fn sample(&self, flow: Vec3, u: [f64; 2]) -> (Vec3, f64) {
        let [a, b] = &self.parts;
        // Numbers stay below one.
        let rest = |v: f64| f64::min(v, 1.0 - f64::EPSILON);
        let (w, _) = if u[0] < self.weight {
            b.sample(flow, [rest(u[0] / self.weight), u[1]])
        } else {
            a.sample(flow, [rest((u[0] - self.weight) / (1.0 - self.weight)), u[1]])
        };
        (w, self.eval(flow.dot(w)))
    }
}

impl From<PhaseBlend> for (f64, [Phase; 2]) {
    fn from(blend: PhaseBlend) -> Self {
        (blend.weight, blend.parts)
    }
}

impl TryFrom<(f64, [Phase; 2])> for PhaseBlend {
    type Error = MediumError;
    fn try_from((weight, parts): (f64, [Phase; 2])) -> Result<Self, MediumError> {
        Self::new(weight, parts)
    }
}
