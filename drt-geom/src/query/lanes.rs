//! Several numbers at a time: the operations the queries need, by plain arrays on any machine and
//! by AVX2 where a running program finds it.
//!
//! All implementations round every operation alike (no fused ones), so they give the same bits.
//! This is the only module with unsafe code: calls of instructions that not every machine has. A
//! value of [`Avx2`] is made only where they were found, and nothing of it can be made without one.
#![allow(unsafe_code)]

use core::ops::{Add, Div, Mul, Sub};

/// `N` numbers.
pub(super) trait Vector<T, const N: usize>:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// `if self < o { self } else { o }` for each: with a NaN, `o`.
    fn min(self, o: Self) -> Self;
    /// `if self > o { self } else { o }` for each: with a NaN, `o`.
    fn max(self, o: Self) -> Self;
    /// `if self < o { yes } else { no }` for each.
    fn less(self, o: Self, yes: Self, no: Self) -> Self;
    /// A bit, from the lowest, for each that is at most its counterpart; NaN never is.
    fn le(self, o: Self) -> u32;
    /// The numbers.
    fn array(self) -> [T; N];
}

/// A way to compute with several numbers at a time.
pub(super) trait Lanes: Copy {
    /// Eight of single precision.
    type Singles: Vector<f32, 8>;
    /// Four of double precision.
    type Doubles: Vector<f64, 4>;

    fn singles(self, x: &[f32; 8]) -> Self::Singles;
    fn doubles(self, x: &[f64; 4]) -> Self::Doubles;
    /// Eight times the same.
    fn single(self, x: f32) -> Self::Singles;
    /// Four times the same.
    fn double(self, x: f64) -> Self::Doubles;
    /// Asks for what will be read soon.
    fn prefetch<T>(self, x: &T);
}

/// What to compute by whichever [`Lanes`] there are.
pub(super) trait Task {
    type Output;

    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// The lanes of the machine the program runs on.
#[derive(Clone, Copy, Debug)]
pub(super) enum Machine {
    Portable,
    #[cfg(all(target_arch = "x86_64", feature = "std"))]
    Avx2(Avx2),
}

impl Machine {
    /// The best there are.
    pub(super) fn detect() -> Self {
        #[cfg(all(target_arch = "x86_64", feature = "std"))]
        if std::arch::is_x86_feature_detected!("avx2") {
            return Self::Avx2(Avx2(()));
        }
        Self::Portable
    }

    #[inline(always)]
    pub(super) fn run<T: Task>(self, task: T) -> T::Output {
        match self {
            Self::Portable => task.run(Portable),
            #[cfg(all(target_arch = "x86_64", feature = "std"))]
            // SAFETY: the value says that AVX2 was found.
            Self::Avx2(lanes) => unsafe { x86::with_avx2(lanes, task) },
        }
    }
}

/// Arrays, which compilers make the best of that they may assume of all machines.
#[derive(Clone, Copy)]
pub(super) struct Portable;

#[derive(Clone, Copy)]
pub(super) struct Array<T, const N: usize>(pub(super) [T; N]);

impl<T: Copy, const N: usize> Array<T, N> {
    #[inline(always)]
    fn zip(mut self, o: Self, f: impl Fn(T, T) -> T) -> Self {
        for (a, b) in self.0.iter_mut().zip(o.0) {
            *a = f(*a, b);
        }
        self
    }
}

macro_rules! array_operator {
    ($($operator:ident $method:ident),*) => {$(
        impl<T: Copy + $operator<Output = T>, const N: usize> $operator for Array<T, N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                self.zip(o, |a, b| a.$method(b))
            }
        }
    )*};
}
array_operator!(Add add, Sub sub, Mul mul, Div div);

