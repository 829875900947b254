//! The table of BSDFs that every general test goes through: a new kind needs a line here, and nothing else.

use alloc::boxed::Box;
use alloc::vec::Vec;

use drt_math::Rgb;

use crate::model::surface::bsdf::KINDS;
use crate::model::surface::tests::measured::isotropic_case;
use crate::model::surface::tests::perturbed::even_map;
use crate::model::surface::tests::*;

/// BSDFs of every kind, rough enough for quadrature where they are not smooth.
pub(crate) fn every_kind() -> Vec<Bsdf> {
    use Distribution::{Beckmann, Ggx};
    let phong = Phong { reflectance: Rgb::new(0.5, 0.3, 0.1), ..Default::default() };
    let two_sided = |front, back| Bsdf::TwoSided(Box::new(TwoSided { front, back }));
    let tinted = Bsdf::Diffuse(Diffuse { reflectance: Rgb::new(0.9, 0.6, 0.3) });
    let copper = |distribution, alpha| Bsdf::RoughConductor(copper(distribution, alpha));
    let glass = |distribution, alpha, eta| Bsdf::RoughDielectric(glass(distribution, alpha, eta));
    let masked = |bsdf| Bsdf::Mask(Box::new(Mask { bsdf, opacity: 0.6 }));
    alloc::vec![
        Bsdf::Null,
        Bsdf::Conductor(Conductor::default()),
        Bsdf::Dielectric(Dielectric::default()),
        Bsdf::ThinDielectric(ThinDielectric::default()),
        Bsdf::Diffuse(Diffuse::default()),
        Bsdf::Phong(phong),
        Bsdf::Phong(Phong { specular_reflectance: Rgb::ZERO, exponent: 2.5, ..phong }),
        Bsdf::RoughConductor(RoughConductor::default()),
        copper(Beckmann, 0.5),
        copper(Ggx, 0.2),
        glass(Beckmann, 0.3, 1.5),
        glass(Ggx, 0.2, 1.2),
        glass(Beckmann, 0.2, 1.0 / 1.33),
        Bsdf::RoughDielectric(RoughDielectric {
            specular_transmittance: Rgb::ZERO,
            ..super::glass(Ggx, 0.5, 1.8)
        }),
        Bsdf::Plastic(rough_plastic(Beckmann, 0.3, 1.9)),
        Bsdf::Plastic(Plastic {
            nonlinear: true,
            specular_reflectance: Rgb::new(0.9, 0.4, 0.0),
            ..rough_plastic(Ggx, 0.2, 1.5)
        }),
        Bsdf::Plastic(smooth_plastic(1.5)),
        two_sided(Bsdf::Phong(phong), None),
        two_sided(copper(Ggx, 0.4), Some(Bsdf::Diffuse(Diffuse::default()))),
        Bsdf::Plastic(unmixed_plastic(Beckmann, 0.3, 1.5)),
        blend(0.3, Bsdf::Phong(phong), glass(Ggx, 0.4, 1.5)),
        varnished(tinted.clone(), None),
        varnished(copper(Ggx, 0.3), Some((Beckmann, 0.2))),
        varnished(two_sided(Bsdf::Phong(phong), None), Some((Ggx, 0.3))),
        masked(copper(Ggx, 0.3)),
        masked(glass(Ggx, 0.4, 1.5)),
        masked(varnished(copper(Ggx, 0.3), None)),
        Bsdf::Perturbed(Box::new(even_map(copper(Ggx, 0.3)))),
        Bsdf::Textured(Box::new(Textured::new(tinted, Vec::new()).expect("no texture"))),
        anisotropic(copper(Beckmann, 0.3), [0.2, 0.5]),
        anisotropic(glass(Ggx, 0.3, 1.5), [0.5, 0.2]),
        Bsdf::Principled(Box::new(opaque())),
        Bsdf::Principled(Box::new(Principled { spec_trans: 0.7, roughness: 0.6, ..through() })),
        Bsdf::PrincipledThin(Box::new(thin())),
        Bsdf::RoughDiffuse(grooves(0.6, false)),
        Bsdf::RoughDiffuse(grooves(0.3, true)),
        Bsdf::Ward(Ward { alpha: [0.2, 0.5], ..Ward::default() }),
        isotropic_case(),
    ]
}

/// Those that scatter into more than single directions.
pub(crate) fn cases() -> Vec<Bsdf> {
    let spreads = |bsdf: &Bsdf| {
        let mut rng = Rng::new(1, 0, 0);
        (0..100)
            .any(|_| bsdf.sample(tilted(20.0), normal(), random_3d(&mut rng), Given::Wo).is_some())
    };
    every_kind().into_iter().filter(spreads).collect()
}

#[test]
fn no_kind_is_left_out() {
    let every = every_kind();
    for kind in KINDS {
        let found = every.iter().any(|bsdf| bsdf.kind() == *kind);
        assert!(found, "{kind} is not in the table");
    }
}

/// What a BSDF has a derivative by has an entry for it, and nothing has more than there is room for.
#[test]
fn properties_that_are_differentiated_exist() {
    for bsdf in every_kind() {
        let properties = bsdf.differentiated();
        assert!(properties.len() <= BsdfParams::MOST, "{bsdf:?}");
        let two = matches!(&bsdf, Bsdf::TwoSided(b) if b.back.is_some());
        for property in properties.iter() {
            assert!(two || bsdf.is_number(property).is_some(), "{bsdf:?}: {property}");
        }
        let gradient = bsdf.gradient(tilted(20.0), tilted(-30.0), normal());
        let apart = gradient.params.properties().without(properties);
        assert!(apart.is_empty(), "{bsdf:?}: {apart:?}");
    }
}
