use alloc::vec;
use alloc::vec::Vec;

use drt_geom::weld;
use drt_math::Vec3;

use crate::lists::Lists;
use crate::optimize::OptimizeError;
use crate::optimize::checks::same_length;

/// The combinatorial Laplacian L of a mesh's edges: (L x)ᵢ is the sum of xᵢ - xⱼ over the vertices j that share an
/// edge with i.
///
/// As a matrix it has the number of neighbours on the diagonal and -1 for each pair of neighbours; it is symmetric
/// and has no negative eigenvalue. An edge counts once, however many triangles share it.
///
/// Copies of a vertex, which files have along the seams of texture coordinates and shading normals, count as one
/// vertex whose value is the mean of theirs. Lists of values have some columns of numbers, side by side, for each
/// vertex of the file, copies included: 3 for coordinates x, y, z.
#[derive(Clone, Debug)]
pub struct MeshLaplacian {
    /// For each vertex of the file the place that it has, all copies the same one.
    places: Vec<u32>,
    /// For each place the number of its copies.
    copies: Vec<f64>,
    /// For each place those that share an edge with it, in ascending order.
    neighbours: Lists,
}

impl MeshLaplacian {
    /// The Laplacian of a mesh with this number of vertices, none of which is a copy of another one.
    ///
    /// # Errors
    /// When a triangle names a vertex that does not exist.
    pub fn new(vertices: usize, triangles: &[[u32; 3]]) -> Result<Self, OptimizeError> {
        let itself: Vec<u32> = (0..vertices as u32).collect();
        Self::of_copies(&itself, triangles)
    }

