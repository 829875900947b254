//! The holds' algebra, and that they are one choice among many.

use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;

use drt_math::sobol::SobolSampler;
use drt_math::stats::Moments;
use drt_math::{Rgb, Rng, Vec3, vec3};

use super::super::tests::scenes::{FILM, diffuse, moves, parameter, phong, shift, surfaces};
use super::Hold;
use crate::boundary::Receiver;
use crate::contraction::{Contraction, Motion};
use crate::inside::Insides;
use crate::interior::{PixelSampler, sequence_name};
use crate::kept::Kept;
use crate::pixels::Sampler;
use crate::prepared::Prepared;
use crate::sensitivity::Functional;
use crate::settings::{EstimatorKind, Settings};
use crate::splatting::Checked;
use crate::tangents;
use crate::transport::{Kind, Lit, SurfacePoint, Vertex, World};

/// A ball over a floor that moves; the ball's surface holds. It has smooth normals, or `facets`.
fn prepare(facets: bool) -> (Prepared, Motion) {
    let mut scene = surfaces(phong(), diffuse(0.6, 0.5, 0.4));
    if facets {
        let ball = scene.shapes.iter_mut().find(|s| s.id.as_deref() == Some("ball"));
        Arc::make_mut(&mut ball.expect("a ball").mesh).normals = None;
    }
    let motion = parameter("ball", 0.0, vec![moves("ball", shift())]);
    let (scene, tangents) =
        tangents::apply(&scene, core::slice::from_ref(&motion)).expect("a valid parameter");
    let mut kept = Kept::default();
    let world = World::new(scene, 0, Some(4), None, Lit::Extended, &mut kept);
    let world = world.expect("a valid scene");
    let insides = Insides::at_rest(&world);
    let motion = Motion::new(tangents.seen_by(0), insides);
    let settings = Settings { estimator: EstimatorKind::Radiative, ..Settings::default() };
    let prepared = Prepared::new(world, &motion.interest, &[], &settings, Some(&motion));
    (prepared.expect("a valid scene"), motion)
}

/// The slope is the gradient of the share, along the surface.
#[test]
fn slopes_are_those_of_shares() {
    let (prepared, _) = prepare(false);
    let world = &prepared.world;
    let mut rng = Rng::new(1, 2, 3);
    let mut held = [0; 2];
    for _ in 0..20_000 {
        // One of the ball's.
        let prim = (rng.next_f64() * 80.0) as u32;
        let from = vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) * 6.0 - Vec3::splat(3.0);
        let holds: [&dyn Fn(&Vertex) -> Hold; 2] =
            [&|v| world.hold(v, (v.x - from).normalize(), (v.x - from).length()), &|v| {
                let pixel = world.camera.view(world.point(prim, [0.3; 2]).1).pixel;
                world.hold_in_pixel(v, pixel.map(|p| p.clamp(0.0, 4.0) as u32))
            }];
        let at = |bary: [f64; 2]| -> (SurfacePoint, Vertex) {
            let (point, x) = world.point(prim, bary);
            (point, Vertex { x, medium: None, kind: Kind::Surface(point) })
        };
        for (hold, count) in holds.iter().zip(&mut held) {
            let (_, here) = at([0.3; 2]);
            let Hold { share, slope } = hold(&here);
            if share == 0.0 || share > 0.999 {
                continue;
            }
            *count += 1;
            let step = 1e-5;
            let ([_, a], [_, b]) = (
                [0.0, step].map(|s| at([0.3 + s, 0.3]).1),
                [0.0, step].map(|s| at([0.3 - s, 0.3]).1),
            );
            let difference = hold(&a).share - hold(&b).share;
            let expected = slope.dot(a.x - b.x);
            let size = slope.length() * (a.x - b.x).length();
            assert!(
                (difference - expected).abs() < 1e-3 * size + 1e-12,
                "{difference} {expected} {size}"
            );
        }
    }
    assert!(held.iter().all(|h| *h > 100), "{held:?}");
}

/// The derivative of the light's moment across the image: what is found along rays with holds `strengths[0]` times
/// as strong as they are, what is found at edges with holds `strengths[1]` times as strong.
fn derivative(facets: bool, strengths: [f64; 2]) -> Moments {
    let [rays, edges] = strengths.map(|strength| {
        let (mut prepared, motion) = prepare(facets);
        let holds = &mut prepared.world.holds;
        holds.bends.iter_mut().chain(&mut holds.seen).for_each(|h| *h *= strength);
        let mut batches = [Vec::new(), Vec::new()];
        for seed in 0..BATCHES {
            let [mut rays, mut edges] = [0.0; 2];
            let sink = Some(Contraction::new(&prepared.world, &motion));
            let along = prepared.along_rays();
            let mut sampler = PixelSampler::new(&prepared.world, sink, along, seed, false, true);
            let mut values = vec![Rgb::ZERO; along.layers(1, true)];
            for pixel in 0..PIXELS {
                let sequence = sequence_name(seed, pixel, 0);
                for unit in 0..SAMPLES {
                    sampler.sample(pixel, unit, SobolSampler::new(sequence, unit), &mut values);
                    let weight = weight(pixel) / f64::from(SAMPLES);
                    rays += values[1].mean() * weight;
                    edges += values[2..].iter().map(|v| v.mean()).sum::<f64>() * weight;
                }
            }
            let contraction = Contraction::new(&prepared.world, &motion);
            let mut outlines = Checked::new(Total { contraction, sum: 0.0 });
            for source in &prepared.sources {
                prepared.splatter(seed).run(
                    *source,
                    source.stream(),
                    SAMPLES * PIXELS,
                    &mut outlines,
                );
            }
            edges += outlines.inner.sum / f64::from(SAMPLES * PIXELS);
            batches[0].push(rays);
            batches[1].push(edges);
        }
        batches
    });
    let mut moments = Moments::default();
    rays[0].iter().zip(&edges[1]).for_each(|(rays, edges)| moments.push(rays + edges));
    moments
}

const BATCHES: u64 = 48;
const SAMPLES: u32 = 128;
const PIXELS: u32 = FILM[0] * FILM[1];

/// Light moves across the image: some columns gain what others lose.
fn weight(pixel: u32) -> f64 {
    f64::from(pixel % FILM[0]) - 2.5
}

/// What lands on any pixel.
struct Total<'a> {
    contraction: Contraction<'a>,
    sum: f64,
}

impl Receiver for Total<'_> {
    fn moves(&mut self, functional: &Functional) -> bool {
        self.contraction.evaluate(functional)
    }

    fn receive(&mut self, pixel: u32, value: Rgb) {
        self.sum += weight(pixel) * value.mean() * self.contraction.rates[0].r;
    }
}

/// How vertices move is a choice; the sum of all terms does not depend on it, that of terms which do not
/// choose alike does.
fn check(facets: bool) {
    let reference = derivative(facets, [1.0; 2]);
    let compare = |strengths: [f64; 2]| {
        let m = derivative(facets, strengths);
        let error = f64::sqrt(m.variance_of_mean() + reference.variance_of_mean());
        ((m.mean() - reference.mean()) / error, error / reference.mean())
    };
    let alike = [[0.0, 0.0], [3.0, 3.0]].map(compare);
    assert!(alike.iter().all(|(z, _)| z.abs() < 4.0), "{alike:?}");
    let unlike = compare([3.0, 0.0]);
    assert!(unlike.0.abs() > 5.0, "{unlike:?}");
}

#[test]
fn the_choice_does_not_matter() {
    check(false);
}

#[test]
fn nor_does_it_with_facets() {
    check(true);
}
