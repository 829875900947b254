//! Points on edges for the boundary term of the 2019 form (theory sheet §3), drawn as they matter to
//! one scattering vertex.
//!
//! At a vertex x that term is an integral over all edges at which the radiance arriving at x jumps,
//!
//! ```text
//! ∫ f(x, w) ΔL(x, w) N.(y_dot - x_dot) sin(t, w) / r^2 dl(y),    r = |y - x|, w r = y - x,
//! ```
//!
//! t the edge's tangent. Of a fine mesh few edges have a jump: silhouettes, one of whose faces turns
//! its front to x and the other its back, and creases between faces with different radiance. Which an
//! edge is depends on x alone and is the same all along it, since the planes of its faces hold it.
//!
//! [`EdgeTree`] is a hierarchy over edges with bounds of their positions and normals (Li et al. 2018,
//! "Differentiable Monte Carlo Ray Tracing through Edge Sampling", section 4), gone through as
//! hierarchies of lights are (Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with
//! Adaptive Tree Splitting"): from the root down, one of a node's children is chosen in proportion
//! to an estimate of
//!
//! ```text
//! sum over its edges: weight × length × P(counts as silhouette or crease) × f / r^2,
//! ```
//!
//! f being a [sketch](crate::edges::Lobes) of how x scatters: a cosine with the normal of a surface,
//! and lobes, as wide as the node is seen besides their own width. The estimate (`node`) is positive
//! wherever an edge below may count, so nothing is lost, and 0 where it is proved that none does.
//! Near x nodes are opened first, down to their edges (`cut`), and the first choice is among all that
//! this leaves. Nodes have eight children, as each choice adds its error and a wide tree has few of
//! them, and as eight are judged at once (`eight`); leaves weigh their edges one by one, eight at once too
//! (`bundle`). On the edge the density is sin / r^2, exactly (`kernel`), mixed with that of lobes that are narrow
//! along it (`glint`). A sample costs time
//! logarithmic in the number of edges.
//!
//! A node may turn out to hold nothing that counts after all. Then there is no sample, and the
//! density is what it is, with an integral below one: an estimate that takes such a sample for zero
//! is unbiased.
//!
//! There are several [ways](Way) to sample, as towards a light: at what is in the cone of directions to a
//! sphere around it, with edges cut to their part in the cone. One way is drawn for each sample, but
//! on the way down the probabilities of all are known, since all weigh the same nodes and differ only by
//! how much of them is in a cone. So the density is that of all ways together, at the cost of one
//! descent (balance heuristic of one sample; Veach & Guibas 1995). Ways that have nothing to choose
//! from leave their part to the others.
//!
//! ```
//! use drt_geom::edges::tree::{Draw, EdgeTree, Segment, TreeScratch, Viewpoint, Way};
//! use drt_math::{Vec3, vec3};
//!
//! // The rim of a sheet along x, seen from a point in space that scatters evenly.
//! let rim = Segment {
//!     a: vec3(-1.0, 0.0, 0.0),
//!     b: vec3(1.0, 0.0, 0.0),
//!     faces: [Vec3::Z; 2],
//!     open: true,
//!     discontinuity: 1.0,
//!     crease: [1.0; 2],
//! };
//! let tree = EdgeTree::new(&[rim]).expect("has a length");
//! let from = Viewpoint::new(vec3(0.0, 0.0, 2.0), None);
//! let draw = Draw { way: 0.5, point: [0.5, 0.5] };
//! let mut scratch = TreeScratch::default();
//! let found = tree.sample(&from, &[Way::anywhere(1.0)], &draw, &mut scratch).expect("in sight");
//! assert!(found.edge == 0 && (found.u - 0.5).abs() < 1e-12 && found.inv_pdf > 0.0);
//! ```

mod build;
mod bundle;
mod cut;
mod eight;
mod glint;
mod kernel;
mod node;
mod options;
mod piece;
mod seen;
#[cfg(all(test, feature = "std"))]
mod tests;
mod view;

use alloc::vec::Vec;

use crate::query::{Registers, Work};
use drt_math::Vec3;

