//! Boundary segments of edges that [rest](crate::discontinuities::contact) on a surface, and of lines along which surfaces [pass
//! through](crate::discontinuities::crossing) each other.

use core::f64::consts::PI;

use drt_math::{Frame, Rgb, Vec3, warp};

use super::{BoundarySink, End, Sampler, Start, seen};
use crate::discontinuities::contact::Contact;
use crate::discontinuities::crossed::Sheets;
use crate::discontinuities::edge::EdgePoint;
use crate::model::sensor::Sensor;

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

    /// The camera sees a line along which surfaces pass through each other.
    pub(super) fn crossing_with_camera(
        &mut self,
        camera: &Sensor,
        at: &EdgePoint<'_>,
        sheets: &Sheets,
    ) -> Option<()> {
        let w = camera.eye_of(at.x) - at.x;
        let contact = |k| Contact::at_crossing(self.tracer.world, at, sheets, k, w);
        // The camera is between two of the faces.
        let [first, second] = {
            let mut seen = (0..sheets.len()).map(contact).filter(|c| c.beside(w).is_some());
            [seen.next(), seen.next()]
        };
        let chance = if second.is_some() { 0.5 } else { 1.0 };
        let chosen = if self.tracer.rng.next_f64() < chance { first? } else { second? };
        let at = EdgePoint { inv_pdf: at.inv_pdf / chance, ..*at };
        self.contact_with_camera(camera, &at, &chosen)
    }

    /// Another vertex sees it.
    pub(super) fn crossing_with_others(
        &mut self,
        at: &EdgePoint<'_>,
        sheets: &Sheets,
    ) -> Option<()> {
        // Either side of any of the faces.
        let sides = 2 * sheets.len();
        let u = self.tracer.rng.next_f64() * sides as f64;
        let side = usize::min(u as usize, sides - 1);
        let (_, across) = sheets[side / 2];
        let normal = across.cross(at.edge.wedge.tangent);
        let towards = if side.is_multiple_of(2) { normal } else { -normal };
        let contact = Contact::at_crossing(self.tracer.world, at, sheets, side / 2, towards);
        let at = EdgePoint { inv_pdf: at.inv_pdf * sides as f64, ..*at };
        self.contact_with_others(&at, &contact)
    }

    /// Another vertex sees the floor.
    pub(super) fn contact_with_others(&mut self, at: &EdgePoint<'_>, c: &Contact) -> Option<()> {
        let world = self.tracer.world;
        let u = self.tracer.rng.next_2d();
        let w = Frame::from_normal(c.up).to_world(warp::cosine_hemisphere(u));
        let (s, start) = self.contact(at, c, w)?;
        if !self.receiver.moves(&self.b.functional) {
            return None;
        }
        let beyond = self.beyond(&start, w, Rgb::ONE);
        self.light_from(&s, w, world.max_depth.checked_sub(2)?);
        // Of lines where surfaces pass through each other nothing is left to shadows in media.
        let emits = !at.edge.is_crossing();
        for (d, only_camera) in beyond.into_iter().flatten() {
            // The density of w is cos θ / π.
            self.deliver(&d, only_camera, emits, w, Rgb::splat(PI * at.inv_pdf));
        }
        Some(())
    }

    /// The floor as the source end of a segment along `w`, where that starts, and how it moves.
    fn contact(&mut self, at: &EdgePoint<'_>, c: &Contact, w: Vec3) -> Option<(End, Start)> {
        let (vertex, outward) = c.beside(w)?;
        let prim = vertex.surface()?.prim;
        let start = Start { x: vertex.x, faces: [prim, prim], medium: vertex.medium };
        let s = End { vertex: Some(vertex), distance: 0.0, weight: Rgb::ONE, flight: None };
        self.b.functional.items.clear();
        self.edge_rate(at, -outward);
        self.end_rate(&s, outward);
        Some((s, start))
    }
}
