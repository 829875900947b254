use alloc::vec;
use alloc::vec::Vec;

use super::{Decay, Method, OptimizeError, Optimizer, Stages, State, Variable};

/// A narrow valley with its least value at (1, 1).
fn valley(x: &[f64]) -> [f64; 2] {
    let bend = x[1] - x[0] * x[0];
    [2.0 * (x[0] - 1.0) - 8.0 * x[0] * bend, 4.0 * bend]
}

fn run(optimizer: &mut Optimizer, iterations: u32, decay: Decay) {
    for i in 0..iterations {
        let gradient = valley(optimizer.values());
        optimizer.step(&gradient, decay.factor(i, iterations)).unwrap();
    }
}

fn variables(learning_rate: f64) -> Vec<Variable> {
    vec![Variable { learning_rate, ..Variable::default() }; 2]
}

#[test]
fn both_methods_find_the_end_of_a_valley() {
    for (method, rate) in [(Method::ADAM, 0.05), (Method::Momentum { momentum: 0.9 }, 0.01)] {
        let mut optimizer = Optimizer::new(method, variables(rate), &[-1.0, 2.0]).unwrap();
        run(&mut optimizer, 1000, Decay::Cosine { end: 0.0 });
        for x in optimizer.values() {
            assert!((x - 1.0).abs() < 1e-3, "{method:?}: {x}");
        }
    }
}

/// The paper's algorithm by hand, for the first two steps.
#[test]
fn adam_is_that_of_its_paper() {
    let (rate, epsilon) = (0.1, 1e-8);
    let method = Method::Adam { beta1: 0.9, beta2: 0.999, epsilon };
    let mut optimizer = Optimizer::new(method, variables(rate)[..1].to_vec(), &[3.0]).unwrap();
    optimizer.step(&[4.0], 1.0).unwrap();
    let after_one = 3.0 - rate * 4.0 / (4.0 + epsilon);
    assert!((optimizer.values()[0] - after_one).abs() < 1e-14);
    optimizer.step(&[-2.0], 0.5).unwrap();
    let mean = (0.9 * 0.1 * 4.0 - 0.1 * 2.0) / (1.0 - 0.81);
    let square: f64 = (0.999 * 0.001 * 16.0 + 0.001 * 4.0) / (1.0 - 0.999 * 0.999);
    let after_two = after_one - 0.5 * rate * mean / (square.sqrt() + epsilon);
    assert!((optimizer.values()[0] - after_two).abs() < 1e-12);
}

#[test]
fn a_stored_state_goes_on_to_the_same_bits() {
    let method = Method::ADAM;
    let logarithmic = Variable { logarithmic: true, lower: 1e-3, ..variables(0.07)[0] };
    let variables = vec![logarithmic, variables(0.03)[1]];
    let mut whole = Optimizer::new(method, variables.clone(), &[0.3, 2.0]).unwrap();
    run(&mut whole, 57, Decay::Constant);
    let mut parts = Optimizer::new(method, variables.clone(), &[0.3, 2.0]).unwrap();
    for steps in [1, 20, 36] {
        let stored: State = parts.state().clone();
        parts = Optimizer::resume(method, variables.clone(), stored).unwrap();
        run(&mut parts, steps, Decay::Constant);
    }
    assert_eq!(whole.state(), parts.state());
}

#[test]
fn logarithms_keep_values_positive_and_make_steps_relative() {
    let variable = Variable { learning_rate: 0.1, logarithmic: true, ..Variable::default() };
    let mut optimizer = Optimizer::new(Method::ADAM, vec![variable; 2], &[1e-6, 1e6]).unwrap();
    optimizer.step(&[1.0, -1.0], 1.0).unwrap();
    let [small, large] = optimizer.values() else { panic!() };
    // To what epsilon takes off gradients of 1e-6.
    assert!((small / 1e-6 - f64::exp(-0.1)).abs() < 1e-9);
    assert!((large / 1e6 - f64::exp(0.1)).abs() < 1e-12);
    for _ in 0..200 {
        optimizer.step(&[1.0, 0.0], 1.0).unwrap();
    }
    assert!(optimizer.values()[0] > 0.0);
}

