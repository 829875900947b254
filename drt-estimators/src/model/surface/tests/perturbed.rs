//! Normals that are not the surface's, and frames that follow texture coordinates.

use drt_geom::{Mesh, procedural};
use drt_math::testing::{SIGNIFICANCE, sphere_chi_square};

use alloc::vec;

use super::*;
use crate::model::surface::shading_frame::shading_frame;
use crate::model::texture::{Bitmap, Texture, TexturePoint};

/// A square whose u grows along y and v along -x, or mirrored.
fn square(mirrored: bool) -> Mesh {
    let mut mesh = procedural::rectangle();
    let uv = |p: Vec3| if mirrored { [p.y, p.x] } else { [p.y, -p.x] };
    let corners = (0..mesh.triangles.len() as u32).map(|i| mesh.triangle(i).map(uv)).collect();
    mesh.texcoords = Some(corners);
    mesh
}

fn everywhere(texel: [f32; 3]) -> Texture {
    Texture::Bitmap(Bitmap::new([1, 1], vec![texel]).expect("one texel"))
}

/// A map whose normals are the surface's.
pub(super) fn even_map(bsdf: Bsdf) -> Perturbed {
    mapped(bsdf, [0.5, 0.5, 1.0])
}

fn mapped(bsdf: Bsdf, texel: [f32; 3]) -> Perturbed {
    Perturbed {
        bsdf,
        map: everywhere(texel),
        perturbation: Perturbation::Normals,
        flip_invalid_normals: true,
        use_shadowing_function: true,
    }
}

#[test]
fn frames_follow_coordinates_on_both_sides() {
    for (mirrored, t) in [(false, -Vec3::X), (true, -Vec3::X)] {
        let mesh = square(mirrored);
        let at = TexturePoint::new(&mesh, 0, [0.2, 0.3]);
        for n in [Vec3::Z, -Vec3::Z] {
            let frame = shading_frame(Some(&at), n);
            assert!((frame.s - Vec3::Y).max_abs() < 1e-15, "{frame:?}");
            assert!((frame.t - t).max_abs() < 1e-15 && frame.n == n, "{frame:?}");
        }
    }
}

/// Frames of an instance are those of its mesh in the world.
#[test]
fn instances_take_their_frames_along() {
    let mirrored = vec3(-0.7, 1.4, 0.9);
    for scale in [vec3(0.7, 1.4, 0.9), mirrored] {
        let rows = [vec3(0.6, -0.8, 0.1), vec3(0.8, 0.6, 0.2), vec3(0.1, -0.3, 1.0)];
        let [a, b, c] = rows.map(|r| vec3(r.x * scale.x, r.y * scale.y, r.z * scale.z));
        let linear = drt_math::Mat3::from_rows(a, b, c);
        let map = drt_math::Affine { linear, translation: vec3(1.0, 2.0, 3.0) };
        let mesh = square(false);
        let placed = mesh.transform(&map);
        for bary in [[0.2, 0.3], [0.6, 0.1]] {
            let own = TexturePoint::new(&placed, 0, bary);
            let at = TexturePoint { to_world: Some(&map), ..TexturePoint::new(&mesh, 0, bary) };
            let n = own.normal().normalize();
            assert!((at.normal().normalize() - n).max_abs() < 1e-12);
            let [a, b] = [&own, &at].map(|at| shading_frame(Some(at), n));
            assert!((a.s - b.s).max_abs() < 1e-12 && (a.t - b.t).max_abs() < 1e-12);
        }
    }
}

#[test]
fn a_map_of_the_surfaces_own_normals_changes_nothing() {
    let mesh = square(false);
    let at = TexturePoint::new(&mesh, 1, [0.2, 0.3]);
    let mut rng = Rng::new(61, 0, 0);
    let plain = anisotropic(Bsdf::RoughConductor(copper(Distribution::Ggx, 0.3)), [0.1, 0.4]);
    let mapped = Bsdf::Perturbed(Box::new(mapped(plain.clone(), [0.5, 0.5, 1.0])));
    for _ in 0..200 {
        let (wo, u) = (random_direction(&mut rng), random_3d(&mut rng));
        let [a, b] = [&plain, &mapped].map(|b| b.sample_at(Some(&at), wo, Vec3::Z, u, Given::Wo));
        let (Some(a), Some(b)) = (a, b) else {
            assert_eq!(a, b);
            continue;
        };
        assert!((a.w - b.w).max_abs() < 1e-12 && (a.pdf - b.pdf).abs() < 1e-9 * a.pdf);
        let [a, b] = [&plain, &mapped].map(|bsdf| bsdf.eval_at(Some(&at), wo, a.w, Vec3::Z));
        assert!((a - b).max_abs() < 1e-9 * a.max_abs());
    }
}

