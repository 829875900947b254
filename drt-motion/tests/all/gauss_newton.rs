//! Gauss and Newton's steps on sums of squares, known exactly and by noisy halves.

use drt_math::dense::{Cholesky, dot};
use drt_math::{Rng, fm};
use drt_motion::optimize::{Decay, Method, Observation, OptimizeError, Optimizer, Variable};

/// Numbers of a normal distribution.
struct Normal(Rng);

impl Normal {
    fn new(seed: u64) -> Self {
        Self(Rng::new(seed, 0x6e01, 0))
    }

    fn vector(&mut self, n: usize, scale: f64) -> Vec<f64> {
        let mut one = || {
            let radius = fm::sqrt(-2.0 * fm::ln(self.0.next_f64()));
            scale * radius * fm::cos(core::f64::consts::TAU * self.0.next_f64())
        };
        (0..n).map(|_| one()).collect()
    }
}

/// What an iteration sees.
struct Seen {
    gradient: Vec<f64>,
    curvature: Vec<Vec<f64>>,
    noise: Vec<Vec<f64>>,
}

impl Seen {
    fn observation(&self) -> Observation<'_> {
        let Self { gradient, curvature, noise } = self;
        Observation { gradient, curvature, noise, covariance: &[], weight: 1.0 }
    }
}

fn table(n: usize, value: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    (0..n).map(|i| (0..n).map(|j| value(i, j)).collect()).collect()
}

/// The sum of squares of columns · (x − goal), pictures and derivatives seen through noise.
struct Squares {
    columns: Vec<Vec<f64>>,
    goal: Vec<f64>,
    picture_noise: f64,
    derivative_noise: f64,
}

impl Squares {
    /// Columns that share most of what they do, so that the matrix has a condition of several hundred.
    fn new(n: usize, pixels: usize) -> Self {
        let mut normal = Normal::new(11);
        let common = normal.vector(pixels, 1.0);
        let own = |normal: &mut Normal| -> Vec<f64> {
            let own = normal.vector(pixels, 0.25);
            own.iter().zip(&common).map(|(o, c)| o + c).collect()
        };
        let columns = (0..n).map(|_| own(&mut normal)).collect();
        let goal = normal.vector(n, 0.3);
        Self { columns, goal, picture_noise: 0.0, derivative_noise: 0.0 }
    }

    fn residual(&self, x: &[f64]) -> Vec<f64> {
        let miss: Vec<f64> = x.iter().zip(&self.goal).map(|(x, g)| x - g).collect();
        let pixel = |k: usize| self.columns.iter().zip(&miss).map(|(c, m)| c[k] * m).sum();
        (0..self.columns[0].len()).map(pixel).collect()
    }

    fn error(&self, x: &[f64]) -> f64 {
        let squares = x.iter().zip(&self.goal).map(|(x, g)| (x - g) * (x - g));
        fm::sqrt(squares.sum::<f64>() / dot(&self.goal, &self.goal))
    }

    fn see(&self, x: &[f64], normal: &mut Normal) -> Seen {
        let (n, pixels) = (self.columns.len(), self.columns[0].len());
        let add =
            |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a + b).collect() };
        let exact = self.residual(x);
        let mut half = || {
            let residual = add(&exact, &normal.vector(pixels, self.picture_noise));
            let mut noisy = |c: &Vec<f64>| add(c, &normal.vector(pixels, self.derivative_noise));
            (residual, self.columns.iter().map(&mut noisy).collect::<Vec<_>>())
        };
        let [(ra, ja), (rb, jb)] = [half(), half()];
        let gradient = (0..n).map(|i| dot(&ra, &jb[i]) + dot(&rb, &ja[i])).collect();
        let curvature = table(n, |i, j| dot(&ja[i], &jb[j]) + dot(&jb[i], &ja[j]));
        let differ: Vec<Vec<f64>> = ja
            .iter()
            .zip(&jb)
            .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect())
            .collect();
        Seen { gradient, curvature, noise: table(n, |i, j| dot(&differ[i], &differ[j])) }
    }
}

