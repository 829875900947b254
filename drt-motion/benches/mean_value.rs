//! Time per query of the mean value field, exact and accelerated.
//!
//! `cargo bench -p drt-motion --bench mean_value`
//!
//! A bumpy ball in a box, the points in between. Both fields take turns on the same batches; the
//! medians are over batches. `difference` is that between the two velocities, rms over the points
//! and relative to the largest velocity of the surface.

use std::hint::black_box;
use std::time::Instant;

use drt_geom::{Mesh, TriangleBvh, procedural};
use drt_math::{Affine, Mat3, Rng, Vec3};
use drt_motion::mean_value::{MeanValueField, MeanValueVelocities, MeanValueWeights};

const BATCHES: usize = 15;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!(
        "triangles  set-up ms   per parameter ms   exact us   accelerated us   +1 parameter us   near  far   difference"
    );
    for (subdivisions, points) in [(3, 40), (4, 20), (5, 20), (6, 20)] {
        row(subdivisions, points)?;
    }
    Ok(())
}

fn row(subdivisions: u32, points: usize) -> Result<(), Box<dyn std::error::Error>> {
    let ball = procedural::bumpy_sphere(subdivisions, 0.2, 6.0);
    let soup = boxed(&ball);
    let start = Instant::now();
    let field = MeanValueField::new(&soup)?;
    let set_up = start.elapsed();
    let moving = ball.triangles.len();
    // The ball turns, with a wave on it; the box rests.
    let corner = |i: usize, p: Vec3| {
        if i < moving { Vec3::Z.cross(p) + Vec3::X * (5.0 * p.y).sin() } else { Vec3::ZERO }
    };
    let corners: Vec<[Vec3; 3]> =
        soup.iter().enumerate().map(|(i, t)| t.map(|p| corner(i, p))).collect();
    let start = Instant::now();
    let velocities = field.velocities(&corners)?;
    let per_parameter = start.elapsed();
    let exact = field.clone().exact();

    let mut rng = Rng::new(1, 0, 0);
    let bvh = TriangleBvh::of(&ball)?;
    let mut near = Vec::new();
    let mut far = Vec::new();
    let mut times = [Vec::new(), Vec::new(), Vec::new()];
    let (mut difference, mut count) = (0.0, 0);
    let mut buffers = [MeanValueWeights::default(), MeanValueWeights::default()];
    for _ in 0..BATCHES {
        let batch = inside(&mut rng, &bvh, points);
        let [a, b] = &mut buffers;
        let slow = batch.len().min(8);
        times[0].push(time(&batch[..slow], |x| query(&exact, &velocities, x, a)));
        times[1].push(time(&batch, |x| query(&field, &velocities, x, b)));
        times[2].push(time(&batch, |_| field.jet(b, &velocities).u));
        for &x in &batch[..slow] {
            let d = query(&exact, &velocities, x, a) - query(&field, &velocities, x, b);
            difference += d.length_squared();
            count += 1;
            let [n, f] = b.counts();
            near.push(n as f64);
            far.push(f as f64);
        }
    }
    let largest = corners.iter().flatten().map(|v| v.length()).fold(0.0, f64::max);
    println!(
        "{:9}  {:9.1}   {:16.1}   {:8.1}   {:14.2}   {:15.2}   {:4.0}  {:4.0}   {:.1e}",
        soup.len(),
        1e3 * set_up.as_secs_f64(),
        1e3 * per_parameter.as_secs_f64(),
        1e6 * median(&mut times[0]),
        1e6 * median(&mut times[1]),
        1e6 * median(&mut times[2]),
        median(&mut near),
        median(&mut far),
        (difference / count as f64).sqrt() / largest,
    );
    Ok(())
}

fn query(
    field: &MeanValueField,
    velocities: &MeanValueVelocities,
    x: Vec3,
    buffer: &mut MeanValueWeights,
) -> Vec3 {
    field.weights(x, buffer);
    field.jet(buffer, velocities).u
}

fn boxed(ball: &Mesh) -> Vec<[Vec3; 3]> {
    let scale = Affine { linear: Mat3::IDENTITY * 2.0, translation: Vec3::ZERO };
    let mut soup = ball.soup();
    soup.extend(procedural::cube().transform(&scale).soup());
    soup
}

/// Points between the ball and the box.
fn inside(rng: &mut Rng, bvh: &TriangleBvh, n: usize) -> Vec<Vec3> {
    let mut points = Vec::new();
    while points.len() < n {
        let x = Vec3::from([(); 3].map(|()| 4.0 * rng.next_f64() - 2.0));
        if !bvh.inside(x) {
            points.push(x);
        }
    }
    points
}

/// Seconds per point.
fn time(points: &[Vec3], mut f: impl FnMut(Vec3) -> Vec3) -> f64 {
    let start = Instant::now();
    for &x in points {
        black_box(f(black_box(x)));
    }
    start.elapsed().as_secs_f64() / points.len() as f64
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
