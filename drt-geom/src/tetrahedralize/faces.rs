//! A hash table in which the two sides of a face meet.

use alloc::vec::Vec;

use crate::NONE;

/// One side of a face: a tetrahedron ([`NONE`] outside the box) and the corner across from it.
#[derive(Clone, Copy, Debug)]
pub(super) struct TetCorner {
    pub(super) tet: u32,
    pub(super) corner: u32,
}

/// Open addressing with linear probing; entries stay until all are cleared.
#[derive(Debug, Default)]
pub(super) struct FaceTable {
    slots: Vec<([u32; 3], TetCorner)>,
    used: Vec<u32>,
}

const VACANT: ([u32; 3], TetCorner) = ([NONE; 3], TetCorner { tet: NONE, corner: 0 });

impl FaceTable {
    pub(super) fn clear(&mut self) {
        for i in self.used.drain(..) {
            self.slots[i as usize] = VACANT;
        }
    }

    /// The side that came first, or `side` stays and waits for the other.
    pub(super) fn take_or_insert(&mut self, face: [u32; 3], side: TetCorner) -> Option<TetCorner> {
        if 2 * self.used.len() >= self.slots.len() {
            self.grow();
        }
        let key = sorted(face);
        let i = self.slot(key);
        if self.slots[i].0 == key {
            return Some(self.slots[i].1);
        }
        self.slots[i] = (key, side);
        self.used.push(i as u32);
        None
    }

    fn slot(&self, key: [u32; 3]) -> usize {
        let mask = self.slots.len() - 1;
        let mix = key.iter().fold(0_u64, |h, &k| {
            (h.rotate_left(23) ^ u64::from(k)).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        });
        let mut i = (mix >> 32) as usize & mask;
        while self.slots[i].0 != key && self.slots[i].0 != VACANT.0 {
            i = (i + 1) & mask;
        }
        i
    }

    fn grow(&mut self) {
        let size = usize::max(256, 2 * self.slots.len());
        let entries: Vec<_> = self.used.iter().map(|&i| self.slots[i as usize]).collect();
        self.slots = alloc::vec![VACANT; size];
        self.used.clear();
        for (key, side) in entries {
            let i = self.slot(key);
            self.slots[i] = (key, side);
            self.used.push(i as u32);
        }
    }
}

pub(super) fn sorted([a, b, c]: [u32; 3]) -> [u32; 3] {
    let ([a, b], c) = (if a < b { [a, b] } else { [b, a] }, c);
    match c {
        _ if c < a => [c, a, b],
        _ if c < b => [a, c, b],
        _ => [a, b, c],
    }
}
