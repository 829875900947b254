//! What [pairs](crate::derivative::antithetic) of rays tell.

use drt_math::{Rgb, RgbVec, Vec3};

use crate::derivative::adjoint::{Differentiator, send, send_material, turn};
use crate::derivative::antithetic::{AntitheticPair, PairKind, PairedRadiance};
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::sensitivity::{AdjointSink, SurfaceAdjoint};
use crate::model::surface::{BsdfParams, Property, Turn};
use crate::sampling::record::Node;
use crate::sampling::trace::{Arrival, Endpoint};
use crate::world::scatter::ScatteringGradient;
use crate::world::vertex::Vertex;

/// The part of the derivative of a value that pairs tell.
pub(super) struct Apart<'a> {
    value: Rgb,
    /// Of its logarithm, by the roughness.
    alpha: f64,
    /// Of its logarithm, by what turns the lobe.
    turn: Option<&'a Turn>,
}

impl<'a> Apart<'a> {
    /// Of the scattering at a node into the ray that left it.
    pub(super) fn of(path: &'a RecordedPath, node: usize) -> Self {
        let paired = path.pairs.paired(node);
        let turn = path.pairs.turn(&paired);
        Self { value: path.record.nodes[node].value, alpha: paired.alpha, turn }
    }

    pub(super) fn take_from(&self, d: &mut ScatteringGradient) {
        let value = self.value;
        if let Some(params) = &mut d.params {
            params.add(Property::Alpha, -value * self.alpha);
            let by_index = self.turn.map_or(0.0, |turn| turn.eta);
            params.add(Property::Eta, -value * by_index);
        }
        if let Some(turn) = self.turn {
            d.wo -= value.outer(turn.wo);
            d.wi -= value.outer(turn.wi);
            d.ns -= value.outer(turn.n);
        }
    }
}

impl Differentiator<'_> {
    /// Sends what a pair tells, which is looked at with a given `chance`. The record is the one that was swept last.
    pub(crate) fn pair<S: AdjointSink>(
        &self,
        path: &RecordedPath<'_>,
        pair: &AntitheticPair,
        chance: f64,
        other: &PairedRadiance,
        sink: &mut S,
    ) {
        let node = &path.record.nodes[pair.node];
        let surface = node.vertex().and_then(Vertex::surface);
        let (Some(arrival), Some(s)) = (&node.arrival, surface) else { return };
        let each = arrival.throughput * (node.inv_pdf * pair.share / chance);
        let [own, others] = [node.value, pair.value].map(|value| each * value);
        let light = [own * self.locals[pair.node].children, others * other.light];
        let params = match &pair.kind {
            PairKind::Roughness(slope) => {
                BsdfParams::of(Property::Alpha, (light[0] - light[1]) * *slope)
            }
            PairKind::Turns(turns) => {
                if sink.active().moves_geometry() {
                    self.turned(path, pair, turns, light, [own, others], other, sink);
                }
                let eta = light[0] * turns[0].eta + light[1] * turns[1].eta;
                BsdfParams::of(Property::Eta, eta)
            }
        };
        let bsdf = self.world.scene.shapes[s.shape as usize].bsdf;
        if sink.active().bsdfs[bsdf] {
            send_material(self.world, s, &params, Rgb::ONE, sink);
        }
    }

    /// Sends what a lobe brings by its `turns` on either side, with so much `light`, each of them so many times what its ray
    /// brings.
    #[allow(clippy::too_many_arguments)]
    fn turned<S: AdjointSink>(
        &self,
        path: &RecordedPath<'_>,
        pair: &AntitheticPair,
        turns: &[Turn; 2],
        light: [Rgb; 2],
        times: [Rgb; 2],
        other: &PairedRadiance,
        sink: &mut S,
    ) {
        let k = pair.node;
        let RecordedPath { record, velocities, .. } = *path;
        let (node, Some(b)) = (&record.nodes[k], self.behind(path, k)) else { return };
        let Some(vertex) = node.vertex() else { return };
        let both =
            |of: fn(&Turn) -> Vec3| light[0].outer(of(&turns[0])) + light[1].outer(of(&turns[1]));
        let mut here = SurfaceAdjoint { ns: both(|t| t.n), ..SurfaceAdjoint::default() };
        let own = |c: &Node| c.arrival.as_ref().is_some_and(|a| a.parent as usize == k);
        for (c, child) in record.nodes.iter().enumerate().skip(k + 1).filter(|(_, c)| own(c)) {
            let Some(end) = &child.arrival else { continue };
            let light = times[0] * self.locals[c].incoming;
            here.u -=
                self.turn_end(end, velocities.of(c).blend.weight, light.outer(turns[0].wi), sink);
        }
        for (end, incoming) in &other.ends {
            let (Endpoint::Surface(v) | Endpoint::Volume(v, _)) = &end.end else { continue };
            let blend = velocities.field().blend(self.world, vertex, v, end.dir, end.distance);
            let light = times[1] * *incoming;
            here.u -= self.turn_end(end, blend.weight, light.outer(turns[1].wi), sink);
        }
        let wo = node.arrival.as_ref().map_or(Vec3::ZERO, |a| -a.dir);
        let to_wo = both(|t| t.wo);
        let g = turn(&(to_wo * b.weight), wo, b.distance);
        self.send_back(path, k, here, -g, RgbVec::ZERO, sink);
        // Only the camera's ray turns by itself.
        let rate = if b.parent == 0 { to_wo * (b.weight - 1.0) } else { RgbVec::ZERO };
        self.send_back(path, b.parent, SurfaceAdjoint::of_place(g), RgbVec::ZERO, rate, sink);
    }

    /// Turns a ray to where it ends, as far as that moves by itself; returns what the other end loses.
    fn turn_end<S: AdjointSink>(
        &self,
        end: &Arrival,
        weight: f64,
        to_wi: RgbVec,
        sink: &mut S,
    ) -> RgbVec {
        let (Endpoint::Surface(vertex) | Endpoint::Volume(vertex, _)) = &end.end else {
            return RgbVec::ZERO;
        };
        let g = turn(&(to_wi * weight), end.dir, end.distance);
        send(vertex, &SurfaceAdjoint::of_place(g), sink);
        g
    }
}
