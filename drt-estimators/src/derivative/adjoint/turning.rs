//! What a ray that [turns](crate::derivative::velocity::RayTurn) owes to the material points that turn it.

use drt_math::{Rgb, RgbVec, Vec3};

use crate::derivative::sensitivity::{AdjointSink, SurfaceAdjoint};
use crate::derivative::velocity::TurnPart;
use crate::world::vertex::Matter;

/// Sends the sensitivity `turned` to the rate of a ray's unit direction `dir`, and a `weight` of light that multiplies the
/// divergence of the rate; returns what the velocity of the ray's origin is to lose.
pub(super) fn send_turn<S: AdjointSink>(
    parts: &[TurnPart],
    dir: Vec3,
    turned: &RgbVec,
    weight: Rgb,
    sink: &mut S,
) -> RgbVec {
    let across = turned.map(|g| g.reject(dir));
    let mut origin = RgbVec::ZERO;
    for part in parts {
        let g = across * part.rate + weight.outer(part.divergence);
        if let Some(point) = part.matter.filter(|p| sink.active().moves(&Matter::Surface(*p))) {
            sink.surface(&point, &SurfaceAdjoint::of_place(g));
        }
        origin += g;
    }
    origin
}
