//! Many short lists in one.

use alloc::vec;
use alloc::vec::Vec;

/// A list of numbers for each of so many keys, all of them in one piece of memory.
#[derive(Clone, Debug)]
pub(crate) struct Lists {
    /// Where the list of each key starts, and where the last one ends.
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    /// The items of each key, in the order of the pairs `(key, item)`.
    pub(crate) fn new(keys: usize, pairs: &[(u32, u32)]) -> Self {
        let mut starts = vec![0; keys + 1];
        for (key, _) in pairs {
            starts[*key as usize + 1] += 1;
        }
        for k in 0..keys {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut items = vec![0; pairs.len()];
        for (key, item) in pairs {
            let at = &mut next[*key as usize];
            items[*at as usize] = *item;
            *at += 1;
        }
        Self { starts, items }
    }

    /// The items of a key.
    pub(crate) fn of(&self, key: usize) -> &[u32] {
        &self.items[self.starts[key] as usize..self.starts[key + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_keep_their_order() {
        let lists = Lists::new(4, &[(2, 7), (0, 1), (2, 5), (3, 9), (2, 6)]);
        assert_eq!(
            [0, 1, 2, 3].map(|k| lists.of(k).to_vec()),
            [vec![1], vec![], vec![7, 5, 6], vec![9]]
        );
    }
}
