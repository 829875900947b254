//! Edges that coincide: of shapes put together from several, side by side or on top of each other.

use alloc::vec::Vec;

use drt_math::Vec3;

use crate::edges::Wedge;

/// Edges in groups, each of all edges between the same two points.
#[derive(Clone, Debug, Default)]
pub struct Coincident {
    order: Vec<usize>,
    /// Where groups end in `order`.
    ends: Vec<usize>,
}

impl Coincident {
    /// Groups edges by their ends, whose order does not count, and which must be equal as numbers.
    pub fn among<'a>(edges: impl IntoIterator<Item = &'a Wedge>) -> Self {
        let mut places: Vec<_> = edges.into_iter().map(place).zip(0..).collect();
        places.sort_unstable();
        let mut groups = Self { order: places.iter().map(|(_, i)| *i).collect(), ends: Vec::new() };
        let mut end = 0;
        for same in places.chunk_by(|a, b| a.0 == b.0) {
            end += same.len();
            groups.ends.push(end);
        }
        groups
    }

    /// Indices of the edges of each group, rising.
    pub fn groups(&self) -> impl Iterator<Item = &[usize]> {
        let starts = core::iter::once(&0).chain(&self.ends);
        starts.zip(&self.ends).map(|(start, end)| &self.order[*start..*end])
    }
}

/// The numbers of both ends, in rising order.
fn place(edge: &Wedge) -> [[u64; 3]; 2] {
    // Adding zero makes a zero positive.
    let bits = |p: Vec3| p.to_array().map(|c| (c + 0.0).to_bits());
    let [a, b] = edge.ends.map(bits);
    if a < b { [a, b] } else { [b, a] }
}

#[cfg(test)]
mod tests {
    use drt_math::vec3;

    use super::*;

    #[test]
    fn by_place_in_either_direction() {
        let (a, b, c) = (vec3(0.0, 0.0, 0.0), vec3(-0.0, 1.0, 0.0), vec3(0.0, 1.0, 1e-16));
        let across = vec3(1.0, 0.0, 0.0);
        let pairs = [[a, b], [a, c], [vec3(0.0, 1.0, -0.0), a], [b, c]];
        let edges = pairs.map(|ends| Wedge::new(ends, [across; 2], [0; 2]).unwrap());
        let coincident = Coincident::among(&edges);
        let mut groups: Vec<Vec<usize>> = coincident.groups().map(<[usize]>::to_vec).collect();
        groups.sort();
        assert_eq!(groups, [alloc::vec![0, 2], alloc::vec![1], alloc::vec![3]]);
        assert_eq!(Coincident::among(&[]).groups().count(), 0);
    }
}
