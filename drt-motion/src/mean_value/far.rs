//! A triangle seen from far away, where the closed form loses the digits that its size falls short
//! of its distance.

use drt_math::Vec3;

use super::quadrature::GAUSS_5;
use super::triangle::{Local, Triangle};
use super::{Kernel, MeanValueWeight};

/// The integrals by a product rule of degree 8: at the distances that come here, to rounding.
pub(super) fn weights(t: &Triangle, local: &Local, kernel: Kernel) -> [MeanValueWeight; 3] {
    let (h, n) = (local.h, t.normal);
    let mut sums = [(0.0, Vec3::ZERO); 3];
    for (u, wu) in GAUSS_5 {
        for (v, wv) in GAUSS_5 {
            let lambda = [1.0 - u, u * (1.0 - v), u * v];
            let z = local.d[0] * lambda[0] + local.d[1] * lambda[1] + local.d[2] * lambda[2];
            let inverse = 1.0 / z.length_squared();
            let f = wu * wv * u * inverse * inverse;
            for (sum, l) in sums.iter_mut().zip(lambda) {
                sum.0 += f * l;
                sum.1 += z * (f * l * inverse);
            }
        }
    }
    sums.map(|(i4, away)| match kernel {
        Kernel::MeanValue => MeanValueWeight {
            value: t.double_area * h * i4,
            gradient: (away * (4.0 * h) - n * i4) * t.double_area,
        },
        Kernel::InverseDistance => {
            MeanValueWeight { value: t.double_area * i4, gradient: away * (4.0 * t.double_area) }
        }
    })
}
