//! Putting segments that lie close together and face alike into the same nodes.

use alloc::vec::Vec;
use core::ops::Range;

use drt_math::{Vec3, vec3};

use super::node::Node;
use super::piece::Piece;
use super::{EdgeTree, Segment, Span};

impl EdgeTree {
    /// A tree over the segments that can count. `None` when there are none: when each is without
    /// length or weight, or not finite.
    pub(crate) fn new(segments: &[Segment]) -> Option<Self> {
        let mut pieces: Vec<Piece> =
            segments.iter().zip(0..).filter_map(|(s, edge)| Piece::new(s, edge)).collect();
        let nodes = build(&mut pieces)?;
        let mut places = alloc::vec![u32::MAX; segments.len()];
        for (piece, place) in pieces.iter().zip(0..) {
            places[piece.edge as usize] = place;
        }
        let largest = pieces.iter().fold(0.0, |m, p| f64::max(m, p.a.max_abs() + p.length));
        Some(Self { nodes, pieces, places, largest })
    }
}

/// A segment's place among others: its middle, in units of the whole set's extent, and the mean of
/// its normals.
type Key = [f32; 6];

/// How much normals at right angles count in comparison with middles an extent apart. Measured on
/// spheres, dented spheres and cubes: with more, near viewpoints suffer, and others gain little.
const TURN: f64 = 0.1;

/// Orders the pieces and builds the nodes over them, each followed somewhere by its children in a
/// row.
fn build(pieces: &mut Vec<Piece>) -> Option<Vec<Node>> {
    if pieces.is_empty() {
        return None;
    }
    let (keys, unit) = (keys(pieces), unit(pieces));
    let mut order: Vec<u32> = (0..pieces.len() as u32).collect();
    let node = |span: &Span, order: &[u32]| {
        Node::around(order[span.range()].iter().map(|i| &pieces[*i as usize]), unit)
    };
    let all = Span { begin: 0, len: order.len() };
    let (mut nodes, mut spans) = (alloc::vec![node(&all, &order)], alloc::vec![all]);
    let mut next = 0;
    while next < nodes.len() {
        let span = spans[next];
        let parts = span.parts();
        if parts > 0 {
            nodes[next].children = nodes.len() as u32;
            halve(&mut order, &keys, span, parts, 0..parts);
            for k in 0..parts {
                let part = span.part(k, parts);
                nodes.push(node(&part, &order));
                spans.push(part);
            }
        }
        next += 1;
    }
    *pieces = order.iter().map(|i| pieces[*i as usize]).collect();
    Some(nodes)
}

/// Orders a span so that its parts are what halving at the median, along the widest axis each time,
/// makes of it.
fn halve(order: &mut [u32], keys: &[Key], span: Span, count: usize, parts: Range<usize>) {
    if parts.len() < 2 {
        return;
    }
    let middle = (parts.start + parts.end) / 2;
    let [begin, cut, end] = [parts.start, middle, parts.end].map(|k| span.part(k, count).begin);
    let part = &mut order[begin..end];
    let axis = widest(part, keys);
    part.select_nth_unstable_by(cut - begin, |i, j| {
        keys[*i as usize][axis].total_cmp(&keys[*j as usize][axis])
    });
    halve(order, keys, span, count, parts.start..middle);
    halve(order, keys, span, count, middle..parts.end);
}

fn widest(part: &[u32], keys: &[Key]) -> usize {
    let (mut low, mut high) = ([f32::INFINITY; 6], [f32::NEG_INFINITY; 6]);
    for i in part {
        for (k, x) in keys[*i as usize].into_iter().enumerate() {
            low[k] = low[k].min(x);
            high[k] = high[k].max(x);
        }
    }
    (0..6).fold(0, |best, k| if high[k] - low[k] > high[best] - low[best] { k } else { best })
}

fn keys(pieces: &[Piece]) -> Vec<Key> {
    let middle = |p: &Piece| p.a + p.tangent * (0.5 * p.length);
    let all = vec3(f64::INFINITY, f64::INFINITY, f64::INFINITY);
    let (low, high) =
        pieces.iter().fold((all, -all), |(low, high), p| (low.min(middle(p)), high.max(middle(p))));
    let extent = (high - low).max_abs();
    let scale = if extent > 0.0 { 1.0 / extent } else { 0.0 };
    let key = |p: &Piece| {
        let at: Vec3 = (middle(p) - low) * scale;
        let n = (p.faces[0] + p.faces[1]) * (0.5 * TURN);
        [at.x, at.y, at.z, n.x, n.y, n.z].map(|x| x as f32)
    };
    pieces.iter().map(key).collect()
}

/// The weight of all segments, were each to count as what it counts for most.
fn unit(pieces: &[Piece]) -> f64 {
    let most = |p: &Piece| p.jump.max(p.crease[0]).max(p.crease[1]);
    pieces.iter().map(|p| most(p) * p.length).sum()
}
