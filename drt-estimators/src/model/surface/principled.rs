//! Burley's principled model of many materials, as Mitsuba's `principled` has it.
//!
//! Burley 2012, "Physically Based Shading at Disney", and 2015, "Extending the Disney BRDF to a BSDF with Integrated Subsurface
//! Scattering". With the viewer's direction o, the light's i and h between them, all in the frame of the surface, metallic m and
//! the transmitted part t of the rest, the value is the sum of
//!
//! ```text
//! F D G / (4 o_z)                                       reflection by microfacets (GGX)
//! (1-m) t sqrt(c) (1-F_d) D G |o·h i·h| / (o_z (o·h + η i·h)²)    refraction by the same
//! k/4 F_k D_k G_k i_z                                     clearcoat, of the distribution GTR1
//! (1-m)(1-t) c/π i_z lerp(f_diffuse + f_retro, f_flat, flatness)
//! (1-m) s F_s(i·h) i_z                                    sheen
//! ```
//!
//! with F = (1-m)(1-tint) F_d + m S(c) + (1-m) tint S(c/lum c · R0), F_d the Fresnel reflectance of η, and S(R) = R + (1-R)(1-cos)⁵
//! Schlick's. From behind, inside of what lets light through, there are only reflection, by (1-m) t F_d, and refraction.

use core::f64::consts::{FRAC_1_PI, PI, TAU};

use drt_geom::edges::Lobes;
use drt_math::{Real, Rgb, Vec3, fm, vec3, warp};

use crate::model::surface::framed::{Framed, scatters_in_frame};
use crate::model::surface::fresnel::dielectric_reflected;
use crate::model::surface::lobes::{SHEEN, widest};
use crate::model::surface::microfacet::{Distribution, LEAST_COS2, mirrored, refracted};
use crate::model::surface::model::{Dependence, Flags, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range, part};
use crate::model::surface::stretched_facets::StretchedFacets;
use crate::model::surface::textures::Textures;
use crate::model::surface::{At, BsdfGradient, Given, RoughDielectric};
use crate::model::texture::Texture;

/// Burley's principled BSDF. All but colour and index are numbers from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Principled<T = f64> {
    /// Its colour; default 0.5.
    pub base_color: Rgb<T>,
    /// The square root of the roughness of microfacets; default 0.5.
    pub roughness: T,
    /// Up to 3.2 times as rough along the tangent as across; default 0.
    pub anisotropic: T,
    /// From a dielectric to a metal; default 0.
    pub metallic: T,
    /// The part of the dielectric that light goes through; default 0.
    pub spec_trans: T,
    /// Index of the interior over that of the exterior; default 1.5.
    pub eta: T,
    /// How much of the base colour a dielectric's reflection has; default 0.
    pub spec_tint: T,
    /// Light at grazing angles, as from cloth; default 0.
    pub sheen: T,
    /// How much of the base colour that has; default 0.
    pub sheen_tint: T,
    /// From diffuse to flat, as by scattering below the surface; default 0.
    pub flatness: T,
    /// A second, sharper reflection; default 0.
    pub clearcoat: T,
    /// How sharp that is; default 0.
    pub clearcoat_gloss: T,
}

impl Default for Principled {
    fn default() -> Self {
        Self {
            base_color: Rgb::splat(0.5),
            roughness: 0.5,
            anisotropic: 0.0,
            metallic: 0.0,
            spec_trans: 0.0,
            eta: Self::index_of(0.5),
            spec_tint: 0.0,
            sheen: 0.0,
            sheen_tint: 0.0,
            flatness: 0.0,
            clearcoat: 0.0,
            clearcoat_gloss: 0.0,
        }
    }
}

/// (1 - cos)⁵.
pub(super) fn grazing<T: Real>(cos: T) -> T {
    let m = T::one() - cos.abs();
    if m.re() > 0.0 { m.powi(5) } else { T::zero() }
}

pub(super) fn lerp<T: Real>(a: T, b: T, by: T) -> T {
    a + (b - a) * by
}

/// Schlick's reflectance, 1 at grazing angles; behind an interface to something thinner by the cosine there.
pub(super) fn schlick<T: Real>(colour: Rgb<T>, cos: T, eta: T) -> Rgb<T> {
    let eta = if cos.re() >= 0.0 { eta } else { eta.recip() };
    let cos = if eta.re() > 1.0 {
        cos
    } else {
        let cos2 = T::one() - (T::one() - cos.squared()) / (eta * eta);
        if cos2.re() > 0.0 { cos2.sqrt() } else { T::zero() }
    };
    let weight = grazing(cos);
    colour.map(|c| lerp(c, T::one(), weight))
}

