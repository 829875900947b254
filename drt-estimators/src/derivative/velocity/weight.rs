//! Weights that depend on the direction of a ray.

use core::ops::{Add, AddAssign, Div, Mul, Sub};

use drt_math::Vec3;

/// A weight and its gradient by a ray's unit direction, across it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Weight {
    pub(crate) value: f64,
    pub(crate) gradient: Vec3,
}

impl Weight {
    pub(crate) const fn constant(value: f64) -> Self {
        Self { value, gradient: Vec3::ZERO }
    }

    /// Replaces the gradient with one, by something else that the direction depends on.
    pub(crate) fn map_gradient(self, f: impl FnOnce(Vec3) -> Vec3) -> Self {
        Self { gradient: f(self.gradient), ..self }
    }
}

impl Add for Weight {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, gradient: self.gradient + other.gradient }
    }
}

impl Sub for Weight {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + other * Self::constant(-1.0)
    }
}

impl AddAssign for Weight {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Mul for Weight {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let gradient = self.gradient * other.value + other.gradient * self.value;
        Self { value: self.value * other.value, gradient }
    }
}

impl Div for Weight {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self { value, gradient: (self.gradient - other.gradient * value) / other.value }
    }
}
