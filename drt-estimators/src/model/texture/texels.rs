//! Texels as unknowns.
//!
//! A value at a place is Σ w_i t_i, of at most four texels t_i, by weights that depend on the place alone. So its derivative by
//! a texel is that texel's weight: a lookup has at most four numbers to send, however large the image is. Changes of
//! texels are affine, t' = a t + b, so that rates of earlier changes pass through later ones times a.

use alloc::boxed::Box;
use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::{Rgb, ValueChange, ValueMap};
use thiserror::Error;

/// Texels that cannot change.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum TexelError {
    /// Nothing there has texels.
    #[error("no texture stands for `{0}` whose texels could change")]
    NoTexture(String),
    /// A texel beyond the image.
    #[error(
        "there is no texel [{}, {}]; the image has {} columns and {} rows",
        .texel[0], .texel[1], .size[0], .size[1]
    )]
    Outside {
        /// Column and row asked for.
        texel: [usize; 2],
        /// Columns and rows that there are.
        size: [u32; 2],
    },
    /// What becomes of a texel.
    #[error("a texel would be negative or not finite; choose a value nearer to zero")]
    NotFinite,
    /// More or fewer values than texels.
    #[error("{found} values for {expected} texels")]
    Count {
        /// The number of values.
        found: usize,
        /// The number of texels.
        expected: usize,
    },
}

/// Texels of these values, as images store them, in place of others.
pub(crate) fn replace_texels(
    texels: &mut Arc<Vec<[f32; 3]>>,
    values: &[Rgb],
) -> Result<(), TexelError> {
    let (found, expected) = (values.len(), texels.len());
    if found != expected {
        return Err(TexelError::Count { found, expected });
    }
    let stored: Vec<[f32; 3]> =
        values.iter().map(|value| value.to_array().map(|v| v as f32)).collect();
    if !stored.iter().flatten().all(|v| v.is_finite()) {
        return Err(TexelError::NotFinite);
    }
    *texels = Arc::new(stored);
    Ok(())
}

/// The texels that a value is made of, by index, with their weights.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    texels: [(u32, f64); 4],
    count: usize,
}

impl Footprint {
    /// Of one texel alone.
    pub(crate) fn of(texel: u32) -> Self {
        Self { texels: [(texel, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)], count: 1 }
    }

    /// Of two rows of two texels, so far to the second of each, and to the second row.
    pub(crate) fn between([[a, b], [c, d]]: [[u32; 2]; 2], [s, t]: [f64; 2]) -> Self {
        let texels =
            [(a, (1.0 - s) * (1.0 - t)), (b, s * (1.0 - t)), (c, (1.0 - s) * t), (d, s * t)];
        Self { texels, count: 4 }
    }

    fn iter(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        self.texels[..self.count].iter().copied()
    }
}

/// A change of one texel of an image, or of all of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelChange {
    /// Its index.
    texel: Option<u32>,
    op: ValueChange,
    theta: f64,
}

impl TexelChange {
    /// Of the texel in a column and row, or of all.
    pub(crate) fn new(
        size: [u32; 2],
        texel: Option<[usize; 2]>,
        op: ValueChange,
        theta: f64,
    ) -> Result<Self, TexelError> {
        let index = |at: [usize; 2]| match (at, size.map(|n| n as usize)) {
            ([x, y], [width, height]) if x < width && y < height => Ok((y * width + x) as u32),
            _ => Err(TexelError::Outside { texel: at, size }),
        };
        Ok(Self { texel: texel.map(index).transpose()?, op, theta })
    }

    /// True where it makes nothing else of any texel.
    fn is_identity(&self) -> bool {
        self.op.map(self.theta) == ValueMap::IDENTITY
    }

    fn covers(&self, texel: u32) -> bool {
        self.texel.is_none_or(|t| t == texel)
    }

    /// What becomes of a texel.
    pub(crate) fn value(&self, texel: u32, value: Rgb) -> Rgb {
        if self.covers(texel) { self.op.at(value, self.theta) } else { value }
    }

    /// Changes texels as images store them; false where they stay what they are.
    pub(crate) fn apply(&self, texels: &mut Arc<Vec<[f32; 3]>>) -> Result<bool, TexelError> {
        if self.is_identity() {
            return Ok(false);
        }
        let texels = Arc::make_mut(texels);
        let all = match self.texel {
            Some(t) => t as usize..t as usize + 1,
            None => 0..texels.len(),
        };
        for t in &mut texels[all] {
            let value = self.op.at(Rgb::from(t.map(f64::from)), self.theta);
            *t = value.to_array().map(|v| v as f32);
            if !t.iter().all(|v| v.is_finite()) {
                return Err(TexelError::NotFinite);
            }
        }
        Ok(true)
    }

    /// The rates of `count` texels, from their values before the change.
    pub(crate) fn tangent(&self, count: u32, value: impl Fn(u32) -> Rgb) -> TexelTangent {
        let rate = self.op.map_rate(self.theta);
        let of = |t: u32| (t, rate.value(value(t)));
        let rates = match self.texel {
            Some(t) => alloc::vec![of(t)],
            None => (0..count).map(of).collect(),
        };
        TexelTangent { rates }
    }
}

/// Rates of texels with a parameter.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct TexelTangent {
    /// In the order of texels; others have none.
    rates: Vec<(u32, Rgb)>,
}

impl TexelTangent {
    /// The rate of a value.
    pub(crate) fn at(&self, footprint: &Footprint) -> Rgb {
        footprint.iter().fold(Rgb::ZERO, |sum, (texel, weight)| sum + self.of(texel) * weight)
    }

