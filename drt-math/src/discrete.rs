//! Sampling of an index with probability proportional to a weight.
//!
//! [`AliasTable`] takes constant time per sample, [`CdfTable`] a binary search but maps
//! neighbouring numbers to neighbouring indices, which keeps stratified points stratified.

use alloc::vec;
use alloc::vec::Vec;

use crate::CompensatedSum;

/// Why a list of weights is no distribution.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WeightsError {
    /// The list has no entries.
    #[error("no weights: a discrete distribution needs at least one")]
    Empty,
    /// More entries than a 32-bit index can name.
    #[error("{0} weights: at most 4294967295 fit a table; group them")]
    TooMany(usize),
    /// A weight below zero.
    #[error("weight {index} is {value}: weights must be zero or more; take its absolute value?")]
    Negative {
        /// Position in the list.
        index: usize,
        /// The weight.
        value: f64,
    },
    /// A weight that is NaN or infinite.
    #[error("weight {index} is {value}: weights must be finite numbers; check how it was computed")]
    NotFinite {
        /// Position in the list.
        index: usize,
        /// The weight.
        value: f64,
    },
    /// Nothing to choose from.
    #[error("all weights are zero: at least one must be positive; skip sampling instead")]
    AllZero,
    /// A stored cumulative distribution that decreases, or does not lead from 0 to 1.
    #[error("cumulative probability {index} is out of order: it must rise from 0 to exactly 1")]
    NotCumulative {
        /// Position in the list.
        index: usize,
    },
}

/// What sampling a discrete distribution gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscreteSample {
    /// The chosen index.
    pub index: usize,
    /// The probability with which it is chosen.
    pub pmf: f64,
    /// A number uniform in [0, 1), independent of the index: what the choice left of the random
    /// number. It has fewer digits than the number had, by the logarithm of `1 / pmf`.
    pub residual: f64,
}

/// The largest number below one.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// Checks the weights and scales them to sum 1.
fn normalized(weights: &[f64]) -> Result<Vec<f64>, WeightsError> {
    if weights.is_empty() {
        return Err(WeightsError::Empty);
    }
    if u32::try_from(weights.len()).is_err() {
        return Err(WeightsError::TooMany(weights.len()));
    }
    let mut largest = 0.0;
    for (index, &value) in weights.iter().enumerate() {
        if !value.is_finite() {
            return Err(WeightsError::NotFinite { index, value });
        }
        if value < 0.0 {
            return Err(WeightsError::Negative { index, value });
        }
        largest = f64::max(largest, value);
    }
    if largest == 0.0 {
        return Err(WeightsError::AllZero);
    }
    // Scaling by the largest first keeps the sum of huge weights finite, of tiny ones normal.
    let total = weights.iter().map(|w| w / largest).collect::<CompensatedSum>().value();
    Ok(weights.iter().map(|w| w / largest / total).collect())
}

/// Sampling in constant time: every index owns a bin of equal width and shares it with one other
/// (Walker 1974; built as by Vose 1991, "A linear algorithm for generating random numbers with a
/// given distribution").
///
/// ```
/// use drt_math::AliasTable;
/// let table = AliasTable::new(&[1.0, 0.0, 3.0])?;
/// assert_eq!((table.pmf(1), table.pmf(2)), (0.0, 0.75));
/// assert_ne!(table.sample(0.4).index, 1);
/// # Ok::<(), drt_math::discrete::WeightsError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Vec<f64>", into = "Vec<f64>"))]
pub struct AliasTable {
    bins: Vec<Bin>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Bin {
    /// Probability of the bin's own index.
    pmf: f64,
    /// The part of the bin's width that chooses its own index; the rest chooses `alias`.
    own: f64,
    alias: u32,
}

impl AliasTable {
    /// A distribution proportional to the weights.
    ///
    /// # Errors
    /// When there are no weights or too many, one is negative or not finite, or all are zero.
    pub fn new(weights: &[f64]) -> Result<Self, WeightsError> {
        Ok(Self::from_pmf(&normalized(weights)?))
    }

    fn from_pmf(pmf: &[f64]) -> Self {
        let n = pmf.len();
        let mut bins: Vec<Bin> =
            (0..n).map(|i| Bin { pmf: pmf[i], own: pmf[i] * n as f64, alias: i as u32 }).collect();
        let (mut short, mut long): (Vec<usize>, Vec<usize>) =
            (0..n).partition(|&i| bins[i].own < 1.0);
        while let (Some(&s), Some(&l)) = (short.last(), long.last()) {
            short.pop();
            bins[s].alias = l as u32;
            bins[l].own -= 1.0 - bins[s].own;
            if bins[l].own < 1.0 {
                long.pop();
                short.push(l);
            }
        }
        // Whatever remains is full up to rounding, except that an impossible index must stay so.
        let likely = (0..n).max_by(|&i, &j| pmf[i].total_cmp(&pmf[j])).unwrap_or(0);
        for i in short.into_iter().chain(long) {
            (bins[i].own, bins[i].alias) =
                if pmf[i] > 0.0 { (1.0, i as u32) } else { (0.0, likely as u32) };
        }
        Self { bins }
    }

