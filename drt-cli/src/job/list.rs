//! Lists of a fixed length.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{Deserialize, Deserializer, Error, IgnoredAny, SeqAccess, Visitor};

/// So many values and no more; arrays by themselves pass over what is too much.
#[derive(Clone, Copy, Debug)]
pub(super) struct List<T, const N: usize>(pub(super) [T; N]);

impl<const N: usize> Default for List<f64, N> {
    fn default() -> Self {
        Self([0.0; N])
    }
}

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for List<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(OfLength(PhantomData)).map(Self)
    }
}

struct OfLength<T, const N: usize>(PhantomData<T>);

impl<'de, T: Deserialize<'de>, const N: usize> Visitor<'de> for OfLength<T, N> {
    type Value = [T; N];

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a list of {N} values")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<[T; N], A::Error> {
        let mut values = Vec::new();
        while values.len() < N
            && let Some(value) = seq.next_element()?
        {
            values.push(value);
        }
        let mut found = values.len();
        while seq.next_element::<IgnoredAny>()?.is_some() {
            found += 1;
        }
        let wrong = |_| A::Error::custom(format!("a list of {found} values; expected {N}"));
        match found {
            n if n == N => values.try_into().map_err(wrong),
            _ => Err(wrong(values)),
        }
    }
}
