//! Which edges can matter: those that move, and those that something passes in moving.
//!
//! A boundary segment's rate is that of the edge against the segment's two ends. At an edge at rest
//! it vanishes unless an end moves, so an edge at rest counts only where a segment that grazes it can
//! end on what moves. Whatever is in between is not asked: a moving surface counts by the box
//! around it, wherever it is, and all tests err towards keeping.

use alloc::vec::Vec;

use drt_geom::Aabb;
use drt_math::Vec3;

use crate::derivative::sensitivity::ActiveInputs;
use crate::discontinuities::edge::Edge;
use crate::model::sensor::{Sensor, Viewpoint};
use crate::world::World;

/// Boxes that are kept apart; more become one around all.
const MOST_BOXES: usize = 64;

/// What moves in a scene.
pub(crate) struct Movers<'a> {
    active: &'a ActiveInputs,
    /// Around each surface that moves.
    boxes: Vec<Aabb>,
    /// Some medium's inside moves: segments can end on it anywhere.
    insides: bool,
}

impl<'a> Movers<'a> {
    pub(crate) fn new(world: &World, active: &'a ActiveInputs) -> Self {
        let shapes = world.scene.shapes.iter().zip(&active.shapes);
        let boxes: Vec<_> =
            shapes.filter(|(_, moves)| **moves).map(|(s, _)| s.mesh.bounds()).collect();
        let boxes = if boxes.len() > MOST_BOXES {
            alloc::vec![boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(b))]
        } else {
            boxes
        };
        Self { active, boxes, insides: active.volumes.contains(&true) }
    }

    /// True when visibility past an edge can change at all.
    pub(crate) fn matter_to(&self, e: &Edge) -> bool {
        if e.is_intersection() {
            // It only moves with its faces.
            return self.moves(e);
        }
        self.active.sensor || self.active.moving_emitters.contains(&true) || self.pass(e)
    }

    /// True when an edge moves, or segments between any two points that graze it can end on what
    /// moves.
    pub(crate) fn pass(&self, e: &Edge) -> bool {
        self.always(e) || self.boxes.iter().any(|b| e.wedge.can_be_grazed_towards(b))
    }

    /// True when an edge can matter to segments that start at the camera.
    pub(crate) fn pass_camera(&self, e: &Edge, camera: &Sensor) -> bool {
        let seen = match camera.viewpoint() {
            Viewpoint::Lens { .. } => self.pass(e),
            from => self.pass_beyond(e, |x| from.onward(x)),
        };
        self.active.sensor || seen
    }

    /// True when an edge can matter to segments that start on an emitter, which leave it at `x`
    /// along `onward(x)`.
    pub(crate) fn pass_emitter(
        &self,
        e: &Edge,
        emitter: usize,
        onward: impl Fn(Vec3) -> Vec3,
    ) -> bool {
        self.active.moving_emitters[emitter] || self.pass_beyond(e, onward)
    }

    /// True when what an edge hides from lights can change in media, wherever they are.
    pub(crate) fn pass_lights(&self, world: &World, e: &Edge) -> bool {
        let mut shapes = world.scene.shapes.iter().zip(&self.active.shapes);
        self.always(e)
            || self.active.moving_emitters.contains(&true)
            || shapes.any(|(s, moves)| *moves && s.emitter.is_some())
    }

    /// True when the edge itself moves.
    pub(crate) fn moves(&self, e: &Edge) -> bool {
        e.shapes().any(|s| self.active.shapes[s as usize])
    }

    /// The edge or an inside moves.
    fn always(&self, e: &Edge) -> bool {
        self.insides || self.moves(e)
    }

    fn pass_beyond(&self, e: &Edge, onward: impl Fn(Vec3) -> Vec3) -> bool {
        let ends = e.wedge.ends;
        let beyond = Beyond { ends, onward: ends.map(onward) };
        self.always(e) || self.boxes.iter().any(|b| beyond.can_meet(b))
    }
}

/// Where rays that graze an edge come to: the part of a plane between two rays that start at the
/// edge's ends.
struct Beyond {
    ends: [Vec3; 2],
    onward: [Vec3; 2],
}

impl Beyond {
    /// False when a plane keeps it apart from a box.
    fn can_meet(&self, b: &Aabb) -> bool {
        let [p, q] = self.ends;
        let [to_p, to_q] = self.onward;
        let n = (q - p).cross(to_p);
        // A half-space through `at` whose inside is where `inner` points.
        let side = |at: Vec3, normal: Vec3, inner: Vec3| {
            let inwards = if normal.dot(inner) < 0.0 { -normal } else { normal };
            b.signed_distances(at, inwards).1
        };
        let (below, above) = b.signed_distances(p, n);
        below <= 0.0
            && above >= 0.0
            && side(p, n.cross(to_p), q - p) >= 0.0
            && side(q, n.cross(to_q), p - q) >= 0.0
            && side(p, n.cross(q - p), to_p + to_q) >= 0.0
    }
}

#[cfg(test)]
mod tests {
    use drt_math::{Rng, vec3};

    use super::*;

    fn point(rng: &mut Rng, size: f64) -> Vec3 {
        vec3(rng.next_f64() - 0.5, rng.next_f64() - 0.5, rng.next_f64() - 0.5) * (2.0 * size)
    }

    fn around(rng: &mut Rng, x: Vec3) -> Aabb {
        let (a, b) = (point(rng, 0.2), point(rng, 0.2));
        Aabb { min: x - a.max(-a), max: x + b.max(-b) }
    }

    #[test]
    fn what_lies_beyond_an_edge_is_met() {
        let mut rng = Rng::new(5, 0, 0);
        let mut dropped = 0;
        for _ in 0..20_000 {
            let ends = [0; 2].map(|_| point(&mut rng, 1.0));
            let [a, b] = ends;
            let x = a + (b - a) * rng.next_f64();
            let (eye, far) = (point(&mut rng, 3.0), 4.0 * rng.next_f64());
            let from_eye = Beyond { ends, onward: [a - eye, b - eye] };
            let parallel = Beyond { ends, onward: [eye, eye] };
            assert!(from_eye.can_meet(&around(&mut rng, x + (x - eye) * far)));
            assert!(parallel.can_meet(&around(&mut rng, x + eye * far)));
            // Anywhere else, nearly all are kept apart.
            let centre = point(&mut rng, 3.0);
            let elsewhere = around(&mut rng, centre);
            dropped += [&from_eye, &parallel].iter().filter(|r| !r.can_meet(&elsewhere)).count();
        }
        assert!(dropped > 34_000, "{dropped}");
    }
}
