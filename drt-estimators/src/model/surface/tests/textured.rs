//! BSDFs with textures: at each point what they are with its values.

use alloc::string::ToString;
use alloc::vec;

use drt_geom::procedural;

use super::*;
use crate::model::texture::{Texture, TexturePoint, UvMap};

/// Two colours, the first where the sum of the coordinates' halves is even.
fn squares(a: Rgb, b: Rgb) -> Texture {
    Texture::Checkerboard { colours: [a, b], to_uv: UvMap::IDENTITY }
}

#[test]
fn every_point_has_a_bsdf_of_its_own() {
    let mesh = procedural::rectangle();
    // Without coordinates of its own a triangle has its weights.
    let points = [[0.1, 0.2], [0.6, 0.2]].map(|bary| TexturePoint::new(&mesh, 0, bary));
    let (rough, smooth) = (Rgb::splat(0.4), Rgb::splat(0.0));
    let (red, blue) = (Rgb::new(0.9, 0.1, 0.0), Rgb::new(0.0, 0.3, 1.0));
    let base = || copper(Distribution::Ggx, 0.1);
    let textures = vec![
        (Property::Alpha, squares(rough, smooth)),
        (Property::SpecularReflectance, squares(red, blue)),
    ];
    let front = Textured::new(Bsdf::RoughConductor(base()), textures).expect("textures");
    let textured = Bsdf::Textured(Box::new(front));
    let both = Bsdf::TwoSided(Box::new(TwoSided { front: textured.clone(), back: None }));
    let plain = |alpha, specular_reflectance| {
        Bsdf::RoughConductor(RoughConductor { alpha, specular_reflectance, ..base() })
    };
    // Roughness is no less than microfacets can have.
    let plain = [plain(0.4, red), plain(1e-4, blue)];
    let mut rng = Rng::new(3, 0, 0);
    for _ in 0..50 {
        let (n, wo) = (normal(), tilted(40.0));
        let u = random_3d(&mut rng);
        for (point, plain) in points.iter().zip(&plain) {
            let at = Some(point);
            let sample = plain.sample(wo, n, u, Given::Wo);
            let Some(DirectionSample { w: wi, pdf }) = sample else { continue };
            assert_eq!(textured.sample_at(at, wo, n, u, Given::Wo), sample);
            // From behind, the normal is turned over.
            for (bsdf, side) in [(&textured, n), (&both, n), (&both, -n)] {
                assert_eq!(bsdf.eval_at(at, wo, wi, side), plain.eval(wo, wi, n));
                assert_eq!(bsdf.pdf_at(at, wo, wi, side, Given::Wo), pdf);
                let gradient = bsdf.gradient_at(at, wo, wi, side);
                assert_eq!(gradient.params, plain.gradient(wo, wi, n).params);
                assert_eq!(gradient.wi, plain.gradient(wo, wi, n).wi);
                assert_eq!(bsdf.lobe_width(at), plain.lobe_width(None));
            }
        }
    }
    // Anywhere: the means.
    let mean = RoughConductor { alpha: 0.2, specular_reflectance: (red + blue) * 0.5, ..base() };
    let wi = tilted(-30.0);
    let [value, expected] =
        [&textured, &Bsdf::RoughConductor(mean)].map(|b| b.eval(tilted(40.0), wi, normal()));
    assert!((value - expected).max_abs() < 1e-12 * expected.max_abs());
}

#[test]
fn values_that_a_bsdf_does_not_take_are_refused() {
    let grey = || Bsdf::Diffuse(Diffuse::default());
    let fails = |bsdf: Bsdf, property, value: f64, part: &str| {
        let texture = squares(Rgb::splat(0.5), Rgb::splat(value));
        let message = Textured::new(bsdf, vec![(property, texture)]).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    };
    for wrong in [f64::NAN, f64::INFINITY, -1.0] {
        fails(grey(), Property::Reflectance, wrong, "reflectance");
    }
    fails(grey(), Property::Reflectance, -0.1, "the texture of \"reflectance\"");
    fails(grey(), Property::Alpha, 0.5, "has no \"alpha\"");
    fails(Bsdf::RoughConductor(RoughConductor::default()), Property::Alpha, f64::NAN, "alpha");
    let two = TwoSided { front: grey(), back: None };
    fails(Bsdf::TwoSided(Box::new(two)), Property::Reflectance, 0.1, "takes no textures");
    // What a texture stands for has no single value that could change.
    let texture = squares(Rgb::ZERO, Rgb::ONE);
    let textured = Textured::new(grey(), vec![(Property::Reflectance, texture)]).expect("one");
    let mut bsdf = Bsdf::Textured(Box::new(textured));
    let change =
        BsdfChange { property: Property::Reflectance, op: drt_math::ValueChange::Multiply(1.0) };
    let message = bsdf.apply(&change, 0.1).unwrap_err().to_string();
    assert!(message.contains("a texture stands for \"reflectance\""), "{message}");
}
