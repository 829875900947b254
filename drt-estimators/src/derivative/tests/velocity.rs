//! A velocity field that is neither of the estimators': the material one, and a smooth part of the velocity of
//! one point of matter.
//!
//! v = u + c(x) e (e·u(q)), with e along surfaces and c = 0 where the integrand jumps, differs from u by a field
//! without flux. By the divergence theorem interior derivatives are the same.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::procedural;
use drt_math::sobol::SobolSampler;
use drt_math::stats::Moments;
use drt_math::{Rgb, Rng, Vec3, vec3};
use drt_motion::{Parameter, SurfacePoint as PointOfMesh};

use crate::derivative::adjoint::Differentiator;
use crate::derivative::antithetic::AntitheticPairs;
use crate::derivative::contraction::{Contraction, Motion};
use crate::derivative::tests::scenes::*;
use crate::derivative::tests::setup::{Recording, motion, prepare, trace_at};
use crate::derivative::velocity::{
    Auxiliary, Blend, Found, Material, Moved, Movers, Probe, VelocityField, VertexVelocity,
};
use crate::model::emitter::Emitter;
use crate::model::scene::Scene;
use crate::run::gradient::ScatterSink;
use crate::sampling::streams::sequence_name;
use crate::sampling::trace::Endpoint;
use crate::sampling::trace::Tracer;
use crate::world::World;
use crate::world::vertex::{MaterialPoint, Matter, SurfacePoint, Vertex};

/// The material field and a smooth one.
#[derive(Clone, Debug)]
struct Smooth {
    material: Material,
    /// q.
    point: MaterialPoint,
    /// e, unit.
    direction: Vec3,
    /// c and its gradient.
    window: fn(Vec3) -> (f64, Vec3),
    /// Times the divergence; 1 but for a planted fault.
    divergence: f64,
}

impl VelocityField for Smooth {
    fn camera(&self) -> VertexVelocity {
        self.material.camera()
    }

    fn vertex(
        &self,
        world: &World,
        found: &Found<'_>,
        probe: &mut Probe,
        auxiliary: &mut Vec<Auxiliary>,
    ) -> VertexVelocity {
        let own = self.material.vertex(world, found, probe, auxiliary);
        let first = auxiliary.len();
        if let (true, Endpoint::Surface(v) | Endpoint::Volume(v, _)) =
            (own.moves, &found.arrival.end)
        {
            let (c, gradient) = (self.window)(v.x);
            auxiliary.push(Auxiliary {
                matter: Matter::Surface(self.point),
                functional: self.direction,
                displacement: self.direction * c,
                divergence: gradient.dot(self.direction) * self.divergence,
                moved: Moved::Vertex,
            });
        }
        VertexVelocity { auxiliary: first..auxiliary.len(), ..own }
    }

    fn blend(&self, world: &World, viewer: &Vertex, end: &Vertex, dir: Vec3, d: f64) -> Blend {
        self.material.blend(world, viewer, end, dir, d)
    }

    fn turns_rays(&self, world: &World, s: &SurfacePoint, velocity: &VertexVelocity) -> bool {
        self.material.turns_rays(world, s, velocity)
    }

    fn widest_paired(&self, transmissive: bool) -> f64 {
        self.material.widest_paired(transmissive)
    }
}

/// Π (1 - (x_i / r)²)² over some axes, and its gradient.
fn window(x: Vec3, r: f64, axes: &[usize]) -> (f64, Vec3) {
    let q = x.to_array().map(|x| x / r);
    if axes.iter().any(|i| q[*i].abs() >= 1.0) {
        return (0.0, Vec3::ZERO);
    }
    let factor = |i: usize| (1.0 - q[i] * q[i]) * (1.0 - q[i] * q[i]);
    let c: f64 = axes.iter().map(|i| factor(*i)).product();
    let slope = |i: usize| {
        if axes.contains(&i) { -4.0 * q[i] / (r * (1.0 - q[i] * q[i])) * c } else { 0.0 }
    };
    (c, vec3(slope(0), slope(1), slope(2)))
}

/// A floor under the sky and the sun.
fn floor() -> Scene {
    let scene = SceneBuilder::new()
        .shape("floor", ShapeBuilder::new(super::scenes::floor(), phong()))
        .emitter("sun", sun(Rgb::new(0.7, 0.6, 0.5)))
        .emitter("sky", sky());
    seen(scene, [vec3(0.3, 0.9, 4.0), vec3(0.0, -0.1, 0.0)], 5)
}

/// A box of mist under the sky.
fn mist() -> Scene {
    let room = placed(procedural::cube(), Vec3::splat(1.4), 0.0, Vec3::ZERO);
    let scene = SceneBuilder::new()
        .medium("mist", homogeneous(Rgb::new(1.0, 0.8, 1.2), Rgb::splat(0.9), Rgb::ZERO, 0.2))
        .shape("room", ShapeBuilder::interface(room).interior("mist"))
        .emitter("sky", Emitter::Constant { radiance: Rgb::new(1.0, 0.5, 0.2) })
        .emitter("sun", sun(Rgb::splat(0.7)));
    seen(scene, [vec3(0.3, 0.9, 4.0), Vec3::ZERO], 4)
}

const PIXELS: u32 = FILM[0] * FILM[1];

