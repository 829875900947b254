//! Functions on the unit square that are linear between the values of a grid, and the maps that draw points by them.
//!
//! A function depends on two parameters as well, linearly between *slices* of given parameters. With the values v of a slice, in
//! rows j of columns i, let C_j(x) be the integral of row j from 0 to x, r_j that of the whole row, and M(y) that of
//! r(y), linear between rows, from 0 to y. The density v(x, y)/M(1) is drawn by inversion: y from the marginal density r,
//! x from that of its row,
//!
//! ```text
//! M(y) = ξ_y M(1),      C(x, y) = ξ_x r(y),      C(x, y) = (1-t) C_j(x) + t C_{j+1}(x),
//! ```
//!
//! with t the part of the way from row j to the next. Between grid points both are quadratic. All of this is linear in v, so a
//! mixture of slices of integral 1 is drawn by the mixture of their integrals: the inversion method of Dupuy & Jakob 2018.

use alloc::vec::Vec;

use drt_math::{Real, fm};

/// Slices with their weights, by two parameters.
#[derive(Clone, Copy)]
pub(super) struct Mix<T> {
    slices: [(usize, T); 4],
    count: usize,
}

impl<T: Real> Mix<T> {
    /// Of a table that has but one.
    pub(super) fn single() -> Self {
        Self { slices: [(0, T::one()); 4], count: 1 }
    }

    /// Between the slices of a table whose parameters are these; beyond them, those at the end.
    pub(super) fn new(parameters: [&[f32]; 2], at: [T; 2]) -> Self {
        let [(first, first_count), (second, second_count)] =
            [0, 1].map(|k| between(parameters[k], at[k]));
        let mut mix = Self { slices: [(0, T::zero()); 4], count: 0 };
        for (i, a) in &first[..first_count] {
            for (j, b) in &second[..second_count] {
                mix.slices[mix.count] = (i * parameters[1].len() + j, *a * *b);
                mix.count += 1;
            }
        }
        mix
    }

    /// The same of a table with `count` channels to each slice.
    pub(super) fn channel(mut self, channel: usize, count: usize) -> Self {
        for (slice, _) in &mut self.slices {
            *slice = *slice * count + channel;
        }
        self
    }

    fn scaled(mut self, scales: &[f64]) -> Self {
        for (slice, weight) in &mut self.slices[..self.count] {
            *weight = *weight * scales[*slice];
        }
        self
    }

    /// The mixture of the numbers at an index of each slice.
    #[inline]
    fn of<V: Copy + Into<f64>>(&self, values: &[V], slice_len: usize, index: usize) -> T {
        let at = |(slice, weight): &(usize, T)| *weight * values[slice * slice_len + index].into();
        let (first, others) = self.slices[..self.count].split_at(1);
        others.iter().map(at).fold(at(&first[0]), |sum, v| sum + v)
    }
}

/// Up to two indices with their weights.
fn between<T: Real>(knots: &[f32], at: T) -> ([(usize, T); 2], usize) {
    if knots.len() == 1 {
        return ([(0, T::one()); 2], 1);
    }
    let next = knots.partition_point(|k| f64::from(*k) < at.re()).clamp(1, knots.len() - 1);
    let [low, high] = [next - 1, next].map(|i| f64::from(knots[i]));
    let part = within((at - low) / (high - low));
    ([(next - 1, T::one() - part), (next, part)], 2)
}

/// Clamped to the interval from 0 to 1.
fn within<T: Real>(x: T) -> T {
    x.max(T::zero()).min(T::one())
}

fn lerp<T: Real>(a: T, b: T, t: T) -> T {
    a + (b - a) * t
}

/// Values of a grid over the unit square, the first column at x = 0, the first row at y = 0; slice by slice, row by row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grid2d {
    columns: usize,
    rows: usize,
    pub(super) values: Vec<f32>,
}

/// A cell of a grid, and where a point is in it.
struct Cell<T> {
    column: usize,
    row: usize,
    s: T,
    t: T,
}

