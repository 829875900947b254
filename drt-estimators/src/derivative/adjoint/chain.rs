//! Directions that smooth surfaces single out.
//!
//! A ray that arrives at a smooth surface along w goes on in a direction w' = s(w, n) ([`Bend`](crate::model::surface::Bend)): no
//! integration variable, but a function of the ray before and of the normal. So it has a rate,
//!
//! ```text
//! w'_dot = s_w w_dot + s_n n_dot,
//! ```
//!
//! and what is found behind the surface moves with it (theory sheet §15). Backwards, what a ray's direction is owed goes to the
//! direction of the ray before, and to the normal, by the transposes of s_w and s_n; an index of refraction that changes is owed
//! its part likewise. A chain of such surfaces passes one vector on
//! from vertex to vertex, up to the ray that started it. The value of the scattering, which is Fresnel's factor and those of the
//! material, depends on the cosine n·wo as well.

use drt_math::{Rgb, RgbVec, Vec3};

use crate::derivative::adjoint::{Differentiator, send_material};
use crate::derivative::sensitivity::{AdjointSink, SurfaceAdjoint};
use crate::model::surface::{BsdfParams, LocalBsdf, Property, SpecularValue};
use crate::sampling::record::Node;
use crate::world::World;
use crate::world::scatter::Scattering;
use crate::world::vertex::SurfacePoint;

/// A vertex that a walk left in a single direction.
pub(super) struct Single<'a> {
    bsdf: LocalBsdf<'a>,
    point: &'a SurfacePoint,
    /// Unit, to where light leaves to.
    wo: Vec3,
    /// Unit, to where it comes from.
    wi: Vec3,
    found: SpecularValue,
}

impl<'a> Single<'a> {
    /// `None` of other vertices.
    pub(super) fn at(world: &'a World, node: &'a Node) -> Option<Self> {
        if !node.single {
            return None;
        }
        let (vertex, arrival) = (node.vertex()?, node.arrival.as_ref()?);
        let Some(Scattering::Surface(bsdf)) = world.scattering(vertex) else { return None };
        let (wo, wi) = (-arrival.dir, node.wi);
        let found = bsdf.specular(wo, wi)?;
        Some(Self { bsdf, point: vertex.surface()?, wo, wi, found })
    }

    /// Sensitivities to `wo` and to the shading normal, from those to the direction in which the walk left. What the index of
    /// refraction is owed goes to the `sink`.
    pub(super) fn pull<S: AdjointSink>(
        &self,
        world: &World,
        onward: RgbVec,
        sink: &mut S,
    ) -> (RgbVec, RgbVec) {
        let (by_w, by_n, by_index) = self.found.bend.pull(-self.wo, self.bsdf.normal(), onward);
        send_index(world.scene.shapes[self.point.shape as usize].bsdf, by_index, sink);
        (-by_w, by_n)
    }
}

/// Sends what is owed to the index of refraction of a BSDF, as it turns light.
pub(super) fn send_index<S: AdjointSink>(bsdf: usize, adjoint: Rgb, sink: &mut S) {
    if sink.active().bending[bsdf] {
        sink.bsdf(bsdf, &BsdfParams::of(Property::Eta, Rgb::ONE), adjoint);
    }
}

impl Differentiator<'_> {
    /// Sends what is owed at a node that the walk left in a single direction: `onward` to the rate of that, and an `adjoint` that
    /// multiplies the value of the scattering. Unless something of this is `moving`, only the material counts.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn bend<S: AdjointSink>(
        &mut self,
        single: &Single<'_>,
        node: usize,
        parent: usize,
        onward: RgbVec,
        adjoint: Rgb,
        moving: bool,
        there: &mut SurfaceAdjoint,
        sink: &mut S,
    ) {
        let Single { bsdf, point, wo, wi, found } = single;
        let shape = &self.world.scene.shapes[point.shape as usize];
        if sink.active().bsdfs[shape.bsdf] {
            send_material(self.world, point, &found.params, adjoint, sink);
        }
        if !moving {
            return;
        }
        let by_cosine = found.by_cosine * adjoint;
        let (to_wo, by_n) = single.pull(self.world, onward, sink);
        let to_wo = to_wo + by_cosine.outer(bsdf.normal());
        there.ns += by_n + by_cosine.outer(*wo);
        there.slide += bsdf.slide(*wo, *wi, &found.params) * adjoint;
        self.locals[node].turn -= to_wo;
        // The camera's ray turns by itself.
        if parent == 0 {
            self.turn -= to_wo;
        }
    }
}
