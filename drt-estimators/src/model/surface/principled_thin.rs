//! Burley's principled model of thin sheets, as Mitsuba's `principledthin` has it (Burley 2015, section 5.3).
//!
//! In the terms of [`Principled`](super::Principled), with the transmitted part t, the diffusely transmitted part d (half of
//! `diff_trans`), i' the light's direction mirrored to the viewer's side, and h between o and i',
//!
//! ```text
//! t F D G / (4 o_z)                    reflection          t c (1-F_d) D' G' / (4 o_z)      straight on, blurred
//! (1-t)(1-d) (c/π f + s F_s) i_z       diffuse, sheen      (1-t) d c/π |i_z|               diffuse, to the other side
//! ```
//!
//! where D' is of the roughness times 0.65 η - 0.35. Both sides are alike.

use core::f64::consts::FRAC_1_PI;

use drt_geom::edges::{Lobe, Lobes};
use drt_math::{Real, Rgb, Vec3, vec3, warp};

use crate::model::surface::framed::{Framed, scatters_in_frame};
use crate::model::surface::fresnel::dielectric_reflected;
use crate::model::surface::lobes::{SHEEN, reflection, widest};
use crate::model::surface::microfacet::{LEAST_COS2, mirrored};
use crate::model::surface::model::{Dependence, Flags, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::principled::{
    NOTHING_DRAWN, TINTED, check_colour, diffuse_lobe, ends_of, grazing, lerp, normal_reflectance,
    schlick, stretched, tint, tints,
};
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range, part};
use crate::model::surface::stretched_facets::StretchedFacets;
use crate::model::surface::textures::Textures;
use crate::model::surface::{At, BsdfGradient, Given};

/// Burley's principled BSDF of thin sheets. Numbers are from 0 to 1 where nothing else is said.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PrincipledThin<T = f64> {
    /// Its colour; default 0.5.
    pub base_color: Rgb<T>,
    /// The square root of the roughness of microfacets; default 0.5.
    pub roughness: T,
    /// Up to 3.2 times as rough along the tangent as across; default 0.
    pub anisotropic: T,
    /// The part that is specular; default 0.
    pub spec_trans: T,
    /// Index of the sheet over that of what is around it; default 1.5.
    pub eta: T,
    /// How much of the base colour the reflection has; default 0.
    pub spec_tint: T,
    /// Light at grazing angles, as from cloth; default 0.
    pub sheen: T,
    /// How much of the base colour that has; default 0.
    pub sheen_tint: T,
    /// From diffuse to flat; default 0.
    pub flatness: T,
    /// Diffuse light that goes through, from none, 0, to all, 2; default 0.
    pub diff_trans: T,
}

impl Default for PrincipledThin {
    fn default() -> Self {
        Self {
            base_color: Rgb::splat(0.5),
            roughness: 0.5,
            anisotropic: 0.0,
            spec_trans: 0.0,
            eta: 1.5,
            spec_tint: 0.0,
            sheen: 0.0,
            sheen_tint: 0.0,
            flatness: 0.0,
            diff_trans: 0.0,
        }
    }
}

/// Both directions with the viewer in front, and the half vector with the light's one mirrored to the front.
fn pair<T: Real>(o: Vec3<T>, i: Vec3<T>) -> Option<[Vec3<T>; 3]> {
    let (o, i) = if o.z.re() < 0.0 { (-o, -i) } else { (o, i) };
    let h = o + vec3(i.x, i.y, i.z.abs());
    let known = (o.z.re() * i.z.re()).abs() >= LEAST_COS2 && h.re().max_abs() > 1e-12;
    known.then(|| [o, i, h.normalize()])
}

impl<T: Real> PrincipledThin<T> {
    pub(super) fn reflecting(&self) -> StretchedFacets<T> {
        stretched(self.roughness, self.anisotropic)
    }

    pub(super) fn blurring(&self) -> StretchedFacets<T> {
        stretched((self.eta * 0.65 - 0.35) * self.roughness, self.anisotropic)
    }