impl Grid2d {
    /// Of so many rows and columns, at least two each.
    pub(super) fn new([rows, columns]: [usize; 2], values: Vec<f32>) -> Self {
        Self { columns, rows, values }
    }

    pub(super) fn size(&self) -> [usize; 2] {
        [self.rows, self.columns]
    }

    fn slice_len(&self) -> usize {
        self.columns * self.rows
    }

    fn slice_count(&self) -> usize {
        self.values.len() / self.slice_len()
    }

    /// Makes the first and the last row of each slice their mean.
    pub(super) fn close_rows(&mut self) {
        let (columns, len) = (self.columns, self.slice_len());
        for slice in self.values.chunks_exact_mut(len) {
            let (first, others) = slice.split_at_mut(columns);
            average(first, &mut others[len - 2 * columns..]);
        }
    }

    /// Makes the first and the last of as many parts of the slices their mean.
    pub(super) fn close_slices(&mut self, parts: usize) {
        let len = self.values.len() / parts;
        let (first, others) = self.values.split_at_mut(len);
        if parts > 1 {
            average(first, &mut others[len * (parts - 2)..]);
        }
    }

    fn cell<T: Real>(&self, [x, y]: [T; 2]) -> Cell<T> {
        let along = |u: T, count: usize| {
            let place = within(u) * (count - 1) as f64;
            let cell = usize::min(place.re() as usize, count - 2);
            (cell, place - cell as f64)
        };
        let ((column, s), (row, t)) = (along(x, self.columns), along(y, self.rows));
        Cell { column, row, s, t }
    }

    /// The values on the sides of a cell, to the left and to the right.
    #[inline]
    fn sides<T: Real>(&self, mix: &Mix<T>, cell: &Cell<T>) -> [T; 2] {
        let (len, index) = (self.slice_len(), cell.row * self.columns + cell.column);
        [index, index + 1].map(|i| {
            let [low, high] = [i, i + self.columns].map(|i| mix.of(&self.values, len, i));
            lerp(low, high, cell.t)
        })
    }

    /// The value at a point; beyond the square, that at its border.
    #[inline]
    pub(super) fn eval<T: Real>(&self, mix: &Mix<T>, at: [T; 2]) -> T {
        let cell = self.cell(at);
        let [left, right] = self.sides(mix, &cell);
        lerp(left, right, cell.s)
    }
}

fn average(first: &mut [f32], last: &mut [f32]) {
    for (a, b) in first.iter_mut().zip(last) {
        let mean = 0.5 * *a + 0.5 * *b;
        (*a, *b) = (mean, mean);
    }
}

/// A density on the unit square, proportional to a [`Grid2d`] by slices.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Marginal2d {
    grid: Grid2d,
    /// C_j at each column.
    along: Vec<f64>,
    /// M at each row.
    marginal: Vec<f64>,
    /// 1/M(1) of each slice.
    scales: Vec<f64>,
}

impl Marginal2d {
    /// `None` where a slice is 0 all over.
    pub(super) fn new(grid: Grid2d) -> Option<Self> {
        let [rows, columns] = grid.size();
        let (mut along, mut marginal, mut scales) = (Vec::new(), Vec::new(), Vec::new());
        for slice in grid.values.chunks_exact(grid.slice_len()) {
            let mut upper = 0.0;
            let mut below = 0.0;
            for (j, row) in slice.chunks_exact(columns).enumerate() {
                let mut sum = 0.0;
                along.push(sum);
                for pair in row.windows(2) {
                    let width = 0.5 / (columns - 1) as f64;
                    sum += width * (f64::from(pair[0]) + f64::from(pair[1]));
                    along.push(sum);
                }
                if j > 0 {
                    below += 0.5 / (rows - 1) as f64 * (upper + sum);
                }
                marginal.push(below);
                upper = sum;
            }
            if below == 0.0 {
                return None;
            }
            scales.push(below.recip());
        }
        debug_assert_eq!(scales.len(), grid.slice_count());
        Some(Self { grid, along, marginal, scales })
    }

    pub(super) fn grid(&self) -> &Grid2d {
        &self.grid
    }

