//! The pieces a tree is made of: the kernel along a line, and cones.

use drt_math::testing::{SIGNIFICANCE, interval_chi_square};
use drt_math::{Rng, Vec3, vec3};

use crate::edges::tree::eight::{Eight, same, single};
use crate::edges::tree::kernel::Kernel;
use crate::edges::tree::seen::{Place, Seen, Toward};
use crate::edges::tree::tests::setup::*;
use crate::edges::tree::*;

#[test]
fn kernels_are_sampled_exactly() {
    let cases = [(0.7, -1.0, 3.0), (0.2, 0.1, 2.0), (0.3, -4.0, -0.2), (3.0, -0.1, 0.2)];
    for (d, near, far) in cases {
        let k = Kernel::new(d, near, far);
        let mut rng = Rng::new(4, 0, 0);
        let samples: alloc::vec::Vec<f64> =
            (0..100_000).map(|_| k.sample(rng.next_f64())).collect();
        let exact = |t: f64| d / (f64::powf(d * d + t * t, 1.5) * k.mass());
        let p = |pdf: &dyn Fn(f64) -> f64| {
            interval_chi_square(samples.iter().copied(), [near, far], pdf)
        };
        assert!(p(&exact) > SIGNIFICANCE && p(&|t| k.pdf(t)) > SIGNIFICANCE);
        let equiangular = |t: f64| d / ((d * d + t * t) * ((far / d).atan() - (near / d).atan()));
        assert!(p(&equiangular) < SIGNIFICANCE || d > 2.0);
    }
}

#[test]
fn kernels_keep_their_digits() {
    // Almost towards the point: the density is that of 1 / t^3.
    for sign in [1.0, -1.0] {
        let k = Kernel::new(1e-7, f64::min(sign, 2.0 * sign), f64::max(sign, 2.0 * sign));
        assert!((k.mass() / 1e-7 / 0.375 - 1.0).abs() < 1e-6, "{}", k.mass());
        let median = f64::sqrt(2.0 / (1.0 + 0.25));
        assert!((k.sample(0.5) * sign - median).abs() < 1e-6);
    }
    // On the line, and on the segment itself.
    for (near, far) in [(1.0, 2.0), (0.0, 1.0), (-1.0, 1.0)] {
        let k = Kernel::new(0.0, near, far);
        for u in [1e-12, 0.3, 0.999_999] {
            let t = k.sample(u);
            assert!((near..=far).contains(&t) && k.pdf(t) > 0.0 && k.pdf(t).is_finite());
        }
    }
    assert_eq!(Kernel::new(1.0, 0.0, 0.0).mass(), 0.0);
}

fn overlap(view: &Viewpoint, way: &Way, middle: Vec3, half: Vec3) -> f32 {
    let place = Place::new(middle - half, middle + half);
    let local = Seen::new(view, 0.0).unwrap().local(&place);
    let [center, half] = [place.of(middle), half * place.scale].map(|v| same(single(v)));
    let center = [0, 1, 2].map(|k| center[k] - local.x()[k]);
    Toward::from(way).overlap(&local, center, half).0[0]
}

/// The parts that planes leave of a line.
fn clipped(view: &Viewpoint, way: &Way, from: Vec3, tangent: Vec3, length: f64) -> [f64; 2] {
    let place = Place::new(from, from + tangent * length);
    let local = Seen::new(view, 0.0).unwrap().local(&place);
    let a = same(single(place.of(from)));
    let to = [0, 1, 2].map(|k| a[k] - local.x()[k]);
    let all = [0.0, (length * place.scale) as f32].map(Eight::splat);
    let (part, _) = Toward::from(way).clip(&local, to, same(single(tangent)), all);
    part.map(|s| f64::from(s.0[0]) / place.scale)
}

#[test]
fn cones_cut_lines_where_they_are_entered_and_left() {
    let mut rng = Rng::new(5, 0, 0);
    let (mut cut, mut none, mut close) = (0, 0, 0);
    for i in 0..2000 {
        let (center, radius) = (in_cube(&mut rng) * 3.0, 0.05 + rng.next_f64());
        let view = Viewpoint::new(Vec3::ZERO, None);
        let way = view.toward(1.0, center, radius);
        let Some(cone) = way.cone else {
            assert!(center.length() <= radius);
            continue;
        };
        let from = if i % 5 == 0 { center * -0.7 } else { in_cube(&mut rng) * 3.0 };
        let (tangent, length) = ((center + in_cube(&mut rng) * 2.0 - from).normalize(), 6.0);
        let part = cone.clip(from, tangent, [0.0, length]);
        let [start, end] = part.unwrap_or([0.0; 2]);
        cut += u32::from(part.is_some());
        none += u32::from(part.is_none());
        let planes = clipped(&view, &way, from, tangent, length);
        let slip = 1e-5 * (from.length() + length);
        let inside = planes[0] <= start + slip && end <= planes[1] + slip;
        assert!(part.is_none() || inside, "{part:?} {planes:?}");
        close += u32::from(part.is_some() && planes[1] - planes[0] < 1.3 * (end - start) + slip);
        for k in 0..200 {
            let s = length * (f64::from(k) + 0.5) / 200.0;
            let p = from + tangent * s;
            // The ray to p meets the sphere.
            let along = center.dot(p.normalize());
            let off = f64::sqrt(center.length_squared() - along * along) - radius;
            let within = along > 0.0 && off < 0.0;
            if off.abs() > 1e-9 && (s - start).abs() > 1e-9 && (s - end).abs() > 1e-9 {
                assert_eq!(within, (start..end).contains(&s), "{cone:?} {from:?} {tangent:?} {s}");
            }
            let half = Vec3::splat(0.01) + (in_cube(&mut rng) + Vec3::splat(1.0)) * 0.2;
            let middle = p + vec3(half.x, -half.y, half.z);
            let overlap = overlap(&view, &way, middle, half);
            assert!((0.0..=1.0).contains(&overlap) && (!within || overlap > 0.0));
        }
    }
    assert!(cut > 200 && none > 200 && 2 * close > cut, "{cut} {none} {close}");
}
