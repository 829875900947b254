//! An edge that turns rays.

use alloc::boxed::Box;

use drt_math::Vec3;

use crate::derivative::velocity::EdgeMatter;
use crate::discontinuities::discontinuity_edge::{DiscontinuityEdge, DiscontinuityEdges};
use crate::model::texture::SurfaceLine;
use crate::world::World;
use crate::world::vertex::MaterialPoint;

/// An edge at which radiance jumps.
#[derive(Clone, Debug)]
pub(super) struct TurningEdge {
    pub(super) ends: [Vec3; 2],
    /// Half its length.
    pub(super) half: f64,
    /// The matter of its ends.
    points: [MaterialPoint; 2],
    /// Where surfaces intersect the ends move with that of both. Few edges have it.
    of_both: Option<Box<[[EdgeMatter; 2]; 2]>>,
    pub(super) moves: bool,
    /// The camera sees it along borders of pixels, at which its rays must not turn.
    pub(super) on_border: bool,
    /// Between faces of a curved surface, on which vertices move with their matter.
    pub(super) facets: bool,
    /// Between faces of a smooth body with interpolated normals, where light jumps at silhouettes alone.
    pub(super) untracked: bool,
    /// The shape that it is of, or one of them where surfaces intersect.
    pub(super) shape: u32,
    /// The shape of both faces of a crease that rests on no other surface.
    pub(super) within: Option<u32>,
    /// Of a crease: the normals of its faces on one side, and whether radiance jumps seen from that side, and the other.
    pub(super) crease: Option<([Vec3; 2], [bool; 2])>,
}

impl TurningEdge {
    pub(super) fn new(
        world: &World,
        edges: &DiscontinuityEdges,
        edge: &DiscontinuityEdge,
        moves: bool,
        curved: bool,
    ) -> Self {
        let ends = [0.0, 1.0].map(|along| edge.edge.matter(world, along));
        let points = ends.map(|(own, _)| own.point);
        let of_both = match ends {
            [(a, Some(b)), (c, Some(d))] => Some(Box::new([[a, b], [c, d]])),
            _ => None,
        };
        let discontinuous = edge.crease.map(|part| part > 0.0);
        let crease = edges.normals(edge).map(|normals| (normals, discontinuous));
        let (ends, half) = (edge.edge.wedge.ends, 0.5 * edge.length());
        let on_border = world.camera.sees_on_border(ends);
        // Of a fold as sharp as a corner, or between materials, a part is 1.
        let facets = curved && edge.crease.iter().all(|part| *part < 1.0);
        // What rests on another surface may end there.
        let within = edges.shape_of_faces(world, edge).filter(|_| !edge.edge.may_rest);
        let untracked = facets && within.is_some_and(|shape| is_untracked(world, shape));
        let shape = edge.edge.shape;
        Self {
            ends,
            half,
            points,
            of_both,
            moves,
            on_border,
            facets,
            untracked,
            shape,
            within,
            crease,
        }
    }

    /// A line on a surface along which its texture jumps. Where light goes straight through, so does what rays see past it, whatever they end on.
    pub(super) fn of_texture(world: &World, shape: u32, line: SurfaceLine, moves: bool) -> Self {
        let SurfaceLine { triangle, ends } = line;
        let item = &world.scene.shapes[shape as usize];
        let points = ends
            .map(|bary| MaterialPoint { shape, at: drt_motion::SurfacePoint { triangle, bary } });
        let [p, q, r] = item.mesh.triangle(triangle);
        let ends = ends.map(|[s, t]| p + (q - p) * s + (r - p) * t);
        let normal = item.mesh.normal(triangle).normalize();
        let passes = world.scene.bsdfs[item.bsdf].item.passes_straight();
        Self {
            ends,
            half: 0.5 * (ends[1] - ends[0]).length(),
            points,
            of_both: None,
            moves,
            on_border: world.camera.sees_on_border(ends),
            facets: false,
            untracked: false,
            shape,
            within: (!passes).then_some(shape),
            crease: (!passes).then_some(([normal; 2], [true; 2])),
        }
    }

    /// How one of its ends moves.
    pub(super) fn matter(&self, end: usize) -> impl Iterator<Item = EdgeMatter> {
        let one = self.of_both.is_none().then(|| EdgeMatter::of(self.points[end]));
        let both = self.of_both.iter().flat_map(move |both| both[end]);
        one.into_iter().chain(both)
    }

    /// Whether radiance jumps there, seen from the front of both faces and from their back; it does where they are one plane, or where there is one
    /// face alone, at which nothing else jumps.
    pub(super) fn is_discontinuous(&self) -> [bool; 2] {
        let Some((normals, discontinuous)) = &self.crease else { return [true; 2] };
        let one_plane = normals[0].cross(normals[1]).length_squared() < 1e-18;
        discontinuous.map(|side| one_plane || (side && !self.untracked))
    }

    /// What radiance does there, seen along a vector.
    pub(super) fn discontinuity(&self, view: Vec3) -> Discontinuity {
        let Some((normals, discontinuous)) = &self.crease else { return Discontinuity::Silhouette };
        let [front, other] = normals.map(|n| n.dot(view) > 0.0);
        match discontinuous[usize::from(front)] {
            _ if front != other => Discontinuity::Silhouette,
            false => Discontinuity::None,
            _ if self.untracked => Discontinuity::None,
            true if self.facets => Discontinuity::Facets,
            true => Discontinuity::Crease,
        }
    }
}

/// Whether all light that a shape scatters is a continuous function of the ray that meets it, up to its silhouette.
pub(super) fn is_untracked(world: &World, shape: u32) -> bool {
    let bsdf = world.bsdf_of(shape);
    let normals = world.scene.shapes[shape as usize].mesh.normals.is_some();
    normals && bsdf.is_smooth() && !bsdf.is_partly_smooth()
}

/// What radiance does at an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Discontinuity {
    None,
    /// Between faces of a curved surface that are both seen from one side.
    Facets,
    /// Between other such faces.
    Crease,
    Silhouette,
}
