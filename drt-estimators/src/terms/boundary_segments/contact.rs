//! Boundary segments of edges that [rest](crate::discontinuities::contact) on a surface, and of lines along which surfaces
//! [intersect](crate::discontinuities::intersection).

use core::f64::consts::PI;

use drt_math::{Frame, Rgb, Vec3, warp};

use super::{BoundarySink, End, Sampler, Start, seen};
use crate::discontinuities::contact::{Contact, Quadrant};
use crate::discontinuities::edge::EdgePoint;
use crate::discontinuities::intersection_faces::Sheets;
use crate::model::sensor::Sensor;
use crate::world::SurroundingMedium;

impl<R: BoundarySink> Sampler<'_, '_, R> {
    /// The camera sees the floor next to the edge.
    pub(super) fn contact_with_camera(
        &mut self,
        camera: &Sensor,
        at: &EdgePoint<'_>,
        c: &Contact,
    ) -> Option<()> {
        let world = self.tracer.world;
        let (w, distance) = c.towards(|x| camera.eye_of(x))?;
        let over = c.two_sided && w.dot(c.up) < 0.0;
        let c = &if over { c.turned_over(world) } else { *c };
        let (s, start) = self.contact(at, c, w)?;
        let transport = seen(camera, &start)?;
        let tau = self.open(&start, w, distance)?;
        if !self.receiver.moves(&self.b.functional) {
            return None;
        }
        let light = self.light_from(&s, w, world.max_depth.checked_sub(1)?);
        let cosine = w.dot(c.up);
        self.show(camera, start.x, light * tau * (cosine * at.inv_pdf * transport));
        Some(())
    }

    /// The camera sees a line along which surfaces intersect, from between two of the faces.
    pub(super) fn intersection_with_camera(
        &mut self,
        camera: &Sensor,
        at: &EdgePoint<'_>,
        sheets: &Sheets,
    ) -> Option<()> {
        let w = camera.eye_of(at.x) - at.x;
        let quadrant = |k| Quadrant::new(at.edge.wedge.tangent, sheets, k, w);
        let mut beside = (0..sheets.len()).map(quadrant).filter(|q| q.contains(w));
        let [first, second] = [beside.next(), beside.next()];
        let chance = if second.is_some() { 0.5 } else { 1.0 };
        let chosen = if self.tracer.rng.next_f64() < chance { first? } else { second? };
        let contact = Contact::of_intersection(self.tracer.world, at, &chosen);
        let at = EdgePoint { inv_pdf: at.inv_pdf / chance, ..*at };
        self.contact_with_camera(camera, &at, &contact)
    }

    /// Another vertex sees it, from either side of any of the faces.
    pub(super) fn intersection_with_others(
        &mut self,
        at: &EdgePoint<'_>,
        sheets: &Sheets,
    ) -> Option<()> {
        let sides = 2 * sheets.len();
        let u = self.tracer.rng.next_f64() * sides as f64;
        let side = usize::min(u as usize, sides - 1);
        let tangent = at.edge.wedge.tangent;
        let normal = sheets[side / 2].1.cross(tangent);
        let towards = if side.is_multiple_of(2) { normal } else { -normal };
        let chosen = Quadrant::new(tangent, sheets, side / 2, towards);
        let contact = Contact::of_intersection(self.tracer.world, at, &chosen);
        let at = EdgePoint { inv_pdf: at.inv_pdf * sides as f64, ..*at };
        self.contact_with_others(&at, &contact)
    }

    /// Another vertex sees the floor.
    pub(super) fn contact_with_others(&mut self, at: &EdgePoint<'_>, c: &Contact) -> Option<()> {
        let world = self.tracer.world;
        let over = c.two_sided && self.tracer.rng.next_f64() < 0.5;
        let c = &if over { c.turned_over(world) } else { *c };
        let sides = if c.two_sided { 2.0 } else { 1.0 };
        let u = self.tracer.rng.next_2d();
        let w = Frame::from_normal(c.up).to_world(warp::cosine_hemisphere(u));
        let (s, start) = self.contact(at, c, w)?;
        if !self.receiver.moves(&self.b.functional) {
            return None;
        }
        let beyond = self.beyond(&start, w, Rgb::ONE);
        self.light_from(&s, w, world.max_depth.checked_sub(2)?);
        for (d, only_camera) in beyond.into_iter().flatten() {
            // The density of w is cos θ / π. What the floor emits no shadow in a medium has: of a point of its plane the edge's
            // is that plane.
            self.deliver(&d, only_camera, false, w, Rgb::splat(PI * at.inv_pdf * sides));
        }
        Some(())
    }

    /// The floor as the source end of a segment along `w`, where that starts, and how it moves.
    fn contact(&mut self, at: &EdgePoint<'_>, c: &Contact, w: Vec3) -> Option<(End, Start)> {
        let (vertex, outward) = c.beside(w)?;
        let prim = vertex.surface()?.prim;
        let start = Start {
            x: vertex.x,
            faces: [prim, prim],
            medium: SurroundingMedium::Uniform(vertex.medium),
        };
        let s = End { vertex: Some(vertex), distance: 0.0, weight: Rgb::ONE, flight: None };
        self.b.functional.items.clear();
        self.edge_rate(at, -outward);
        self.end_rate(&s, outward);
        Some((s, start))
    }
}
