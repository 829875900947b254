//! Images from both ends are those from one, and what is wrong with weights is found.

use alloc::vec::Vec;

use drt_math::stats::Moments;
use drt_math::{Rgb, Rng};

use super::*;
use crate::derivative::tests::scenes::*;
use crate::model::scene::Scene;
use crate::model::sensor::Aperture;
use crate::sampling::record::Radiance;
use crate::world::cache::PreparedCache;
use crate::world::lights::EmitterMask;

/// What is wrong with strategies or their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// Vertices are not connected.
    NoConnections,
    /// The camera is connected to nothing.
    NoSplats,
    /// Weights leave out the strategies that connect an earlier segment than the last one.
    NoEarlier,
    /// Light paths are connected to the middle of the lens.
    OneEye,
}

const SAMPLES: u32 = 400;

impl<'w> Bidirectional<'w> {
    /// A sample as by [`trace`](Bidirectional::trace), with a fault.
    fn trace_with(
        &mut self,
        fault: Option<Fault>,
        tracer: &mut Tracer<'w>,
        view: &ViewSample,
        filter: Rgb,
        splats: &mut Vec<Splat>,
    ) -> Rgb {
        let radiance = &mut Radiance::default();
        self.trace_camera(tracer, view, filter, radiance);
        self.trace_light::<Radiance>(tracer);
        match fault {
            // No connection is made between vertices that are too many segments from both ends.
            Some(Fault::NoConnections) => {
                self.light.vertices.iter_mut().for_each(|v| v.segments = tracer.max_segments);
            }
            Some(Fault::NoEarlier) => {
                let all = self.camera.vertices.iter_mut().chain(&mut self.light.vertices);
                all.for_each(|v| v.ratios.earlier = 0.0);
            }
            _ => {}
        }
        let value = self.join(tracer, view, splats, radiance);
        if fault == Some(Fault::NoSplats) {
            splats.clear();
        }
        value
    }
}

/// The light of an image, by columns that gain and lose.
fn light(scene: &Scene, fault: Option<Fault>, both: bool) -> Moments {
    let mut kept = PreparedCache::default();
    let world = World::new(scene.clone(), 0, Some(4), None, EmitterMask::All, &mut kept);
    let world = world.expect("a valid scene");
    let camera = &world.camera;
    let emission = EmissionSampler::new(&world);
    let mut from_both = Bidirectional::new(&world, &emission);
    let mut moments = Moments::default();
    let mut splats = Vec::new();
    let [width, height] = camera.film();
    let weight = |x: u32| 1.0 + f64::from(x);
    for seed in 0..32 {
        let mut tracer = Tracer::new(&world);
        let mut sum = 0.0;
        for pixel in 0..width * height {
            for unit in 0..SAMPLES {
                tracer.rng = Rng::new(seed, u64::from(pixel), unit);
                let u = tracer.rng.next_2d();
                let lens = camera.draw_lens(&mut tracer.rng);
                let mut s = camera.at_lens(lens).sample_square(pixel, u);
                s.lens = if fault == Some(Fault::OneEye) { [0.0; 2] } else { lens };
                let filter = Rgb::splat(s.weight);
                splats.clear();
                let value = if both {
                    from_both.trace_with(fault, &mut tracer, &s, filter, &mut splats)
                } else {
                    let mut radiance = Radiance::default();
                    tracer.trace_camera(&s, filter, &mut radiance);
                    radiance.0
                };
                splats.push(Splat {
                    point: s.point,
                    value,
                    weight: s.weight,
                    density: SplatDensity::Known,
                });
                for splat in &splats {
                    for p in camera.footprint(splat.point) {
                        sum += weight(p.pixel[0]) * p.weight * splat.value.mean();
                    }
                }
            }
        }
        moments.push(sum / f64::from(SAMPLES));
    }
    moments
}

fn compare(scene: &Scene, faults: &[Fault]) {
    let reference = light(scene, None, false);
    let off = |fault| {
        let own = light(scene, fault, true);
        let error = f64::sqrt(own.variance_of_mean() + reference.variance_of_mean());
        ((own.mean() - reference.mean()) / error, error / reference.mean())
    };
    let fair = off(None);
    assert!(fair.0.abs() < 4.0 && fair.1 < 0.01, "{fair:?}");
    for fault in faults {
        let faulty = off(Some(*fault));
        assert!(faulty.0.abs() > 5.0, "{fault:?} {faulty:?}");
    }
}

#[test]
fn surfaces_under_every_light() {
    let scene = surfaces(phong(), diffuse(0.6, 0.5, 0.7));
    compare(&scene, &[Fault::NoSplats, Fault::NoEarlier]);
}

#[test]
fn fog_under_every_light() {
    compare(&fog(), &[Fault::NoConnections, Fault::NoSplats, Fault::NoEarlier]);
}

#[test]
fn lenses() {
    let mut scene = surfaces(phong(), diffuse(0.6, 0.5, 0.7));
    let sensor = &mut scene.sensors[0].item.sensor;
    let aperture = Aperture { radius: 0.5, focus_distance: 1.0 };
    *sensor = sensor.clone().with_aperture(aperture).expect("a lens");
    compare(&scene, &[Fault::NoSplats, Fault::OneEye]);
}
