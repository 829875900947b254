use alloc::sync::Arc;
use alloc::vec::Vec;
use core::ops::Index;

use drt_math::Vec3;

/// A vector for each vertex of a mesh. Where nearly all are zero, only the others are stored, so that many
/// parameters of a few vertices each take no more room and time than what they move.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "Vec<Vec3>", into = "Vec<Vec3>"))]
pub struct VertexVectors(Stored);

#[derive(Clone, Debug)]
enum Stored {
    All(Arc<[Vec3]>),
    /// The number of vertices, and the stored ones by ascending index.
    Few(usize, Vec<(u32, Vec3)>),
}

/// Vectors are stored singly where they are at most one in so many.
const FEW: usize = 16;

impl VertexVectors {
    /// Zero at `count` vertices.
    #[must_use]
    pub fn zeros(count: usize) -> Self {
        Self(Stored::Few(count, Vec::new()))
    }

    /// Zero at `count` vertices but for those listed by ascending index.
    pub(super) fn of_few(count: usize, few: Vec<(u32, Vec3)>) -> Self {
        debug_assert!(few.is_sorted_by(|a, b| a.0 < b.0));
        if few.len() * FEW <= count {
            return Self(Stored::Few(count, few));
        }
        let mut all = alloc::vec![Vec3::ZERO; count];
        few.iter().for_each(|(i, v)| all[*i as usize] = *v);
        all.into()
    }

    /// The number of vertices.
    #[must_use]
    pub fn len(&self) -> usize {
        match &self.0 {
            Stored::All(all) => all.len(),
            Stored::Few(count, _) => *count,
        }
    }

    /// True when there are no vertices.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The vectors of all vertices.
    pub fn iter(&self) -> impl Iterator<Item = &Vec3> {
        (0..self.len()).map(|i| &self[i])
    }

    /// The stored vectors with the indices of their vertices, ascending: all, or few that leave out nothing but
    /// zeros.
    pub fn stored(&self) -> impl Iterator<Item = (usize, Vec3)> {
        let (all, few): (&[Vec3], &[(u32, Vec3)]) = match &self.0 {
            Stored::All(all) => (all, &[]),
            Stored::Few(_, few) => (&[], few),
        };
        let all = all.iter().enumerate().map(|(i, v)| (i, *v));
        all.chain(few.iter().map(|(i, v)| (*i as usize, *v)))
    }

    /// The [stored](Self::stored) indices where not all vertices are.
    pub(super) fn few(&self) -> Option<&[(u32, Vec3)]> {
        match &self.0 {
            Stored::All(_) => None,
            Stored::Few(_, few) => Some(few),
        }
    }

    /// True when all are zero.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.stored().all(|(_, v)| v == Vec3::ZERO)
    }

    /// The vectors after a linear map.
    pub(super) fn map(&self, map: impl Fn(Vec3) -> Vec3) -> Self {
        Self(match &self.0 {
            Stored::All(all) => Stored::All(all.iter().map(|v| map(*v)).collect()),
            Stored::Few(count, few) => {
                Stored::Few(*count, few.iter().map(|(i, v)| (*i, map(*v))).collect())
            }
        })
    }

    /// The sums with other vectors of as many vertices.
    pub(super) fn plus(&self, other: &Self) -> Self {
        let (Stored::Few(count, a), Stored::Few(_, b)) = (&self.0, &other.0) else {
            let mut sums: Vec<Vec3> = self.iter().copied().collect();
            other.stored().for_each(|(i, v)| sums[i] += v);
            return sums.into();
        };
        let mut sums: Vec<(u32, Vec3)> = Vec::with_capacity(a.len() + b.len());
        let mut rest = b.iter().peekable();
        for (i, v) in a {
            while let Some(before) = rest.next_if(|(j, _)| j < i) {
                sums.push(*before);
            }
            let same = rest.next_if(|(j, _)| j == i);
            sums.push((*i, same.map_or(*v, |(_, w)| *v + *w)));
        }
        sums.extend(rest);
        Self::of_few(*count, sums)
    }
}

impl Index<usize> for VertexVectors {
    type Output = Vec3;
    #[inline]
    fn index(&self, vertex: usize) -> &Vec3 {
        match &self.0 {
            Stored::All(all) => &all[vertex],
            Stored::Few(count, few) => {
                assert!(vertex < *count, "vertex {vertex} of a mesh with {count}");
                let at = few.binary_search_by_key(&vertex, |(i, _)| *i as usize);
                at.map_or(&Vec3::ZERO, |at| &few[at].1)
            }
        }
    }
}

impl From<Vec<Vec3>> for VertexVectors {
    fn from(all: Vec<Vec3>) -> Self {
        Self(Stored::All(all.into()))
    }
}

impl From<VertexVectors> for Vec<Vec3> {
    fn from(v: VertexVectors) -> Self {
        v.iter().copied().collect()
    }
}

impl PartialEq for VertexVectors {
    fn eq(&self, other: &Self) -> bool {
        self.len() == other.len() && self.iter().eq(other.iter())
    }
}

#[cfg(test)]
mod tests {
    use drt_math::vec3;

    use super::*;

    #[test]
    fn few_and_all_are_the_same_vectors() {
        let count = 100;
        let few = |list: &[(u32, f64)]| {
            let few = list.iter().map(|(i, v)| (*i, vec3(*v, -v, 2.0)));
            VertexVectors::of_few(count, few.collect())
        };
        let all = |v: &VertexVectors| VertexVectors::from(Vec::from(v.clone()));
        let (a, b) = (few(&[(3, 1.0), (7, 2.0)]), few(&[(0, 5.0), (7, 3.0), (99, 4.0)]));
        assert!(a.few().is_some() && b.few().is_some() && all(&a).few().is_none());
        assert_eq!(a, all(&a));
        assert_ne!(a, b);
        let sum = a.plus(&b);
        assert_eq!(sum.stored().map(|(i, _)| i).collect::<Vec<_>>(), [0, 3, 7, 99]);
        for other in [all(&a).plus(&b), a.plus(&all(&b)), all(&a).plus(&all(&b))] {
            assert_eq!(sum, other);
        }
        assert_eq!(sum[7], a[7] + b[7]);
        assert_eq!(a.map(|v| v * 2.0), all(&a).map(|v| v * 2.0));
        assert!(VertexVectors::zeros(count).is_zero() && !a.is_zero());
        let many: Vec<_> = (0..50).map(|i| (i, 1.0)).collect();
        assert!(few(&many).few().is_none(), "half of them are not few");
    }
}
