//! How much radiance jumps at an edge, by side paths (2019 paper, Algorithm 3, in the corrected form of
//! theory sheet §3).

use drt_math::{Rgb, Vec3};

use super::jumps::{Jump, Jumps, Sides};
use crate::transport::flight::Travel;
use crate::transport::{Kind, Radiance, RayPath, Tracer, Vertex};

/// An edge point and a viewer of it.
pub(super) struct Sight<'a> {
    pub(super) jump: &'a Jump,
    along: f64,
    /// The edge point.
    pub(super) x: Vec3,
    /// Unit, to the viewer.
    pub(super) w: Vec3,
    pub(super) distance: f64,
    pub(super) sides: Sides,
    medium: Option<usize>,
    own_faces: [u32; 2],
}

impl<'a> Sight<'a> {
    /// Of the point `along` an edge, from a viewer at `from`; `None` where the edge is seen end on.
    pub(super) fn new(
        tracer: &Tracer<'_>,
        jumps: &Jumps,
        jump: &'a Jump,
        along: f64,
        from: Vec3,
    ) -> Option<Self> {
        let (x, _) = jump.point(along);
        let to = from - x;
        let distance = to.length();
        let w = to / distance;
        let sides = jumps.sides(jump, w)?;
        let own_faces = sides.own_faces()?;
        let medium = jump.medium(tracer.world, &sides, x, w);
        Some(Self { jump, along, x, w, distance, sides, medium, own_faces })
    }

    /// Transmittance to the viewer, if nothing blocks.
    pub(super) fn open(&self, tracer: &mut Tracer<'_>) -> Option<Rgb> {
        let mut ray = core::mem::take(&mut tracer.shadow);
        let Tracer { world, rng, counters, .. } = tracer;
        let open = world.connect_past(
            self.x,
            self.own_faces,
            self.medium,
            self.w,
            self.distance,
            &mut ray,
            counters,
        );
        let tau = open.then(|| world.transmittance(self.x, self.w, &ray, rng, counters));
        tracer.shadow = ray;
        tau.filter(|t| !t.is_zero())
    }

    /// L(-n) - L(n), over at most `longest` segments beyond the edge.
    pub(super) fn difference(&self, tracer: &mut Tracer<'_>, longest: u32) -> Rgb {
        let own = core::mem::replace(&mut tracer.max_segments, longest);
        let [plus, minus] = self.sides.faces;
        let difference = if plus.is_some() && minus.is_some() {
            // Both sides of a crease see much the same: the same numbers for both.
            let numbers = tracer.rng.clone();
            let l = self.side(tracer, minus);
            tracer.rng = numbers;
            l - self.side(tracer, plus)
        } else {
            self.side(tracer, minus) - self.side(tracer, plus)
        };
        tracer.max_segments = own;
        difference
    }

    /// What comes from one side of the edge.
    fn side(&self, tracer: &mut Tracer<'_>, face: Option<(u32, Vec3)>) -> Rgb {
        let mut light = Radiance::default();
        match face {
            Some(face) => {
                let (point, x) = self.jump.beside(tracer.world, self.x, face);
                let vertex = Vertex { x, medium: self.medium, kind: Kind::Surface(point) };
                tracer.radiance_from(vertex, self.w, &mut light);
                light.0
            }
            None => match self.jump.contact(tracer.world, self.along) {
                Some(contact) => {
                    let floor = contact.floor_along(self.sides.outward());
                    if let Some(vertex) = floor {
                        tracer.radiance_from(vertex, self.w, &mut light);
                    }
                    light.0
                }
                None => self.beyond(tracer),
            },
        }
    }

    /// What comes from behind the edge.
    fn beyond(&self, tracer: &mut Tracer<'_>) -> Rgb {
        let mut ray = tracer.ray.take().unwrap_or_default();
        let d = -self.w;
        let (x, faces, medium) = (self.x, self.own_faces, self.medium);
        tracer.world.cast_past(x, faces, medium, d, &mut ray, &mut tracer.counters);
        let travel = tracer.travel(x, d, &ray, Rgb::ONE);
        let after = |ray: &RayPath| ray.crossings.last().map_or(ray.medium, |c| c.after);
        let found = match travel {
            Travel::Volume(v) => Some((v.vertex, v.arrival)),
            Travel::Surface(point, x, arrival) => {
                let vertex = Vertex { x, medium: after(&ray), kind: Kind::Surface(point) };
                Some((vertex, arrival))
            }
            Travel::Escape(arrival) => {
                tracer.ray = Some(ray);
                let sky = tracer.world.lights.environment();
                return sky.map_or(Rgb::ZERO, |(_, l)| l * arrival);
            }
            Travel::Absorbed => None,
        };
        tracer.ray = Some(ray);
        let Some((vertex, arrival)) = found else { return Rgb::ZERO };
        let mut light = Radiance::default();
        tracer.radiance_from(vertex, self.w, &mut light);
        light.0 * arrival
    }
}