    fn of(&self, texel: u32) -> Rgb {
        match self.rates.get(texel as usize) {
            Some((t, rate)) if *t == texel => *rate,
            _ => match self.rates.binary_search_by_key(&texel, |(t, _)| *t) {
                Ok(i) => self.rates[i].1,
                Err(_) => Rgb::ZERO,
            },
        }
    }

    /// What a later change makes of it.
    pub(crate) fn carry(&mut self, change: &TexelChange) {
        let factor = change.op.map(change.theta).factor;
        for (_, rate) in self.rates.iter_mut().filter(|(t, _)| change.covers(*t)) {
            *rate *= factor;
        }
    }

    /// That of a number, which has the first channel in all of them.
    pub(crate) fn of_number(mut self) -> Self {
        self.rates.iter_mut().for_each(|(_, rate)| *rate = Rgb::splat(rate.r));
        self
    }

    pub(crate) fn add(&mut self, other: Self) {
        if self.rates.is_empty() {
            *self = other;
            return;
        }
        let mut sums: BTreeMap<u32, Rgb> = self.rates.drain(..).collect();
        for (texel, rate) in other.rates {
            *sums.entry(texel).or_insert(Rgb::ZERO) += rate;
        }
        self.rates = sums.into_iter().collect();
    }

    pub(crate) fn is_zero(&self) -> bool {
        self.rates.iter().all(|(_, rate)| rate.is_zero())
    }
}

/// Texels of a page: what a gradient makes room for where something reaches one of them.
const PAGE: usize = 64;

/// The gradient of a number by the texels of an image: of a checkerboard, by its two colours.
#[derive(Clone, Debug)]
pub struct TexelGradient {
    size: [u32; 2],
    pages: Vec<Option<Box<[Rgb; PAGE]>>>,
}

impl TexelGradient {
    pub(crate) fn zeros(size: [u32; 2]) -> Self {
        let pages = (size[0] as usize * size[1] as usize).div_ceil(PAGE);
        Self { size, pages: alloc::vec![None; pages] }
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// One derivative per channel of each texel, row by row from the first; of a number, which has the same value in all channels, the derivative
    /// is their sum.
    #[must_use]
    pub fn values(&self) -> Vec<Rgb> {
        let count = self.size[0] as usize * self.size[1] as usize;
        let pages = self.pages.iter();
        let texels = pages.flat_map(|p| p.as_deref().copied().unwrap_or([Rgb::ZERO; PAGE]));
        texels.take(count).collect()
    }

    /// Adds the derivative by a value, as far as each of its texels makes it up.
    pub(crate) fn scatter(&mut self, footprint: &Footprint, adjoint: Rgb) {
        for (texel, weight) in footprint.iter() {
            let (page, at) = (texel as usize / PAGE, texel as usize % PAGE);
            let page = self.pages[page].get_or_insert_with(|| Box::new([Rgb::ZERO; PAGE]));
            page[at] += adjoint * weight;
        }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        for (sum, page) in self.pages.iter_mut().zip(&other.pages) {
            match (sum, page) {
                (Some(sum), Some(page)) => sum.iter_mut().zip(&**page).for_each(|(s, p)| *s += *p),
                (sum @ None, Some(page)) => *sum = Some(page.clone()),
                (_, None) => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString;

    use super::*;

    #[test]
    fn rates_pass_through_later_changes() {
        let value = |t: u32| Rgb::splat(f64::from(t));
        let change =
            |texel, op, theta| TexelChange::new([3, 2], texel, op, theta).expect("a texel");
        let add = change(Some([1, 1]), ValueChange::Add(Rgb::new(1.0, 2.0, 3.0)), 0.5);
        let mut rates = add.tangent(6, value);
        let double = change(None, ValueChange::Multiply(1.0), 1.0);
        rates.carry(&double);
        rates.add(double.tangent(6, |t| add.value(t, value(t))));
        // Texel 4: 2 (1, 2, 3) + 4 + (1, 2, 3)/2.
        assert_eq!(rates.of(4), Rgb::new(6.5, 9.0, 11.5));
        assert_eq!(rates.of(5), Rgb::splat(5.0));
        rates.carry(&change(Some([2, 1]), ValueChange::Multiply(-1.0), 1.0));
        assert_eq!([rates.of(5), rates.of(3)], [Rgb::ZERO, Rgb::splat(3.0)]);
        let outside = TexelChange::new([3, 2], Some([3, 0]), ValueChange::Multiply(1.0), 0.0);
        assert!(outside.unwrap_err().to_string().contains("no texel [3, 0]"));
        let mut huge = Arc::new(alloc::vec![[3e38; 3]]);
        assert_eq!(double.apply(&mut huge), Err(TexelError::NotFinite));
    }

    #[test]
    fn gradients_are_transposed_rates() {
        let rates =
            TexelTangent { rates: alloc::vec![(70, Rgb::ONE), (141, Rgb::new(1.0, 2.0, 3.0))] };
        let footprint = Footprint::between([[70, 71], [141, 141]], [0.25, 0.5]);
        let mut gradient = TexelGradient::zeros([71, 2]);
        let adjoint = Rgb::new(0.5, -1.0, 2.0);
        gradient.scatter(&footprint, adjoint);
        let mut twice = TexelGradient::zeros([71, 2]);
        twice.add(&gradient);
        twice.add(&gradient);
        let values = twice.values();
        assert_eq!(values.len(), 142);
        let reverse: f64 = rates.rates.iter().map(|(t, r)| values[*t as usize].dot(*r)).sum();
        assert_eq!(reverse, 2.0 * rates.at(&footprint).dot(adjoint));
        assert_eq!(twice.pages.iter().filter(|p| p.is_some()).count(), 2);
    }
}
