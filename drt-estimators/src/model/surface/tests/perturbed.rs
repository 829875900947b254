//! Normals that are not the surface's, and frames that follow texture coordinates.

use drt_geom::{Mesh, procedural};
use drt_math::RgbVec;
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

/// A triangle whose u and v grow along neither of its sides, with a varied map.
fn slanted() -> Mesh {
    let frame = Frame::from_normal(normal());
    let corners = [[0.0, 0.0], [1.0, 0.2], [0.3, 0.9]];
    let place = |[x, y]: [f64; 2]| frame.to_world(vec3(x, y, 0.0));
    let mesh = Mesh::new(corners.map(place).to_vec(), vec![[0, 1, 2]]).expect("a mesh");
    mesh.with_texcoords(vec![[[0.1, 0.3], [0.8, 0.2], [0.4, 0.9]]]).expect("coordinates")
}

/// Maps of normals and of heights around BSDFs of several kinds, with what is done at horizons in all combinations.
fn bent() -> Vec<Perturbed> {
    let texels = [[0.7, 0.4, 0.9], [0.3, 0.8, 0.8], [0.9, 0.6, 0.7], [0.4, 0.2, 0.6]].to_vec();
    let map = Texture::Bitmap(Bitmap::new([2, 2], texels).expect("an image"));
    let metal = || Bsdf::RoughConductor(copper(Distribution::Ggx, 0.4));
    let kinds = [
        Bsdf::Diffuse(Diffuse::default()),
        anisotropic(metal(), [0.3, 0.6]),
        Bsdf::RoughDielectric(glass(Distribution::Ggx, 0.4, 1.5)),
    ];
    let mut all = Vec::new();
    for bsdf in kinds {
        for perturbation in [Perturbation::Normals, Perturbation::Heights(0.4)] {
            for [flip_invalid_normals, use_shadowing_function] in [[true, true], [false, false]] {
                all.push(Perturbed {
                    bsdf: bsdf.clone(),
                    map: map.clone(),
                    perturbation,
                    flip_invalid_normals,
                    use_shadowing_function,
                });
            }
        }
    }
    all
}

/// Directions in which a point scatters, some of them where the value goes over from one normal to the other.
fn bent_pairs(bsdf: &Perturbed, at: &TexturePoint<'_>, count: usize) -> Vec<[Vec3; 2]> {
    let (n, mut rng) = (normal(), Rng::new(64, 0, 0));
    let boxed = Bsdf::Perturbed(Box::new(bsdf.clone()));
    let mut pairs = Vec::new();
    while pairs.len() < count {
        let mut wo = random_direction(&mut rng);
        if pairs.len() % 4 == 0 {
            // Across the normal of the map, within a third of the angle at which it goes over.
            let (m, cos) = (bsdf.plain_normal(at, n), 0.0015 * (1.0 + rng.next_f64()));
            wo = wo.reject(m).normalize() * (1.0 - cos * cos).sqrt() + m * cos;
        }
        let Some(drawn) = boxed.sample_at(Some(at), wo, n, random_3d(&mut rng), Given::Wo) else {
            continue;
        };
        let [o, i] = [wo, drawn.w].map(|w| n.dot(w).abs());
        if o > 0.05 && i > 0.05 && bsdf.plain_normal(at, n).dot(drawn.w).abs() > 0.02 {
            pairs.push([wo, drawn.w]);
        }
    }
    pairs
}

/// A slope, with how far two steps of differences agree on it.
fn slope(f: impl Fn(f64) -> Rgb) -> (Rgb, f64) {
    let by = |h: f64| (f(h) - f(-h)) * (0.5 / h);
    let (coarse, fine) = (by(2e-6), by(1e-6));
    (fine, (fine - coarse).max_abs())
}

/// Counts how often a wrong value would be seen in place of the right one, which must agree with differences.
fn agrees(what: &Perturbed, found: Rgb, wrong: Rgb, (expected, error): (Rgb, f64)) -> u32 {
    let tolerance = 4.0 * error + 1e-5 * (1.0 + expected.max_abs());
    let off = |found: Rgb| (found - expected).max_abs();
    assert!(off(found) <= tolerance, "{what:?}: {found:?} {expected:?}");
    u32::from(off(wrong) > tolerance)
}

#[test]
fn bent_normals_have_the_slopes_of_finite_differences() {
    let (mesh, n, mut rng) = (slanted(), normal(), Rng::new(65, 0, 0));
    let at = TexturePoint::new(&mesh, 0, [0.3, 0.4]);
    let mut planted = 0;
    for what in bent() {
        let bsdf = Bsdf::Perturbed(Box::new(what.clone()));
        for [wo, wi] in bent_pairs(&what, &at, 40) {
            let d = bsdf.gradient_at(Some(&at), wo, wi, n);
            assert_eq!(d.value, bsdf.eval_at(Some(&at), wo, wi, n));
            let velocity = [wo, wi, n].map(|w| random_direction(&mut rng).reject(w));
            let along = |by_n: RgbVec| {
                d.wo.dot(velocity[0]) + d.wi.dot(velocity[1]) + by_n.dot(velocity[2])
            };
            let difference = slope(|h| {
                let [wo, wi, n] =
                    [(wo, 0), (wi, 1), (n, 2)].map(|(w, k)| (w + velocity[k] * h).normalize());
                bsdf.eval_at(Some(&at), wo, wi, n)
            });
            planted += agrees(&what, along(d.n), along(RgbVec::ZERO), difference);
        }
    }
    assert!(planted > 300, "normals at rest are seen {planted} times only");
}

