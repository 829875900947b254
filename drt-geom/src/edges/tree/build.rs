//! Putting segments that lie close together into the same nodes.
//!
//! Spans of segments are cut in two where that makes the sum over both parts of weight times squared
//! diagonal least, at one of a few places along the longest side (as Wald 2007, "On fast Construction
//! of SAH-based Bounding Volume Hierarchies", does it for rays). They are also cut by length: a
//! room's few long edges would else blow up the boxes of a fine mesh in it. On meshes, segments that
//! lie close together face alike too; to cut by their normals as well was found to gain nothing.

use alloc::vec::Vec;
use core::ops::Range;

use crate::Aabb;
use crate::query::Registers;
use drt_math::fm;

use crate::edges::tree::bundle::Bundle;
use crate::edges::tree::eight::LANES;
use crate::edges::tree::node::{Child, Family, Node};
use crate::edges::tree::piece::{Line, Piece};
use crate::edges::tree::{ARITY, EdgeTree, LEAF, Segment};

impl EdgeTree {
    /// A tree over the segments that can count. `None` when there are none: when each is without
    /// length or weight, or not finite.
    #[must_use]
    pub fn new(segments: &[Segment]) -> Option<Self> {
        let mut pieces: Vec<Piece> =
            segments.iter().zip(0..).filter_map(|(s, edge)| Piece::new(s, edge)).collect();
        if pieces.is_empty() {
            return None;
        }
        let spans = spans(&mut pieces);
        let (mut bundles, mut families) = (Vec::new(), 0);
        let mut children = Vec::with_capacity(spans.len());
        for span in &spans {
            if span.children.is_empty() {
                let first = bundles.len() as u32;
                for from in (span.begin..span.end).step_by(LANES) {
                    let until = span.end.min(from + LANES);
                    bundles.push(Bundle::new(&pieces[from..until], from));
                }
                children.push(Child { first, bundles: bundles.len() as u32 - first });
            } else {
                children.push(Child { first: families, bundles: 0 });
                families += 1;
            }
        }
        let family = |span: &Span| {
            let node = |k: usize| {
                let below = pieces[spans[k].begin..spans[k].end].iter();
                (Node::around(below), children[k])
            };
            let nodes: Vec<(Node, Child)> = span.children.clone().map(node).collect();
            Family::new(&nodes, span.len())
        };
        let families = spans.iter().filter(|s| !s.children.is_empty()).map(family).collect();
        let lines: Vec<Line> = pieces.iter().map(|p| p.line).collect();
        let largest = lines.iter().fold(0.0, |m, l| f64::max(m, l.a.max_abs() + l.length));
        Some(Self {
            root: children[0],
            families,
            bundles,
            lines,
            largest,
            registers: Registers::widest(),
        })
    }
}

/// Places at which a span may be cut.
const CUTS: usize = 16;

/// Deeper than this, spans are cut at the median.
const DEEP: u32 = 48;

/// A segment on its way to its place.
#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    /// The middle, and the logarithm of the length.
    key: [f64; 4],
    weight: f64,
    piece: u32,
}

/// Consecutive items.
#[derive(Clone)]
struct Span {
    begin: usize,
    end: usize,
    depth: u32,
    /// What cutting it may gain.
    cost: f64,
    /// Its parts among all spans.
    children: Range<usize>,
}

impl Span {
    fn new(begin: usize, end: usize, depth: u32, items: &[Item]) -> Self {
        let all = items[begin..end].iter().fold(Bin::EMPTY, |bin, item| bin.with(&item.into()));
        Self { begin, end, depth, cost: all.cost(), children: 0..0 }
    }

    fn len(&self) -> usize {
        self.end - self.begin
    }

    /// Orders its items so that those of both parts are together.
    fn cut(&self, items: &mut [Item]) -> [Self; 2] {
        let part = &mut items[self.begin..self.end];
        let (axis, count) = best_cut(part, self.depth);
        part.select_nth_unstable_by(count, |a, b| a.key[axis].total_cmp(&b.key[axis]));
        let (middle, depth) = (self.begin + count, self.depth + 1);
        [[self.begin, middle], [middle, self.end]].map(|[b, e]| Self::new(b, e, depth, items))
    }
}

