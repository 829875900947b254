use drt_geom::Mesh;
use drt_geom::edges::Lobes;
use drt_math::{Dual, Frame, Real, Rgb, RgbVec, Vec3, vec3};

use crate::model::surface::bsdf::Composed;
use crate::model::surface::model::{Flags, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError};
use crate::model::surface::shading_frame::{by_coordinates, is_front, shading_frame};
use crate::model::surface::textures::Textures;
use crate::model::surface::{At, Bsdf, BsdfGradient, Given, SpecularSample, SpecularValue};
use crate::model::texture::{Texture, TexturePoint};

/// A BSDF with other normals than those of its surface: Mitsuba's `normalmap` and `bumpmap`.
///
/// Light counts only if it is on one and the same side of the surface's normal and of the perturbed one. Where textures
/// are replaced by their means, the normals are the surface's.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Perturbed {
    /// The BSDF that is evaluated with these normals.
    pub bsdf: Bsdf,
    /// Normals or heights.
    pub map: Texture,
    /// Whether the map has normals or heights.
    pub perturbation: Perturbation,
    /// A normal that faces away from the viewer is mirrored at the surface's (Schüssler et al. 2017, "Microfacet-based
    /// Normal Mapping for Robust Monte Carlo Path Tracing").
    pub flip_invalid_normals: bool,
    /// Light fades towards the horizon, as by microfacets (Conty Estevez et al. 2019, "A Microfacet-Based Shadowing
    /// Function to Solve the Bump Terminator Problem").
    pub use_shadowing_function: bool,
}

/// The kind of map that gives the normals.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Perturbation {
    /// Its channels are the normal's coordinates along the directions of u, of v, and of the surface's normal, with
    /// [-1, 1] stored as [0, 1].
    Normals,
    /// Its first channel is the height of the surface, to be multiplied by this.
    Heights(f64),
}

/// The surface's frame at a point, and the normal in it.
struct Tilt<'a> {
    at: TexturePoint<'a>,
    frame: Frame,
    /// In the frame, of any length.
    normal: Vec3,
}

/// One normal that scatters.
struct Facet<'a> {
    point: TexturePoint<'a>,
    /// What nested frames follow.
    tangent: Vec3,
    /// Unit, in the world.
    normal: Vec3,
    /// Squared tangent of its angle to the surface's.
    tan2: f64,
    surface: Vec3,
}

impl Tilt<'_> {
    /// True where the normal faces away from a direction that the surface faces, or the other way round.
    fn is_invalid_from(&self, w: Vec3) -> bool {
        let local = self.frame.to_local(w);
        local.z * local.dot(self.normal) <= 0.0
    }

    fn facet(&self, mirrored: bool) -> Facet<'_> {
        let Vec3 { x, y, z } = self.normal;
        let normal = if mirrored { vec3(-x, -y, z) } else { self.normal };
        let length = normal.length();
        let normal = if length > 0.0 { normal * (1.0 / length) } else { Vec3::Z };
        let along = Vec3::X.reject(normal);
        let along = if along.max_abs() > 0.0 { along.normalize() } else { Vec3::Y };
        let cos2 = normal.z * normal.z;
        Facet {
            point: self.at,
            tangent: self.frame.to_world(along),
            normal: self.frame.to_world(normal),
            tan2: if cos2 > 0.0 { (1.0 - cos2).max(0.0) / cos2 } else { f64::INFINITY },
            surface: self.frame.n,
        }
    }
}

impl Facet<'_> {
    /// The point with the tangent that nested frames follow.
    fn at(&self) -> TexturePoint<'_> {
        TexturePoint { tangent: Some(&self.tangent), ..self.point }
    }

    /// Both normals see the direction from the same side.
    fn sees(&self, w: Vec3) -> bool {
        self.normal.dot(w) * self.surface.dot(w) > 0.0
    }

    /// The factor of light from a direction at a cosine to the surface's normal.
    fn shadowed<T: Real>(&self, cos: T) -> T {
        let alpha2 = f64::min(0.125 * self.tan2, 1.0);
        let tan2 = (cos.squared().recip() - 1.0).max(T::zero());
        let root = (tan2 * alpha2 + 1.0).sqrt();
        T::from(2.0) / (root + 1.0)
    }
}