#[test]
fn samples_follow_their_density_about_other_normals() {
    let mesh = square(false);
    let at = TexturePoint::new(&mesh, 0, [0.2, 0.3]);
    let metal = || Bsdf::RoughConductor(copper(Distribution::Ggx, 0.4));
    for bsdf in [Bsdf::Diffuse(Diffuse::default()), metal()] {
        let bsdf = Bsdf::Perturbed(Box::new(mapped(bsdf, [0.9, 0.6, 0.8])));
        for (from, given) in [
            (vec3(0.3, -0.2, 0.8), Given::Wo),
            (vec3(-0.3, -0.9, 0.3), Given::Wo),
            (vec3(0.3, -0.9, 0.3), Given::Wi),
        ] {
            let from = from.normalize();
            let mut rng = Rng::new(62, 0, 0);
            let samples = (0..100_000).map(|_| {
                let drawn = bsdf.sample_at(Some(&at), from, Vec3::Z, random_3d(&mut rng), given);
                drawn.map_or(Vec3::splat(f64::NAN), |s| s.w)
            });
            let samples: Vec<Vec3> = samples.collect();
            let pdf = |w| bsdf.pdf_at(Some(&at), from, w, Vec3::Z, given);
            let p = sphere_chi_square(samples.iter().copied(), pdf);
            assert!(p > SIGNIFICANCE, "{bsdf:?} {from:?}: p = {p:e}");
            // Planted: the density about the surface's own normal.
            let inner = match &bsdf {
                Bsdf::Perturbed(b) => &b.bsdf,
                other => other,
            };
            let wrong = |w| inner.pdf_at(Some(&at), from, w, Vec3::Z, given);
            assert!(sphere_chi_square(samples.iter().copied(), wrong) < SIGNIFICANCE);
        }
    }
}

/// The value covers all light that paths from lights may bring, whichever way the normal faces.
#[test]
fn densities_from_lights_cover_all_values() {
    let mesh = square(true);
    let at = TexturePoint::new(&mesh, 0, [0.2, 0.3]);
    let bsdf =
        Bsdf::Perturbed(Box::new(mapped(Bsdf::Diffuse(Diffuse::default()), [1.0, 0.6, 0.6])));
    let mut rng = Rng::new(63, 0, 0);
    for _ in 0..5000 {
        let [wo, wi] = [random_direction(&mut rng), random_direction(&mut rng)];
        let value = bsdf.eval_at(Some(&at), wo, wi, Vec3::Z);
        let pdf = bsdf.pdf_at(Some(&at), wi, wo, Vec3::Z, Given::Wi);
        assert!(value.is_zero() || pdf > 0.0, "{wo:?} {wi:?}");
        let g = bsdf.gradient_at(Some(&at), wo, wi, Vec3::Z);
        assert_eq!(g.value, value);
    }
}

#[test]
fn slopes_of_heights_tilt_normals() {
    // Heights that grow by 0.5 per unit of u, which is 0.5 per unit of length along y.
    let texels = [0.0, 0.25, 0.5, 0.75].map(|h| [h, 0.0, 0.0]).to_vec();
    let map = Texture::Bitmap(Bitmap::new([4, 1], texels).expect("an image"));
    let mesh = square(false);
    let at = TexturePoint::new(&mesh, 0, [0.25, 0.25]);
    let slope = map.slopes(at.uv())[0].r;
    assert!(slope.abs() > 0.1);
    let bump = Perturbed {
        bsdf: Bsdf::Diffuse(Diffuse::default()),
        map,
        perturbation: Perturbation::Heights(2.0),
        flip_invalid_normals: true,
        use_shadowing_function: false,
    };
    let bsdf = Bsdf::Perturbed(Box::new(bump));
    let tilted = vec3(0.0, -2.0 * slope, 1.0).normalize();
    let wi = vec3(0.1, 0.2, 0.9).normalize();
    let expected = 0.5 / core::f64::consts::PI * tilted.dot(wi).max(0.0);
    let value = bsdf.eval_at(Some(&at), Vec3::Z, wi, Vec3::Z).r;
    assert!((value - expected).abs() < 1e-12, "{value} {expected}");
    // Behind, everything is turned over.
    let both = TwoSided { front: bsdf.clone(), back: None };
    let wi = vec3(0.1, 0.2, -0.9).normalize();
    let back = Bsdf::TwoSided(Box::new(both)).eval_at(Some(&at), -Vec3::Z, wi, Vec3::Z).r;
    let mirrored = vec3(tilted.x, tilted.y, -tilted.z);
    let expected = 0.5 / core::f64::consts::PI * mirrored.dot(wi).max(0.0);
    assert!((back - expected).abs() < 1e-12, "{back} {expected}");
}
