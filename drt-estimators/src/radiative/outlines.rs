//! Edges seen from the camera (2019 paper, Eq. 41, at fixed image points).

use drt_math::Rgb;

use super::Radiative;
use super::difference::Sight;
use crate::boundary::Receiver;
use crate::sensitivity::{Functional, Rate};
use crate::transport::{Kind, Tracer, Vertex};

impl Radiative {
    /// Takes one sample of the camera's edges.
    pub(crate) fn outline<R: Receiver>(
        &self,
        tracer: &mut Tracer<'_>,
        functional: &mut Functional,
        receiver: &mut R,
    ) -> Option<()> {
        tracer.counters.boundary_samples += 1;
        let world = tracer.world;
        let camera = &world.camera;
        let chosen = self.camera.as_ref()?.sample(&self.jumps, &mut tracer.rng);
        let eye = world.eye();
        let sight = Sight::new(tracer, &self.jumps, chosen.jump, chosen.along, eye.x)?;
        let (x, point) = chosen.jump.point(chosen.along);
        let (_, importance) = tracer.see(&Vertex { x, medium: None, kind: Kind::Point })?;
        let n = sight.sides.n;
        // A camera that turns takes its image points with it.
        let mut gradient = camera.direction_gradient(-sight.w, n * -sight.distance);
        gradient.position -= n;
        functional.items.clear();
        functional.items.extend([Rate::Surface(point, n), Rate::Sensor(gradient)]);
        if !receiver.moves(functional) {
            return None;
        }
        let tau = sight.open(tracer)?;
        let difference = sight.difference(tracer, tracer.max_segments.checked_sub(1)?);
        let value: Rgb = tau * difference * (sight.sides.sine * chosen.inv_pdf * importance);
        if value.is_zero() {
            return None;
        }
        let width = camera.film()[0];
        for p in camera.footprint(camera.view(x).pixel) {
            receiver.receive(p.pixel[1] * width + p.pixel[0], value * p.weight);
        }
        Some(())
    }
}
