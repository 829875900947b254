//! Gradients by the numbers of something that moves, and the tangents that hold the rates of the same numbers.

use drt_math::{Rgb, Vec3};

/// A number of a gradient or a tangent, or several that belong together.
pub(in crate::model) trait Entry: Copy {
    /// The entry times a factor.
    fn scaled(self, w: f64) -> Self;

    /// A sum, and the product of this entry of a gradient with that of a tangent.
    fn paired(self, tangent: Self, sum: f64) -> f64;

    /// Adds an entry to this one.
    fn add(&mut self, other: Self);
}

/// Implements [`Entry`] for types that have the operators of a vector, with their own product.
macro_rules! entry {
    ($type:ty, $a:ident, $b:ident => $product:expr) => {
        impl Entry for $type {
            #[inline]
            fn scaled(self, w: f64) -> Self {
                self * w
            }

            #[inline]
            fn paired(self, $b: Self, sum: f64) -> f64 {
                let $a = self;
                sum + $product
            }

            #[inline]
            fn add(&mut self, other: Self) {
                *self += other;
            }
        }
    };
}

entry!(f64, a, b => a * b);
entry!(Vec3, a, b => a.dot(b));
entry!(Rgb, a, b => a.dot(b));

impl Entry for [f64; 2] {
    #[inline]
    fn scaled(self, w: f64) -> Self {
        self.map(|x| x * w)
    }

    #[inline]
    fn paired(self, [u, v]: Self, sum: f64) -> f64 {
        sum + self[0] * u + self[1] * v
    }

    #[inline]
    fn add(&mut self, [u, v]: Self) {
        self[0] += u;
        self[1] += v;
    }
}

/// Gives a gradient and the tangent of the same fields, all of which it lists, what both have as vectors that are dual to each other.
macro_rules! dual_vectors {
    ($gradient:ident, $tangent:ident { $($field:ident),+ $(,)? }) => {
        impl $gradient {
            /// A multiple.
            #[inline]
            #[must_use]
            pub fn scaled(&self, w: f64) -> Self {
                use $crate::model::gradient::Entry;
                Self { $($field: self.$field.scaled(w)),+ }
            }

            /// The derivative along a tangent.
            #[inline]
            #[must_use]
            pub fn dot(&self, t: &$tangent) -> f64 {
                use $crate::model::gradient::Entry;
                let sum = 0.0;
                $(let sum = self.$field.paired(t.$field, sum);)+
                sum
            }
        }

        impl $tangent {
            /// True when nothing changes.
            #[must_use]
            pub fn is_zero(&self) -> bool {
                *self == Self::default()
            }
        }

        $crate::model::gradient::dual_vectors!(@sum $gradient { $($field),+ });
        $crate::model::gradient::dual_vectors!(@sum $tangent { $($field),+ });
    };
    (@sum $type:ident { $($field:ident),+ }) => {
        impl ::core::ops::AddAssign for $type {
            #[inline]
            fn add_assign(&mut self, other: Self) {
                use $crate::model::gradient::Entry;
                let Self { $($field),+ } = other;
                $(self.$field.add($field);)+
            }
        }
    };
}

pub(in crate::model) use dual_vectors;