use crate::edges::tree::bundle::Bundle;
use crate::edges::tree::cut::Looking;
use crate::edges::tree::node::{Child, Family};
use crate::edges::tree::options::NodeGroup;
pub use crate::edges::tree::options::TreeScratch;
use crate::edges::tree::piece::{Line, Stretch};
pub use crate::edges::tree::view::{MOST_WAYS, Viewpoint, Way};

/// An edge of a surface at which the radiance may jump that arrives at a point.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Its first end.
    pub a: Vec3,
    /// Its second end.
    pub b: Vec3,
    /// Unit normals of the two faces, on the sides that are one side of the surface; only the first
    /// is looked at of an open edge.
    pub faces: [Vec3; 2],
    /// One face only: always a silhouette.
    pub open: bool,
    /// What to expect of the jump where the edge is a silhouette.
    pub discontinuity: f64,
    /// The same where both faces are seen from the front, and where both are from the back.
    pub crease: [f64; 2],
}

/// A point on an edge.
#[derive(Clone, Copy, Debug)]
pub struct Chosen {
    /// Index among the edges that the tree was built of.
    pub edge: usize,
    /// How far it is from the edge's first end, as a part of its length.
    pub u: f64,
    /// 1 over the density per length.
    pub inv_pdf: f64,
}

/// Edges to choose from; see the [module](self).
#[derive(Debug)]
pub struct EdgeTree {
    root: Child,
    /// The children of nodes.
    families: Vec<Family>,
    /// In the order of the leaves.
    bundles: Vec<Bundle>,
    /// In the same order.
    lines: Vec<Line>,
    /// Of all coordinates.
    largest: f64,
    registers: Registers,
}

/// Most children of a node.
const ARITY: usize = eight::LANES;

/// Evenly made choices in comparison with others.
const EVEN: f64 = 0.1;

/// Most segments of a leaf: among fewer than this, the number of silhouettes is hard to guess.
const LEAF: usize = 32;

/// Uniform numbers to draw a point with.
#[derive(Clone, Copy, Debug)]
pub struct Draw {
    /// For the way of looking.
    pub way: f64,
    /// For the edge: what each choice leaves of it serves for the next. And for the place on it.
    pub point: [f64; 2],
}

impl EdgeTree {
    /// Draws a point by looking one of several ways; its density is that of all of them together.
    /// `None` where nothing counts, or nothing is found (see [above](self)).
    pub fn sample(
        &self,
        view: &Viewpoint,
        ways: &[Way],
        draw: &Draw,
        options: &mut TreeScratch,
    ) -> Option<Chosen> {
        self.registers.run(Sampling { tree: self, view, ways, draw, options })
    }

    /// An estimate of the integral over all segments of kernel, scattering and weight, looking one way.
    pub fn amount(&self, view: &Viewpoint, way: &Way, options: &mut TreeScratch) -> f64 {
        self.registers.run(Summing { tree: self, view, way, options })
    }

    /// The same tree, with registers that every machine has.
    #[cfg(all(test, feature = "std"))]
    fn portable(self) -> Self {
        Self { registers: Registers::portable(), ..self }
    }

    /// What rounding may move places by.
    fn slack(&self, view: &Viewpoint) -> f64 {
        1e-15 * (self.largest + view.x.max_abs())
    }

    /// Goes down by choices among options, given how probable what they are part of is, each way.
    /// Returns the line, and how probable it is.
    #[inline(always)]
    fn descend(
        &self,
        view: &Viewpoint,
        ways: &[Way],
        options: &mut TreeScratch,
        mut choose: impl FnMut(&TreeScratch, &[f64]) -> Option<(usize, usize)>,
    ) -> Option<(&Line, [f64; MOST_WAYS])> {
        let query_rays = Looking::new(view, ways, self.slack(view), true)?;
        let (mut child, mut open) = (self.root, query_rays.seen.normal.is_none());
        let mut so_far = None;
        loop {
            self.cut(child, &query_rays, open, options);
            let chances = so_far.get_or_insert_with(|| first_chances(ways, options));
            let (group, lane) = choose(options, &chances[..ways.len()])?;
            for (way, chance) in chances[..ways.len()].iter_mut().enumerate() {
                *chance *= options.chance(way, (group, lane));
            }
            match options.groups()[group] {
                NodeGroup::Family(f) => {
                    child = self.families[f as usize].children[lane];
                    open = false;
                }
                NodeGroup::Bundle(b) => {
                    let place = self.bundles[b as usize].first as usize + lane;
                    return Some((&self.lines[place], *chances));
                }
            }
        }
    }
}

