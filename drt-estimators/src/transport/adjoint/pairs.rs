//! What [pairs](crate::transport::pairs) of rays tell of roughness.

use drt_math::Rgb;

use super::Differentiator;
use crate::sensitivity::AdjointSink;
use crate::surface::BsdfParams;
use crate::transport::pairs::Pair;
use crate::transport::record::PathRecord;
use crate::transport::vertex::Vertex;

impl Differentiator<'_> {
    /// Sends what a pair tells, which is looked at with a given `chance`; `other` is what its other ray brings,
    /// r f' C'. The record is the one that was swept last.
    pub(crate) fn pair<S: AdjointSink>(
        &self,
        record: &PathRecord,
        pair: &Pair,
        chance: f64,
        other: Rgb,
        sink: &mut S,
    ) {
        let node = &record.nodes[pair.node];
        let surface = node.vertex().and_then(Vertex::surface);
        let (Some(arrival), Some(s)) = (&node.arrival, surface) else { return };
        let difference = node.value * self.locals[pair.node].children - other;
        let params = BsdfParams { alpha: Rgb::splat(pair.slope), ..BsdfParams::default() };
        let weight = arrival.throughput * difference * (node.inv_pdf / chance);
        sink.bsdf(self.world.scene.shapes[s.shape as usize].bsdf, &params, weight);
    }
}
