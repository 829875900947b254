//! Edges seen from the camera (2019 paper, Eq. 41, at fixed image points).

use drt_math::Rgb;

use crate::derivative::sensitivity::{VelocityFunctional, VelocityTerm};
use crate::sampling::importance::see;
use crate::sampling::trace::Tracer;
use crate::terms::boundary_segments::BoundarySink;
use crate::terms::edge_queries::SeenEdges;
use crate::terms::edge_queries::difference::{EdgeView, SideRadiance};
use crate::world::vertex::{Kind, Vertex};

impl SeenEdges {
    /// Takes one sample of the camera's edges.
    pub(crate) fn primary_edge<R: BoundarySink>(
        &self,
        tracer: &mut Tracer<'_>,
        functional: &mut VelocityFunctional,
        receiver: &mut R,
    ) -> Option<()> {
        tracer.counters.boundary_samples += 1;
        let world = tracer.world;
        let chosen = self.camera.as_ref()?.sample(&self.discontinuities, &mut tracer.rng);
        let lens = world.camera.draw_lens(&mut tracer.rng);
        let camera = &*world.camera.at_lens(lens);
        let edge = &chosen.discontinuity.edge;
        let x = edge.wedge.at(chosen.along);
        let eye = world.eye_at(camera.eye_of(x));
        let view = EdgeView::new(tracer, self, chosen.discontinuity, chosen.along, &eye)?;
        let (_, importance) = see(camera, &Vertex { x, medium: None, kind: Kind::Point })?;
        let tau = view.open(tracer)?;
        let [minus, plus] = view.sides(tracer, tracer.max_segments.checked_sub(1)?);
        let weight = tau * (view.sides.sine * chosen.inv_pdf * importance);
        let [minus_light, plus_light] = [weight * minus.light, weight * -plus.light];
        // What has a blend weight moves in view by itself.
        let n = view.sides.n;
        let mut terms = edge.velocity_terms(world, chosen.along, n);
        let edge = [terms.next(), terms.next()];
        let held = [minus_light * -minus.blend, plus_light * -plus.blend];
        let of = |side: &SideRadiance| [side.matter.map(|m| VelocityTerm::of(m, n)), None];
        let nothing = (edge, view.distance, Rgb::ZERO, true);
        // Both sides of a crease move with it, and what they tell cancels where it shows none.
        let [plus_face, minus_face] = view.sides.faces.map(|face| face.is_some());
        let is_crease = plus_face
            && minus_face
            && self.discontinuities.is_of_one_mesh(world, chosen.discontinuity);
        let sides = match is_crease {
            true => [(edge, view.distance, held[0] + held[1], true), nothing],
            false => [
                (of(&minus), minus.distance, held[0], true),
                (of(&plus), plus.distance, held[1], true),
            ],
        };
        let parts = [(edge, view.distance, minus_light + plus_light, false), sides[0], sides[1]];
        let width = camera.film()[0];
        let image_point = camera.view(x).pixel;
        for (matter, distance, value, held) in parts {
            // A camera that turns takes its image points with it.
            let gradient = camera.ray_gradient(eye.x, -view.w, -n, n * -distance);
            let gradient = world.camera.lens_gradient(lens, gradient);
            functional.items.clear();
            functional.items.extend(matter.into_iter().flatten());
            functional.items.push(VelocityTerm::Sensor(gradient));
            if value.is_zero() || !receiver.moves(functional) {
                continue;
            }
            for p in camera.footprint(image_point) {
                let share = if held { camera.window(p.pixel, image_point).0 } else { 1.0 };
                receiver.receive(p.pixel[1] * width + p.pixel[0], value * (p.weight * share));
            }
        }
        Some(())
    }
}
