//! Fits a cage to a target mesh, without rendering anything.
//!
//! A body follows a cage by mean value coordinates. Given the body as it was and as it became, gradient
//! descent finds the cage that made it so: the gradient by the cage's vertices is the transpose of what
//! spreads their motion over the body, and the optimiser knows nothing but numbers.

use std::error::Error;

use drt_geom::Mesh;
use drt_geom::procedural::{bumpy_sphere, icosphere};
use drt_math::{Affine, Mat3, Vec3, fm, vec3};
use drt_motion::mean_value::{Cage, CageWeights};
use drt_motion::optimize::{Decay, Method, Optimizer, Variable};

const ITERATIONS: u32 = 300;

/// What a fit came to.
pub struct Fitted {
    /// Root mean square distance of the cage's vertices from the true ones, before and after.
    pub cage: [f64; 2],
    /// That of the body's vertices from the target's.
    pub body: [f64; 2],
}

/// Bends and twists a cage.
fn true_motion(cage: &Mesh) -> Vec<Vec3> {
    let bent = |x: Vec3| {
        let twist = Mat3::rotation(Vec3::Z, 0.4 * x.z);
        twist * x + vec3(0.15 * x.z * x.z, 0.1 * x.x, 0.2 * x.x * x.y) - x
    };
    cage.positions.iter().map(|x| bent(*x)).collect()
}

fn rms(vectors: impl ExactSizeIterator<Item = Vec3>) -> f64 {
    let n = vectors.len() as f64;
    fm::sqrt(vectors.map(Vec3::length_squared).sum::<f64>() / n)
}

fn vectors(numbers: &[f64]) -> Vec<Vec3> {
    numbers.chunks_exact(3).map(|c| vec3(c[0], c[1], c[2])).collect()
}

/// Finds the motion of a cage's vertices from that of a body in it.
pub fn fit() -> Result<Fitted, Box<dyn Error>> {
    let body = bumpy_sphere(3, 0.2, 5.0);
    let size = Affine { linear: Mat3::IDENTITY * 1.7, translation: Vec3::ZERO };
    let cage = icosphere(0).transform(&size);
    let weights = CageWeights::new(&Cage::new(&cage)?, &body.positions);
    let truth = true_motion(&cage);
    let target = weights.spread(&truth);

    let n = 3 * truth.len();
    let variable = Variable { learning_rate: 0.02, ..Variable::default() };
    let mut optimizer = Optimizer::new(Method::ADAM, vec![variable; n], &vec![0.0; n])?;
    let misses = |numbers: &[f64]| -> Vec<Vec3> {
        let reached = weights.spread(&vectors(numbers));
        reached.iter().zip(&target).map(|(a, b)| *a - *b).collect()
    };
    let measure = |numbers: &[f64]| {
        let cage: Vec<Vec3> = vectors(numbers).iter().zip(&truth).map(|(a, b)| *a - *b).collect();
        [rms(cage.into_iter()), rms(misses(numbers).into_iter())]
    };
    let before = measure(optimizer.values());
    let decay = Decay::Cosine { end: 0.01 };
    for i in 0..ITERATIONS {
        // Of half the sum of squared distances.
        let gradient = weights.gather(&misses(optimizer.values()));
        let gradient: Vec<f64> = gradient.iter().flat_map(|g| [g.x, g.y, g.z]).collect();
        optimizer.step(&gradient, decay.factor(i, ITERATIONS))?;
    }
    let after = measure(optimizer.values());
    Ok(Fitted { cage: [before[0], after[0]], body: [before[1], after[1]] })
}

#[allow(dead_code, reason = "the test runs the fit alone")]
fn main() -> Result<(), Box<dyn Error>> {
    let Fitted { cage, body } = fit()?;
    println!("{ITERATIONS} iterations            before      after");
    println!("rms distance of the cage  {:9.6}  {:9.6}", cage[0], cage[1]);
    println!("rms distance of the body  {:9.6}  {:9.6}", body[0], body[1]);
    Ok(())
}