#[test]
fn bent_normals_turn_and_stretch_with_the_corners_of_their_triangles() {
    let (mesh, n, mut rng) = (slanted(), normal(), Rng::new(66, 0, 0));
    let bary = [0.3, 0.4];
    let at = TexturePoint::new(&mesh, 0, bary);
    let mut planted = [0; 2];
    for what in bent() {
        let bsdf = Bsdf::Perturbed(Box::new(what.clone()));
        for [wo, wi] in bent_pairs(&what, &at, 40) {
            let local = bsdf.at(Some(at), n, n, false);
            let (d, by_ng) = local.gradient(wo, wi);
            let turned = local.corners(wo, wi, [d.wo, d.wi, by_ng]);
            let still = bsdf.stretch(Some(&at), [wo, wi, n], 1.0);
            let velocity = [0; 3].map(|_| random_direction(&mut rng));
            let along = |g: [RgbVec; 3]| {
                g.iter().zip(&velocity).fold(Rgb::ZERO, |sum, (g, v)| sum + g.dot(*v))
            };
            let difference = slope(|h| {
                let mut moved = mesh.clone();
                moved.positions.iter_mut().zip(&velocity).for_each(|(p, v)| *p += *v * h);
                bsdf.eval_at(Some(&TexturePoint::new(&moved, 0, bary)), wo, wi, n)
            });
            let heights = matches!(what.perturbation, Perturbation::Heights(_));
            let wrong = if heights { along(turned) - along(still) } else { along(still) };
            planted[usize::from(heights)] += agrees(&what, along(turned), wrong, difference);
        }
    }
    assert!(
        planted.iter().all(|seen| *seen > 150),
        "turns and stretches are seen {planted:?} times only"
    );
}

#[test]
fn maps_of_normals_slide_under_points() {
    let (mesh, n, mut rng) = (slanted(), normal(), Rng::new(67, 0, 0));
    let bary = [0.3, 0.4];
    let at = TexturePoint::new(&mesh, 0, bary);
    let [by_s, by_t] = {
        let [p, q, r] = mesh.triangle(0);
        [q - p, r - p]
    };
    let mut planted = 0;
    for what in bent().into_iter().filter(|b| b.perturbation == Perturbation::Normals) {
        // Also inside of what holds others.
        let perturbed = Bsdf::Perturbed(Box::new(what.clone()));
        let masked = Bsdf::Mask(Box::new(Mask { bsdf: perturbed.clone(), opacity: 0.6 }));
        let mixed = blend(0.3, Bsdf::Diffuse(Diffuse::default()), perturbed.clone());
        for [wo, wi] in bent_pairs(&what, &at, 20) {
            for bsdf in [&perturbed, &masked, &mixed] {
                let d = bsdf.gradient_at(Some(&at), wo, wi, n);
                let by_place = bsdf.slide(Some(&at), [wo, wi, n], &d.params, 1.0);
                let [s, t] = [0; 2].map(|_| rng.next_f64() - 0.5);
                let found = by_place.dot(by_s * s + by_t * t);
                let difference = slope(|h| {
                    let bary = [bary[0] + s * h, bary[1] + t * h];
                    bsdf.eval_at(Some(&TexturePoint::new(&mesh, 0, bary)), wo, wi, n)
                });
                planted += agrees(&what, found, Rgb::ZERO, difference);
            }
        }
    }
    assert!(planted > 200, "maps at rest are seen {planted} times only");
}

/// Values do not jump where a normal turns its back, as they do without a range in which one goes over to the other.
#[test]
fn values_are_continuous_where_normals_turn_away() {
    let (mesh, n, mut rng) = (slanted(), normal(), Rng::new(68, 0, 0));
    let at = TexturePoint::new(&mesh, 0, [0.3, 0.4]);
    for what in bent() {
        let bsdf = Bsdf::Perturbed(Box::new(what.clone()));
        let m = what.plain_normal(&at, n);
        let mut largest = 0.0_f64;
        for _ in 0..200 {
            let across = random_direction(&mut rng).reject(m).normalize();
            let wi = random_direction(&mut rng);
            let [a, b] = [1e-9, -1e-9].map(|c| bsdf.eval_at(Some(&at), across + m * c, wi, n));
            assert!((a - b).max_abs() < 1e-5, "{what:?}: {a:?} {b:?}");
            largest = largest.max(bsdf.eval_at(Some(&at), across + m * 0.01, wi, n).max_abs());
        }
        assert!(largest > 0.01, "{what:?}: black");
    }
}
