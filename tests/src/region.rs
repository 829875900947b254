//! Boxes that hold media, as null interfaces; boxes that touch share a face.

use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Mat3, Vec3};

use crate::Result;

/// A box that holds a medium.
#[derive(Clone, Copy, Debug)]
pub struct Region {
    /// Index of the medium.
    pub medium: usize,
    /// Lower and upper corner.
    pub ends: [Vec3; 2],
}

/// A plane of box faces, across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// 0, 1 or 2 for x, y, z.
    pub axis: usize,
    /// Where it crosses the axis.
    pub at: f64,
}

/// A null surface between two media.
#[derive(Clone, Debug)]
pub struct Interface {
    /// Outward, or towards the upper medium. Vertices are the corners of a box, used or not.
    pub mesh: Mesh,
    /// Medium behind.
    pub interior: usize,
    /// Medium before; `None` is vacuum.
    pub exterior: Option<usize>,
}

/// A coordinate by axis.
#[must_use]
pub fn coordinate(p: Vec3, axis: usize) -> f64 {
    p.to_array()[axis]
}

impl Plane {
    /// True when a point lies in it.
    #[must_use]
    pub fn contains(&self, p: Vec3) -> bool {
        coordinate(p, self.axis) == self.at
    }
}

impl Region {
    /// The faces of the box, outward.
    ///
    /// # Errors
    /// When the box has no inside.
    pub fn mesh(&self) -> Result<Mesh> {
        let [lo, hi] = self.ends;
        let half = (hi - lo) * 0.5;
        if half.to_array().into_iter().any(|h| h <= 0.0) {
            return Err("a box has no inside".into());
        }
        let place = Affine { linear: Mat3::diagonal(half), translation: lo + half };
        let mut mesh = procedural::cube().transform(&place);
        // Exactly the given corners, so that faces can be told by their coordinates.
        for p in &mut mesh.positions {
            let middle = lo + half;
            let pick = |axis| {
                let end = usize::from(coordinate(*p, axis) > coordinate(middle, axis));
                coordinate(self.ends[end], axis)
            };
            *p = drt_math::vec3(pick(0), pick(1), pick(2));
        }
        Ok(mesh)
    }

    /// The plane of the face that this box's upper side along an axis shares with another box.
    fn shared_face(&self, above: &Self) -> Option<Plane> {
        (0..3).find_map(|axis| {
            let others = [(axis + 1) % 3, (axis + 2) % 3];
            let same =
                |end: usize, a| coordinate(self.ends[end], a) == coordinate(above.ends[end], a);
            let at = coordinate(self.ends[1], axis);
            let touch = at == coordinate(above.ends[0], axis);
            (touch && others.into_iter().all(|a| same(0, a) && same(1, a)))
                .then_some(Plane { axis, at })
        })
    }
}

/// Planes of the faces shared by two boxes, with the index of the box on either side.
#[must_use]
pub fn shared_faces(regions: &[Region]) -> Vec<(Plane, usize, usize)> {
    let pairs = (0..regions.len()).flat_map(|i| (0..regions.len()).map(move |j| (i, j)));
    pairs.filter_map(|(i, j)| Some((regions[i].shared_face(&regions[j])?, i, j))).collect()
}

/// The surfaces that bound the boxes: what each has alone, then what two share.
///
/// # Errors
/// When a box has no inside.
pub fn interfaces(regions: &[Region]) -> Result<Vec<Interface>> {
    let shared = shared_faces(regions);
    let mut own = Vec::new();
    let mut between = Vec::new();
    for (i, region) in regions.iter().enumerate() {
        let mut mesh = region.mesh()?;
        for (plane, below, above) in &shared {
            if i != *below && i != *above {
                continue;
            }
            let (cut, kept) = mesh
                .triangles
                .iter()
                .partition(|t| t.iter().all(|v| plane.contains(mesh.positions[*v as usize])));
            mesh.triangles = kept;
            if i == *below {
                let mesh = Mesh { triangles: cut, ..mesh.clone() };
                let exterior = Some(regions[*above].medium);
                between.push(Interface { mesh, interior: region.medium, exterior });
            }
        }
        own.push(Interface { mesh, interior: region.medium, exterior: None });
    }
    own.extend(between);
    Ok(own)
}