fn variables(n: usize, learning_rate: f64) -> Vec<Variable> {
    vec![Variable { learning_rate, ..Variable::default() }; n]
}

fn gauss_newton(n: usize, learning_rate: f64) -> Optimizer {
    Optimizer::new(Method::GAUSS_NEWTON, variables(n, learning_rate), &vec![0.0; n]).unwrap()
}

#[test]
fn without_noise_one_step_is_enough() {
    let problem = Squares::new(12, 40);
    let mut optimizer = gauss_newton(12, 100.0);
    let seen = problem.see(optimizer.values(), &mut Normal::new(0));
    optimizer.step_by(&seen.observation(), 1.0).unwrap();
    assert!(problem.error(optimizer.values()) < 1e-6, "{:?}", optimizer.values());
}

/// Nobody sees the gradient again after the first step: what limits held back is done later.
#[test]
fn steps_are_limited_and_the_rest_is_not_forgotten() {
    let problem = Squares::new(3, 20);
    let mut optimizer = gauss_newton(3, 0.1);
    let far = problem.goal.iter().fold(0.0, |m: f64, g| m.max(g.abs()));
    for i in 0..30 {
        let before = optimizer.values().to_vec();
        let seen = problem.see(&before, &mut Normal::new(0));
        optimizer.step_by(&seen.observation(), 1.0).unwrap();
        let moved = before.iter().zip(optimizer.values()).map(|(a, b)| (a - b).abs());
        let longest = moved.fold(0.0, f64::max);
        assert!(longest <= 0.1 + 1e-15, "{longest}");
        assert!(i > 0 || longest == 0.1, "the goal is {far} away");
    }
    assert!(problem.error(optimizer.values()) < 1e-9);
}

/// The least value in a box is where no free variable has a slope and every other one presses outwards.
#[test]
fn bounds_are_part_of_the_step() {
    let problem = Squares::new(6, 30);
    let upper = 0.03;
    let mut all = variables(6, 10.0);
    all.iter_mut().for_each(|v| v.upper = upper);
    all[1].learning_rate = 0.0;
    let mut optimizer = Optimizer::new(Method::GAUSS_NEWTON, all, &[0.0; 6]).unwrap();
    for _ in 0..40 {
        let seen = problem.see(optimizer.values(), &mut Normal::new(0));
        optimizer.step_by(&seen.observation(), 1.0).unwrap();
    }
    let x = optimizer.values();
    let slope = problem.see(x, &mut Normal::new(0)).gradient;
    assert_eq!(x[1], 0.0);
    let bound = x.iter().filter(|x| **x == upper).count();
    assert!((1..5).contains(&bound), "{x:?}");
    for (i, (x, slope)) in x.iter().zip(slope).enumerate().filter(|(i, _)| *i != 1) {
        let fits = if *x == upper { slope < 0.0 } else { slope.abs() < 1e-6 };
        assert!(fits, "variable {i} at {x} of {upper} has the slope {slope}");
    }
}

/// In (ln x − ln 3)² a step of the logarithm arrives at once; in x it would not.
#[test]
fn logarithms_are_what_is_stepped() {
    let logarithmic = Variable { logarithmic: true, learning_rate: 100.0, ..Variable::default() };
    for (variable, arrives) in [(logarithmic, true), (variables(1, 100.0)[0], false)] {
        let mut optimizer = Optimizer::new(Method::GAUSS_NEWTON, vec![variable], &[0.5]).unwrap();
        let x = optimizer.values()[0];
        let (gradient, curvature) = ([2.0 * fm::ln(x / 3.0) / x], [vec![2.0 / (x * x)]]);
        let (gradient, curvature) = (&gradient, &curvature);
        let seen = Observation { gradient, curvature, noise: &[], covariance: &[], weight: 1.0 };
        optimizer.step_by(&seen, 1.0).unwrap();
        assert_eq!((optimizer.values()[0] - 3.0).abs() < 1e-8, arrives);
    }
}

const RUNS: u64 = 24;
const ITERATIONS: u32 = 100;

/// Root mean square over runs of the error relative to the start's.
fn rms(run: impl Fn(u64) -> f64) -> f64 {
    fm::sqrt((0..RUNS).map(|seed| run(seed).powi(2)).sum::<f64>() / RUNS as f64)
}