/// The work of [`EdgeTree::sample`].
struct Sampling<'a> {
    tree: &'a EdgeTree,
    view: &'a Viewpoint,
    ways: &'a [Way],
    draw: &'a Draw,
    options: &'a mut TreeScratch,
}

impl Work for Sampling<'_> {
    type Output = Option<Chosen>;

    #[inline(always)]
    fn run(self) -> Option<Chosen> {
        let Self { tree, view, ways, draw, options } = self;
        let [mut u, along] = draw.point;
        let mut by = None;
        let (line, chances) = tree.descend(view, ways, options, |options, chances| {
            let way = match by {
                Some(way) => way,
                None => *by.insert(pick(chances, draw.way)?),
            };
            options.choose(way, &mut u)
        })?;
        let (by, slack) = (by?, tree.slack(view));
        let stretches = stretches(line, view, ways, &chances, slack);
        let u = stretches[by].as_ref()?.sample(along);
        let pdf = density(&stretches, &chances, u);
        Some(Chosen { edge: line.edge as usize, u, inv_pdf: 1.0 / pdf })
    }
}

/// The work of [`EdgeTree::amount`].
struct Summing<'a> {
    tree: &'a EdgeTree,
    view: &'a Viewpoint,
    way: &'a Way,
    options: &'a mut TreeScratch,
}

impl Work for Summing<'_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let Self { tree, view, way, options } = self;
        let slack = tree.slack(view);
        let Some(query_rays) = Looking::new(view, core::slice::from_ref(way), slack, false) else {
            return 0.0;
        };
        tree.cut(tree.root, &query_rays, query_rays.seen.normal.is_none(), options);
        options.sum(0)
    }
}

/// The chances of ways that have something to choose.
fn first_chances(ways: &[Way], options: &TreeScratch) -> [f64; MOST_WAYS] {
    let mut chances = [0.0; MOST_WAYS];
    for (k, way) in ways.iter().enumerate() {
        chances[k] = if options.sum(k) > 0.0 { way.chance } else { 0.0 };
    }
    let total: f64 = chances.iter().sum();
    chances.map(|c| if c > 0.0 { c / total } else { 0.0 })
}

/// One of some chances that sum to one.
fn pick(chances: &[f64], mut u: f64) -> Option<usize> {
    let mut chosen = None;
    for (k, chance) in chances.iter().enumerate().filter(|(_, c)| **c > 0.0) {
        chosen = Some(k);
        u -= chance;
        if u < 0.0 {
            break;
        }
    }
    chosen
}

/// The parts of a line that count each possible way.
fn stretches(
    line: &Line,
    view: &Viewpoint,
    ways: &[Way],
    chances: &[f64; MOST_WAYS],
    slack: f64,
) -> [Option<Stretch>; MOST_WAYS] {
    let mut stretches = [None; MOST_WAYS];
    for (k, way) in ways.iter().enumerate().filter(|(k, _)| chances[*k] > 0.0) {
        stretches[k] = line.stretch(view, way, slack);
    }
    stretches
}

/// Density per length at a place on a line, by the parts of it that count each way.
fn density(stretches: &[Option<Stretch>; MOST_WAYS], chances: &[f64; MOST_WAYS], u: f64) -> f64 {
    let of = |(stretch, chance): (&Option<Stretch>, &f64)| {
        stretch.as_ref().map_or(0.0, |s| chance * s.pdf(u))
    };
    stretches.iter().zip(chances).map(of).sum()
}
