//! Vertices of a light path, which several connections lead to.
//!
//! A vertex y of a light path scatters light that comes from the vertex before it, y', towards all that it is connected with and
//! towards the next vertex of the light path. What lies behind y is the same for all of these: its value C per unit of
//! scattering, and the sensitivities that it leaves at y. Both are collected once, per unit of what y scatters; what is sent on the way is
//! multiplied by all that y scatters of what comes from the camera. Each one that looks at y has a scattering function of its own,
//! f(x → y → y'), and takes its part, Θ σ f / p, of C and of the sensitivities.

use drt_math::{Rgb, RgbVec};

use crate::derivative::adjoint::{Differentiator, send, turn};
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::sensitivity::{AdjointSink, SurfaceAdjoint};
use crate::sampling::trace::Endpoint;

impl Differentiator<'_> {
    /// Sends what the last record's value owes to the column (0) or row (1) of the image point of the one vertex that
    /// its camera sees.
    pub(crate) fn image_point<S: AdjointSink>(
        &mut self,
        path: &RecordedPath<'_>,
        axis: usize,
        sink: &mut S,
    ) {
        let RecordedPath { record, velocities, .. } = *path;
        let [camera, seen, ..] = &record.nodes[..] else { return };
        let (Some(arrival), Some(vertex)) = (&seen.arrival, seen.vertex()) else { return };
        self.filter = [0.0; 2];
        self.filter[axis] = 1.0;
        let value = self.locals[1].incoming * camera.value;
        let phi = velocities.of(1).blend.weight;
        self.sensor = Default::default();
        let active = sink.active();
        let place = self.seen(Some(vertex), arrival.dir, value, Rgb::ZERO, phi, active);
        send(vertex, &SurfaceAdjoint::of_place(place * phi), sink);
        let mut origin = RgbVec::ZERO;
        if let Some(ray) = path.ray_motion(velocities.of(1).turn) {
            let (share, active) = (ray.turn.weight, sink.active());
            let place = self.seen(None, arrival.dir, value, Rgb::ZERO, share, active);
            origin -= ray.send(arrival.dir, &place, Rgb::ZERO, sink);
        }
        let sensor = self.sensor;
        self.camera_ray(record, origin, RgbVec::ZERO, &sensor, sink);
    }

    /// Node `k` being a vertex of a light path as something sees it: what its scattering collects from behind, and the
    /// sensitivities there. `ends` is what nodes have collected.
    pub(super) fn behind_joint<S: AdjointSink>(
        &mut self,
        path: &RecordedPath<'_>,
        k: usize,
        ends: &mut [SurfaceAdjoint],
        sink: &mut S,
    ) -> (Rgb, SurfaceAdjoint) {
        let nothing = (Rgb::ZERO, SurfaceAdjoint::default());
        let RecordedPath { record, velocities, .. } = *path;
        let node = &record.nodes[k];
        let own = record.of_light(node.light);
        let next = node.light.checked_sub(1).and_then(|v| record.of_light(v));
        // The first vertex is connected to an emitter alone.
        let (Some(own), Some(next), Some(arrival)) = (own, next, &node.arrival) else {
            return nothing;
        };
        let (Endpoint::Surface(vertex) | Endpoint::Volume(vertex, _)) = &arrival.end else {
            return nothing;
        };
        let theta = arrival.throughput * arrival.end.sigma_s();
        let children = self.locals[own].children;
        let passes = theta * (node.value * node.inv_pdf);
        let mut here = ends[own].times(passes);
        let adjoint = theta * node.inv_pdf * children;
        let moving = [k, next, arrival.parent as usize].iter().any(|n| velocities.moves(*n));
        let (wo, wi, behind) = (-arrival.dir, node.wi, self.behind(path, k));
        let to_wi =
            self.scattering(vertex, wo, wi, None, adjoint, behind, moving, &mut here, ends, sink);
        let end = record.nodes[next].arrival.as_ref();
        if let (Some(to_wi), Some(end), Some(v)) = (to_wi, end, record.nodes[next].vertex()) {
            let phi = velocities.of(next).blend.weight;
            let g = turn(&(to_wi * phi), wi, end.distance);
            here.u -= g;
            send(v, &SurfaceAdjoint::of_place(g), sink);
            if let Some(ray) = path.ray_motion(velocities.of(next).turn)
                && !self.edges_at_rest
            {
                here.u -= ray.send(wi, &to_wi, Rgb::ZERO, sink);
            }
        }
        (node.value * node.inv_pdf * children, here)
    }
}