    /// The density at a point.
    pub(super) fn density<T: Real>(&self, mix: &Mix<T>, at: [T; 2]) -> T {
        self.grid.eval(&mix.scaled(&self.scales), at)
    }

    /// C and r between two rows, at a column.
    #[inline]
    fn row<T: Real>(&self, mix: &Mix<T>, row: usize, column: usize) -> [T; 2] {
        let (len, columns) = (self.grid.slice_len(), self.grid.columns);
        let index = row * columns + column;
        [index, index + columns].map(|i| mix.of(&self.along, len, i))
    }

    /// Draws a point by two numbers of (0, 1).
    pub(super) fn sample(&self, mix: &Mix<f64>, [x, y]: [f64; 2]) -> [f64; 2] {
        let mix = mix.scaled(&self.scales);
        let [rows, columns] = self.grid.size();
        let marginal = |j| mix.of(&self.marginal, rows, j);
        let y = y * marginal(rows - 1);
        let row = last_below(rows, y, marginal);
        let [r0, r1] = self.row(&mix, row, columns - 1);
        let t = solve((y - marginal(row)) * (rows - 1) as f64, r0, r1);
        let along = |i| {
            let [low, high] = self.row(&mix, row, i);
            lerp(low, high, t)
        };
        let x = x * lerp(r0, r1, t);
        let column = last_below(columns, x, along);
        let rest = (x - along(column)) * (columns - 1) as f64;
        let [left, right] = self.grid.sides(&mix, &Cell { column, row, s: 0.0, t });
        let s = solve(rest, left, right);
        [(column as f64 + s) / (columns - 1) as f64, (row as f64 + t) / (rows - 1) as f64]
    }

    /// The numbers that [`Marginal2d::sample`] draws a point by.
    pub(super) fn invert<T: Real>(&self, mix: &Mix<T>, at: [T; 2]) -> [T; 2] {
        let mix = mix.scaled(&self.scales);
        let [rows, columns] = self.grid.size();
        let cell = self.grid.cell(at);
        let Cell { column, row, s, t } = cell;
        let [left, right] = self.grid.sides(&mix, &cell);
        let [low, high] = self.row(&mix, row, column);
        let [r0, r1] = self.row(&mix, row, columns - 1);
        let x = lerp(low, high, t) + integral(s, left, right) / (columns - 1) as f64;
        let whole = lerp(r0, r1, t);
        // Nothing is drawn in an empty row.
        let x = if whole.re() > 0.0 { x / whole } else { T::zero() };
        let y = mix.of(&self.marginal, rows, row) + integral(t, r0, r1) / (rows - 1) as f64;
        [x, y]
    }
}

/// The integral from 0 to t of what goes from a at 0 to b at 1.
fn integral<T: Real>(t: T, a: T, b: T) -> T {
    (a + (b - a) * t * 0.5) * t
}

/// The t of which that is the integral.
fn solve(integral: f64, a: f64, b: f64) -> f64 {
    let root = fm::sqrt(f64::max(a * a + 2.0 * integral * (b - a), 0.0));
    let t = 2.0 * integral / (a + root);
    // Where rounding leaves something to draw in a cell without any.
    if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 }
}

/// The last of all but one of `count` rising numbers that is below `x`, or the first.
fn last_below(count: usize, x: f64, number: impl Fn(usize) -> f64) -> usize {
    let (mut low, mut high) = (0, count - 1);
    while high - low > 1 {
        let middle = usize::midpoint(low, high);
        if number(middle) < x { low = middle } else { high = middle }
    }
    low
}

#[cfg(test)]
mod tests {
    use drt_math::testing::{SIGNIFICANCE, rectangle_chi_square};
    use drt_math::{Dual, Rng};

    use super::*;

    const PHI: [f32; 2] = [0.0, 2.0];
    const THETA: [f32; 3] = [0.0, 0.5, 1.5];