/// The reflectance of an interface at normal incidence.
pub(super) fn normal_reflectance<T: Real>(eta: T) -> T {
    let r = (eta - 1.0) / (eta + 1.0);
    r * r
}

/// A colour of luminance 1, whose channels depend on all others: constant.
pub(super) fn tint<T: Real>(colour: Rgb<T>) -> Rgb<T> {
    let colour = colour.map(Real::re);
    let luminance = Rgb::new(0.212_671, 0.715_160, 0.072_169).dot(colour);
    let tint = if luminance > 0.0 { colour * luminance.recip() } else { Rgb::ONE };
    tint.map(T::from)
}

/// Roughness along the tangent and across it.
pub(super) fn stretched<T: Real>(roughness: T, anisotropic: T) -> StretchedFacets<T> {
    let aspect = (T::one() - anisotropic * 0.9).sqrt();
    let even = roughness * roughness;
    let alpha = [even / aspect, even * aspect].map(|a| a.max(T::from(1e-3)));
    StretchedFacets { distribution: Distribution::Ggx, alpha }
}

/// The diffuse lobe but for colour and π, with retro-reflection and flattened, by the cosines at viewer and light and of the
/// light with the half vector.
pub(super) fn diffuse_lobe<T: Real>(cosines: [T; 3], roughness: T, flatness: T) -> T {
    let [o, i, d] = cosines;
    let [at_o, at_i] = [grazing(o), grazing(i)];
    let base = (T::one() - at_o * 0.5) * (T::one() - at_i * 0.5);
    let back = d.squared() * (roughness * 2.0);
    let retro = back * (at_i + at_o + at_i * at_o * (back - 1.0));
    if flatness.is_zero() {
        return base + retro;
    }
    let at_90 = back * 0.5;
    let both = lerp(T::one(), at_90, at_o) * lerp(T::one(), at_90, at_i);
    let flat = (both * ((o.abs() + i.abs()).recip() - 0.5) + 0.5) * 1.25;
    lerp(base + retro, flat, flatness)
}

/// The distribution of normals GTR1 of Burley 2012, of a roughness.
#[derive(Clone, Copy)]
struct LongTails(f64);

impl LongTails {
    fn density<T: Real>(self, cos: T) -> T {
        let less = self.0 * self.0 - 1.0;
        let scale = less / (PI * 2.0 * fm::ln(self.0));
        (cos.squared() * less + 1.0).recip() * scale
    }

    /// A normal of density D cos.
    fn sample(self, [u, v]: [f64; 2]) -> Vec3 {
        let alpha2 = self.0 * self.0;
        let cos2 = (1.0 - fm::powf(alpha2, 1.0 - v)) / (1.0 - alpha2);
        let (sin_phi, cos_phi) = fm::sin_cos(TAU * u);
        let sin = fm::sqrt((1.0 - cos2).max(0.0));
        vec3(cos_phi * sin, sin_phi * sin, fm::sqrt(cos2.max(0.0)))
    }
}

/// Roughness of the masking of clearcoats.
const COAT_MASKING: f64 = 0.25;

impl<T: Real> Principled<T> {
    fn refractive(&self) -> T {
        (T::one() - self.metallic) * self.spec_trans
    }

    fn diffuse(&self) -> T {
        (T::one() - self.metallic) * (T::one() - self.spec_trans)
    }

    fn coat(&self) -> LongTails {
        LongTails(lerp(0.1, 0.001, self.clearcoat_gloss.re()))
    }

    fn reflectance(&self, fresnel: T, cos: T, front: bool) -> Rgb<T> {
        if !front {
            return Rgb::splat(fresnel * self.refractive());
        }
        let dielectric = T::one() - self.metallic;
        let mut sum = Rgb::splat(fresnel * (dielectric * (T::one() - self.spec_tint)));
        if !self.metallic.is_zero() {
            sum += schlick(self.base_color, cos, self.eta) * self.metallic;
        }
        if !self.spec_tint.is_zero() {
            let colour = tint(self.base_color) * normal_reflectance(self.eta);
            sum += schlick(colour, cos, self.eta) * (dielectric * self.spec_tint);
        }
        sum
    }