    /// The Laplacian of a mesh in which vertices at equal positions are copies of each other (see [`weld()`]).
    ///
    /// The positions are those of the mesh as it was read: a fit may bring vertices together that are not
    /// connected.
    ///
    /// # Errors
    /// When a triangle names a vertex that does not exist.
    pub fn with_seams(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self, OptimizeError> {
        Self::of_copies(&weld(positions), triangles)
    }

    /// `lowest` has for each vertex the first one that it is a copy of.
    fn of_copies(lowest: &[u32], triangles: &[[u32; 3]]) -> Result<Self, OptimizeError> {
        let mut places = vec![0; lowest.len()];
        let mut copies = Vec::new();
        for (i, first) in lowest.iter().enumerate() {
            let first = *first as usize;
            if first == i {
                places[i] = copies.len() as u32;
                copies.push(1.0);
            } else {
                places[i] = places[first];
                copies[places[i] as usize] += 1.0;
            }
        }
        let mut pairs = Vec::with_capacity(6 * triangles.len());
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(vertex) = corners.iter().copied().find(|v| *v as usize >= places.len()) {
                let vertices = places.len();
                return Err(OptimizeError::Triangle { triangle, vertex, vertices });
            }
            let at = corners.map(|v| places[v as usize]);
            for k in 0..3 {
                let (a, b) = (at[k], at[(k + 1) % 3]);
                if a != b {
                    pairs.extend([(a, b), (b, a)]);
                }
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        let neighbours = Lists::new(copies.len(), &pairs);
        Ok(Self { places, copies, neighbours })
    }

    /// The number of the mesh's vertices, copies included.
    #[must_use]
    pub fn vertices(&self) -> usize {
        self.places.len()
    }

    /// Replaces `values`, with this number of columns, by L times them. All copies of a vertex get the same result.
    ///
    /// # Errors
    /// When the number of values is not the number of vertices times that of columns.
    pub fn multiply(&self, values: &mut [f64], columns: usize) -> Result<(), OptimizeError> {
        self.same_shape("the values", values, columns)?;
        let product = self.product(&self.mean(values, columns), columns);
        self.spread(&product, values, columns);
        Ok(())
    }

    /// Replaces the values of the copies of a vertex by their sum, in all of them. Gradients need that: what moves
    /// all copies of a vertex changes a loss by the sum of its derivatives by each.
    ///
    /// # Errors
    /// When the number of values is not the number of vertices times that of columns.
    pub fn sum_copies(&self, values: &mut [f64], columns: usize) -> Result<(), OptimizeError> {
        self.same_shape("the values", values, columns)?;
        if self.copies.len() < self.places.len() {
            let sums = self.sum(values, columns);
            self.spread(&sums, values, columns);
        }
        Ok(())
    }

    /// The number of columns of so many values.
    #[cfg(feature = "sparse")]
    pub(super) fn columns(&self, values: usize) -> Result<usize, OptimizeError> {
        let vertices = self.vertices();
        match values.checked_rem(vertices) {
            Some(0) => Ok(values / vertices),
            None if values == 0 => Ok(0),
            _ => Err(OptimizeError::Columns { values, vertices }),
        }
    }

    pub(super) fn same_shape(
        &self,
        what: &'static str,
        values: &[f64],
        columns: usize,
    ) -> Result<(), OptimizeError> {
        same_length(what, self.vertices().saturating_mul(columns), values)
    }

    /// For each place its neighbours.
    #[cfg(feature = "sparse")]
    pub(super) fn neighbours(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        (0..self.copies.len()).map(|place| self.neighbours.of(place))
    }

    /// The sum at each place.
    fn sum(&self, values: &[f64], columns: usize) -> Vec<f64> {
        let mut sums = vec![0.0; self.copies.len() * columns];
        for (vertex, place) in self.places.iter().enumerate() {
            for k in 0..columns {
                sums[*place as usize * columns + k] += values[vertex * columns + k];
            }
        }
        sums
    }

    /// The mean value at each place.
    pub(super) fn mean(&self, values: &[f64], columns: usize) -> Vec<f64> {
        let mut means = self.sum(values, columns);
        for (place, copies) in self.copies.iter().enumerate() {
            for mean in &mut means[place * columns..(place + 1) * columns] {
                *mean /= copies;
            }
        }
        means
    }

    /// Gives the value of each place to all of its copies.
    pub(super) fn spread(&self, at_places: &[f64], values: &mut [f64], columns: usize) {
        for (vertex, place) in self.places.iter().enumerate() {
            for k in 0..columns {
                values[vertex * columns + k] = at_places[*place as usize * columns + k];
            }
        }
    }

    /// L times values at places.
    fn product(&self, at_places: &[f64], columns: usize) -> Vec<f64> {
        let mut product = vec![0.0; at_places.len()];
        for place in 0..self.copies.len() {
            for k in 0..columns {
                let here = at_places[place * columns + k];
                let differences = self
                    .neighbours
                    .of(place)
                    .iter()
                    .map(|j| here - at_places[*j as usize * columns + k]);
                product[place * columns + k] = differences.sum();
            }
        }
        product
    }
}

/// The energy `weight` × ½ |L x|² of a mesh's values x, whose derivatives by x are added to `gradient`.
///
/// With the coordinates of the vertices for values it is small where each vertex is near the mean of its neighbours,
/// and 0 where it is that mean. The values have `columns` numbers for each vertex, and so has the gradient.
///
/// # Errors
/// When the number of values or derivatives is not the number of vertices times that of columns.
pub fn laplacian_energy(
    laplacian: &MeshLaplacian,
    columns: usize,
    values: &[f64],
    gradient: &mut [f64],
    weight: f64,
) -> Result<f64, OptimizeError> {
    laplacian.same_shape("the values", values, columns)?;
    laplacian.same_shape("the gradient", gradient, columns)?;
    let bends = laplacian.product(&laplacian.mean(values, columns), columns);
    let slopes = laplacian.product(&bends, columns);
    for (vertex, place) in laplacian.places.iter().enumerate() {
        let share = weight / laplacian.copies[*place as usize];
        for k in 0..columns {
            gradient[vertex * columns + k] += share * slopes[*place as usize * columns + k];
        }
    }
    Ok(0.5 * weight * bends.iter().map(|b| b * b).sum::<f64>())
}
