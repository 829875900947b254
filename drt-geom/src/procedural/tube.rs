use alloc::vec::Vec;

use drt_math::{Frame, Vec3};

use super::{on_circle, quad};

/// Vertices and triangles of a surface under construction.
#[derive(Default)]
pub(super) struct Tube {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Tube {
    /// Adds a ring of `n` vertices in the plane of the frame's tangents, and returns its first.
    pub(super) fn ring(&mut self, center: Vec3, frame: &Frame, radius: f64, n: u32) -> u32 {
        let first = self.positions.len() as u32;
        self.positions.extend((0..n).map(|i| {
            let (c, s) = on_circle(i, n);
            center + (frame.s * c + frame.t * s) * radius
        }));
        first
    }

    /// Joins two rings, the second further along the normal, turned by `twist` vertices.
    pub(super) fn join(&mut self, from: u32, to: u32, n: u32, twist: u32) {
        for i in 0..n {
            let (a, b) = (i, (i + 1) % n);
            let upper = |k: u32| to + (k + twist) % n;
            self.triangles.extend(quad([from + a, from + b, upper(b), upper(a)]));
        }
    }

    /// Closes a ring with a tip beyond it: along the normal when `forward`, else against it.
    pub(super) fn cap(&mut self, ring: u32, n: u32, tip: Vec3, forward: bool) {
        let apex = self.positions.len() as u32;
        self.positions.push(tip);
        for i in 0..n {
            let (a, b) = (ring + i, ring + (i + 1) % n);
            self.triangles.push(if forward { [a, b, apex] } else { [b, a, apex] });
        }
    }
}

/// The frame after moving from a frame to a new axis with the least rotation about it.
pub(super) fn transport(frame: &Frame, axis: Vec3) -> Frame {
    let s = frame.s.reject(axis).normalize();
    Frame { s, t: axis.cross(s), n: axis }
}
