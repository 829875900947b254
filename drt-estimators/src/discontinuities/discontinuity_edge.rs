//! Edges of surfaces, each with all faces around it.

use alloc::vec::Vec;
use core::f64::consts::PI;
use core::ops::Range;

use drt_geom::edges::{Coincident, EdgeSides, Fan, FanFace, faces_around};
use drt_math::{Vec3, fm};

use crate::discontinuities::collect::{Edges, collect};
use crate::discontinuities::contact::{BESIDE, Contact};
use crate::discontinuities::edge::{Edge, EdgePoint};
use crate::model::sensor::Sensor;
use crate::world::vertex::SurfacePoint;
use crate::world::{SurroundingMedium, World};

/// How much less radiance jumps at a crease of a surface with interpolated normals than its angle tells.
const SMOOTH: f64 = 0.2;

/// How much less from behind: next to black, and hidden by the front of what is closed.
const BEHIND: f64 = 0.05;

/// Angle by which two faces may be out of one plane and still go on in it.
const FLAT: f64 = 1e-6;

/// An edge at which radiance jumps.
#[derive(Clone, Debug)]
pub(crate) struct DiscontinuityEdge {
    pub(crate) edge: Edge,
    /// Its faces, in the order in which one goes around it.
    fan: Range<usize>,
    /// The medium around its shape, where that bounds none and it is the same everywhere.
    around: SurroundingMedium,
    /// A face of it bounds a medium.
    bounds: bool,
    /// How much a crease jumps, compared to a silhouette, on the side of its faces' [normals](DiscontinuityEdges::normals) and
    /// on the other.
    pub(crate) crease: [f64; 2],
    /// Between faces with interpolated normals.
    smooth: bool,
}

/// All edges.
#[derive(Debug, Default)]
pub(crate) struct DiscontinuityEdges {
    pub(crate) list: Vec<DiscontinuityEdge>,
    faces_of_fans: Vec<FanFace>,
    /// Edges of the scene's meshes in all, flat ones too.
    pub(crate) all: u64,
}

impl DiscontinuityEdges {
    /// Collects the edges of surfaces that scatter or block. Of edges at one place, that of a shape that
    /// `moves` tells how the place moves.
    pub(crate) fn collect(world: &World, moves: &[bool]) -> Self {
        let Edges { of_meshes: edges, intersections, all } = collect(world);
        let around: Vec<_> =
            (0..world.scene.shapes.len()).map(|s| world.medium_around(s)).collect();
        let mut discontinuities = Self { list: Vec::new(), faces_of_fans: Vec::new(), all };
        for same in Coincident::among(edges.iter().map(|e| &e.wedge)).groups() {
            let of = |i: &usize| &edges[*i];
            let moving = same.iter().find(|i| moves[of(i).shape as usize]);
            let mut edge = *of(moving.unwrap_or(&same[0]));
            let faces = faces_around(&edge.wedge, same.iter().map(|i| &of(i).wedge));
            let kind = Self::crease(world, edge.wedge.tangent, &faces);
            let Some((crease, smooth)) = kind else { continue };
            edge.may_rest = Contact::anywhere(world, &edge);
            let shapes = same.iter().map(|i| of(i).shape);
            let around = around[edge.shape as usize];
            discontinuities.add(world, edge, &faces, shapes, around, (crease, smooth));
        }
        for edge in intersections {
            let Some(sheets) = edge.intersecting_sheets(world) else { continue };
            let mut faces = sheets.map(|(face, across)| FanFace::new(&edge.wedge, face, across));
            faces.sort_unstable_by(|a, b| a.angle.total_cmp(&b.angle));
            let around = around[edge.shape as usize];
            discontinuities.add(world, edge, &faces, edge.shapes(), around, ([1.0; 2], false));
        }
        discontinuities
    }

