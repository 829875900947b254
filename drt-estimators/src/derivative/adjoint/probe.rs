//! A point of a path's segment that stands for volume vertices where free flight puts none.

use drt_math::{Ray, Rgb, Vec3};
use drt_medium::DepthEstimate;

use crate::derivative::adjoint::segment::{Along, Stretch};
use crate::derivative::adjoint::{Differentiator, by_coefficients, lit_by};
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::sensitivity::{AdjointSink, SurfaceAdjoint};
use crate::sampling::trace::Endpoint;
use crate::world::vertex::Vertex;

impl Differentiator<'_> {
    /// Sends what the extinction at a probe owes: the part of it that vertices leave over. No light of the path passes the
    /// probe, so that its place matters only as far as the extinction varies.
    pub(super) fn probed<S: AdjointSink>(
        &mut self,
        path: &RecordedPath<'_>,
        k: usize,
        ends: &mut [SurfaceAdjoint],
        sink: &mut S,
    ) {
        let RecordedPath { record, lit, probed: Some(collected), .. } = *path else { return };
        let Some(arrival) = &record.nodes[k].arrival else { return };
        let Endpoint::Volume(vertex, c) = &arrival.end else { return };
        let Some((here, before)) = ends[..=k].split_last_mut() else { return };
        let c = &lit_by(lit, c);
        let share = 1.0 - self.world.share_of_vertices(vertex, c);
        let (theta, area) = (arrival.throughput * share, self.area_along(vertex, arrival.dir));
        let adjoint = by_coefficients(c, lit, theta, collected, 1.0, area);
        self.coefficients(vertex, &adjoint, path.velocities.moves(k), here, sink);
        let control = arrival.throughput * path.control(k) * share;
        self.control_at(vertex, arrival.dir, control, sink);
        self.arrive(path, k, &path.motion(k), Rgb::ZERO, Rgb::ZERO, here, before, sink);
    }
}

impl Differentiator<'_> {
    /// Takes the control radiance, times its throughput, off what the extinction along `dir` at a place owes.
    pub(super) fn control_at<S: AdjointSink>(
        &self,
        vertex: &Vertex,
        dir: Vec3,
        control: Rgb,
        sink: &mut S,
    ) {
        let Some(m) = vertex.medium.filter(|m| self.world.probed[*m].is_some()) else { return };
        if control.is_zero() || !sink.active().media[m] {
            return;
        }
        let medium = self.world.medium(m);
        let ray = Ray::new(vertex.x, dir).until(0.0);
        let point = DepthEstimate::inside(medium, ray, &[(0.0, 1.0)], false).at_rest();
        sink.depth(m, &point, -control);
    }

    /// Gives the control radiance of a node's segment to its line integrals, if nothing else has asked for these.
    pub(super) fn control_alone<S: AdjointSink>(
        &mut self,
        path: &RecordedPath<'_>,
        k: usize,
        sink: &mut S,
    ) {
        if self.control.is_zero() {
            return;
        }
        let record = path.record;
        let node = &record.nodes[k];
        let Some(arrival) = &node.arrival else { return };
        let start = record.nodes[arrival.parent as usize].vertex().map_or(record.origin, |v| v.x);
        let stretch = Stretch {
            start,
            dir: arrival.dir,
            length: arrival.distance,
            medium: arrival.start_medium,
            crossings: &record.crossings[node.crossings.clone()],
        };
        self.transmittance(&stretch, false, Rgb::ZERO, &mut Along::default(), sink);
    }
}
