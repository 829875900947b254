//! Which edge a vertex looks at: the [tree](super::tree), asked in several ways at once.
//!
//! Radiance jumps most where a lamp is behind an edge, or the lamp's own rim. So some looks go towards
//! the spheres around the lamps, and the rest anywhere. A point's density is that of all ways together
//! (balance heuristic of one sample; Veach and Guibas 1995).

use alloc::vec::Vec;

use drt_math::Vec3;

use super::jumps::{Jump, Jumps};
use super::tree::{EdgeTree, Segment, Viewpoint};
use super::{Chosen, Look};
use crate::transport::{Kind, Vertex, World};

/// The part of looks that go towards lamps.
const TOWARD_LAMPS: f64 = 0.5;

/// Lamps looked towards on purpose.
const MOST_LAMPS: usize = 4;

/// How much more radiance jumps at the edges of lamps.
const LAMP: f64 = 4.0;

/// A sphere.
#[derive(Clone, Copy, Debug)]
struct Sphere {
    center: Vec3,
    radius: f64,
}

/// Edges to look at, and where to look.
#[derive(Debug)]
pub(super) struct Views {
    tree: EdgeTree,
    /// The jumps that the tree's segments are.
    jumps: Vec<u32>,
    lamps: Vec<Sphere>,
}

impl Views {
    /// Of the jumps that `matter`, in proportion to how much; `None` without any.
    pub(super) fn new(world: &World, jumps: &Jumps, matter: impl Fn(&Jump) -> f64) -> Option<Self> {
        let weighed = (0..).zip(&jumps.list).map(|(i, jump)| (i, jump, matter(jump)));
        let kept = weighed.filter(|(_, _, weight)| *weight > 0.0);
        let (indices, segments): (Vec<u32>, Vec<Segment>) =
            kept.map(|(i, jump, weight)| (i, segment(world, jumps, jump, weight))).unzip();
        let tree = EdgeTree::new(&segments)?;
        Some(Self { tree, jumps: indices, lamps: lamps(world) })
    }

    /// Draws a point of an edge that `vertex` may see, from where it scatters light to `wo`.
    pub(super) fn sample<'a>(
        &self,
        world: &World,
        jumps: &'a Jumps,
        vertex: &Vertex,
        wo: Vec3,
        look: &Look,
    ) -> Option<Chosen<'a>> {
        let around = viewpoint(world, vertex, wo);
        let mut way = look.way;
        let (i, (_, view)) = self.ways(around).enumerate().find(|(_, (chance, _))| {
            way -= chance;
            way < 0.0
        })?;
        let chosen = self.tree.sample(&view, look.point)?;
        let densities = self.ways(around).enumerate().map(|(k, (chance, view))| {
            let known = (k == i).then(|| 1.0 / chosen.inv_pdf);
            chance * known.unwrap_or_else(|| self.tree.pdf(&view, chosen.edge, chosen.u))
        });
        let density: f64 = densities.sum();
        let index = self.jumps[chosen.edge];
        let jump = &jumps.list[index as usize];
        (density > 0.0).then(|| Chosen { jump, index, along: chosen.u, inv_pdf: 1.0 / density })
    }

    /// The ways of looking, and their chances: towards lamps, and anywhere.
    fn ways(&self, around: Viewpoint) -> impl Iterator<Item = (f64, Viewpoint)> {
        let share = if self.lamps.is_empty() { 0.0 } else { TOWARD_LAMPS };
        let per_lamp = share / self.lamps.len().max(1) as f64;
        let lamps = self.lamps.iter().map(move |l| (per_lamp, around.toward(l.center, l.radius)));
        lamps.chain([(1.0 - share, around)])
    }

    /// The density per length of [`Views::sample`].
    pub(super) fn density(&self, world: &World, vertex: &Vertex, wo: Vec3, at: &Chosen) -> f64 {
        let Ok(edge) = self.jumps.binary_search(&at.index) else { return 0.0 };
        let around = viewpoint(world, vertex, wo);
        self.ways(around).map(|(chance, view)| chance * self.tree.pdf(&view, edge, at.along)).sum()
    }
}

fn viewpoint(world: &World, vertex: &Vertex, wo: Vec3) -> Viewpoint {
    let normal = match &vertex.kind {
        Kind::Surface(s) => {
            let n = if s.ns.dot(wo) < 0.0 { -s.ns } else { s.ns };
            Some((n, world.bsdf_of(s.shape).is_transmissive()))
        }
        _ => None,
    };
    Viewpoint::new(vertex.x, normal)
}

fn segment(world: &World, jumps: &Jumps, jump: &Jump, weight: f64) -> Segment {
    let (a, along) = jump.edge.line();
    let lamp = jumps.faces(jump).any(|(prim, _)| {
        let shape = world.point(prim, [0.0; 2]).0.shape;
        world.scene.shapes[shape as usize].emitter.is_some()
    });
    let size = if lamp { LAMP * weight } else { weight };
    let across: Vec<Vec3> = jumps.faces(jump).map(|(_, across)| across).collect();
    // Both on one side of the surface, whatever the order of the faces' corners.
    let t = jump.edge.tangent;
    let (faces, open) = match across[..] {
        [f, g] => ([t.cross(f), g.cross(t)], false),
        // What is seen of three faces and more depends on where from.
        _ => ([t.cross(across[0]); 2], true),
    };
    let crease = jump.crease * size;
    Segment { a, b: a + along, faces, open, jump: size, crease: [crease; 2] }
}

/// The spheres around the surfaces that emit most.
fn lamps(world: &World) -> Vec<Sphere> {
    let shapes = world.scene.shapes.iter().filter_map(|s| {
        let radiance = world.lights.area_radiance(s.emitter?);
        let b = s.mesh.bounds();
        let sphere = Sphere { center: b.center(), radius: 0.5 * (b.max - b.min).length() };
        Some((radiance.mean() * s.mesh.surface_area(), sphere))
    });
    let mut lamps: Vec<(f64, Sphere)> = shapes.collect();
    lamps.sort_by(|a, b| b.0.total_cmp(&a.0));
    lamps.into_iter().take(MOST_LAMPS).map(|(_, sphere)| sphere).collect()
}
