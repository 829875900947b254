//! Derivatives of what tells directions along the surface apart.

use drt_geom::Mesh;
use drt_math::RgbVec;

use super::*;
use crate::model::surface::framed::by_corners;

/// What has a derivative by every number that a [`BsdfParams`] has an entry of.
pub(super) fn framed_cases() -> Vec<Bsdf> {
    let base_color = Rgb::new(0.6, 0.4, 0.2);
    let common = Principled { base_color, anisotropic: 0.7, flatness: 0.3, ..Default::default() };
    alloc::vec![
        anisotropic(Bsdf::RoughConductor(copper(Distribution::Beckmann, 0.3)), [0.5, 0.2]),
        anisotropic(Bsdf::RoughConductor(copper(Distribution::Ggx, 0.3)), [0.2, 0.5]),
        anisotropic(Bsdf::RoughDielectric(glass(Distribution::Beckmann, 0.3, 1.5)), [0.6, 0.3]),
        anisotropic(Bsdf::RoughDielectric(glass(Distribution::Ggx, 0.3, 1.5)), [0.3, 0.6]),
        Bsdf::Principled(Box::new(Principled { metallic: 0.4, sheen: 0.3, ..common })),
        Bsdf::Principled(Box::new(Principled {
            metallic: 0.3,
            spec_trans: 0.6,
            clearcoat: 0.5,
            ..common
        })),
        Bsdf::PrincipledThin(Box::new(PrincipledThin {
            spec_tint: 0.0,
            base_color,
            sheen: 0.2,
            ..thin()
        })),
        Bsdf::RoughDiffuse(grooves(0.6, false)),
        Bsdf::RoughDiffuse(grooves(0.3, true)),
        Bsdf::Ward(Ward { alpha: [0.2, 0.5], ..Ward::default() }),
        Bsdf::Ward(Ward { alpha: [0.5, 0.2], variant: WardVariant::Ward, ..Ward::default() }),
        Bsdf::Ward(Ward { alpha: [0.5, 0.3], variant: WardVariant::Duer, ..Ward::default() }),
    ]
}

/// Pairs of directions that a case scatters, away from where values end.
fn pairs(bsdf: &Bsdf, count: u32) -> Vec<[Vec3; 2]> {
    let (n, mut rng) = (normal(), Rng::new(91, 0, 0));
    let mut pair = || {
        let wo = random_direction(&mut rng);
        let wi = bsdf.sample(wo, n, random_3d(&mut rng), Given::Wo)?.w;
        (n.dot(wo).abs() > 0.1 && n.dot(wi).abs() > 0.1).then_some([wo, wi])
    };
    (0..count).filter_map(|_| pair()).collect()
}

/// The derivative of a function at 0, and how far two steps differ.
fn slope(f: impl Fn(f64) -> Rgb) -> (Rgb, f64) {
    let by = |h: f64| (f(h) - f(-h)) * (0.5 / h);
    let (coarse, fine) = (by(2e-5), by(1e-5));
    (fine, (fine - coarse).max_abs())
}

#[test]
fn numbers_have_the_slopes_of_finite_differences() {
    for bsdf in framed_cases() {
        let mut seen = 0;
        for property in Property::ALL {
            let number = bsdf.is_number(property);
            if number.is_none() || bsdf.undifferentiated(property).is_some() {
                continue;
            }
            seen += 1;
            for [wo, wi] in pairs(&bsdf, 60) {
                let value = bsdf.clone().property(property).expect("a property").value();
                let at = |h: f64| {
                    let mut moved = bsdf.clone();
                    moved.set(property, value + Rgb::splat(h)).expect("a property");
                    moved.eval(wo, wi, normal())
                };
                let (expected, error) = slope(at);
                let found = bsdf.gradient(wo, wi, normal()).params.get(property);
                let off = (found - expected).max_abs();
                let tolerance = 4.0 * error + 1e-6 * (1.0 + expected.max_abs());
                assert!(off <= tolerance, "{bsdf:?} {property}: {found:?} {expected:?}");
            }
        }
        let least = if matches!(bsdf, Bsdf::RoughDiffuse(_)) { 2 } else { 4 };
        assert!(seen >= least, "{bsdf:?}: {seen}");
    }
}

/// A triangle in the plane of [`normal`], with texture coordinates along none of its sides.
fn triangle() -> Mesh {
    let frame = Frame::from_normal(normal());
    let corners = [[0.0, 0.0], [1.0, 0.2], [0.3, 0.9]];
    let place = |[x, y]: [f64; 2]| frame.to_world(vec3(x, y, 0.0));
    let mesh = Mesh::new(corners.map(place).to_vec(), alloc::vec![[0, 1, 2]]).expect("a mesh");
    mesh.with_texcoords(alloc::vec![[[0.1, 0.7], [0.8, 0.2], [0.4, 0.9]]]).expect("coordinates")
}

#[test]
fn frames_follow_the_corners_of_their_triangles() {
    let (mesh, n, mut rng) = (triangle(), normal(), Rng::new(92, 0, 0));
    let bary = [0.3, 0.4];
    let mut planted = 0;
    for bsdf in framed_cases() {
        for [wo, wi] in pairs(&bsdf, 60) {
            let at = TexturePoint::new(&mesh, 0, bary);
            let d = bsdf.gradient_at(Some(&at), wo, wi, n);
            let gradients = by_corners(&at, n, &[(wo, d.wo), (wi, d.wi)]);
            let velocity = [0; 3].map(|_| random_direction(&mut rng));
            let along = |g: [RgbVec; 3]| {
                g.iter().zip(&velocity).fold(Rgb::ZERO, |sum, (g, v)| sum + g.dot(*v))
            };
            let (expected, error) = slope(|h| {
                let mut moved = mesh.clone();
                moved.positions.iter_mut().zip(&velocity).for_each(|(p, v)| *p += *v * h);
                bsdf.eval_at(Some(&TexturePoint::new(&moved, 0, bary)), wo, wi, n)
            });
            let tolerance = 4.0 * error + 1e-6 * (1.0 + expected.max_abs());
            let off = |found: Rgb| (found - expected).max_abs();
            let found = along(gradients);
            assert!(off(found) <= tolerance, "{bsdf:?}: {found:?} {expected:?}");
            planted += u32::from(off(-found) > tolerance);
        }
    }
    assert!(planted > 200, "the wrong sign is seen {planted} times only");
}

#[test]
fn properties_without_derivatives_say_why() {
    let case = Principled { base_color: Rgb::new(0.6, 0.0, 0.2), ..Default::default() };
    let why = |b: Principled, p| Bsdf::Principled(Box::new(b)).undifferentiated(p);
    assert_eq!(why(case, Property::BaseColor), None);
    assert_eq!(why(case, Property::Metallic), None);
    for (bsdf, property, part) in [
        (Principled { spec_tint: 0.1, ..case }, Property::BaseColor, "tint"),
        (Principled { sheen: 0.1, sheen_tint: 0.1, ..case }, Property::BaseColor, "tint"),
        (Principled { spec_trans: 0.1, ..case }, Property::BaseColor, "root"),
        (case, Property::SpecTrans, "at 0"),
        (Principled { spec_trans: 0.1, metallic: 1.0, ..case }, Property::Metallic, "at 1"),
        (case, Property::Anisotropic, "no path"),
    ] {
        let found = why(bsdf, property);
        assert!(found.is_some_and(|reason| reason.contains(part)), "{property}: {found:?}");
    }
}