    /// The value in the frame of the surface.
    fn value_of(&self, o: Vec3<T>, i: Vec3<T>) -> Rgb<T> {
        let mut sum = Rgb::splat(T::zero());
        let Some([o, i, h]) = pair(o, i) else { return sum };
        let colour = self.base_color;
        let (reflects, across, diffuse) =
            (i.z.re() > 0.0, self.diff_trans * 0.5, T::one() - self.spec_trans);
        let oh = o.dot(h);
        // Behind, facets must show the light their other side.
        let joined = oh.re() > 0.0 && i.dot(h).re() * i.z.re() > 0.0;
        if !self.spec_trans.is_zero() && joined {
            let fresnel = dielectric_reflected(oh, self.eta);
            let facets = if reflects { self.reflecting() } else { self.blurring() };
            let light = facets.density(h) * facets.masking(o) * facets.masking(i) * i.z.abs();
            let light = light * (self.spec_trans * 0.25);
            sum += if reflects {
                let tinted = tint(self.base_color) * normal_reflectance(self.eta);
                let tinted = schlick(tinted, oh, self.eta);
                tinted.map(|t| lerp(fresnel, t, self.spec_tint)) * light
            } else {
                colour * (light * (T::one() - fresnel))
            };
        }
        if reflects {
            let ih = i.dot(h);
            let lobe = diffuse_lobe([o.z, i.z, ih], self.roughness, self.flatness);
            let scale = diffuse * (T::one() - across);
            sum += colour * (lobe * i.z * (scale * FRAC_1_PI));
            if !self.sheen.is_zero() {
                let white = Rgb::splat(T::one() - self.sheen_tint);
                let colour = tint(self.base_color) * self.sheen_tint + white;
                sum += colour * (grazing(ih) * i.z * (self.sheen * scale));
            }
        } else {
            sum += colour * (i.z.abs() * (diffuse * across * FRAC_1_PI));
        }
        sum
    }
}

impl PrincipledThin {
    /// Its numbers from 0 to 1.
    fn unit_numbers(&mut self) -> [(Property, &mut f64); 7] {
        [
            (Property::Roughness, &mut self.roughness),
            (Property::Anisotropic, &mut self.anisotropic),
            (Property::SpecTrans, &mut self.spec_trans),
            (Property::SpecTint, &mut self.spec_tint),
            (Property::Sheen, &mut self.sheen),
            (Property::SheenTint, &mut self.sheen_tint),
            (Property::Flatness, &mut self.flatness),
        ]
    }

    /// Its numbers over another scalar.
    fn over<T: Real>(&self, numbers: impl Numbers<T>) -> PrincipledThin<T> {
        PrincipledThin {
            base_color: numbers.colour(Property::BaseColor, self.base_color),
            roughness: numbers.number(Property::Roughness, self.roughness),
            anisotropic: numbers.number(Property::Anisotropic, self.anisotropic),
            spec_trans: numbers.number(Property::SpecTrans, self.spec_trans),
            eta: numbers.number(Property::Eta, self.eta),
            spec_tint: numbers.number(Property::SpecTint, self.spec_tint),
            sheen: numbers.number(Property::Sheen, self.sheen),
            sheen_tint: numbers.number(Property::SheenTint, self.sheen_tint),
            flatness: numbers.number(Property::Flatness, self.flatness),
            diff_trans: numbers.number(Property::DiffTrans, self.diff_trans),
        }
    }

    /// Probabilities of reflection, of going on, and of diffuse light on this side; the rest is for that on the other one.
    fn shares(&self) -> [f64; 3] {
        let half = 0.5 * self.spec_trans;
        [half, half, (1.0 - self.spec_trans) * (1.0 - 0.5 * self.diff_trans)]
    }
}

impl Framed for PrincipledThin {
    fn in_frame<T: Real>(&self, numbers: impl Numbers<T>, o: Vec3<T>, i: Vec3<T>) -> Rgb<T> {
        self.over(numbers).value_of(o, i)
    }

    fn density(&self, o: Vec3, i: Vec3) -> f64 {
        let Some([o, i, h]) = pair(o, i) else { return 0.0 };
        let [reflected, straight, diffuse] = self.shares();
        let rest = 1.0 - reflected - straight - diffuse;
        let reflects = i.z > 0.0;
        let (facets, specular, even) = if reflects {
            (self.reflecting(), reflected, diffuse)
        } else {
            (self.blurring(), straight, rest)
        };
        let even = even * i.z.abs() * FRAC_1_PI;
        let joined = o.dot(h) > 0.0 && i.dot(h) * i.z > 0.0;
        if joined && specular > 0.0 {
            even + 0.25 * specular * facets.visible_density(h, o)
        } else {
            even
        }
    }