    /// The value in the frame of the surface.
    fn value_of(&self, o: Vec3<T>, i: Vec3<T>) -> Rgb<T> {
        let mut sum = Rgb::splat(T::zero());
        let Some(pair) = Pair::new(o, i, self.eta) else { return sum };
        let Pair { h, oh, ih, front, reflects, eta, .. } = pair;
        let fresnel = pair.fresnel();
        if pair.is_joined() {
            let facets = stretched(self.roughness, self.anisotropic);
            let light = facets.density(h) * facets.masking(o) * facets.masking(i) * i.z.abs();
            if reflects {
                sum += self.reflectance(fresnel, oh, front) * (light * 0.25);
            } else if fresnel.re() < 1.0 {
                let bent = (oh + ih * eta).squared();
                let through = (T::one() - fresnel) * (oh * ih).abs() / bent * self.refractive();
                // Black has no slope, which would be infinite.
                let root = |c: T| if c.re() > 0.0 { c.sqrt() } else { T::zero() };
                sum += self.base_color.map(root) * (light * through);
            }
        }
        if !(front && reflects) {
            return sum;
        }
        if !self.clearcoat.is_zero() && pair.is_joined() {
            let reflected = schlick(Rgb::splat(T::from(0.04)), oh, self.eta).r;
            let alpha = T::from(COAT_MASKING);
            let masking = |w: Vec3<T>| Distribution::Ggx.masking(w.z, alpha) * w.z;
            let light = reflected * self.coat().density(h.z) * masking(o) * masking(i) * i.z;
            sum += Rgb::splat(light * (self.clearcoat * 0.25));
        }
        let lobe = diffuse_lobe([o.z, i.z, ih], self.roughness, self.flatness);
        sum += self.base_color * (lobe * i.z * (self.diffuse() * FRAC_1_PI));
        if !self.sheen.is_zero() {
            let white = T::one() - self.sheen_tint;
            let colour = tint(self.base_color) * self.sheen_tint + Rgb::splat(white);
            sum += colour * (grazing(ih) * i.z * (self.sheen * (T::one() - self.metallic)));
        }
        sum
    }
}

/// The probabilities of lobes.
struct Shares {
    diffuse: f64,
    coat: f64,
    facets: f64,
}

impl Principled {
    /// Its numbers from 0 to 1.
    fn unit_numbers(&mut self) -> [(Property, &mut f64); 10] {
        [
            (Property::Roughness, &mut self.roughness),
            (Property::Anisotropic, &mut self.anisotropic),
            (Property::Metallic, &mut self.metallic),
            (Property::SpecTrans, &mut self.spec_trans),
            (Property::SpecTint, &mut self.spec_tint),
            (Property::Sheen, &mut self.sheen),
            (Property::SheenTint, &mut self.sheen_tint),
            (Property::Flatness, &mut self.flatness),
            (Property::Clearcoat, &mut self.clearcoat),
            (Property::ClearcoatGloss, &mut self.clearcoat_gloss),
        ]
    }

    /// The index of refraction that artists know as `specular`, which is 0.08 times the reflectance at normal incidence.
    #[must_use]
    pub fn index_of(specular: f64) -> f64 {
        2.0 / (1.0 - fm::sqrt(0.08 * specular)) - 1.0
    }

    /// Its numbers over another scalar.
    fn over<T: Real>(&self, numbers: impl Numbers<T>) -> Principled<T> {
        Principled {
            base_color: numbers.colour(Property::BaseColor, self.base_color),
            roughness: numbers.number(Property::Roughness, self.roughness),
            anisotropic: numbers.number(Property::Anisotropic, self.anisotropic),
            metallic: numbers.number(Property::Metallic, self.metallic),
            spec_trans: numbers.number(Property::SpecTrans, self.spec_trans),
            eta: numbers.number(Property::Eta, self.eta),
            spec_tint: numbers.number(Property::SpecTint, self.spec_tint),
            sheen: numbers.number(Property::Sheen, self.sheen),
            sheen_tint: numbers.number(Property::SheenTint, self.sheen_tint),
            flatness: numbers.number(Property::Flatness, self.flatness),
            clearcoat: numbers.number(Property::Clearcoat, self.clearcoat),
            clearcoat_gloss: numbers.number(Property::ClearcoatGloss, self.clearcoat_gloss),
        }
    }

    /// The probabilities of lobes seen from the front.
    fn shares(&self) -> Shares {
        let (diffuse, coat) = (self.diffuse(), 0.25 * self.clearcoat);
        let all = 1.0 + diffuse + coat;
        Shares { diffuse: diffuse / all, coat: coat / all, facets: 1.0 / all }
    }

    /// The probability that a facet refracts, where it does not reflect all.
    fn refracts(&self, fresnel: f64, front: bool) -> f64 {
        (1.0 - fresnel) * if front { self.refractive() } else { 1.0 }
    }
}

