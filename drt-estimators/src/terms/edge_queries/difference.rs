//! How much radiance jumps at an edge, by side paths (2019 paper, Algorithm 3, in the corrected form of
//! theory sheet §3).

use drt_geom::edges::EdgeSides;
use drt_math::{Ray, Rgb, Vec3};

use crate::derivative::velocity::blend::Blends;
use crate::discontinuities::contact::Contact;
use crate::discontinuities::discontinuity_edge::DiscontinuityEdge;
use crate::sampling::record::Radiance;
use crate::sampling::trace::Tracer;
use crate::terms::edge_queries::SeenEdges;
use crate::world::vertex::{Kind, Matter, Vertex};

/// An edge point and a viewer of it.
pub(super) struct EdgeView<'a> {
    pub(super) discontinuity: &'a DiscontinuityEdge,
    /// The edge point.
    pub(super) x: Vec3,
    /// Unit, to the viewer.
    pub(super) w: Vec3,
    pub(super) distance: f64,
    pub(super) sides: EdgeSides,
    medium: Option<usize>,
    own_faces: [u32; 2],
    /// What the edge rests on there.
    contact: Option<Contact>,
    viewer: &'a Vertex,
    blends: &'a Blends,
}

/// What is seen on one side of an edge.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SideRadiance {
    pub(super) light: Rgb,
    /// How much of the velocity of what is seen its place in view has: the share of its
    /// [blend](crate::derivative::velocity::blend), over its distance in those of the edge.
    pub(super) blend: f64,
    /// The distance of what is seen.
    pub(super) distance: f64,
    /// What is seen; `None` for what stands still.
    pub(super) matter: Option<Matter>,
}

impl<'a> EdgeView<'a> {
    /// Of the point `along` an edge, from a viewer; `None` where the edge is seen end on.
    pub(super) fn new(
        tracer: &Tracer<'_>,
        radiative: &'a SeenEdges,
        discontinuity: &'a DiscontinuityEdge,
        along: f64,
        viewer: &'a Vertex,
    ) -> Option<Self> {
        let x = discontinuity.edge.wedge.at(along);
        let to = viewer.x - x;
        let distance = to.length();
        let w = to / distance;
        let SeenEdges { discontinuities, spatial, .. } = radiative;
        let sides = discontinuities.sides(discontinuity, w)?;
        let own_faces = sides.own_faces()?;
        let medium = discontinuity.medium(tracer.world, &sides, x, w, w);
        Some(Self {
            discontinuity,
            x,
            w,
            distance,
            sides,
            medium,
            own_faces,
            contact: discontinuity.contact(tracer.world, along),
            viewer,
            blends: &spatial.blends,
        })
    }

    /// Transmittance to the viewer, if nothing blocks. By rounding, an edge that rests on a surface may lie under it.
    pub(super) fn open(&self, tracer: &mut Tracer<'_>) -> Option<Rgb> {
        let edge = &self.discontinuity.edge;
        let off_the_floor = |contact: &Contact| contact.off_the_floor(edge, self.x, self.w);
        let x = self.contact.as_ref().map_or(self.x, off_the_floor);
        let to = self.viewer.x - x;
        let distance = to.length();
        let w = to / distance;
        let mut ray = core::mem::take(&mut tracer.shadow);
        let Tracer { world, rng, counters, .. } = tracer;
        let faces = self.own_faces;
        let open = world.connect_past(x, faces, self.medium, w, distance, &mut ray, counters);
        let tau = open.then(|| world.transmittance(&Ray::new(x, w), &ray, rng, counters));
        tracer.shadow = ray;
        tau.filter(|t| !t.is_zero())
    }

    /// What is seen on the sides of -n and n, over at most `longest` segments beyond the edge.
    pub(super) fn sides(&self, tracer: &mut Tracer<'_>, longest: u32) -> [SideRadiance; 2] {
        let own = core::mem::replace(&mut tracer.max_segments, longest);
        let [plus, minus] = self.sides.faces;
        let numbers = tracer.rng.clone();
        let first = self.side(tracer, minus);
        if plus.is_some() && minus.is_some() {
            // Both sides of a crease see much the same: the same numbers for both.
            tracer.rng = numbers;
        }
        let second = self.side(tracer, plus);
        tracer.max_segments = own;
        [first, second]
    }

    /// What comes from one side of the edge.
    fn side(&self, tracer: &mut Tracer<'_>, face: Option<(u32, Vec3)>) -> SideRadiance {
        match face {
            Some(face) => {
                let (point, x) = self.discontinuity.beside(tracer.world, self.x, face);
                let vertex = Vertex { x, medium: self.medium, kind: Kind::Surface(point) };
                self.from(tracer, vertex, self.distance)
            }
            None => match &self.contact {
                Some(contact) => {
                    let floor = contact.floor_along(self.sides.outward());
                    floor
                        .map_or_else(SideRadiance::default, |v| self.from(tracer, v, self.distance))
                }
                None => self.beyond(tracer),
            },
        }
    }

    /// What leaves a vertex, at a `distance` from the viewer.
    fn from(&self, tracer: &mut Tracer<'_>, vertex: Vertex, distance: f64) -> SideRadiance {
        let mut light = Radiance::default();
        tracer.radiance_from(vertex, self.w, &mut light);
        let world = tracer.world;
        let blend = match self.viewer.kind {
            Kind::Point => self.blends.in_view(world, &vertex, -self.w, distance),
            _ => self.blends.of(world, self.viewer, &vertex, -self.w, distance),
        };
        let blend = blend.weight * self.distance / distance;
        SideRadiance { light: light.0, blend, distance, matter: vertex.matter() }
    }

    /// What comes from behind the edge.
    fn beyond(&self, tracer: &mut Tracer<'_>) -> SideRadiance {
        let mut ray = tracer.ray.take().unwrap_or_default();
        let d = -self.w;
        let (x, faces) = (self.x, self.own_faces);
        let medium = self.discontinuity.medium(tracer.world, &self.sides, x, self.w, d);
        tracer.world.cast_past(x, faces, medium, d, &mut ray, &mut tracer.counters);
        let end = tracer.travel(x, d, &ray, Rgb::ONE).end();
        tracer.ray = Some(ray);
        let Some((end, arrival)) = end else { return SideRadiance::default() };
        let Some(vertex) = end else {
            let sky = tracer.world.lights.environment();
            let light = sky.map_or(Rgb::ZERO, |sky| sky.radiance(d) * arrival);
            return SideRadiance { light, ..SideRadiance::default() };
        };
        let side = self.from(tracer, vertex, self.distance + (vertex.x - x).length());
        SideRadiance { light: side.light * arrival, ..side }
    }
}
