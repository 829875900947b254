use crate::{Rgb, fm};

/// How a value changes with a parameter theta. Scalars are colours with equal channels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum ValueChange {
    /// value + theta a.
    Add(Rgb),
    /// value (1 + theta m).
    Multiply(f64),
    /// value exp(theta m).
    MultiplyLog(f64),
}

impl ValueChange {
    /// The changed value at theta.
    #[must_use]
    pub fn at(&self, value: Rgb, theta: f64) -> Rgb {
        self.map(theta).value(value)
    }

    /// The derivative with respect to theta, from the value *after* the change.
    ///
    /// Not finite for a [`Multiply`](Self::Multiply) that has just wiped out its value,
    /// 1 + theta m = 0; [`map_rate`](Self::map_rate), which starts from the value before, has no
    /// such exception.
    #[must_use]
    pub fn rate(&self, value_after: Rgb, theta: f64) -> Rgb {
        match *self {
            Self::Add(a) => a,
            Self::Multiply(_) | Self::MultiplyLog(_) => value_after * self.relative_rate(theta),
        }
    }

    /// The derivative of the logarithm of the factor that the value is multiplied by, with the
    /// exception of [`rate`](Self::rate); zero for an addition.
    #[must_use]
    pub fn relative_rate(&self, theta: f64) -> f64 {
        match *self {
            Self::Add(_) => 0.0,
            Self::Multiply(m) => m / (1.0 + theta * m),
            Self::MultiplyLog(m) => m,
        }
    }

    /// The change at theta as a map of the value before.
    #[must_use]
    pub fn map(&self, theta: f64) -> ValueMap {
        match *self {
            Self::Add(a) => ValueMap { factor: 1.0, offset: a * theta },
            Self::Multiply(m) => ValueMap { factor: 1.0 + theta * m, offset: Rgb::ZERO },
            Self::MultiplyLog(m) => ValueMap { factor: fm::exp(theta * m), offset: Rgb::ZERO },
        }
    }

    /// The derivative of [`map`](Self::map) with respect to theta.
    #[must_use]
    pub fn map_rate(&self, theta: f64) -> ValueMap {
        match *self {
            Self::Add(a) => ValueMap { factor: 0.0, offset: a },
            Self::Multiply(m) => ValueMap { factor: m, offset: Rgb::ZERO },
            Self::MultiplyLog(m) => ValueMap { factor: m * fm::exp(theta * m), offset: Rgb::ZERO },
        }
    }

    /// True when all channels change alike: what a scalar can be changed by.
    #[must_use]
    pub fn is_scalar(&self) -> bool {
        match self {
            Self::Add(a) => a.r == a.g && a.g == a.b,
            Self::Multiply(_) | Self::MultiplyLog(_) => true,
        }
    }

    /// The kind of change, as job files spell it.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Add(_) => "add",
            Self::Multiply(_) | Self::MultiplyLog(_) => "multiply",
        }
    }
}

/// The map value -> factor value + offset; as a rate, the derivative of such a map.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ValueMap {
    /// Multiplies the value.
    pub factor: f64,
    /// Added after.
    pub offset: Rgb,
}

impl ValueMap {
    /// The map that changes nothing.
    pub const IDENTITY: Self = Self { factor: 1.0, offset: Rgb::ZERO };
    /// The map to zero: as a rate, no change.
    pub const ZERO: Self = Self { factor: 0.0, offset: Rgb::ZERO };

    /// Image of a value.
    #[inline]
    #[must_use]
    pub fn value(&self, v: Rgb) -> Rgb {
        v * self.factor + self.offset
    }

    /// This map after another: `self ∘ first`.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        Self { factor: self.factor * first.factor, offset: self.value(first.offset) }
    }

    /// Sum of two rates.
    #[must_use]
    pub fn plus(&self, o: &Self) -> Self {
        Self { factor: self.factor + o.factor, offset: self.offset + o.offset }
    }

    /// True when neither part is NaN or infinite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.factor.is_finite() && self.offset.is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Dual, Real};

    const THETA: f64 = 0.3;

    fn changes() -> [ValueChange; 4] {
        [
            ValueChange::Add(Rgb::new(1.0, -2.0, 0.3)),
            ValueChange::Add(Rgb::splat(0.4)),
            ValueChange::Multiply(-0.7),
            ValueChange::MultiplyLog(1.3),
        ]
    }

    #[test]
    fn rates_are_the_derivatives_of_the_changed_value() {
        let (value, theta) = (Rgb::new(0.5, 2.0, -1.0), Dual::<f64, 1>::variable(THETA, 0));
        for change in changes() {
            let dual = value.map(Dual::from);
            let moved = match change {
                ValueChange::Add(a) => dual + a.map(Dual::from) * theta,
                ValueChange::Multiply(m) => dual * (theta * m + 1.0),
                ValueChange::MultiplyLog(m) => dual * (theta * m).exp(),
            };
            let after = change.at(value, THETA);
            assert!((after - moved.map(Real::re)).max_abs() < 1e-15);
            let truth = moved.map(|c| c.eps[0]);
            for rate in [change.rate(after, THETA), change.map_rate(THETA).value(value)] {
                assert!((rate - truth).max_abs() < 1e-14, "{change:?}: {rate:?} {truth:?}");
            }
        }
    }

    #[test]
    fn maps_compose_and_their_rates_add() {
        let v = Rgb::new(0.1, 0.7, 1.9);
        for first in changes() {
            for second in changes() {
                let (a, b) = (first.map(THETA), second.map(-THETA));
                assert!((b.after(&a).value(v) - b.value(a.value(v))).max_abs() < 1e-15);
                assert!((a.plus(&b).value(v) - (a.value(v) + b.value(v))).max_abs() < 1e-15);
            }
            assert_eq!(ValueMap::IDENTITY.after(&first.map(THETA)), first.map(THETA));
            assert_eq!(first.map(0.0).value(v), v);
        }
        assert_eq!(ValueMap::ZERO.value(v), Rgb::ZERO);
    }

    #[test]
    fn scalars_refuse_colours_and_wiped_out_values_have_no_logarithm() {
        assert_eq!(changes().map(|c| c.is_scalar()), [false, true, true, true]);
        assert_eq!(changes().map(|c| c.kind()), ["add", "add", "multiply", "multiply"]);
        let vanishing = ValueChange::Multiply(-1.0);
        assert!(!vanishing.rate(Rgb::ZERO, 1.0).is_finite());
        assert_eq!(vanishing.map_rate(1.0).value(Rgb::ONE), -Rgb::ONE);
        assert!(!ValueChange::MultiplyLog(1e4).map(1.0).is_finite());
    }

    #[cfg(feature = "serde")]
    #[test]
    fn changes_survive_storage() {
        let text = serde_json::to_string(&changes()).unwrap();
        assert!(text.contains("\"multiply_log\":1.3"), "{text}");
        assert_eq!(serde_json::from_str::<[ValueChange; 4]>(&text).unwrap(), changes());
    }
}
