//! How vertices move in the spatial form is a choice: the sum of all terms does not depend on it, that of
//! terms which do not choose alike does.

use alloc::vec;
use alloc::vec::Vec;

use drt_math::Rgb;
use drt_math::sobol::SobolSampler;
use drt_math::stats::Moments;
use drt_motion::Parameter;

use crate::derivative::contraction::{Contraction, Motion};
use crate::derivative::sensitivity::VelocityFunctional;
use crate::derivative::tangents;
use crate::derivative::tests::scenes::FILM;
use crate::estimators;
use crate::estimators::Changes;
use crate::model::scene::Scene;
use crate::model::settings::{EstimatorKind, Settings};
use crate::sampling::pixels::Sampler;
use crate::sampling::streams::sequence_name;
use crate::terms::boundary_segments::BoundarySink;
use crate::terms::boundary_source::BoundarySource;
use crate::terms::interior::PixelSampler;
use crate::terms::prepared::Prepared;
use crate::terms::splatting::Checked;
use crate::world::World;
use crate::world::cache::PreparedCache;
use crate::world::lights::EmitterMask;

/// A scene prepared for `kind = "radiative"`.
pub(crate) fn prepare(scene: &Scene, motion: &Parameter, depth: u32) -> (Prepared, Motion) {
    prepare_for(EstimatorKind::Radiative, scene, motion, depth)
}

/// A scene prepared for the light that fits an estimator that goes along rays.
pub(crate) fn prepare_for(
    estimator: EstimatorKind,
    scene: &Scene,
    motion: &Parameter,
    depth: u32,
) -> (Prepared, Motion) {
    prepare_lit(estimator, EmitterMask::Extended, scene, motion, depth)
}

/// A scene prepared for the light of some emitters.
pub(crate) fn prepare_lit(
    estimator: EstimatorKind,
    lit: EmitterMask,
    scene: &Scene,
    motion: &Parameter,
    depth: u32,
) -> (Prepared, Motion) {
    prepare_by(&Settings { estimator, ..Settings::default() }, lit, scene, motion, depth)
}

/// The same by some settings.
pub(crate) fn prepare_by(
    settings: &Settings,
    lit: EmitterMask,
    scene: &Scene,
    motion: &Parameter,
    depth: u32,
) -> (Prepared, Motion) {
    let (scene, tangents) =
        tangents::apply(scene, core::slice::from_ref(motion)).expect("a valid parameter");
    let mut kept = PreparedCache::default();
    let world = World::new(scene, 0, Some(depth), None, lit, &mut kept);
    let mut world = world.expect("a valid scene");
    let tangents = tangents.seen_by(0);
    let insides = crate::derivative::medium_motion::MediumMotions::affine(&world, &tangents, &[]);
    let motion = Motion::new(tangents, insides);
    world.prepare_for_derivatives(motion.factors());
    let changes =
        Changes { active: &motion.active, flux_shapes: &[], settings, motion: Some(&motion) };
    let prepared = estimators::prepare(estimators::named(settings.estimator), world, &changes);
    (prepared.expect("a valid scene"), motion)
}

/// A weighted sum of the image, and how well it is known.
#[derive(Clone, Copy)]
pub(crate) struct Sum {
    /// By pixel.
    pub(crate) weight: fn(u32) -> f64,
    /// Per pixel and batch.
    pub(crate) samples: u32,
    /// At most 48.
    pub(crate) batches: u64,
}

/// The light's moment across the image: some columns gain what others lose.
pub(crate) const MOMENT: Sum = Sum { weight: |pixel| f64::from(pixel % FILM[0]) - 2.5, ..LIGHT };

/// All of it.
pub(crate) const LIGHT: Sum = Sum { weight: |_| 1.0, samples: 128, batches: BATCHES };

/// The derivative of a sum by batches of samples: the interior term, and all others.
pub(crate) struct Parts {
    rays: Vec<f64>,
    edges: Vec<f64>,
}