    /// The index for a uniform number `u` in [0, 1).
    #[inline]
    #[must_use]
    pub fn sample(&self, u: f64) -> DiscreteSample {
        let scaled = u * self.bins.len() as f64;
        let i = (scaled as usize).min(self.bins.len() - 1);
        let inside = scaled - i as f64;
        let bin = &self.bins[i];
        let (index, residual) = if inside < bin.own {
            (i, inside / bin.own)
        } else {
            (bin.alias as usize, (inside - bin.own) / (1.0 - bin.own))
        };
        DiscreteSample { index, pmf: self.bins[index].pmf, residual: residual.min(BELOW_ONE) }
    }

    /// Probability of an index; zero beyond the last.
    #[inline]
    #[must_use]
    pub fn pmf(&self, index: usize) -> f64 {
        self.bins.get(index).map_or(0.0, |bin| bin.pmf)
    }

    /// Number of indices.
    #[inline]
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "a table is never empty")]
    pub fn len(&self) -> usize {
        self.bins.len()
    }
}

/// From probabilities or any other weights: how a stored table is read back.
impl TryFrom<Vec<f64>> for AliasTable {
    type Error = WeightsError;
    fn try_from(weights: Vec<f64>) -> Result<Self, WeightsError> {
        Self::new(&weights)
    }
}

/// The probabilities: how a table is stored.
impl From<AliasTable> for Vec<f64> {
    fn from(table: AliasTable) -> Self {
        table.bins.iter().map(|bin| bin.pmf).collect()
    }
}

/// Sampling by inversion of the cumulative distribution: monotone in the random number.
///
/// ```
/// use drt_math::CdfTable;
/// let table = CdfTable::new(&[1.0, 3.0])?;
/// let s = table.sample(0.625);
/// assert_eq!((s.index, s.pmf, s.residual), (1, 0.75, 0.5));
/// # Ok::<(), drt_math::discrete::WeightsError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Vec<f64>", into = "Vec<f64>"))]
pub struct CdfTable {
    /// Probability of all indices before each, and at the end 1.
    cdf: Vec<f64>,
}

impl CdfTable {
    /// A distribution proportional to the weights.
    ///
    /// # Errors
    /// When there are no weights or too many, one is negative or not finite, or all are zero.
    pub fn new(weights: &[f64]) -> Result<Self, WeightsError> {
        let pmf = normalized(weights)?;
        let mut cdf = vec![0.0; pmf.len() + 1];
        let mut sum = CompensatedSum::ZERO;
        let mut before = 0.0;
        for (entry, &p) in cdf[1..].iter_mut().zip(&pmf) {
            sum += p;
            before = sum.value().clamp(before, 1.0);
            *entry = before;
        }
        // The last possible index, not a zero weight behind it, takes what rounding left over.
        let last = pmf.iter().rposition(|&p| p > 0.0).unwrap_or(0);
        cdf[last + 1..].fill(1.0);
        Ok(Self { cdf })
    }

    /// The index for a uniform number `u` in [0, 1).
    #[inline]
    #[must_use]
    pub fn sample(&self, u: f64) -> DiscreteSample {
        let u = u.clamp(0.0, BELOW_ONE);
        let index = self.cdf.partition_point(|&c| c <= u) - 1;
        let pmf = self.pmf(index);
        let residual = ((u - self.cdf[index]) / pmf).min(BELOW_ONE);
        DiscreteSample { index, pmf, residual }
    }

    /// Probability of an index; zero beyond the last.
    #[inline]
    #[must_use]
    pub fn pmf(&self, index: usize) -> f64 {
        self.cdf.get(index + 1).map_or(0.0, |after| after - self.cdf[index])
    }

    /// Number of indices.
    #[inline]
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "a table is never empty")]
    pub fn len(&self) -> usize {
        self.cdf.len() - 1
    }
}

/// From cumulative probabilities, 0 first and 1 last: how a stored table is read back.
impl TryFrom<Vec<f64>> for CdfTable {
    type Error = WeightsError;
    fn try_from(cdf: Vec<f64>) -> Result<Self, WeightsError> {
        if cdf.len() < 2 {
            return Err(WeightsError::Empty);
        }
        if cdf[0] != 0.0 {
            return Err(WeightsError::NotCumulative { index: 0 });
        }
        if let Some(i) = cdf.windows(2).position(|w| !(w[0] <= w[1] && w[1] <= 1.0)) {
            return Err(WeightsError::NotCumulative { index: i + 1 });
        }
        if cdf[cdf.len() - 1] != 1.0 {
            return Err(WeightsError::NotCumulative { index: cdf.len() - 1 });
        }
        Ok(Self { cdf })
    }
}

/// The cumulative probabilities: how a table is stored.
impl From<CdfTable> for Vec<f64> {
    fn from(table: CdfTable) -> Self {
        table.cdf
    }
}

#[cfg(test)]
mod tests;