fn by_gauss_newton(problem: &Squares, seed: u64) -> f64 {
    let mut optimizer = gauss_newton(problem.goal.len(), 0.2);
    let mut normal = Normal::new(seed);
    for _ in 0..ITERATIONS {
        let seen = problem.see(optimizer.values(), &mut normal);
        optimizer.step_by(&seen.observation(), 1.0).unwrap();
    }
    problem.error(optimizer.values())
}

fn by_adam(problem: &Squares, seed: u64, rate: f64) -> f64 {
    let n = problem.goal.len();
    let method = Method::Adam { beta1: 0.9, beta2: 0.95, epsilon: 1e-15 };
    let mut optimizer = Optimizer::new(method, variables(n, rate), &vec![0.0; n]).unwrap();
    let mut normal = Normal::new(seed);
    for i in 0..ITERATIONS {
        let seen = problem.see(optimizer.values(), &mut normal);
        let factor = Decay::Cosine { end: 0.01 }.factor(i, ITERATIONS);
        optimizer.step(&seen.gradient, factor).unwrap();
    }
    problem.error(optimizer.values())
}

/// No estimate from the same gradients, each with the covariance C, can be nearer than H⁻¹ C H⁻¹ / t.
#[test]
fn noise_is_averaged_nearly_as_well_as_can_be() {
    let n = 8;
    let problem = Squares { picture_noise: 0.1, derivative_noise: 0.1, ..Squares::new(n, 60) };
    let exact = Squares::new(n, 60).see(&problem.goal, &mut Normal::new(0)).curvature;
    let inverse = Cholesky::new(&exact, 0.0).unwrap();
    let mut normal = Normal::new(77);
    let samples = 4000;
    // Of a Newton step from the goal.
    let variance = (0..samples).map(|_| {
        let mut step = problem.see(&problem.goal, &mut normal).gradient;
        inverse.solve(&mut step);
        dot(&step, &step)
    });
    let variance = variance.sum::<f64>() / f64::from(samples);
    let bound = fm::sqrt(variance / f64::from(ITERATIONS) / dot(&problem.goal, &problem.goal));
    let ours = rms(|seed| by_gauss_newton(&problem, seed));
    // The memory costs a factor of 1.3.
    assert!(ours < 1.5 * bound, "{ours}, at best {bound}");
    let rates = [0.02, 0.05, 0.1, 0.2];
    let adam = rates.map(|rate| rms(|seed| by_adam(&problem, seed, rate)));
    let adam = adam.into_iter().fold(f64::INFINITY, f64::min);
    assert!(adam > 4.0 * ours, "Adam at its best rate: {adam}, Gauss-Newton: {ours}");
    println!("bound {bound:.4}, Gauss-Newton {ours:.4}, Adam {adam:.4}");
}

/// The mean over runs and variables of squared errors, in units of what `known` says they are, after a
/// multiple of the covariance of a gradient at the goal was told with each iteration.
fn squared_errors(problem: &Squares, told: f64, known: impl Fn(&Optimizer) -> Vec<f64>) -> f64 {
    let (n, mut normal) = (problem.goal.len(), Normal::new(78));
    let gradients: Vec<Vec<f64>> =
        (0..4000).map(|_| problem.see(&problem.goal, &mut normal).gradient).collect();
    let product = |i: usize, j: usize| gradients.iter().map(|g| g[i] * g[j]).sum::<f64>();
    let covariance = table(n, |i, j| told * product(i, j) / gradients.len() as f64);
    let run = |seed| {
        let (mut optimizer, mut normal) = (gauss_newton(n, 0.2), Normal::new(seed));
        for _ in 0..ITERATIONS {
            let seen = problem.see(optimizer.values(), &mut normal);
            let seen = Observation { covariance: &covariance, ..seen.observation() };
            optimizer.step_by(&seen, 1.0).unwrap();
        }
        let found = optimizer.values().iter().zip(&problem.goal).zip(known(&optimizer));
        found.map(|((x, goal), error)| ((x - goal) / error).powi(2)).sum::<f64>()
    };
    (0..RUNS).map(run).sum::<f64>() / (RUNS as usize * n) as f64
}

