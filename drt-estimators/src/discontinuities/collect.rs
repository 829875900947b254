//! The edges of a scene.

use alloc::vec::Vec;

use drt_geom::edges::Wedge;
use drt_geom::{EdgeClass, NONE, Topology};

use crate::discontinuities::edge::{Edge, GrazedSide};
use crate::discontinuities::intersection::intersections;
use crate::world::World;

/// The edges of surfaces that scatter or block.
pub(crate) struct Edges {
    /// Of meshes, those that can be grazed.
    pub(crate) of_meshes: Vec<Edge>,
    /// Lines along which surfaces intersect.
    pub(crate) intersections: Vec<Edge>,
    /// How many there are, flat ones too.
    pub(crate) all: u64,
}

/// Looks for every edge.
pub(crate) fn collect(world: &World) -> Edges {
    let mut edges = Vec::new();
    let mut all = 0;
    for (i, shape) in world.scene.shapes.iter().enumerate() {
        if world.is_null(i as u32) {
            continue;
        }
        let mesh = &shape.mesh;
        let topology = Topology::of(mesh);
        all += topology.edges.len() as u64;
        for e in &topology.edges {
            if e.class == EdgeClass::Flat
                || (e.class != EdgeClass::Boundary && !e.can_be_silhouette())
            {
                continue;
            }
            let [a, b] = e.vertices.map(|v| mesh.positions[v as usize]);
            let face = mesh.triangles[e.faces[0] as usize];
            let corner = |v: u32| face.iter().position(|c| *c == v);
            let (Some(ca), Some(cb)) = (corner(e.vertices[0]), corner(e.vertices[1])) else {
                continue;
            };
            let second = usize::from(e.faces[1] != NONE);
            let opposite = [0, second].map(|k| mesh.positions[e.opposite[k] as usize]);
            let faces = [0, second].map(|k| world.prim_of(i, e.faces[k]));
            let side = match e.class {
                EdgeClass::Convex => GrazedSide::Front,
                EdgeClass::Concave => GrazedSide::Back,
                _ => GrazedSide::Unknown,
            };
            let corners = [ca as u8, cb as u8];
            let wedge = Wedge::new([a, b], opposite, faces);
            edges.extend(wedge.map(|w| Edge::new(w, i as u32, e.faces[0], corners, side)));
        }
    }
    let (of_meshes, intersections) = intersections(world, edges);
    all += intersections.len() as u64;
    Edges { of_meshes, intersections, all }
}