#[test]
fn values_stay_within_bounds_and_at_rate_zero() {
    let bounded = Variable { learning_rate: 0.5, lower: 0.2, upper: 1.5, logarithmic: false };
    let kept = Variable { learning_rate: 0.0, ..Variable::default() };
    let mut optimizer =
        Optimizer::new(Method::ADAM, vec![bounded, bounded, kept], &[1.0, 1.0, 0.7]).unwrap();
    for _ in 0..10 {
        optimizer.step(&[1.0, -1.0, 5.0], 1.0).unwrap();
    }
    assert_eq!(optimizer.values(), [0.2, 1.5, 0.7]);
}

#[test]
fn what_cannot_be_meant_is_refused() {
    let fail = |variable: Variable, start: f64| {
        Optimizer::new(Method::ADAM, vec![variable], &[start]).unwrap_err()
    };
    let ok = Variable::default();
    assert!(matches!(fail(ok, f64::NAN), OptimizeError::NotFinite { variable: 0, .. }));
    let rate = Variable { learning_rate: -1.0, ..ok };
    assert!(matches!(fail(rate, 0.0), OptimizeError::LearningRate { .. }));
    let bounds = Variable { lower: 1.0, upper: 1.0, ..ok };
    assert!(matches!(fail(bounds, 1.0), OptimizeError::Bounds { .. }));
    let outside = Variable { lower: 1.0, ..ok };
    assert!(matches!(fail(outside, 0.0), OptimizeError::Start { .. }));
    let logarithmic = Variable { logarithmic: true, ..ok };
    assert!(matches!(fail(logarithmic, 0.0), OptimizeError::NotPositive { .. }));
    let method = Method::Momentum { momentum: 1.0 };
    assert!(matches!(
        Optimizer::new(method, vec![ok], &[0.0]),
        Err(OptimizeError::Method { name: "momentum", .. })
    ));
    let mut optimizer = Optimizer::new(Method::ADAM, vec![ok], &[0.0]).unwrap();
    let before = optimizer.clone();
    assert!(matches!(optimizer.step(&[], 1.0), Err(OptimizeError::Length { found: 0, .. })));
    assert!(matches!(
        optimizer.step(&[f64::NAN], 1.0),
        Err(OptimizeError::NotFinite { variable: 0, what: "the gradient" })
    ));
    // Its square is too large for a number.
    assert!(optimizer.step(&[1e200], 1.0).is_err());
    assert_eq!(optimizer, before);
}

#[test]
fn schedules_reach_what_they_say() {
    for decay in [Decay::Exponential { end: 0.1 }, Decay::Cosine { end: 0.1 }] {
        assert!((decay.factor(0, 50) - 1.0).abs() < 1e-15);
        assert!((decay.factor(50, 50) - 0.1).abs() < 1e-15);
        assert!((1..50).all(|i| decay.factor(i, 50) < decay.factor(i - 1, 50)));
    }
    assert_eq!(Decay::Constant.factor(7, 9), 1.0);
    let stages = Stages::new(4, vec![(20, 64), (10, 16)]);
    assert_eq!([0, 9, 10, 19, 20, 99].map(|i| stages.at(i)), [4, 4, 16, 16, 64, 64]);
    assert_eq!(stages.values().max(), Some(64));
}

#[test]
fn a_step_can_be_taken_back() {
    let mut optimizer = Optimizer::new(Method::ADAM, variables(0.5), &[0.5, 0.5]).unwrap();
    optimizer.step(&[1.0, -1.0], 1.0).unwrap();
    let other = optimizer.values()[1];
    optimizer.take_back(0, 0.25).unwrap();
    assert_eq!(optimizer.values(), [0.25, other]);
    assert_eq!(optimizer.state().steps, 1);
    assert!(optimizer.take_back(0, f64::NAN).is_err() && optimizer.take_back(2, 0.0).is_err());
}