/// Errors are as large as is said. With 24 runs of 8 correlated variables the mean of squares scatters by
/// about a tenth.
#[test]
fn how_well_values_are_known_is_known() {
    let problem = Squares { picture_noise: 0.1, derivative_noise: 0.1, ..Squares::new(8, 60) };
    let known = |o: &Optimizer| o.outlook(None).unwrap().unwrap().errors;
    let squares = squared_errors(&problem, 1.0, known);
    assert!((squares - 1.0).abs() < 0.4, "{squares}");
    // As if all that was averaged were one iteration.
    let planted = squared_errors(&problem, 1.0, |o| {
        let share = o.state().averages.as_ref().unwrap().share;
        known(o).iter().map(|e| e / fm::sqrt(share)).collect()
    });
    assert!(planted < 0.1, "{planted}");
    // Gradients themselves show how far off they are.
    let shown = squared_errors(&problem, 1.0 / 9.0, known);
    assert!((shown - 1.0).abs() < 0.4, "{shown}");
    println!("{squares:.3}, told too little {shown:.3}, planted {planted:.3}");
}

/// Without noise and without a step, what is left is the way to the goal.
#[test]
fn what_is_left_leads_to_the_goal() {
    let problem = Squares::new(5, 30);
    let optimizer = gauss_newton(5, 0.1);
    assert_eq!(optimizer.outlook(None), Ok(None));
    let seen = problem.see(optimizer.values(), &mut Normal::new(0));
    let outlook = optimizer.outlook(Some(&seen.observation())).unwrap().unwrap();
    assert!(problem.error(&outlook.step) < 1e-6, "{outlook:?}");
    assert_eq!(outlook.errors, [0.0; 5]);
    // Nothing tells two columns apart that are the same.
    let mut same = Squares::new(5, 30);
    same.columns[1] = same.columns[0].clone();
    let seen = same.see(optimizer.values(), &mut Normal::new(0));
    assert_eq!(optimizer.outlook(Some(&seen.observation())), Ok(None));
    let adam = Optimizer::new(Method::ADAM, variables(1, 0.1), &[0.0]).unwrap();
    assert_eq!(adam.outlook(None), Ok(None));
}

/// Noise that is larger than the signal in most directions makes matrices indefinite.
#[test]
fn matrices_of_mostly_noise_do_no_harm() {
    let n = 8;
    let problem = Squares { picture_noise: 0.1, derivative_noise: 2.0, ..Squares::new(n, 60) };
    let seen = problem.see(&vec![0.0; n], &mut Normal::new(1));
    assert!(Cholesky::new(&seen.curvature, 0.0).is_none());
    let ours = rms(|seed| by_gauss_newton(&problem, seed));
    assert!(ours < 0.6, "{ours}");
    // Taken as exact, they are refused rather than followed.
    let planted = Observation { noise: &[], ..seen.observation() };
    let mut optimizer = gauss_newton(n, 0.2);
    assert_eq!(optimizer.step_by(&planted, 1.0), Err(OptimizeError::NotSquares));
    println!("{ours:.3}");
}