    /// Six slices, with an empty corner and a row and a column that are empty in some.
    fn density() -> Marginal2d {
        let mut rng = Rng::new(3, 0, 0);
        let mut values: Vec<f32> = (0..6 * 20).map(|_| rng.next_f64() as f32).collect();
        values[0] = 0.0;
        values[5..10].fill(0.0);
        values.iter_mut().skip(20).step_by(5).for_each(|v| *v = 0.0);
        Marginal2d::new(Grid2d::new([4, 5], values)).expect("not empty")
    }

    fn mixes() -> [Mix<f64>; 3] {
        [[0.3, 1.1], [-1.0, 0.2], [2.0, 9.0]].map(|at| Mix::new([&PHI, &THETA], at))
    }

    #[test]
    fn samples_follow_their_density() {
        let density = density();
        let p = |mix: Mix<f64>, other: Mix<f64>| {
            let mut rng = Rng::new(4, 0, 0);
            let points = (0..100_000).map(|_| density.sample(&mix, rng.next_2d()));
            rectangle_chi_square(points, [0.0; 2], [1.0; 2], |at| density.density(&other, at))
        };
        for mix in mixes() {
            assert!(p(mix, mix) > SIGNIFICANCE, "{}", p(mix, mix));
        }
        // Planted: a parameter that is off.
        let off = p(mixes()[0], Mix::new([&PHI, &THETA], [0.8, 1.1]));
        assert!(off < SIGNIFICANCE, "{off}");
    }

    #[test]
    fn the_inverse_finds_what_a_point_was_drawn_by() {
        let (density, mut rng) = (density(), Rng::new(5, 0, 0));
        for mix in mixes() {
            for _ in 0..2000 {
                let u = rng.next_2d();
                let back = density.invert(&mix, density.sample(&mix, u));
                let off = f64::max((u[0] - back[0]).abs(), (u[1] - back[1]).abs());
                assert!(off < 1e-12, "{u:?} {back:?}");
            }
        }
    }

    /// The determinant of the inverse is the density; derivatives by parameters are those of differences.
    #[test]
    fn slopes_of_the_inverse() {
        type D = Dual<f64, 4>;
        let (density, mut rng) = (density(), Rng::new(6, 0, 0));
        for _ in 0..200 {
            let p = [2.0 * rng.next_f64(), 1.5 * rng.next_f64()];
            let at = density.sample(&Mix::new([&PHI, &THETA], p), rng.next_2d());
            let lane = |v: f64, k| D::variable(v, k);
            let mix = Mix::new([&PHI, &THETA], [lane(p[0], 2), lane(p[1], 3)]);
            let [x, y] = density.invert(&mix, [lane(at[0], 0), lane(at[1], 1)]);
            let determinant = x.eps[0] * y.eps[1] - x.eps[1] * y.eps[0];
            let plain = Mix::new([&PHI, &THETA], p);
            let value = density.density(&plain, at);
            assert!((determinant - value).abs() < 1e-9 * (1.0 + value), "{determinant} {value}");
            for k in 0..2 {
                let moved = |h: f64| {
                    let mut p = p;
                    p[k] += h;
                    density.invert(&Mix::new([&PHI, &THETA], p), at)
                };
                let ([a, b], h) = ([moved(1e-6), moved(-1e-6)], 2e-6);
                for (i, dual) in [x, y].into_iter().enumerate() {
                    let off = (a[i] - b[i]) / h - dual.eps[2 + k];
                    assert!(off.abs() < 1e-6, "{off}");
                }
            }
        }
    }

    #[test]
    fn ends_that_are_the_same_place_are_made_equal() {
        let mut grid = Grid2d::new([3, 2], (0..18).map(|v| v as f32).collect());
        grid.close_rows();
        assert_eq!(grid.values[..6], [2.0, 3.0, 2.0, 3.0, 2.0, 3.0]);
        grid.close_slices(3);
        assert_eq!(grid.values[..6], grid.values[12..]);
        assert_eq!(grid.values[6..8], [8.0, 9.0]);
        let before = grid.clone();
        grid.close_slices(1);
        assert_eq!(grid, before);
    }

    #[test]
    fn empty_slices_have_no_density() {
        assert!(Marginal2d::new(Grid2d::new([2, 2], alloc::vec![0.0; 4])).is_none());
    }
}