pub(crate) fn parts(
    Sum { weight, samples, batches }: Sum,
    (prepared, motion): &(Prepared, Motion),
) -> Parts {
    let mut parts = Parts { rays: Vec::new(), edges: Vec::new() };
    for seed in 0..batches {
        let [mut rays, mut edges] = [0.0; 2];
        let component = prepared.component(Contraction::new(&prepared.world, motion));
        let terms = &prepared.terms;
        let mut sampler = PixelSampler::new(&prepared.world, [component], seed, false, true)
            .with_light_paths(prepared.terms.emission.as_ref());
        let mut values = vec![Rgb::ZERO; 2 + terms.along_paths(terms.queries).count()];
        for pixel in 0..PIXELS {
            let sequence = sequence_name(seed, pixel, 0);
            for unit in 0..samples {
                sampler.sample(pixel, unit, SobolSampler::new(sequence, unit), &mut values);
                let weight = weight(pixel) / f64::from(samples);
                rays += values[1].mean() * weight;
                edges += values[2..].iter().map(|v| v.mean()).sum::<f64>() * weight;
            }
        }
        for source in &prepared.terms.sources {
            let contraction = Contraction::new(&prepared.world, motion);
            let mut splatted = Checked::new(Total { contraction, weight, sum: 0.0 });
            prepared.splatter(&prepared.world, seed).run(
                *source,
                None,
                source.stream(),
                samples * PIXELS,
                &mut splatted,
            );
            let part = match source {
                BoundarySource::GrazingPaths => &mut rays,
                _ => &mut edges,
            };
            *part += splatted.inner.sum / f64::from(samples * PIXELS);
        }
        parts.rays.push(rays);
        parts.edges.push(edges);
    }
    parts
}

/// The interior term of one, and all others of another.
pub(crate) fn total(rays: &Parts, edges: &Parts) -> Batches {
    Batches(rays.rays.iter().zip(&edges.edges).map(|(rays, edges)| rays + edges).collect())
}

/// A derivative by batches of samples. A batch takes the same random numbers in each estimate, so that much of the noise of two of them is
/// common to both, and their difference is known better than either.
#[derive(Clone, Debug)]
pub(crate) struct Batches(Vec<f64>);

impl Batches {
    /// A derivative that is known.
    pub(crate) fn exact(value: f64) -> Self {
        Self(vec![value; BATCHES as usize])
    }

    /// The mean of all batches.
    pub(crate) fn mean(&self) -> f64 {
        self.0.iter().sum::<f64>() / self.0.len() as f64
    }

    /// How many standard errors its mean is above that of a reference by the same batches, and what a standard error is over the reference.
    pub(crate) fn off(&self, reference: &Self) -> (f64, f64) {
        let pairs = self.0.iter().zip(&reference.0);
        let differences: Moments = pairs.map(|(own, other)| own - other).collect();
        let error = differences.standard_error();
        (differences.mean() / error, error / reference.mean().abs())
    }
}

/// The derivative of a sum, by all terms of a scene that has been prepared.
pub(crate) fn derivative(sum: Sum, prepared: &(Prepared, Motion)) -> Batches {
    let parts = parts(sum, prepared);
    total(&parts, &parts)
}

const BATCHES: u64 = 48;
const PIXELS: u32 = FILM[0] * FILM[1];

/// What lands on any pixel, by a weight of it.
pub(crate) struct Total<'a> {
    pub(crate) contraction: Contraction<'a>,
    pub(crate) weight: fn(u32) -> f64,
    pub(crate) sum: f64,
}

impl<'a> BoundarySink for Total<'a> {
    fn moves(&mut self, functional: &VelocityFunctional) -> bool {
        self.contraction.evaluate(functional)
    }

    fn receive(&mut self, pixel: u32, value: Rgb) {
        self.sum += (self.weight)(pixel) * value.mean() * self.contraction.rates[0].r;
    }

    type Sink = Contraction<'a>;

    fn spread(&mut self, pixels: &[(u32, f64)], send: impl FnOnce(&mut Contraction<'a>)) -> bool {
        self.contraction.clear();
        send(&mut self.contraction);
        let rate = self.contraction.rates[0].mean();
        self.sum += pixels.iter().map(|(p, w)| (self.weight)(*p) * w * rate).sum::<f64>();
        true
    }
}

/// Compares strengths of what is chosen with each other, and finds out terms that do not choose alike.
pub(crate) fn check(sum: Sum, prepare: &dyn Fn(f64) -> (Prepared, Motion)) {
    let [one, none, three] = [1.0, 0.0, 3.0].map(|strength| parts(sum, &prepare(strength)));
    let reference = total(&one, &one);
    let compare = |(rays, edges)| total(rays, edges).off(&reference);
    let alike = [(&none, &none), (&three, &three)].map(compare);
    assert!(alike.iter().all(|(z, _)| z.abs() < 4.0), "{alike:?}");
    let unlike = compare((&three, &none));
    assert!(unlike.0.abs() > 5.0, "{unlike:?}");
}
