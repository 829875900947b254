use alloc::vec::Vec;

use drt_math::Vec3;

use super::Mesh;
use crate::weld;

impl Mesh {
    /// The mesh without triangles of exactly zero area and without repetitions of a triangle
    /// (same positions, same orientation; the first stays), and how many were dropped.
    ///
    /// Vertices stay as they are. Two triangles back to back, of opposite orientation, are a thin
    /// sheet and both stay.
    #[must_use]
    pub fn drop_degenerate(&self) -> (Self, usize) {
        let welded = weld(&self.positions);
        // Rotated to begin with its smallest corner: equal for equal oriented triangles.
        let key = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| welded[v as usize]);
            core::cmp::min([a, b, c], core::cmp::min([b, c, a], [c, a, b]))
        };
        let mut order: Vec<u32> =
            (0..self.triangles.len() as u32).filter(|&i| self.normal(i) != Vec3::ZERO).collect();
        order.sort_by_cached_key(|&i| (key(&self.triangles[i as usize]), i));
        order.dedup_by_key(|i| key(&self.triangles[*i as usize]));
        order.sort_unstable();

        let triangles: Vec<_> = order.iter().map(|&i| self.triangles[i as usize]).collect();
        let dropped = self.triangles.len() - triangles.len();
        let texcoords = self.texcoords.as_ref();
        let texcoords = texcoords.map(|t| order.iter().map(|&i| t[i as usize]).collect());
        let mut attributes = self.attributes.clone();
        for a in &mut attributes {
            a.values = order.iter().map(|&i| a.values[i as usize]).collect();
        }
        (Self { triangles, texcoords, attributes, ..self.clone() }, dropped)
    }
}
