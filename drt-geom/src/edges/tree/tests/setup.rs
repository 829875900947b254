//! Edges of meshes, where they are seen from, and what they amount to without a tree.

use alloc::vec::Vec;

use crate::{EdgeClass, Mesh, NONE, Topology, procedural};
use drt_math::{Rng, Vec3, vec3, warp};

use crate::edges::tree::options::NodeGroup;
use crate::edges::tree::*;

/// Looking at all edges.
pub(super) const ALL: [Way; 1] = [Way::anywhere(1.0)];

/// Draws points with memory of its own.
pub(super) struct Drawing<'a> {
    tree: &'a EdgeTree,
    options: TreeScratch,
    /// Where each piece is in the tree.
    paths: Vec<Vec<(NodeGroup, usize)>>,
    /// The piece of each edge.
    pieces: Vec<Option<usize>>,
}

impl<'a> Drawing<'a> {
    pub(super) fn new(tree: &'a EdgeTree) -> Self {
        let mut paths = alloc::vec![Vec::new(); tree.lines.len()];
        find(tree, tree.root, &mut Vec::new(), &mut paths);
        let edges = tree.lines.iter().map(|p| p.edge as usize + 1).max().unwrap();
        let mut pieces = alloc::vec![None; edges];
        for (k, p) in tree.lines.iter().enumerate() {
            pieces[p.edge as usize] = Some(k);
        }
        Self { tree, options: TreeScratch::default(), paths, pieces }
    }

    pub(super) fn sample(
        &mut self,
        view: &Viewpoint,
        ways: &[Way],
        rng: &mut Rng,
    ) -> Option<Chosen> {
        let draw = Draw { way: rng.next_f64(), point: rng.next_2d() };
        self.tree.sample(view, ways, &draw, &mut self.options)
    }

    /// The density of samples at a place.
    pub(super) fn pdf(&mut self, view: &Viewpoint, ways: &[Way], edge: usize, u: f64) -> f64 {
        let Some(Some(piece)) = self.pieces.get(edge) else { return 0.0 };
        let path = &self.paths[*piece];
        let found = self.tree.descend(view, ways, &mut self.options, |options, _| {
            let place = |group: NodeGroup| options.groups().iter().position(|g| *g == group);
            path.iter().rev().find_map(|(group, lane)| Some((place(*group)?, *lane)))
        });
        let slack = self.tree.slack(view);
        found.map_or(0.0, |(line, chances)| {
            density(&stretches(line, view, ways, &chances, slack), &chances, u)
        })
    }
}

/// Notes ways to all pieces below a child.
fn find(
    tree: &EdgeTree,
    child: Child,
    path: &mut Vec<(NodeGroup, usize)>,
    paths: &mut [Vec<(NodeGroup, usize)>],
) {
    if child.bundles == 0 {
        for (lane, below) in tree.families[child.first as usize].children.iter().enumerate() {
            // What there is not is of the first family, as only the root is.
            if below.bundles > 0 || below.first > 0 {
                path.push((NodeGroup::Family(child.first), lane));
                find(tree, *below, path, paths);
                path.pop();
            }
        }
    }
    for b in child.first..child.first + child.bundles {
        let first = tree.bundles[b as usize].first as usize;
        // A leaf's last may have less, which the next one's first overwrite.
        for lane in 0..(tree.lines.len() - first).min(8) {
            paths[first + lane] = path.clone();
            paths[first + lane].push((NodeGroup::Bundle(b), lane));
        }
    }
}

/// Weights of silhouettes and creases that can be told apart.
pub(super) const PRIORS: (f64, [f64; 2]) = (1.0, [0.3, 0.15]);

/// All edges of a mesh that are not flat.
pub(super) fn segments(mesh: &Mesh, (discontinuity, crease): (f64, [f64; 2])) -> Vec<Segment> {
    let normal = |f: u32| {
        let [a, b, c] = mesh.triangles[f as usize].map(|v| mesh.positions[v as usize]);
        (b - a).cross(c - a).normalize()
    };
    let topology = Topology::of(mesh);
    let edges = topology.edges.iter().filter(|e| e.class != EdgeClass::Flat);
    let segment = |e: &crate::Edge| {
        let [a, b] = e.vertices.map(|v| mesh.positions[v as usize]);
        let open = e.faces[1] == NONE;
        let faces = [normal(e.faces[0]), if open { Vec3::ZERO } else { normal(e.faces[1]) }];
        Segment { a, b, faces, open, discontinuity, crease }
    };
    edges.map(segment).collect()
}