/// How many batches of paths there are. Places in pixels are spread evenly in each.
const BATCHES: u64 = 64;

/// Derivatives of the moment of light across the image, by the first of all batches, each of so many paths; and the largest difference between
/// forward and reverse mode, over the root mean square of paths.
fn derivatives(
    scene: &Scene,
    parameter: &Parameter,
    batches: u64,
    paths: u32,
    field: &dyn Fn(Material) -> Smooth,
) -> (Vec<f64>, f64) {
    let (world, motion) = prepare(scene, parameter);
    let field = field(Material::new(Movers::new(&motion.active)));
    let mut path = Recording::new(&world, Arc::new(field), AntitheticPairs::default());
    let mut tracer = Tracer::new(&world);
    let mut differentiator = Differentiator::new(&world);
    let mut rates = Contraction::new(&world, &motion);
    let (mut forward, mut apart, mut square) = (Vec::new(), 0.0, 0.0);
    for batch in 0..batches {
        let mut sum = 0.0;
        for i in 0..paths {
            let (pixel, index) = (i % PIXELS, i / PIXELS);
            let mut places = SobolSampler::new(sequence_name(batch, pixel, 0), index);
            let place = [places.next_f64(), places.next_f64()];
            let rng = Rng::new(31 + batch, u64::from(pixel), index);
            let slope = trace_at(&mut tracer, &mut path, None, None, pixel, place, rng);
            let column = f64::from(path.record.camera_ray.pixel[0]) - 2.5;
            let rng = Rng::new(6, batch, i);
            rates.clear();
            differentiator.differentiate(&path.path(), slope, rng.clone(), &mut rates);
            let value = rates.rates[0].mean() * column;
            (sum, square) = (sum + value, square + value * value);
            if batch == 0 && i < 200 {
                let weights = Rgb::splat(column / 3.0);
                let mut sink = ScatterSink::of_surfaces(&world, &motion.active, weights);
                differentiator.differentiate(&path.path(), slope, rng, &mut sink);
                apart = f64::max(apart, (along(&motion, &world, sink) - value).abs());
            }
        }
        forward.push(sum / f64::from(paths));
    }
    (forward, apart / f64::sqrt(square / (batches as f64 * f64::from(paths))))
}

/// A scattered gradient along the velocities of the one parameter.
fn along(motion: &Motion, world: &World, sink: ScatterSink<'_>) -> f64 {
    let gradient = sink.into_gradient();
    let of = |(s, g): (usize, &Option<drt_motion::surface::VertexGradient>)| {
        let (g, (_, surface)) = (g.as_ref()?, motion.tangents.shapes[s].first()?);
        Some(g.dot(&world.scene.shapes[s].mesh, surface))
    };
    gradient.shapes.iter().enumerate().filter_map(of).sum()
}

fn check(
    scene: &Scene,
    parameter: &Parameter,
    paths: u32,
    smooth: &dyn Fn(Material, f64) -> Smooth,
    reverse: bool,
) {
    let none = |material| Smooth { window: |_| (0.0, Vec3::ZERO), ..smooth(material, 1.0) };
    let (material, transposed) = derivatives(scene, parameter, BATCHES, paths, &none);
    assert!(!reverse || transposed < 1e-12, "{transposed}");
    let difference = |batches: u64, divergence: f64| {
        let field = |material| smooth(material, divergence);
        let (own, transposed) = derivatives(scene, parameter, batches, paths, &field);
        assert!(!reverse || transposed < 1e-12, "{transposed}");
        own.iter().zip(&material).map(|(a, b)| a - b).collect::<Moments>()
    };
    // What is planted is so large that a part of the paths shows it.
    let (fair, faulty) = (difference(BATCHES, 1.0), difference(BATCHES / 16, 0.0));
    let error = fair.standard_error();
    println!("{}: {} {} ± {error}", parameter.name, fair.mean(), faulty.mean());
    assert!(fair.mean().abs() < 4.0 * error && fair.variance() > 0.0, "{fair:?}");
    // Planted: the field has no divergence. It makes 50 times what is not known.
    assert!(faulty.mean().abs() > 50.0 * error, "{faulty:?} {error}");
}

#[test]
fn surfaces_may_slide_within_themselves() {
    let scene = floor();
    let field = |material, divergence| Smooth {
        material,
        point: MaterialPoint { shape: 0, at: PointOfMesh { triangle: 3, bary: [0.2, 0.5] } },
        direction: vec3(0.6, 0.0, 0.8),
        window: |x| window(x, 4.0, &[0, 2]),
        divergence,
    };
    check(
        &scene,
        &motion("floor", "wobble", wobble(&scene, "floor", 3)),
        256 * PIXELS,
        &field,
        true,
    );
}

/// Their insides have no vertices to which reverse mode would scatter.
#[test]
fn insides_may_move_as_they_like() {
    let field = |material, divergence| Smooth {
        material,
        point: MaterialPoint { shape: 0, at: PointOfMesh { triangle: 3, bary: [0.2, 0.5] } },
        direction: vec3(0.6, 0.0, 0.8),
        window: |x| window(x, 1.4, &[0, 1, 2]),
        divergence,
    };
    check(&mist(), &motion("room", "stretch", stretch()), 64 * PIXELS, &field, false);
}
