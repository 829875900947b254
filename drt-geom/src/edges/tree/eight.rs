//! Eight numbers of single precision at a time: what is only estimated needs no more, and machines
//! compute with as many at once. Plain arrays, so that all of them get the same bits: by AVX2 they are
//! one register each in what is inlined where [`Registers`](crate::query::Registers) are asked for. So closures here are only for
//! functions that are always inlined, and never for `map` of an array or an option.

use core::ops::{Add, Div, Mul, Sub};

use drt_math::{Vec3, fm};

/// How many.
pub(super) const LANES: usize = 8;

#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Eight(pub(super) [f32; LANES]);

/// Eight vectors.
pub(super) type Vectors = [Eight; 3];

impl Eight {
    pub(super) const ZERO: Self = Self([0.0; LANES]);
    pub(super) const ONE: Self = Self([1.0; LANES]);

    #[inline(always)]
    pub(super) const fn splat(x: f32) -> Self {
        Self([x; LANES])
    }

    /// Of what there is of each of at most eight; 0 for the others.
    pub(super) fn gather(values: impl Iterator<Item = f64>) -> Self {
        let mut all = [0.0; LANES];
        all.iter_mut().zip(values).for_each(|(a, v)| *a = v as f32);
        Self(all)
    }

    #[inline(always)]
    fn zip(mut self, o: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        for i in 0..LANES {
            self.0[i] = f(self.0[i], o.0[i]);
        }
        self
    }

    #[inline(always)]
    fn map(mut self, f: impl Fn(f32) -> f32) -> Self {
        for i in 0..LANES {
            self.0[i] = f(self.0[i]);
        }
        self
    }

    /// The lesser of each two: with a NaN, `o`.
    #[inline(always)]
    pub(super) fn min(self, o: Self) -> Self {
        self.zip(o, |a, b| if a < b { a } else { b })
    }

    /// The greater of each two: with a NaN, `o`.
    #[inline(always)]
    pub(super) fn max(self, o: Self) -> Self {
        self.zip(o, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    pub(super) fn abs(self) -> Self {
        self.map(f32::abs)
    }

    #[inline(always)]
    pub(super) fn sqrt(self) -> Self {
        self.map(|x| fm::sqrt(f64::from(x)) as f32)
    }

    /// `if self < o { yes } else { no }` for each.
    #[inline(always)]
    pub(super) fn less(self, o: Self, yes: Self, mut no: Self) -> Self {
        for i in 0..LANES {
            no.0[i] = if self.0[i] < o.0[i] { yes.0[i] } else { no.0[i] };
        }
        no
    }

    /// True where one is less than its counterpart.
    #[inline(always)]
    pub(super) fn any_less(self, o: Self) -> bool {
        (0..LANES).fold(false, |any, i| any | (self.0[i] < o.0[i]))
    }

    #[inline(always)]
    pub(super) fn sum(self) -> f32 {
        let [a, b, c, d, e, f, g, h] = self.0;
        ((a + e) + (c + g)) + ((b + f) + (d + h))
    }

    /// How many are positive.
    #[inline(always)]
    pub(super) fn positive(self) -> u32 {
        self.0.iter().map(|x| u32::from(*x > 0.0)).sum()
    }
}

macro_rules! operator {
    ($($operator:ident $method:ident),*) => {$(
        impl $operator for Eight {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                self.zip(o, |a, b| a.$method(b))
            }
        }

        impl $operator<f32> for Eight {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: f32) -> Self {
                self.$method(Self::splat(o))
            }
        }
    )*};
}
operator!(Add add, Sub sub, Mul mul, Div div);

#[inline(always)]
pub(super) fn dot(a: Vectors, b: Vectors) -> Eight {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(super) fn each(a: Vectors, f: impl Fn(Eight) -> Eight) -> Vectors {
    let [x, y, z] = a;
    [f(x), f(y), f(z)]
}

#[inline(always)]
pub(super) fn pairs(a: Vectors, b: Vectors, f: impl Fn(Eight, Eight) -> Eight) -> Vectors {
    [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2])]
}

/// `a + b s`.
#[inline(always)]
pub(super) fn along(a: Vectors, b: Vectors, s: Eight) -> Vectors {
    pairs(a, b, |a, b| a + b * s)
}

/// Eight times the same.
#[inline(always)]
pub(super) fn same(v: [f32; 3]) -> Vectors {
    let [x, y, z] = v;
    [Eight::splat(x), Eight::splat(y), Eight::splat(z)]
}

/// The vectors of at most eight.
pub(super) fn vectors(values: impl Iterator<Item = Vec3> + Clone) -> Vectors {
    [0, 1, 2].map(|k| Eight::gather(values.clone().map(|v| v.to_array()[k])))
}

/// In single precision.
#[inline(always)]
pub(super) fn single(v: Vec3) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}
