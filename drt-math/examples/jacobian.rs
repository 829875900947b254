//! The derivative of a reflected point with respect to everything that moves it.
//!
//! A ray leaves the eye, meets the plane through `p` with normal along `n`, is mirrored and meets
//! the ground z = 0. Written once for any scalar, the landing point yields its value in `f64` and its
//! Jacobian in duals, which is compared with finite differences here.
//!
//! `cargo run --example jacobian`

use drt_math::{Dual, Real, Vec3, vec3};

/// Parameters: the mirror's point (0..3) and unnormalised normal (3..6).
const PARAMETERS: usize = 6;

fn landing<T: Real>(parameters: [T; PARAMETERS]) -> Vec3<T> {
    let [px, py, pz, nx, ny, nz] = parameters;
    let (p, n) = (vec3(px, py, pz), vec3(nx, ny, nz).normalize());
    let eye = vec3(-2.0, 0.5, 1.5).lift::<T>();
    let direction = vec3(1.0, 0.1, 0.2).lift::<T>();

    let on_mirror = eye + direction * ((p - eye).dot(n) / direction.dot(n));
    let mirrored = direction - n * (direction.dot(n) * 2.0);
    on_mirror - mirrored * (on_mirror.z / mirrored.z)
}

fn main() {
    let at = [0.0, 0.0, 1.0, -1.0, 0.2, -0.6];
    let point = landing::<Dual<f64, PARAMETERS>>(std::array::from_fn(|i| Dual::variable(at[i], i)));

    println!("lands at ({:.6}, {:.6}, {:.6})", point.x.re, point.y.re, point.z.re);
    println!("parameter      dx            dy        (finite differences)");
    for (i, name) in ["px", "py", "pz", "nx", "ny", "nz"].into_iter().enumerate() {
        let moved = |h: f64| {
            let mut parameters = at;
            parameters[i] += h;
            landing(parameters)
        };
        let h = 1e-5;
        let difference = (moved(h) - moved(-h)) / (2.0 * h);
        let (dx, dy) = (point.x.eps[i], point.y.eps[i]);
        println!("{name:9} {dx:13.9} {dy:13.9}  ({:.9} {:.9})", difference.x, difference.y);
        assert!((vec3(dx, dy, 0.0) - difference).max_abs() < 1e-7);
    }
}