impl<T, const N: usize> Vector<T, N> for Array<T, N>
where
    T: Copy + PartialOrd + Add<Output = T> + Sub<Output = T> + Mul<Output = T> + Div<Output = T>,
{
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        self.zip(o, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        self.zip(o, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn less(self, o: Self, yes: Self, mut no: Self) -> Self {
        for i in 0..N {
            no.0[i] = if self.0[i] < o.0[i] { yes.0[i] } else { no.0[i] };
        }
        no
    }
    #[inline(always)]
    fn le(self, o: Self) -> u32 {
        (0..N).fold(0, |mask, i| mask | (u32::from(self.0[i] <= o.0[i]) << i))
    }
    #[inline(always)]
    fn array(self) -> [T; N] {
        self.0
    }
}

impl Lanes for Portable {
    type Singles = Array<f32, 8>;
    type Doubles = Array<f64, 4>;

    #[inline(always)]
    fn singles(self, x: &[f32; 8]) -> Self::Singles {
        Array(*x)
    }
    #[inline(always)]
    fn doubles(self, x: &[f64; 4]) -> Self::Doubles {
        Array(*x)
    }
    #[inline(always)]
    fn single(self, x: f32) -> Self::Singles {
        Array([x; 8])
    }
    #[inline(always)]
    fn double(self, x: f64) -> Self::Doubles {
        Array([x; 4])
    }
    #[inline(always)]
    fn prefetch<T>(self, _: &T) {}
}

#[cfg(all(target_arch = "x86_64", feature = "std"))]
pub(super) use x86::Avx2;

#[cfg(all(target_arch = "x86_64", feature = "std"))]
mod x86 {
    use core::arch::x86_64::*;
    use core::ops::{Add, Div, Mul, Sub};

    use super::{Lanes, Task, Vector};

    /// Proof that the machine has AVX2.
    #[derive(Clone, Copy, Debug)]
    pub(in super::super) struct Avx2(pub(super) ());

    /// Where AVX2 may be used, all that is inlined here may use it.
    #[target_feature(enable = "avx2")]
    pub(super) fn with_avx2<T: Task>(lanes: Avx2, task: T) -> T::Output {
        task.run(lanes)
    }

    macro_rules! vector {
        ($name:ident($register:ident) of $n:literal $t:ident:
         $add:ident $sub:ident $mul:ident $div:ident $min:ident $max:ident
         $compare:ident $blend:ident $mask:ident $store:ident) => {
            #[derive(Clone, Copy)]
            pub(in super::super) struct $name($register);

            vector!(@operator $name: Add add $add, Sub sub $sub, Mul mul $mul, Div div $div);

            impl Vector<$t, $n> for $name {
                #[inline(always)]
                fn min(self, o: Self) -> Self {
                    // SAFETY: made only by an `Avx2`.
                    Self(unsafe { $min(self.0, o.0) })
                }
                #[inline(always)]
                fn max(self, o: Self) -> Self {
                    // SAFETY: made only by an `Avx2`.
                    Self(unsafe { $max(self.0, o.0) })
                }
                #[inline(always)]
                fn less(self, o: Self, yes: Self, no: Self) -> Self {
                    // SAFETY: made only by an `Avx2`.
                    Self(unsafe { $blend(no.0, yes.0, $compare::<_CMP_LT_OQ>(self.0, o.0)) })
                }
                #[inline(always)]
                fn le(self, o: Self) -> u32 {
                    // SAFETY: made only by an `Avx2`.
                    unsafe { $mask($compare::<_CMP_LE_OQ>(self.0, o.0)) as u32 }
                }
                #[inline(always)]
                fn array(self) -> [$t; $n] {
                    let mut out = [0.0; $n];
                    // SAFETY: made only by an `Avx2`; the array has room for all of it.
                    unsafe { $store(out.as_mut_ptr(), self.0) };
                    out
                }
            }
        };
        (@operator $name:ident: $($operator:ident $method:ident $instruction:ident),*) => {$(
            impl $operator for $name {
                type Output = Self;
                #[inline(always)]
                fn $method(self, o: Self) -> Self {
                    // SAFETY: made only by an `Avx2`.
                    Self(unsafe { $instruction(self.0, o.0) })
                }
            }
        )*};
    }

    vector!(Singles(__m256) of 8 f32:
        _mm256_add_ps _mm256_sub_ps _mm256_mul_ps _mm256_div_ps _mm256_min_ps _mm256_max_ps
        _mm256_cmp_ps _mm256_blendv_ps _mm256_movemask_ps _mm256_storeu_ps);
    vector!(Doubles(__m256d) of 4 f64:
        _mm256_add_pd _mm256_sub_pd _mm256_mul_pd _mm256_div_pd _mm256_min_pd _mm256_max_pd
        _mm256_cmp_pd _mm256_blendv_pd _mm256_movemask_pd _mm256_storeu_pd);

    impl Lanes for Avx2 {
        type Singles = Singles;
        type Doubles = Doubles;

        #[inline(always)]
        fn singles(self, x: &[f32; 8]) -> Singles {
            // SAFETY: the machine has AVX2; the reference is to all that is read.
            Singles(unsafe { _mm256_loadu_ps(x.as_ptr()) })
        }
        #[inline(always)]
        fn doubles(self, x: &[f64; 4]) -> Doubles {
            // SAFETY: the machine has AVX2; the reference is to all that is read.
            Doubles(unsafe { _mm256_loadu_pd(x.as_ptr()) })
        }
        #[inline(always)]
        fn single(self, x: f32) -> Singles {
            // SAFETY: the machine has AVX2.
            Singles(unsafe { _mm256_set1_ps(x) })
        }
        #[inline(always)]
        fn double(self, x: f64) -> Doubles {
            // SAFETY: the machine has AVX2.
            Doubles(unsafe { _mm256_set1_pd(x) })
        }
        #[inline(always)]
        fn prefetch<T>(self, x: &T) {
            let start = core::ptr::from_ref(x).cast::<i8>();
            for line in (0..size_of::<T>()).step_by(64) {
                // SAFETY: within the referenced value, and a hint only.
                unsafe { _mm_prefetch::<_MM_HINT_T0>(start.add(line)) };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use drt_math::Rng;

    use super::{Lanes, Machine, Task, Vector};

    struct Everything<'a>([[f64; 4]; 2], &'a mut Vec<u64>);

    impl Task for Everything<'_> {
        type Output = ();

        fn run<L: Lanes>(self, lanes: L) {
            let [x, y] = self.0;
            let (a, b) = (lanes.doubles(&x), lanes.doubles(&y));
            let zero = lanes.double(0.0);
            for v in [a + b, a - b, a * b, a / b, a.min(b), a.max(b), a.less(b, a, zero)] {
                self.1.extend(v.array().map(f64::to_bits));
            }
            self.1.push(a.le(b).into());
            let eight = |x: [f64; 4]| [0, 1, 2, 3, 0, 1, 2, 3].map(|i| x[i] as f32);
            let (a, b) = (lanes.singles(&eight(x)), lanes.singles(&eight(y)));
            let zero = lanes.single(0.0);
            for v in [a + b, a - b, a * b, a / b, a.min(b), a.max(b), a.less(b, a, zero)] {
                self.1.extend(v.array().map(|x| u64::from(x.to_bits())));
            }
            self.1.push(a.le(b).into());
        }
    }

    #[test]
    fn the_machine_and_arrays_give_the_same_bits() {
        let odd = [0.0, -0.0, 1e-310, -1e-40, 1.0 / 3.0];
        let mut rng = Rng::new(2, 0, 0);
        let mut number = || match rng.next_u32() % 8 {
            i @ 0..5 => odd[i as usize],
            _ => (rng.next_f64() - 0.5) * 1e3,
        };
        for _ in 0..10_000 {
            let x = [0; 4].map(|_| number());
            let y = [0; 4].map(|_| number());
            let [arrays, machine] = [Machine::Portable, Machine::detect()].map(|machine| {
                let mut bits = Vec::new();
                machine.run(Everything([x, y], &mut bits));
                bits
            });
            // The sign of a NaN from 0/0 is anybody's.
            let nan = |(i, b): (usize, &u64)| match i {
                0..29 => f64::from_bits(*b).is_nan(),
                _ => f32::from_bits(*b as u32).is_nan(),
            };
            for (i, (a, m)) in arrays.iter().zip(&machine).enumerate() {
                assert!(a == m || (nan((i, a)) && nan((i, m))), "{i} of {x:?} {y:?}");
            }
        }
    }

    #[test]
    fn a_nan_loses_and_is_at_most_nothing() {
        struct Nan;
        impl Task for Nan {
            type Output = ();

            fn run<L: Lanes>(self, lanes: L) {
                let (nan, one) = (lanes.double(f64::NAN), lanes.double(1.0));
                assert_eq!(nan.min(one).array(), [1.0; 4]);
                assert_eq!(nan.max(one).array(), [1.0; 4]);
                assert!(one.min(nan).array()[0].is_nan() && one.max(nan).array()[0].is_nan());
                assert_eq!((nan.le(one), one.le(nan), one.le(one)), (0, 0, 0b1111));
                assert_eq!(nan.less(one, nan, one).array(), [1.0; 4]);
            }
        }
        Machine::Portable.run(Nan);
        Machine::detect().run(Nan);
    }
}
