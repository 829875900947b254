use core::f64::consts::{FRAC_1_PI, FRAC_PI_4, PI};

use crate::{Vec3, fm, vec3};

const TAU: f64 = 2.0 * PI;

/// A point uniform in the unit disk, by the map that sends concentric squares to concentric
/// circles (Shirley & Chiu 1997, "A Low Distortion Map Between Disk and Square").
#[inline]
#[must_use]
pub fn concentric_disk([u, v]: [f64; 2]) -> [f64; 2] {
    let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if x == 0.0 && y == 0.0 {
        return [0.0, 0.0];
    }
    if x.abs() > y.abs() {
        let (s, c) = fm::sin_cos(FRAC_PI_4 * (y / x));
        [x * c, x * s]
    } else {
        let (s, c) = fm::sin_cos(FRAC_PI_4 * (x / y));
        [y * s, y * c]
    }
}

/// Density of [`concentric_disk`] in area: 1/pi inside the unit disk.
#[inline]
#[must_use]
pub fn concentric_disk_pdf([x, y]: [f64; 2]) -> f64 {
    if x * x + y * y <= 1.0 { FRAC_1_PI } else { 0.0 }
}

/// A direction about +z with density proportional to its cosine (Malley's method).
#[inline]
#[must_use]
pub fn cosine_hemisphere(u: [f64; 2]) -> Vec3 {
    let [x, y] = concentric_disk(u);
    vec3(x, y, fm::sqrt((1.0 - x * x - y * y).max(0.0)))
}

/// Density of [`cosine_hemisphere`] in solid angle at the unit vector `w`: `max(z, 0) / pi`.
#[inline]
#[must_use]
pub fn cosine_hemisphere_pdf(w: Vec3) -> f64 {
    w.z.max(0.0) * FRAC_1_PI
}

/// A direction uniform on the unit sphere; `u[0]` goes from the pole +z to the pole -z.
#[inline]
#[must_use]
pub fn uniform_sphere(u: [f64; 2]) -> Vec3 {
    cap(2.0 * u[0], u[1])
}

/// Density of [`uniform_sphere`] in solid angle: 1/(4 pi) everywhere.
#[inline]
#[must_use]
pub const fn uniform_sphere_pdf() -> f64 {
    0.25 * FRAC_1_PI
}

/// A direction uniform on the hemisphere about +z.
#[inline]
#[must_use]
pub fn uniform_hemisphere(u: [f64; 2]) -> Vec3 {
    cap(u[0], u[1])
}

/// Density of [`uniform_hemisphere`] in solid angle at the unit vector `w`: 1/(2 pi) for z >= 0.
#[inline]
#[must_use]
pub fn uniform_hemisphere_pdf(w: Vec3) -> f64 {
    if w.z >= 0.0 { 0.5 * FRAC_1_PI } else { 0.0 }
}

/// A direction uniform in the cone about +z whose half angle has the cosine `cos_max` in [-1, 1).
#[inline]
#[must_use]
pub fn uniform_cone(u: [f64; 2], cos_max: f64) -> Vec3 {
    let w = cap((1.0 - cos_max) * u[0], u[1]);
    // Rounding must not carry a sample out of its own density's support.
    vec3(w.x, w.y, w.z.max(cos_max))
}

/// Density of [`uniform_cone`] in solid angle at the unit vector `w`:
/// `1 / (2 pi (1 - cos_max))` inside.
#[inline]
#[must_use]
pub fn uniform_cone_pdf(w: Vec3, cos_max: f64) -> f64 {
    if w.z >= cos_max { 1.0 / (TAU * (1.0 - cos_max)) } else { 0.0 }
}

/// The direction `h = 1 - cos(theta)` below the pole +z, at azimuth `2 pi v`. Areas on the sphere
/// are proportional to `h`, and taking it in place of the cosine keeps narrow cones accurate.
#[inline]
fn cap(h: f64, v: f64) -> Vec3 {
    let (s, c) = fm::sin_cos(TAU * v);
    let r = fm::sqrt((h * (2.0 - h)).max(0.0));
    vec3(r * c, r * s, 1.0 - h)
}
