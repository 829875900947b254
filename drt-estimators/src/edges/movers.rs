//! Which edges can matter: those that move, and those that something passes in moving.
//!
//! A boundary segment's rate is that of the edge against the segment's two ends. At an edge at rest
//! it vanishes unless an end moves, so an edge at rest counts only where a segment that grazes it can
//! end on what moves. Whatever is in between is not asked: a moving surface counts by the box
//! around it, wherever it is, and all tests err towards keeping.

use alloc::vec::Vec;

use drt_geom::Aabb;
use drt_math::{Real, Vec3};

use crate::derivative::sensitivity::ActiveInputs;
use crate::edges::edge::Edge;
use crate::world::World;

/// Boxes that are kept apart; more become one around all.
const MOST_BOXES: usize = 64;

/// Relative rounding errors of a point's distance from a plane.
const ROUNDING: f64 = 1e-9;

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
        self.active.sensor || self.active.moving_emitters.contains(&true) || self.pass(e)
    }

    /// True when an edge moves, or segments between any two points that graze it can end on what
    /// moves.
    pub(crate) fn pass(&self, e: &Edge) -> bool {
        self.always(e) || self.boxes.iter().any(|b| e.can_be_grazed_towards(b))
    }

    /// True when an edge can matter to segments that start at the camera.
    pub(crate) fn pass_camera(&self, e: &Edge, eye: Vec3) -> bool {
        self.active.sensor || self.pass_beyond(e, |x| x - eye)
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
        self.active.shapes[e.shape as usize]
    }

    /// The edge or an inside moves.
    fn always(&self, e: &Edge) -> bool {
        self.insides || self.moves(e)
    }

    fn pass_beyond(&self, e: &Edge, onward: impl Fn(Vec3) -> Vec3) -> bool {
        let (a, along) = e.line();
        let beyond = Beyond { ends: [a, a + along], onward: [onward(a), onward(a + along)] };
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
            distances(b, at, inwards).1
        };
        let (below, above) = distances(b, p, n);
        below <= 0.0
            && above >= 0.0
            && side(p, n.cross(to_p), q - p) >= 0.0
            && side(q, n.cross(to_q), p - q) >= 0.0
            && side(p, n.cross(q - p), to_p + to_q) >= 0.0
    }
}

impl Edge {
    /// False when no segment that grazes the edge can end in a box: when all of it lies on opposite
    /// sides of the two faces' planes.
    fn can_be_grazed_towards(&self, b: &Aabb) -> bool {
        let (a, _) = self.line();
        let [(low0, high0), (low1, high1)] = self.plane_normals().map(|n| distances(b, a, n));
        let apart = |low: f64, high: f64| low > 0.0 && high < 0.0;
        !apart(low0, high1) && !apart(low1, high0)
    }
}

/// The least and greatest value of n·(x - at) in a box, moved apart by rounding errors.
fn distances(b: &Aabb, at: Vec3, n: Vec3) -> (f64, f64) {
    let (centre, half) = (b.center() - at, b.extent() * 0.5);
    let sum = |v: Vec3| {
        Real::abs(n.x) * Real::abs(v.x)
            + Real::abs(n.y) * Real::abs(v.y)
            + Real::abs(n.z) * Real::abs(v.z)
    };
    let (middle, reach) = (n.dot(centre), sum(half));
    // Of the coordinates themselves, which may be much larger than their differences.
    let rounding = ROUNDING * (sum(at) + sum(b.center()) + reach);
    (middle - reach - rounding, middle + reach + rounding)
}

#[cfg(test)]
mod tests {
    use drt_math::{Rng, vec3};

    use super::*;
    use crate::edges::edge::GrazedSide;

    fn point(rng: &mut Rng, size: f64) -> Vec3 {
        vec3(rng.next_f64() - 0.5, rng.next_f64() - 0.5, rng.next_f64() - 0.5) * (2.0 * size)
    }

    fn around(rng: &mut Rng, x: Vec3) -> Aabb {
        let (a, b) = (point(rng, 0.2), point(rng, 0.2));
        Aabb { min: x - a.max(-a), max: x + b.max(-b) }
    }

    /// Calls `test` with random edges, a point on each, and a box that the test may choose.
    fn edges(test: impl Fn(&mut Rng, &Edge, Vec3)) {
        let mut rng = Rng::new(5, 0, 0);
        for _ in 0..20_000 {
            let [a, b, c, d] = [0; 4].map(|_| point(&mut rng, 1.0));
            let e = Edge::new([a, b], [c, d], [0, 1], 0, [0, 1], GrazedSide::Unknown).unwrap();
            let x = a + (b - a) * rng.next_f64();
            test(&mut rng, &e, x);
        }
    }

    /// No edge is dropped past which a segment ends in the box; boxes elsewhere are kept apart.
    #[test]
    fn edges_that_are_grazed_stay() {
        let (seen, dropped) = (core::cell::Cell::new(0), core::cell::Cell::new(0));
        edges(|rng, e, x| {
            let end = point(rng, 3.0);
            let b = around(rng, end);
            if e.faces_split((end - x).normalize()) {
                assert!(e.can_be_grazed_towards(&b));
                seen.set(seen.get() + 1);
            } else if !e.can_be_grazed_towards(&b) {
                dropped.set(dropped.get() + 1);
            }
        });
        assert!(seen.get() > 5_000 && dropped.get() > 3_000, "{seen:?} {dropped:?}");
    }

    #[test]
    fn what_lies_beyond_an_edge_is_met() {
        let dropped = core::cell::Cell::new(0);
        edges(|rng, e, x| {
            let (eye, far) = (point(rng, 3.0), 4.0 * rng.next_f64());
            let (a, along) = e.line();
            let (ends, b) = ([a, a + along], a + along);
            let from_eye = Beyond { ends, onward: [a - eye, b - eye] };
            let parallel = Beyond { ends, onward: [eye, eye] };
            assert!(from_eye.can_meet(&around(rng, x + (x - eye) * far)));
            assert!(parallel.can_meet(&around(rng, x + eye * far)));
            // Anywhere else, nearly all are kept apart.
            let centre = point(rng, 3.0);
            let elsewhere = around(rng, centre);
            let kept = [&from_eye, &parallel].map(|r| u32::from(r.can_meet(&elsewhere)));
            dropped.set(dropped.get() + 2 - kept[0] - kept[1]);
        });
        assert!(dropped.get() > 34_000, "{dropped:?}");
    }
}
