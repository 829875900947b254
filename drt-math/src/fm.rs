//! Elementary functions of `f64`, from `std` or, without it (or when `libm` is asked for), from
//! the `libm` crate. Everything above calls these, so that one switch decides for the family.

macro_rules! unary {
    ($($(#[$doc:meta])* $name:ident = $libm:ident),* $(,)?) => {$(
        $(#[$doc])*
        #[inline]
        #[must_use]
        pub fn $name(x: f64) -> f64 {
            #[cfg(not(feature = "libm"))]
            { x.$name() }
            #[cfg(feature = "libm")]
            { libm::$libm(x) }
        }
    )*};
}

unary! {
    /// Square root.
    sqrt = sqrt,
    /// Cube root.
    cbrt = cbrt,
    /// e to the x.
    exp = exp,
    /// e to the x, less one, accurate near zero.
    exp_m1 = expm1,
    /// Natural logarithm.
    ln = log,
    /// ln(1 + x), accurate near zero.
    ln_1p = log1p,
    /// Sine.
    sin = sin,
    /// Cosine.
    cos = cos,
    /// Tangent.
    tan = tan,
    /// Arc sine.
    asin = asin,
    /// Arc cosine.
    acos = acos,
    /// Arc tangent.
    atan = atan,
    /// Largest integer not above x.
    floor = floor,
    /// Smallest integer not below x.
    ceil = ceil,
    /// Nearest integer, halves away from zero.
    round = round,
}

/// Angle of the point (x, y) from the x axis, in (-pi, pi].
#[inline]
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    #[cfg(not(feature = "libm"))]
    {
        y.atan2(x)
    }
    #[cfg(feature = "libm")]
    {
        libm::atan2(y, x)
    }
}

/// x to the power y.
#[inline]
#[must_use]
pub fn powf(x: f64, y: f64) -> f64 {
    #[cfg(not(feature = "libm"))]
    {
        x.powf(y)
    }
    #[cfg(feature = "libm")]
    {
        libm::pow(x, y)
    }
}

/// Sine and cosine together.
#[inline]
#[must_use]
pub fn sin_cos(x: f64) -> (f64, f64) {
    #[cfg(not(feature = "libm"))]
    {
        x.sin_cos()
    }
    #[cfg(feature = "libm")]
    {
        libm::sincos(x)
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{E, FRAC_PI_3, LN_2, PI};

    use super::*;

    #[test]
    fn every_name_is_the_function_it_says() {
        let half_root = 0.5 * sqrt(3.0);
        for (value, known) in [
            (sqrt(2.25), 1.5),
            (cbrt(-27.0), -3.0),
            (exp(1.0), E),
            (exp_m1(LN_2), 1.0),
            (exp_m1(1e-20), 1e-20),
            (ln(E), 1.0),
            (ln_1p(1.0), LN_2),
            (ln_1p(1e-20), 1e-20),
            (sin(FRAC_PI_3), half_root),
            (cos(FRAC_PI_3), 0.5),
            (tan(FRAC_PI_3), 2.0 * half_root),
            (asin(half_root), FRAC_PI_3),
            (acos(0.5), FRAC_PI_3),
            (atan(2.0 * half_root), FRAC_PI_3),
            (atan2(-half_root, -0.5), FRAC_PI_3 - PI),
            (powf(2.0, -1.5), 0.5 / sqrt(2.0)),
            (floor(-1.5), -2.0),
            (ceil(-1.5), -1.0),
            (round(-1.5), -2.0),
            (sin_cos(FRAC_PI_3).0, half_root),
            (sin_cos(FRAC_PI_3).1, 0.5),
        ] {
            assert!((value / known - 1.0).abs() < 1e-15, "{value} for {known}");
        }
    }
}