/// Orders the pieces by the spans they are in, of which the first has all. Parts of one are in a row.
fn spans(pieces: &mut Vec<Piece>) -> Vec<Span> {
    let mut items = items(pieces);
    let mut spans = alloc::vec![Span::new(0, items.len(), 0, &items)];
    let mut next = 0;
    while next < spans.len() {
        if spans[next].len() > LEAF {
            let first = spans.len();
            spans.extend(cut_often(spans[next].clone(), &mut items));
            spans[next].children = first..spans.len();
        }
        next += 1;
    }
    *pieces = items.iter().map(|i| pieces[i.piece as usize]).collect();
    spans
}

/// The parts of a span after as many cuts as make [`ARITY`] of them, each cut where most is gained.
fn cut_often(span: Span, items: &mut [Item]) -> Vec<Span> {
    let mut parts = alloc::vec![span];
    while parts.len() < ARITY {
        let large = (0..parts.len()).filter(|i| parts[*i].len() > LEAF);
        let order = |i: &usize, j: &usize| {
            let (a, b) = (&parts[*i], &parts[*j]);
            a.cost.total_cmp(&b.cost).then(a.len().cmp(&b.len()))
        };
        let Some(i) = large.max_by(order) else { break };
        let [first, second] = parts[i].cut(items);
        parts[i] = first;
        parts.insert(i + 1, second);
    }
    parts
}

/// Items between two cuts.
#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    weight: f64,
    count: usize,
}

impl Bin {
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, weight: 0.0, count: 0 };

    fn with(&self, o: &Self) -> Self {
        Self {
            bounds: self.bounds.union(&o.bounds),
            weight: self.weight + o.weight,
            count: self.count + o.count,
        }
    }

    fn cost(&self) -> f64 {
        if self.count == 0 { 0.0 } else { self.weight * self.bounds.extent().length_squared() }
    }
}

impl From<&Item> for Bin {
    fn from(item: &Item) -> Self {
        Self { bounds: item.bounds, weight: item.weight, count: 1 }
    }
}

/// An axis, and how many of the items come first along it: the longest axis of places, or that of
/// lengths.
fn best_cut(items: &[Item], depth: u32) -> (usize, usize) {
    let (mut low, mut high) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
    for item in items {
        for k in 0..4 {
            low[k] = low[k].min(item.key[k]);
            high[k] = high[k].max(item.key[k]);
        }
    }
    let extent = |k: usize| high[k] - low[k];
    let longest = (0..LENGTH).fold(0, |best, k| if extent(k) > extent(best) { k } else { best });
    let mut best = (f64::INFINITY, (longest, items.len() / 2));
    let axes = if depth < DEEP { &[longest, LENGTH][..] } else { &[] };
    for axis in axes.iter().copied().filter(|k| extent(*k) > 0.0) {
        let scale = CUTS as f64 / extent(axis);
        let mut bins = [Bin::EMPTY; CUTS];
        for item in items {
            let bin = &mut bins[(((item.key[axis] - low[axis]) * scale) as usize).min(CUTS - 1)];
            *bin = bin.with(&item.into());
        }
        let mut after = [Bin::EMPTY; CUTS];
        for k in (1..CUTS).rev() {
            after[k - 1] = after[k].with(&bins[k]);
        }
        let mut before = Bin::EMPTY;
        for k in 0..CUTS {
            before = before.with(&bins[k]);
            let cost = before.cost() + after[k].cost();
            if after[k].count > 0 && cost < best.0 {
                best = (cost, (axis, before.count));
            }
        }
    }
    best.1
}

/// The axis of lengths.
const LENGTH: usize = 3;

fn items(pieces: &[Piece]) -> Vec<Item> {
    let item = |(p, piece): (&Piece, u32)| {
        let bounds = Aabb::around(p.line.ends());
        let [x, y, z] = bounds.center().to_array();
        Item { bounds, key: [x, y, z, fm::ln(p.line.length)], weight: p.most(), piece }
    };
    pieces.iter().zip(0..).map(item).collect()
}