    /// Adds an edge with the faces around it, which are of some shapes.
    fn add(
        &mut self,
        world: &World,
        edge: Edge,
        faces: &[FanFace],
        shapes: impl Iterator<Item = u32>,
        around: SurroundingMedium,
        (crease, smooth): ([f64; 2], bool),
    ) {
        let start = self.faces_of_fans.len();
        self.faces_of_fans.extend_from_slice(faces);
        let fan = start..self.faces_of_fans.len();
        let mut shapes = shapes.map(|s| &world.scene.shapes[s as usize]);
        let bounds = shapes.any(|shape| shape.boundary.is_some());
        self.list.push(DiscontinuityEdge { edge, fan, around, bounds, crease, smooth });
    }

    /// How much radiance jumps at a crease between faces, and whether these are smooth; `None` where it never does.
    fn crease(world: &World, tangent: Vec3, faces: &[FanFace]) -> Option<([f64; 2], bool)> {
        let [a, b] = faces else { return Some(([1.0; 2], false)) };
        let points = [a, b].map(|f| world.point(f.face, [0.0; 2]).0);
        let [sa, sb] = points.map(|p| p.shape as usize);
        let shapes = &world.scene.shapes;
        let interpolated = [sa, sb].iter().any(|s| shapes[*s].mesh.normals.is_some());
        let smooth = sa == sb && interpolated;
        // What is one-sided is black from behind, but where a normal that is interpolated faces the viewer.
        let normals = normals(tangent, [a.across, b.across]);
        let fronts = [0, 1].map(|k| normals[k].dot(points[k].ng) > 0.0);
        let one_sided = points.iter().all(|p| world.bsdf_of(p.shape).is_black_from_behind());
        let behind = if interpolated { BEHIND } else { 0.0 };
        let sides = match fronts {
            _ if !one_sided => [1.0; 2],
            [true, true] => [1.0, behind],
            [false, false] => [behind, 1.0],
            _ => [1.0; 2],
        };
        let dull = |s: usize| shapes[s].emitter.is_none();
        let alike = sa == sb && fronts[0] == fronts[1] && world.emits_evenly(sa as u32);
        if shapes[sa].bsdf != shapes[sb].bsdf || !(alike || dull(sa) && dull(sb)) {
            return Some((sides, false));
        }
        if alike && world.bsdf_of(sa as u32).is_black() {
            return Some(([0.0; 2], smooth));
        }
        let bend = PI - fm::atan2(a.across.cross(b.across).length(), a.across.dot(b.across));
        if bend < FLAT {
            return None;
        }
        let discontinuity = f64::min(bend, 1.0) * if smooth { SMOOTH } else { 1.0 };
        Some((sides.map(|side| side * discontinuity), smooth))
    }

    /// The faces around an edge, and the unit vectors across it into them.
    pub(crate) fn faces(
        &self,
        discontinuity: &DiscontinuityEdge,
    ) -> impl Iterator<Item = (u32, Vec3)> {
        self.faces_of_fans[discontinuity.fan.clone()].iter().map(|f| (f.face, f.across))
    }

    /// The shape of the two faces of a crease, if it is the same one.
    pub(crate) fn shape_of_faces(
        &self,
        world: &World,
        discontinuity: &DiscontinuityEdge,
    ) -> Option<u32> {
        let [a, b] = &self.faces_of_fans[discontinuity.fan.clone()] else { return None };
        let [sa, sb] = [a, b].map(|f| world.geometry.prim(f.face).shape);
        (sa == sb).then_some(sa)
    }

    /// True of an edge whose two faces belong to its own mesh. Where surfaces intersect there is none, as each side moves by itself.
    pub(crate) fn is_of_one_mesh(&self, world: &World, discontinuity: &DiscontinuityEdge) -> bool {
        discontinuity.edge.shapes().eq(self.shape_of_faces(world, discontinuity))
    }

    /// True of a crease whose two faces show their fronts on the same side.
    pub(crate) fn faces_one_way(&self, world: &World, discontinuity: &DiscontinuityEdge) -> bool {
        let [a, b] = &self.faces_of_fans[discontinuity.fan.clone()] else { return false };
        let [n, m] = normals(discontinuity.edge.wedge.tangent, [a.across, b.across]);
        let [f, g] = [a, b].map(|f| world.point(f.face, [0.0; 2]).0.ng);
        (n.dot(f) > 0.0) == (m.dot(g) > 0.0)
    }

