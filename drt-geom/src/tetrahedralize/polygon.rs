//! Triangles with further vertices on their sides, cut into triangles.

use alloc::vec::Vec;

use drt_math::Vec3;

/// A vertex on the rim of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rim {
    pub(super) vertex: u32,
    /// The sides it lies on, one bit each: known, because rounded vertices are on no line.
    pub(super) sides: u8,
}

pub(super) struct Pieces {
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) diagonals: Vec<[u32; 2]>,
}

/// Cuts off ears, that with the shortest diagonal first.
pub(super) fn cut(mut rim: Vec<Rim>, points: &[Vec3]) -> Pieces {
    let mut pieces = Pieces { triangles: Vec::new(), diagonals: Vec::new() };
    while rim.len() > 3 {
        let n = rim.len();
        let around = |i: usize| [rim[(i + n - 1) % n], rim[i], rim[(i + 1) % n]];
        let is_ear = |i: &usize| {
            let rest = (0..n).filter(|k| k != i).fold(7, |sides, k| sides & rim[k].sides);
            let own = around(*i).iter().fold(7, |sides, v| sides & v.sides);
            own == 0 && rest == 0
        };
        let diagonal = |i: usize| {
            let [a, _, c] = around(i).map(|v| points[v.vertex as usize]);
            (a - c).length_squared()
        };
        let Some(i) = (0..n).filter(is_ear).min_by(|&i, &j| diagonal(i).total_cmp(&diagonal(j)))
        else {
            break;
        };
        let ear = around(i).map(|v| v.vertex);
        pieces.triangles.push(ear);
        pieces.diagonals.push([ear[0], ear[2]]);
        rim.remove(i);
    }
    if let [a, b, c] = rim[..] {
        pieces.triangles.push([a.vertex, b.vertex, c.vertex]);
    }
    pieces
}