pub(super) fn check_colour(colour: Rgb) -> Result<(), SurfaceError> {
    colour.to_array().into_iter().try_for_each(|c| part(Property::BaseColor, c))
}

/// Why nothing is differentiated by a part of which there is none by now.
pub(super) const NOTHING_DRAWN: &str = "at 0 no path goes where light would";
/// Why nothing is differentiated by the colour of what has a tint.
pub(super) const TINTED: &str = "a tint mixes its channels";

/// The least and the largest value of a number, for which a texture may stand.
pub(super) fn ends_of(value: f64, property: Property, textures: Textures<'_>) -> [f64; 2] {
    let bounds = textures.of(property).map(Texture::bounds);
    bounds.map_or([value; 2], |[least, most]| [least.r, most.r])
}

/// The least channel of a base colour, for which a texture may stand.
pub(super) fn least_colour(colour: Rgb, textures: Textures<'_>) -> f64 {
    let texture = textures.of(Property::BaseColor);
    let least = texture.map_or(colour, |t| t.bounds()[0]);
    least.to_array().into_iter().fold(f64::INFINITY, f64::min)
}

/// True where the base colour tints something.
pub(super) fn tints(spec_tint: f64, sheen: f64, sheen_tint: f64, textures: Textures<'_>) -> bool {
    let some = |value, property| ends_of(value, property, textures)[1] > 0.0;
    some(spec_tint, Property::SpecTint)
        || (some(sheen, Property::Sheen) && some(sheen_tint, Property::SheenTint))
}

/// Two directions in the frame of a surface, neither in the surface, and the half vector between them, on the front.
struct Pair<T> {
    h: Vec3<T>,
    oh: T,
    ih: T,
    front: bool,
    reflects: bool,
    /// The index beyond the interface over that on the viewer's side.
    eta: T,
    /// The index inside over that outside.
    material: T,
}

impl<T: Real> Pair<T> {
    fn new(o: Vec3<T>, i: Vec3<T>, material: T) -> Option<Self> {
        let sides = o.z.re() * i.z.re();
        let (front, reflects) = (o.z.re() > 0.0, sides > 0.0);
        let eta = if front { material } else { material.recip() };
        let h = if reflects { o + i } else { o + i * eta };
        // Opposite directions have no half vector between them, and directions in the surface underflow.
        if sides.abs() < LEAST_COS2 || h.re().max_abs() < 1e-12 {
            return None;
        }
        let h = h.normalize();
        let h = if h.z.re() < 0.0 { -h } else { h };
        Some(Self { h, oh: o.dot(h), ih: i.dot(h), front, reflects, eta, material })
    }

    /// Facets show the viewer, and the light where they reflect, the side that the surface does.
    fn is_joined(&self) -> bool {
        let side = if self.front { 1.0 } else { -1.0 };
        let light = if self.reflects { side } else { -side };
        self.oh.re() * side > 0.0 && self.ih.re() * light > 0.0
    }

    fn fresnel(&self) -> T {
        let eta = if self.oh.re() >= 0.0 { self.material } else { self.material.recip() };
        dielectric_reflected(self.oh.abs(), eta)
    }
}

impl Framed for Principled {
    fn in_frame<T: Real>(&self, numbers: impl Numbers<T>, o: Vec3<T>, i: Vec3<T>) -> Rgb<T> {
        self.over(numbers).value_of(o, i)
    }

    fn density(&self, o: Vec3, i: Vec3) -> f64 {
        let Some(pair) = Pair::new(o, i, self.eta) else { return 0.0 };
        let Pair { h, oh, ih, front, reflects, eta, .. } = pair;
        if !front && self.refractive() <= 0.0 {
            return 0.0;
        }
        let lobes =
            if front { self.shares() } else { Shares { diffuse: 0.0, coat: 0.0, facets: 1.0 } };
        let mut sum = 0.0;
        if pair.is_joined() {
            let facets = stretched(self.roughness, self.anisotropic);
            let visible = facets.visible_density(h, o) * oh.abs() * lobes.facets;
            let refracts = self.refracts(pair.fresnel(), front);
            sum += if reflects {
                (1.0 - refracts) * visible / (4.0 * ih.abs())
            } else {
                let bent = oh + eta * ih;
                refracts * visible * eta * eta * ih.abs() / (bent * bent)
            };
            if front && reflects {
                sum += lobes.coat * self.coat().density(h.z) * h.z / (4.0 * ih.abs());
            }
        }
        if front && reflects {
            sum += lobes.diffuse * i.z * FRAC_1_PI;
        }
        sum
    }