impl Perturbed {
    fn tilt<'a>(&self, at: &TexturePoint<'a>, n: Vec3) -> Tilt<'a> {
        // Maps tell normals of the front; behind, they are turned over with the surface's.
        let front = if is_front(at, n) { n } else { -n };
        let frame = shading_frame(Some(at), front);
        let normal = match self.perturbation {
            Perturbation::Normals => {
                let c = self.map.at_point(at);
                vec3(c.r, c.g, c.b) * 2.0 - Vec3::splat(1.0)
            }
            Perturbation::Heights(scale) => {
                let slopes = self.map.slopes(at.uv());
                let [by_u, by_v] = by_coordinates(at);
                let lifted = |by: Vec3, slope: Rgb| by.reject(front) + front * (scale * slope.r);
                let normal = lifted(by_u, slopes[0]).cross(lifted(by_v, slopes[1]));
                let side = at.face_normal().dot(normal);
                frame.to_local(if side < 0.0 { -normal } else { normal })
            }
        };
        Tilt { at: *at, frame: Frame { n, ..frame }, normal }
    }

    /// The normal that scatters as seen from a direction.
    fn seen_from<'a>(&self, tilt: &'a Tilt<'_>, w: Vec3) -> Facet<'a> {
        tilt.facet(self.flip_invalid_normals && tilt.is_invalid_from(w))
    }

    /// The normals of which, seen from the light, either may scatter.
    fn either<'a>(&self, tilt: &'a Tilt<'_>) -> ([Facet<'a>; 2], bool) {
        ([tilt.facet(false), tilt.facet(true)], self.flip_invalid_normals)
    }

    /// The factor of light from `wi`, and its derivative by the cosine.
    fn shadowing(&self, facet: &Facet<'_>, wi: Vec3) -> (f64, f64) {
        if !self.use_shadowing_function {
            return (1.0, 0.0);
        }
        let factor = facet.shadowed(Dual::<f64, 1>::variable(facet.surface.dot(wi), 0));
        (factor.re, factor.eps[0])
    }
}

impl Composed for Perturbed {
    fn parts(&self) -> [Option<&Bsdf>; 2] {
        [Some(&self.bsdf), None]
    }
}

