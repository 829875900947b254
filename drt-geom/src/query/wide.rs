//! The tree that queries walk: nodes of eight children whose boxes are tested together.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use super::children::{LEAF, NO_CHILD, WIDTH};
use super::collapse::Collapsed;
use super::frame::{Box32, BoxPoint, BoxRay};
use super::lanes::{Lanes, Vector};

/// Entries of the stack before it goes on in the heap: enough unless a tree is huge or very uneven, and few
/// enough to be cleared without a call.
const STACK: usize = 32;

/// An inner node, four lines of cache.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct WideNode {
    /// Lower and upper bounds of the children by axis: x, x, y, y, z, z. Children that are not there
    /// have the empty box, which nothing enters.
    bounds: [[f32; WIDTH]; 6],
    /// Another node, a block with the mark [`LEAF`], or [`NO_CHILD`].
    children: [u32; WIDTH],
}

/// The tree. It numbers blocks of primitives in its own order.
#[derive(Clone, Debug)]
pub(super) struct WideTree {
    /// The root first, children after their parents.
    nodes: Vec<WideNode>,
}

/// What a walk does with the blocks it meets.
pub(super) trait Visitor {
    /// Looks at a block, and answers where the walk ends from now on: the ray's parameter, or the
    /// squared distance. Breaks off a walk that has found enough.
    fn block<L: Lanes>(&mut self, lanes: L, index: usize) -> ControlFlow<(), f32>;
    /// Is told of a block that it will be shown, unless it finds something nearer first.
    fn announce<L: Lanes>(&self, lanes: L, index: usize);
}

/// What a walk follows through the boxes.
pub(super) trait Query: Copy {
    /// Those of a node's boxes, as bits, that begin before `far`; and where each does.
    fn enter<L: Lanes>(self, lanes: L, node: &WideNode, far: f32) -> (u32, [f32; WIDTH]);
    /// Where the walk ends at first.
    fn far(self) -> f32;
}

impl WideTree {
    /// The tree with the boxes of its blocks.
    pub(super) fn new(collapsed: &Collapsed, block: impl Fn(usize) -> Box32) -> Self {
        let node = |children: &[u32; WIDTH]| WideNode { bounds: EMPTY, children: *children };
        let mut tree = Self { nodes: collapsed.nodes.iter().map(node).collect() };
        tree.fit(block);
        tree
    }

    /// New boxes for the same tree, by block.
    pub(super) fn fit(&mut self, block: impl Fn(usize) -> Box32) {
        for i in (0..self.nodes.len()).rev() {
            for place in 0..WIDTH {
                let child = self.nodes[i].children[place];
                let bounds = match child {
                    NO_CHILD => Box32::EMPTY,
                    _ if child & LEAF != 0 => block((child & !LEAF) as usize),
                    _ => self.nodes[child as usize].union(),
                };
                for (k, row) in self.nodes[i].bounds.iter_mut().enumerate() {
                    row[place] = if k % 2 == 0 { bounds.min[k / 2] } else { bounds.max[k / 2] };
                }
            }
        }
    }

    /// The boxes that a random line through the scene meets, in the mean: the sum of their surfaces over that of them all.
    pub(super) fn boxes_met(&self) -> f64 {
        let Some(root) = self.nodes.first() else { return 0.0 };
        let surface = |low: [f32; 3], high: [f32; 3]| {
            let [x, y, z] = [0, 1, 2].map(|k| f64::from(high[k]) - f64::from(low[k]));
            x * y + y * z + z * x
        };
        let child = |node: &WideNode, place: usize| {
            let side = |first: usize| [0, 2, 4].map(|k| node.bounds[k + first][place]);
            if node.children[place] == NO_CHILD { 0.0 } else { surface(side(0), side(1)) }
        };
        let all = self.nodes.iter().flat_map(|n| (0..WIDTH).map(move |place| child(n, place)));
        let whole = root.union();
        all.sum::<f64>() / surface(whole.min, whole.max)
    }

    /// Shows the visitor every block whose box the query meets, by and large the nearer first.
    #[inline(always)]
    pub(super) fn walk<L: Lanes>(&self, lanes: L, query: impl Query, visitor: &mut impl Visitor) {
        let mut far = query.far();
        let mut stack = Stack { entries: [0; STACK], len: 0, spilled: Vec::new() };
        let mut next = entry(0.0, 0);
        loop {
            let index = next as u32;
            if index & LEAF != 0 {
                match visitor.block(lanes, (index & !LEAF) as usize) {
                    ControlFlow::Continue(limit) => far = limit,
                    ControlFlow::Break(()) => return,
                }
            } else {
                let node = &self.nodes[index as usize];
                let (mut mask, begin) = query.enter(lanes, node, far);
                // The nearest so far is not in the list, farthest first, of the others.
                let (mut nearest, mut others, mut count) = (u64::MAX, [0; WIDTH], 0);
                while mask != 0 {
                    let place = mask.trailing_zeros() as usize % WIDTH;
                    mask &= mask - 1;
                    let child = node.children[place];
                    self.announce(lanes, child, visitor);
                    let this = entry(begin[place], child);
                    let other = u64::max(this, nearest);
                    nearest = u64::min(this, nearest);
                    if other != u64::MAX {
                        let mut k = count % WIDTH;
                        while k > 0 && others[k - 1] < other {
                            others[k] = others[k - 1];
                            k -= 1;
                        }
                        others[k] = other;
                        count += 1;
                    }
                }
                if nearest != u64::MAX {
                    for other in &others[..count % WIDTH] {
                        stack.push(*other);
                    }
                    next = nearest;
                    continue;
                }
            }
            loop {
                let Some(later) = stack.pop() else { return };
                if f32::from_bits((later >> 32) as u32) <= far {
                    next = later;
                    break;
                }
            }
        }
    }