    fn direction(&self, o: Vec3, [u, v, choice]: [f64; 3]) -> Option<Vec3> {
        let front = o.z > 0.0;
        if !front && (self.refractive() <= 0.0 || o.z == 0.0) {
            return None;
        }
        let lobes =
            if front { self.shares() } else { Shares { diffuse: 0.0, coat: 0.0, facets: 1.0 } };
        if choice < lobes.diffuse {
            return Some(warp::cosine_hemisphere([u, v]));
        }
        let choice = choice - lobes.diffuse;
        if choice < lobes.coat {
            let i = mirrored(o, self.coat().sample([u, v]));
            return (i.z > 0.0).then_some(i);
        }
        let choice = (choice - lobes.coat) / lobes.facets;
        let side = o.z.signum();
        let facets = stretched(self.roughness, self.anisotropic);
        let m = facets.sample_visible(o * side, [u, v]) * side;
        let eta = if front { self.eta } else { 1.0 / self.eta };
        let cos = m.dot(o);
        if cos <= 0.0 {
            return None;
        }
        let fresnel = dielectric_reflected(cos.min(1.0), eta);
        let refracts = choice < self.refracts(fresnel, front);
        let i = if refracts { refracted(o, m, eta)?.0 } else { mirrored(o, m) };
        (refracts == (i.z * side < 0.0)).then_some(i)
    }
}

impl Model for Principled {
    fn name(&self) -> &'static str {
        "principled"
    }

    #[inline]
    fn flags(&self) -> Flags {
        let (transmissive, oriented) = (self.spec_trans > 0.0, self.anisotropic != 0.0);
        Flags { transmissive, oriented, ..Flags::INTERFACE }
    }

    scatters_in_frame!(BaseColor, Roughness, Metallic, SpecTrans, Eta, Sheen, Clearcoat);

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::BaseColor => Some(Slot::Color(&mut self.base_color)),
            Property::Eta => Some(Slot::Scalar(&mut self.eta)),
            _ => {
                let mut numbers = self.unit_numbers().into_iter();
                numbers.find(|(p, _)| *p == property).map(|(_, value)| Slot::Scalar(value))
            }
        }
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        check_colour(self.base_color)?;
        let contrast = self.spec_trans == 0.0 || (self.eta - 1.0).abs() >= 1e-6;
        let allowed = self.eta > 0.0 && contrast;
        in_range(Property::Eta, self.eta, allowed, "positive, and not 1 where light goes through")?;
        let mut own = *self;
        own.unit_numbers().into_iter().try_for_each(|(property, value)| part(property, *value))
    }

    fn undifferentiated(&self, property: Property, textures: Textures<'_>) -> Option<&'static str> {
        // The values of a property are between these.
        let ends = |value: f64, p| ends_of(value, p, textures);
        let never = |value, p| ends(value, p)[1] <= 0.0;
        let no_light_through = never(self.spec_trans, Property::SpecTrans);
        match property {
            Property::BaseColor if tints(self.spec_tint, self.sheen, self.sheen_tint, textures) => {
                Some(TINTED)
            }
            Property::BaseColor
                if !no_light_through && least_colour(self.base_color, textures) <= 0.0 =>
            {
                Some("light goes through by its root, which has no slope at 0")
            }
            Property::SpecTrans if ends(self.spec_trans, property)[0] <= 0.0 => Some(NOTHING_DRAWN),
            Property::Metallic if !no_light_through && ends(self.metallic, property)[1] >= 1.0 => {
                Some("at 1 no path goes where light would")
            }
            _ => None,
        }
    }

    fn lobes(&self, _: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        let (colour, dielectric_part) = (self.base_color.mean(), 1.0 - self.metallic);
        let glass = RoughDielectric {
            distribution: Distribution::Ggx,
            alpha: widest(stretched(self.roughness, self.anisotropic).alpha),
            eta: self.eta,
            specular_transmittance: Rgb::splat(colour * dielectric_part * self.spec_trans),
            ..RoughDielectric::default()
        };
        let Lobes { lobes: [mut reflected, refracted], .. } = glass.lobes(None, wo, n);
        reflected.height += (colour * self.metallic + 0.01 * self.clearcoat) * FRAC_1_PI;
        let diffuse = colour * (1.0 - self.spec_trans) * FRAC_1_PI + self.sheen * SHEEN;
        Lobes::glossy(diffuse * dielectric_part, [reflected, refracted])
    }

    fn lobe_width(&self, _: At<'_>) -> f64 {
        let [u, v] = stretched(self.roughness, self.anisotropic).alpha;
        f64::min(u, v)
    }
}
