//! Maps from uniform numbers to points with a wanted density, each with that density.
//!
//! Every sampling function takes numbers uniform in (0, 1), is continuous in them wherever the
//! target allows it, so that stratified numbers give stratified points, and is measured against
//! its `pdf`. A `pdf` is zero outside the support of its warp; its doc names the measure.

mod direction;
mod distance;
mod interval;
mod spherical_triangle;
#[cfg(test)]
mod tests;

pub use direction::{
    concentric_disk, concentric_disk_pdf, cosine_hemisphere, cosine_hemisphere_pdf, uniform_cone,
    uniform_cone_pdf, uniform_hemisphere, uniform_hemisphere_pdf, uniform_sphere,
    uniform_sphere_pdf,
};
pub use distance::{Equiangular, truncated_exponential, truncated_exponential_pdf};
pub use interval::{sin_squared_polar, sin_squared_polar_pdf, tent, tent_pdf};
pub use spherical_triangle::SphericalTriangle;

/// A point uniform on a triangle, as barycentric coordinates, by the low-distortion map of Heitz
/// 2019, "A Low-Distortion Map Between Triangle and Square": no square root, no folding.
#[inline]
#[must_use]
pub fn uniform_triangle([u, v]: [f64; 2]) -> [f64; 3] {
    let (a, b) = if v > u { (0.5 * u, v - 0.5 * u) } else { (u - 0.5 * v, 0.5 * v) };
    [a, b, 1.0 - a - b]
}

/// Density of [`uniform_triangle`] in the measure of any two of the three coordinates: 2 inside.
/// On a triangle of area `A` this is the density `1 / A`.
#[inline]
#[must_use]
pub fn uniform_triangle_pdf(barycentric: [f64; 3]) -> f64 {
    if barycentric.iter().all(|&b| b >= 0.0) { 2.0 } else { 0.0 }
}