/// Units and mixtures of variables change nothing but the numbers that stand for the same step.
#[test]
fn steps_do_not_depend_on_units() {
    let n = 5;
    let problem = Squares { picture_noise: 0.5, derivative_noise: 1.0, ..Squares::new(n, 60) };
    let unit = |i: usize| fm::powf(10.0, i as f64 - 2.0);
    let mut scaled = Squares { picture_noise: 0.5, derivative_noise: 1.0, ..Squares::new(n, 60) };
    scaled.goal.iter_mut().enumerate().for_each(|(i, g)| *g /= unit(i));
    let see = |optimizer: &Optimizer, normal: &mut Normal| {
        let x: Vec<f64> = optimizer.values().iter().enumerate().map(|(i, x)| x * unit(i)).collect();
        let Seen { gradient, curvature, noise } = problem.see(&x, normal);
        let gradient = gradient.iter().enumerate().map(|(i, g)| g * unit(i)).collect();
        let change = |m: Vec<Vec<f64>>| table(n, |i, j| m[i][j] * unit(i) * unit(j));
        Seen { gradient, curvature: change(curvature), noise: change(noise) }
    };
    let mut rates = variables(n, 0.2);
    let plain = Optimizer::new(Method::GAUSS_NEWTON, rates.clone(), &vec![0.0; n]);
    rates.iter_mut().enumerate().for_each(|(i, v)| v.learning_rate /= unit(i));
    let other = Optimizer::new(Method::GAUSS_NEWTON, rates, &vec![0.0; n]);
    let (mut plain, mut other) = (plain.unwrap(), other.unwrap());
    let (mut a, mut b) = (Normal::new(2), Normal::new(2));
    for _ in 0..20 {
        let seen = problem.see(plain.values(), &mut a);
        plain.step_by(&seen.observation(), 1.0).unwrap();
        let seen = see(&other, &mut b);
        other.step_by(&seen.observation(), 1.0).unwrap();
    }
    for (i, (p, o)) in plain.values().iter().zip(other.values()).enumerate() {
        assert!((p - o * unit(i)).abs() < 1e-6, "{:?} {:?}", plain.values(), other.values());
    }
}

#[test]
fn a_stored_state_goes_on_to_the_same_bits() {
    let problem = Squares { picture_noise: 0.5, derivative_noise: 0.5, ..Squares::new(4, 30) };
    let run = |optimizer: &mut Optimizer, steps: std::ops::Range<u64>| {
        for i in steps {
            let seen = problem.see(optimizer.values(), &mut Normal::new(i));
            optimizer.step_by(&seen.observation(), 1.0).unwrap();
        }
    };
    let mut whole = gauss_newton(4, 0.1);
    run(&mut whole, 0..30);
    let mut parts = gauss_newton(4, 0.1);
    run(&mut parts, 0..13);
    let stored = parts.state().clone();
    let mut rest = Optimizer::resume(Method::GAUSS_NEWTON, variables(4, 0.1), stored).unwrap();
    run(&mut rest, 13..30);
    assert_eq!(whole.state(), rest.state());
    // Weights that grow by 1/0.35 - 1 average this much.
    let expected = 1.0 / (0.35 * (2.0 - 0.35)) / 30.0;
    let share = rest.state().averages.as_ref().unwrap().share;
    assert!((share / expected - 1.0).abs() < 0.2, "{share} {expected}");
}

#[test]
fn what_cannot_be_meant_is_refused() {
    let mut optimizer = gauss_newton(2, 0.1);
    let before = optimizer.clone();
    assert_eq!(optimizer.step(&[1.0, 1.0], 1.0), Err(OptimizeError::NoCurvature));
    let square = table(2, |i, j| if i == j { 1.0 } else { 0.0 });
    let (gradient, curvature) = (&[1.0, 1.0], &square);
    let good = Observation { gradient, curvature, noise: &[], covariance: &[], weight: 1.0 };
    let mut fail = |seen: Observation<'_>| optimizer.step_by(&seen, 1.0).unwrap_err().to_string();
    assert!(fail(Observation { gradient: &[1.0], ..good }).contains("the gradient: expected 2"));
    assert!(fail(Observation { curvature: &square[..1], ..good }).contains("the curvature"));
    let uneven = [vec![1.0, 0.0], vec![0.0]];
    assert!(fail(Observation { noise: &uneven, ..good }).contains("the noise: expected 2"));
    assert!(fail(Observation { covariance: &uneven, ..good }).contains("the covariance: expected"));
    assert!(fail(Observation { weight: 0.0, ..good }).contains("weight is 0"));
    let infinite = table(2, |_, _| f64::INFINITY);
    assert!(fail(Observation { curvature: &infinite, ..good }).contains("not finite"));
    assert_eq!(optimizer, before);
    let none = Method::GaussNewton { memory: 0.0 };
    let refused = Optimizer::new(none, variables(1, 0.1), &[0.0]).unwrap_err();
    assert_eq!(refused.to_string(), "memory is 0; expected more than 0 and at most 1");
}