impl Model for Perturbed {
    fn name(&self) -> &'static str {
        match self.perturbation {
            Perturbation::Normals => "normalmap",
            Perturbation::Heights(_) => "bumpmap",
        }
    }

    #[inline(never)]
    fn flags(&self) -> Flags {
        Flags { oriented: true, differentiable: false, ..self.bsdf.flags() }
    }

    fn differentiated(&self) -> PropertySet {
        self.bsdf.differentiated()
    }

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        self.bsdf.property(property)
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        if self.bsdf.is_null() || self.bsdf.passes_straight() {
            return Err(SurfaceError::CannotHold { outer: self.name(), bsdf: self.bsdf.name() });
        }
        if let Perturbation::Heights(scale) = self.perturbation
            && !scale.is_finite()
        {
            return Err(SurfaceError::BadScale(scale));
        }
        self.bsdf.validate()
    }

    #[inline(never)]
    fn value<T: Real>(
        &self,
        numbers: impl Numbers<T>,
        at: At<'_>,
        [wo, wi, n]: [Vec3<T>; 3],
    ) -> Rgb<T> {
        let Some(at) = at else { return self.bsdf.value(numbers, None, [wo, wi, n]) };
        let tilt = self.tilt(at, n.re());
        let facet = self.seen_from(&tilt, wo.re());
        if !facet.sees(wi.re()) {
            return Rgb::splat(T::zero());
        }
        let value = self.bsdf.value(numbers, Some(&facet.at()), [wo, wi, facet.normal.lift()]);
        if !self.use_shadowing_function {
            return value;
        }
        value * facet.shadowed(facet.surface.lift().dot(wi))
    }

    /// With respect to the surface's normal there is none: nothing that moves is differentiated here.
    #[inline(never)]
    fn gradient(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        let Some(at) = at else { return self.bsdf.gradient_at(None, wo, wi, n) };
        let tilt = self.tilt(at, n);
        let facet = self.seen_from(&tilt, wo);
        if !facet.sees(wi) {
            return BsdfGradient::default();
        }
        let d = self.bsdf.gradient_at(Some(&facet.at()), wo, wi, facet.normal);
        let (shadowing, by_cos) = self.shadowing(&facet, wi);
        let mut scaled = d.scaled(shadowing);
        scaled.wi += (d.value * by_cos).outer(n);
        scaled.n = RgbVec::ZERO;
        scaled
    }

    #[inline(never)]
    fn sample(&self, at: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], given: Given) -> Option<Vec3> {
        let Some(at) = at else { return self.bsdf.direction(None, from, n, u, given) };
        let tilt = self.tilt(at, n);
        let (facet, choice) = match given {
            Given::Wo => (self.seen_from(&tilt, from), u[2]),
            Given::Wi => {
                let ([plain, mirrored], both) = self.either(&tilt);
                match (both, u[2] < 0.5) {
                    (false, _) => (plain, u[2]),
                    (true, true) => (plain, 2.0 * u[2]),
                    (true, false) => (mirrored, (2.0 * u[2] - 1.0).max(f64::MIN_POSITIVE)),
                }
            }
        };
        let u = [u[0], u[1], choice];
        let w = self.bsdf.direction(Some(&facet.at()), from, facet.normal, u, given)?;
        facet.sees(w).then_some(w)
    }

    #[inline(never)]
    fn sample_specular(
        &self,
        at: At<'_>,
        from: Vec3,
        n: Vec3,
        choice: f64,
        given: Given,
    ) -> Option<SpecularSample> {
        let Some(at) = at else {
            return self.bsdf.sample_specular_at(None, from, n, choice, given);
        };
        let tilt = self.tilt(at, n);
        let facet = self.seen_from(&tilt, from);
        let s =
            self.bsdf.sample_specular_at(Some(&facet.at()), from, facet.normal, choice, given)?;
        let shadowing = match given {
            _ if !facet.sees(s.w) => 0.0,
            Given::Wo => self.shadowing(&facet, s.w).0,
            Given::Wi => self.shadowing(&facet, from).0,
        };
        Some(SpecularSample { weight: s.weight * shadowing, ..s })
    }

    #[inline(never)]
    fn specular(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        let Some(at) = at else { return self.bsdf.specular(None, wo, wi, n) };
        let tilt = self.tilt(at, n);
        let facet = self.seen_from(&tilt, wo);
        let found = self.bsdf.specular(Some(&facet.at()), wo, wi, facet.normal)?;
        let shadowing = if facet.sees(wi) { self.shadowing(&facet, wi).0 } else { 0.0 };
        Some(found.scaled(Rgb::splat(shadowing), 1.0))
    }

    #[inline(never)]
    fn pdf(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64 {
        let Some(at) = at else { return self.bsdf.pdf_at(None, from, to, n, given) };
        let tilt = self.tilt(at, n);
        let by = |facet: &Facet<'_>| {
            if facet.sees(to) {
                self.bsdf.pdf_at(Some(&facet.at()), from, to, facet.normal, given)
            } else {
                0.0
            }
        };
        match given {
            Given::Wo => by(&self.seen_from(&tilt, from)),
            Given::Wi => match self.either(&tilt) {
                ([plain, mirrored], true) => 0.5 * (by(&plain) + by(&mirrored)),
                ([plain, _], false) => by(&plain),
            },
        }
    }

    fn lobe_width(&self, at: At<'_>) -> f64 {
        self.bsdf.lobe_width(at)
    }

    /// No sampler asks for it, as nothing that moves is differentiated at such surfaces.
    fn lobes(&self, _: At<'_>, _: Vec3, _: Vec3) -> Lobes {
        Lobes::even(0.0)
    }

    fn texture(&self, property: Property) -> Option<&Texture> {
        self.bsdf.texture(property)
    }

    fn undifferentiated(&self, property: Property, _: Textures<'_>) -> Option<&'static str> {
        self.bsdf.undifferentiated(property)
    }

    fn validate_on(&self, mesh: &Mesh) -> Result<(), SurfaceError> {
        match self.map.bounds_on(mesh) {
            Some(_) => Ok(()),
            None => {
                let name = self.map.attribute().unwrap_or_default().into();
                Err(SurfaceError::NoAttribute { name })
            }
        }
    }
}