    /// Has a child brought near that a walk will come to.
    #[inline(always)]
    fn announce<L: Lanes>(&self, lanes: L, child: u32, visitor: &impl Visitor) {
        if child & LEAF != 0 {
            visitor.announce(lanes, (child & !LEAF) as usize);
        } else {
            lanes.prefetch(&self.nodes[child as usize]);
        }
    }
}

const EMPTY: [[f32; WIDTH]; 6] = {
    let (low, high) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
    [low, high, low, high, low, high]
};

impl WideNode {
    /// The children's lower and upper bounds along an axis.
    #[inline(always)]
    pub(super) fn bounds<L: Lanes>(&self, lanes: L, axis: usize) -> [L::Singles; 2] {
        [lanes.singles(&self.bounds[2 * axis]), lanes.singles(&self.bounds[2 * axis + 1])]
    }

    /// The box around all children.
    fn union(&self) -> Box32 {
        Box32::around((0..WIDTH).map(|c| Box32 {
            min: [0, 1, 2].map(|k| self.bounds[2 * k][c]),
            max: [0, 1, 2].map(|k| self.bounds[2 * k + 1][c]),
        }))
    }
}

impl Query for &BoxRay {
    #[inline(always)]
    fn enter<L: Lanes>(self, lanes: L, node: &WideNode, far: f32) -> (u32, [f32; WIDTH]) {
        let (mut enter, mut leave) = (lanes.single(0.0), lanes.single(far));
        for k in 0..3 {
            let back = usize::from(self.inverse[k] < 0.0);
            let inverse = lanes.single(self.inverse[k]);
            let front = lanes.singles(&node.bounds[2 * k + back]);
            let rear = lanes.singles(&node.bounds[2 * k + 1 - back]);
            enter = ((front - lanes.single(self.enter[k])) * inverse).max(enter);
            leave = ((rear - lanes.single(self.leave[k])) * inverse).min(leave);
        }
        (enter.le(leave), enter.array())
    }
    fn far(self) -> f32 {
        self.far
    }
}

impl Query for BoxPoint {
    #[inline(always)]
    fn enter<L: Lanes>(self, lanes: L, node: &WideNode, far: f32) -> (u32, [f32; WIDTH]) {
        let mut sum = lanes.single(0.0);
        for k in 0..3 {
            let below = lanes.singles(&node.bounds[2 * k]) - lanes.single(self.below[k]);
            let above = lanes.single(self.above[k]) - lanes.singles(&node.bounds[2 * k + 1]);
            let d = below.max(above).max(lanes.single(0.0));
            sum = sum + d * d;
        }
        let sum = sum * lanes.single(self.trust);
        (sum.le(lanes.single(far)), sum.array())
    }
    fn far(self) -> f32 {
        // No box that is there is as far as the largest number, and the empty one is farther.
        self.far
    }
}

/// A child and where it begins, ordered by that: the bits of floats that are not negative are.
#[inline(always)]
fn entry(begin: f32, child: u32) -> u64 {
    u64::from(begin.to_bits()) << 32 | u64::from(child)
}

/// What is left to visit.
struct Stack {
    entries: [u64; STACK],
    len: usize,
    spilled: Vec<u64>,
}

impl Stack {
    #[inline(always)]
    fn push(&mut self, e: u64) {
        if let Some(place) = self.entries.get_mut(self.len) {
            *place = e;
            self.len += 1;
        } else {
            self.spill(e);
        }
    }
    #[cold]
    fn spill(&mut self, e: u64) {
        self.spilled.push(e);
    }
    #[inline(always)]
    fn pop(&mut self) -> Option<u64> {
        if self.len == STACK
            && let Some(e) = self.spilled.pop()
        {
            return Some(e);
        }
        self.len = self.len.checked_sub(1)?;
        self.entries.get(self.len).copied()
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::{STACK, Stack};

    #[test]
    fn a_stack_holds_more_than_it_has_room_for() {
        let mut stack = Stack { entries: [0; STACK], len: 0, spilled: Vec::new() };
        let mut model = Vec::new();
        for round in 0..10 {
            for i in 0..STACK as u64 / 2 {
                stack.push(round << 32 | i);
                model.push(round << 32 | i);
            }
            for _ in 0..round {
                assert_eq!(stack.pop(), model.pop());
            }
        }
        assert!(model.len() > 2 * STACK);
        while let Some(e) = model.pop() {
            assert_eq!(stack.pop(), Some(e));
        }
        assert_eq!(stack.pop(), None);
    }
}