    fn direction(&self, from: Vec3, [u, v, choice]: [f64; 3]) -> Option<Vec3> {
        let side = from.z.signum();
        let o = from * side;
        if o.z <= 0.0 {
            return None;
        }
        let [reflected, straight, diffuse] = self.shares();
        let i = if choice < reflected {
            let i = mirrored(o, self.reflecting().sample_visible(o, [u, v]));
            (i.z > 0.0).then_some(i)?
        } else if choice < reflected + straight {
            let m = self.blurring().sample_visible(o, [u, v]);
            let i = mirrored(o, m);
            let through = vec3(i.x, i.y, -i.z);
            // Facets must show it their other side.
            (i.z > 0.0 && through.dot(m) < 0.0).then_some(through)?
        } else {
            let i = warp::cosine_hemisphere([u, v]);
            if choice < reflected + straight + diffuse { i } else { -i }
        };
        Some(i * side)
    }
}

impl Model for PrincipledThin {
    fn name(&self) -> &'static str {
        "principledthin"
    }

    #[inline]
    fn flags(&self) -> Flags {
        Flags { oriented: self.anisotropic != 0.0, ..Flags::INTERFACE }
    }

    scatters_in_frame!(BaseColor, Roughness, SpecTrans, Eta, Sheen, DiffTrans);

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::BaseColor => Some(Slot::Color(&mut self.base_color)),
            Property::Eta => Some(Slot::Scalar(&mut self.eta)),
            Property::DiffTrans => Some(Slot::Scalar(&mut self.diff_trans)),
            _ => {
                let mut numbers = self.unit_numbers().into_iter();
                numbers.find(|(p, _)| *p == property).map(|(_, value)| Slot::Scalar(value))
            }
        }
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        check_colour(self.base_color)?;
        in_range(Property::Eta, self.eta, self.eta > 0.0, "above 0")?;
        let part_of_two = (0.0..=2.0).contains(&self.diff_trans);
        in_range(Property::DiffTrans, self.diff_trans, part_of_two, "from 0 to 2")?;
        let mut own = *self;
        own.unit_numbers().into_iter().try_for_each(|(property, value)| part(property, *value))
    }

    fn undifferentiated(&self, property: Property, textures: Textures<'_>) -> Option<&'static str> {
        match property {
            Property::BaseColor if tints(self.spec_tint, self.sheen, self.sheen_tint, textures) => {
                Some(TINTED)
            }
            Property::SpecTrans if ends_of(self.spec_trans, property, textures)[0] <= 0.0 => {
                Some(NOTHING_DRAWN)
            }
            Property::DiffTrans => match ends_of(self.diff_trans, property, textures) {
                [least, _] if least <= 0.0 => Some(NOTHING_DRAWN),
                [_, most] if most >= 2.0 => Some("at 2 no path goes where light would"),
                _ => None,
            },
            _ => None,
        }
    }

    fn lobes(&self, _: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        let n = if n.dot(wo) >= 0.0 { n } else { -n };
        let colour = self.base_color.mean();
        let once = dielectric_reflected(n.dot(wo).clamp(1e-6, 1.0), self.eta);
        // From both sides of the sheet.
        let reflected = 2.0 * once / (1.0 + once);
        let [mirror, through] =
            [(self.reflecting(), reflected), (self.blurring(), (1.0 - reflected) * colour)].map(
                |(facets, share)| reflection(wo, n, widest(facets.alpha), self.spec_trans * share),
            );
        let through = Lobe { axis: -wo, ..through };
        let diffuse = (1.0 - self.spec_trans) * colour * FRAC_1_PI + self.sheen * SHEEN;
        Lobes::glossy(diffuse, [mirror, through])
    }

    fn lobe_width(&self, _: At<'_>) -> f64 {
        if self.spec_trans == 0.0 {
            return 1.0;
        }
        let facets = [self.reflecting(), self.blurring()];
        facets.iter().flat_map(|f| f.alpha).fold(1.0, f64::min)
    }
}