    /// Unit normals of the two faces of a crease, on one side of the surface.
    pub(crate) fn normals(&self, discontinuity: &DiscontinuityEdge) -> Option<[Vec3; 2]> {
        let [a, b] = &self.faces_of_fans[discontinuity.fan.clone()] else { return None };
        Some(normals(discontinuity.edge.wedge.tangent, [a.across, b.across]))
    }

    /// Weight of an edge seen from a point: the angle it subtends, less where it is a crease. Samples of its
    /// two sides, of the same random numbers, seldom differ, but then by all there is: their root mean square
    /// is that of how often. Where normals are interpolated they differ each time, by little.
    pub(crate) fn seen_from(&self, discontinuity: &DiscontinuityEdge, camera: &Sensor) -> f64 {
        let edge = &discontinuity.edge;
        let silhouette = edge.silhouette_in_view(camera);
        if silhouette > 0.0 {
            return silhouette;
        }
        let size = edge.size_in_view(camera);
        // Of other than two faces some are seen from anywhere.
        let Some(normals) = self.normals(discontinuity) else { return size };
        let view = camera.viewpoint().onward(edge.wedge.ends[0]);
        let crease = discontinuity.crease[usize::from(normals[0].dot(view) > 0.0)];
        let weight = if discontinuity.smooth { crease } else { fm::sqrt(crease) };
        weight * size
    }

    /// What a viewer sees of an edge; `w` is unit, from the edge to the viewer.
    pub(crate) fn sides(&self, discontinuity: &DiscontinuityEdge, w: Vec3) -> Option<EdgeSides> {
        let faces = &self.faces_of_fans[discontinuity.fan.clone()];
        Fan { edge: &discontinuity.edge.wedge, faces }.sides(w)
    }
}

/// Unit normals of two faces at an edge, by the directions across it into them, on one side of the surface.
fn normals(tangent: Vec3, [f, g]: [Vec3; 2]) -> [Vec3; 2] {
    [tangent.cross(f), g.cross(tangent)]
}

impl DiscontinuityEdge {
    pub(crate) fn length(&self) -> f64 {
        self.edge.wedge.length
    }

    /// True when a shape with which it moves is one of some.
    pub(crate) fn moves(&self, shapes: &[bool]) -> bool {
        self.edge.shapes().any(|s| shapes[s as usize])
    }

    /// What the edge rests on at a point of it.
    pub(crate) fn contact(&self, world: &World, along: f64) -> Option<Contact> {
        Contact::at(world, &EdgePoint::new(&self.edge, along, 1.0))
    }

    /// A surface point on a face, beside the point `x` of the edge.
    pub(crate) fn beside(
        &self,
        world: &World,
        x: Vec3,
        (prim, across): (u32, Vec3),
    ) -> (SurfacePoint, Vec3) {
        world.point_near(prim, x + across * (BESIDE * self.length()))
    }

    /// The medium around the edge at `x` on the viewer's side, `w` pointing to the viewer, where a ray along `dir` starts.
    pub(crate) fn medium(
        &self,
        world: &World,
        sides: &EdgeSides,
        x: Vec3,
        w: Vec3,
        dir: Vec3,
    ) -> Option<usize> {
        // Most bound none: what it takes to tell by a face is seldom in a cache.
        let faces = sides.faces.iter().flatten().filter(|_| self.bounds);
        for (prim, _) in faces {
            let (point, _) = world.point(*prim, [1.0 / 3.0; 2]);
            let bounds = world.scene.shapes[point.shape as usize].boundary.is_some();
            if bounds {
                return world.medium_on_side(&point, point.ng.dot(w) > 0.0, None);
            }
        }
        self.around.toward(world, x, dir)
    }
}
