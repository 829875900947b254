//! A rough metal as a measurement would tell it.
//!
//! Its density of visible normals is D(m) o·m / σ(o), where o·m > 0, with σ(o) = cos θ_o / G₁(o) (Heitz 2014, eq. 16), so that the colours are
//! those of facets, less what others hide from the light: c_o = F(o·m) G₁(i).

use alloc::vec::Vec;
use core::f64::consts::{FRAC_PI_2, PI};

use drt_math::{Rgb, Vec3, fm};

use crate::model::surface::RoughConductor;
use crate::model::surface::fresnel::conductor_reflected;
use crate::model::surface::measured::marginal2d::{Grid2d, Marginal2d, Mix};
use crate::model::surface::measured::{MeasuredError, MeasuredTables, Tensor, direction};
use crate::model::surface::microfacet::mirrored;
use crate::model::surface::stretched_facets::StretchedFacets;

impl MeasuredTables {
    /// The tables of a metal of the roughness `alpha` along u and across it; its own does not count. There are azimuths `phi_i`, a
    /// single one where the roughness is even; `thetas` angles with the normal; and grids of `normals` and `places` rows and
    /// columns. Odd numbers of these keep symmetries.
    ///
    /// # Errors
    /// Where one of the three is below two, or there is no azimuth.
    pub fn of_metal(
        metal: &RoughConductor,
        alpha: [f64; 2],
        phi_i: &[f32],
        [thetas, normals, places]: [usize; 3],
    ) -> Result<Self, MeasuredError> {
        for (field, count) in [("theta_i", thetas), ("ndf", normals), ("rgb", places)] {
            if count < 2 {
                return Err(MeasuredError::new(field, "has fewer than two numbers along a side"));
            }
        }
        if phi_i.is_empty() {
            return Err(MeasuredError::new("phi_i", "is empty"));
        }
        let facets = StretchedFacets { distribution: metal.distribution, alpha };
        let knot = |k: usize| (k as f64 / (thetas - 1) as f64 * FRAC_PI_2) as f32;
        let theta_i: Vec<f32> = (0..thetas).map(knot).collect();
        let viewers: Vec<Vec3> = phi_i
            .iter()
            .flat_map(|p| theta_i.iter().map(|t| viewer(f64::from(*t), f64::from(*p))))
            .collect();
        let vndf = grid(normals, viewers.iter(), |o, [x, y]| {
            let m = normal([x, y]);
            let jacobian = x * fm::sin(x * x * FRAC_PI_2);
            o.dot(m).max(0.0) * facets.density(m) * jacobian
        });
        let density = Grid2d::new([normals; 2], vndf.clone());
        let density =
            Marginal2d::new(density).ok_or_else(|| MeasuredError::new("vndf", "is too narrow"))?;
        let mut rgb = Vec::new();
        let mut luminance = Vec::new();
        for (k, o) in viewers.iter().enumerate() {
            let mix = Mix::single().channel(k, 1);
            let colours: Vec<Rgb> = square(places)
                .map(|s| {
                    let m = normal(density.sample(&mix, s));
                    let i = mirrored(*o, m);
                    let cos = o.dot(m);
                    if cos <= 0.0 || i.z <= 0.0 {
                        return Rgb::ZERO;
                    }
                    let fresnel = [0, 1, 2].map(|c| {
                        let index = [metal.eta, metal.k].map(|v| v.to_array()[c]);
                        conductor_reflected(cos, index[0], index[1])
                    });
                    let shown = facets.masking(i) * i.z;
                    metal.specular_reflectance * Rgb::from(fresnel) * shown
                })
                .collect();
            luminance.extend(colours.iter().map(|c| c.mean() as f32));
            for c in 0..3 {
                rgb.extend(colours.iter().map(|v| v.to_array()[c] as f32));
            }
        }
        let once = [Vec3::Z];
        let ndf = grid(normals, once.iter(), |_, at| facets.density(normal(at)));
        let sigma = grid(normals, once.iter(), |_, at| facets.masking(raised(normal(at))).recip());
        let by_viewer = [phi_i.len(), thetas];
        let tensor = |leading: &[usize], side: usize, values| Tensor {
            shape: [leading, &[side; 2]].concat(),
            values,
        };
        Ok(Self {
            ndf: tensor(&[], normals, ndf),
            sigma: tensor(&[], normals, sigma),
            vndf: tensor(&by_viewer, normals, vndf),
            luminance: tensor(&by_viewer, places, luminance),
            rgb: tensor(&[phi_i.len(), thetas, 3], places, rgb),
            jacobian: true,
            phi_i: phi_i.to_vec(),
            theta_i,
        })
    }
}

/// A direction that is a little above the surface, where it would be in it.
fn raised(w: Vec3) -> Vec3 {
    Vec3 { z: w.z.max(1e-4), ..w }.normalize()
}

fn viewer(theta: f64, phi: f64) -> Vec3 {
    raised(direction(theta, phi))
}

fn normal([x, y]: [f64; 2]) -> Vec3 {
    direction(x * x * FRAC_PI_2, (2.0 * y - 1.0) * PI)
}

/// The points of a grid of so many rows and columns.
fn square(side: usize) -> impl Iterator<Item = [f64; 2]> {
    let at = move |k: usize| k as f64 / (side - 1) as f64;
    (0..side * side).map(move |i| [at(i % side), at(i / side)])
}

fn grid<'a>(
    side: usize,
    viewers: impl Iterator<Item = &'a Vec3>,
    value: impl Fn(Vec3, [f64; 2]) -> f64,
) -> Vec<f32> {
    viewers.flat_map(|o| square(side).map(|at| value(*o, at) as f32).collect::<Vec<_>>()).collect()
}