/// The weight with which a segment counts, seen from `x`.
fn prior(s: &Segment, x: Vec3) -> f64 {
    if s.open {
        return s.discontinuity;
    }
    match s.faces.map(|n| n.dot(x - s.a) > 0.0) {
        [true, true] => s.crease[0],
        [false, false] => s.crease[1],
        _ => s.discontinuity,
    }
}

/// What a point of a segment amounts to: angular speed times weight times cosine.
pub(super) fn kernel(s: &Segment, u: f64, view: &Viewpoint) -> f64 {
    let to = s.a.lerp(s.b, u) - view.x;
    let r = to.length();
    let sine = to.cross(s.b - s.a).length() / (r * (s.b - s.a).length());
    let cosine = view.normal.map_or(1.0, |(n, through)| {
        let c = n.dot(to) / r;
        if through { c.abs() } else { c.max(0.0) }
    });
    prior(s, view.x) * sine * cosine / (r * r)
}

/// The integral over all segments of what their points amount to.
pub(super) fn integral(segments: &[Segment], view: &Viewpoint) -> f64 {
    const STEPS: u32 = 400;
    let along = |s: &Segment| -> f64 {
        // Steps of equal angles.
        let length = (s.b - s.a).length();
        let tangent = (s.b - s.a) / length;
        let start = (s.a - view.x).dot(tangent);
        let d = (s.a - view.x).reject(tangent).length();
        let [from, to] = [start, start + length].map(|t| (t / d).atan());
        let step = (to - from) / f64::from(STEPS);
        let at = |i: u32| {
            let angle = from + (f64::from(i) + 0.5) * step;
            let per_angle = d / (angle.cos() * angle.cos());
            kernel(s, (d * angle.tan() - start) / length, view) * per_angle * step
        };
        (0..STEPS).map(at).sum()
    };
    segments.iter().filter(|s| prior(s, view.x) > 0.0).map(along).sum()
}

/// The mesh scaled and then shifted.
pub(super) fn moved(mesh: &Mesh, scale: f64, by: Vec3) -> Mesh {
    let positions = mesh.positions.iter().map(|p| *p * scale + by).collect();
    Mesh { positions, ..mesh.clone() }
}

pub(super) fn direction(rng: &mut Rng) -> Vec3 {
    warp::uniform_sphere(rng.next_2d())
}

/// A point in the cube from -1 to 1.
pub(super) fn in_cube(rng: &mut Rng) -> Vec3 {
    vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) * 2.0 - Vec3::splat(1.0)
}

/// A cube, a ball with dents, and a sheet with a rim.
pub(super) fn still_life() -> Vec<Segment> {
    let meshes = [
        moved(&procedural::cube(), 0.5, vec3(-1.2, 0.1, 0.2)),
        moved(&procedural::bumpy_sphere(2, 0.3, 4.0), 0.7, vec3(1.1, -0.3, 0.1)),
        moved(&procedural::grid(3, 3), 2.0, vec3(0.0, 0.3, -1.1)),
    ];
    meshes.iter().flat_map(|m| segments(m, PRIORS)).collect()
}

/// From a volume, from a surface, and from one that lets light through; some way off all edges.
pub(super) fn views() -> [Viewpoint; 4] {
    let up = vec3(0.2, -0.1, 1.0).normalize();
    [
        Viewpoint::new(vec3(0.1, 0.2, 1.3), None),
        Viewpoint::new(vec3(-0.2, 0.9, -0.4), Some((up, false))),
        Viewpoint::new(vec3(0.3, -1.2, 0.15), Some((up, true))),
        Viewpoint::new(vec3(-1.1, -0.9, -2.0), Some((vec3(0.0, 0.6, 0.8), false))),
    ]
}
