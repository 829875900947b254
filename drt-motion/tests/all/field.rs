//! Fields of many unknowns: their steps, what is stored of them, and the two energies against finite differences.

use drt_geom::procedural::{grid, icosphere};
use drt_math::{Vec3, vec3};
use drt_motion::optimize::field::{
    FieldOptimizer, FieldRule, FieldState, MeshLaplacian, laplacian_energy, total_variation,
};
use drt_motion::optimize::{Method, OptimizeError, Optimizer, Stages, Variable};

const DESCENT: Method = Method::Momentum { momentum: 0.0 };

/// Numbers from -1 to 1 without a pattern, from a linear congruence.
fn noise(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut next = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

fn rule(method: Method, rate: f64) -> FieldRule {
    FieldRule { method, learning_rate: Stages::new(rate, vec![]), ..FieldRule::default() }
}

fn farthest(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Two triangles beside each other with a seam between them: vertices 1 and 4, and 2 and 3, are copies.
fn seam() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let [a, b, c, d] =
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[x, y]| vec3(x, y, 0.0));
    (vec![a, b, c, c, b, d], vec![[0, 1, 2], [3, 4, 5]])
}

#[test]
fn without_smoothing_a_field_steps_as_so_many_variables() {
    let start: Vec<f64> = noise(20, 1).iter().map(|x| 1.5 + 0.4 * x).collect();
    for logarithmic in [false, true] {
        for method in [Method::ADAM, Method::Momentum { momentum: 0.8 }] {
            let field = FieldRule { lower: 1.0, upper: 2.0, logarithmic, ..rule(method, 0.03) };
            let variable = Variable { learning_rate: 0.03, lower: 1.0, upper: 2.0, logarithmic };
            let mut field = FieldOptimizer::new(field, &start).unwrap();
            let mut variables = Optimizer::new(method, vec![variable; 20], &start).unwrap();
            for i in 0..30 {
                let gradient = noise(20, 2 + u64::from(i));
                field.step(&gradient, i, 0.5).unwrap();
                variables.step(&gradient, 0.5).unwrap();
                assert_eq!(field.values(), variables.values());
            }
            assert!(field.values().iter().all(|v| (1.0..=2.0).contains(v)));
            assert_ne!(field.values(), start);
        }
    }
}

#[test]
fn bounds_end_steps_and_logarithms_make_them_relative() {
    let bounded = FieldRule { lower: 0.2, upper: 1.5, ..rule(DESCENT, 1.0) };
    let mut bounded = FieldOptimizer::new(bounded, &[1.0, 1.0, 1.0]).unwrap();
    bounded.step(&[5.0, -5.0, 0.25], 0, 1.0).unwrap();
    assert_eq!(bounded.values(), [0.2, 1.5, 0.75]);
    let relative = FieldRule { logarithmic: true, ..rule(Method::ADAM, 0.1) };
    let mut relative = FieldOptimizer::new(relative, &[1e-6, 1e6]).unwrap();
    relative.step(&[1.0, -1.0], 0, 1.0).unwrap();
    // To what epsilon takes off gradients of 1e-6.
    assert!((relative.values()[0] / 1e-6 - f64::exp(-0.1)).abs() < 1e-8);
    assert!((relative.values()[1] / 1e6 - f64::exp(0.1)).abs() < 1e-8);
}

#[test]
fn the_learning_rate_is_that_of_the_iteration() {
    let staged = FieldRule {
        learning_rate: Stages::new(1.0, vec![(3, 0.0), (5, 0.5)]),
        ..rule(DESCENT, 0.0)
    };
    let mut field = FieldOptimizer::new(staged, &[0.0]).unwrap();
    for (iteration, expected) in [(2, -1.0), (3, -1.0), (7, -1.5)] {
        field.step(&[1.0], iteration, 1.0).unwrap();
        assert_eq!(field.values(), [expected]);
    }
    assert_eq!(field.state().steps, 3);
}

#[test]
fn steps_can_be_shortened_more_than_once() {
    let mut field = FieldOptimizer::new(rule(DESCENT, 1.0), &[1.0, 2.0]).unwrap();
    field.shorten(0.0);
    assert_eq!(field.values(), [1.0, 2.0]);
    field.step(&[4.0, 0.0], 0, 1.0).unwrap();
    field.shorten(1.0);
    assert_eq!(field.values(), [-3.0, 2.0]);
    field.shorten(0.5);
    assert_eq!(field.values(), [-1.0, 2.0]);
    field.shorten(0.5);
    assert_eq!(field.values(), [0.0, 2.0]);
    field.shorten(f64::NAN);
    assert_eq!(field.values(), [1.0, 2.0]);
    let relative = FieldRule { logarithmic: true, ..rule(DESCENT, 1.0) };
    let mut relative = FieldOptimizer::new(relative, &[4.0]).unwrap();
    relative.step(&[0.5], 0, 1.0).unwrap();
    relative.shorten(0.25);
    assert!((relative.values()[0] - 4.0 * f64::exp(-0.5)).abs() < 1e-14);
}

/// Through text where it can be stored.
fn stored(state: &FieldState) -> FieldState {
    #[cfg(feature = "serde")]
    return serde_json::from_str(&serde_json::to_string(state).unwrap()).unwrap();
    #[cfg(not(feature = "serde"))]
    return state.clone();
}

fn goes_on_to_the_same_bits(rule: &FieldRule, start: &[f64]) {
    let run = |field: &mut FieldOptimizer, iterations: core::ops::Range<u32>| {
        for i in iterations {
            let pull = field.values().iter().zip(noise(start.len(), u64::from(i)));
            let gradient: Vec<f64> = pull.map(|(x, n)| x - 2.0 + n).collect();
            field.step(&gradient, i, 1.0).unwrap();
            if i % 4 == 0 {
                field.shorten(0.3);
            }
        }
    };
    let mut whole = FieldOptimizer::new(rule.clone(), start).unwrap();
    run(&mut whole, 0..23);
    let mut parts = FieldOptimizer::new(rule.clone(), start).unwrap();
    for iterations in [0..1, 1..9, 9..23] {
        parts = FieldOptimizer::resume(rule.clone(), stored(parts.state())).unwrap();
        run(&mut parts, iterations);
    }
    assert_eq!(whole.state(), parts.state());
}

#[test]
fn a_stored_state_goes_on_to_the_same_bits() {
    let start: Vec<f64> = noise(12, 3).iter().map(|x| x + 1.5).collect();
    for method in [Method::ADAM, Method::Momentum { momentum: 0.7 }] {
        let logarithmic = FieldRule { logarithmic: true, lower: 0.1, ..rule(method, 0.02) };
        goes_on_to_the_same_bits(&logarithmic, &start);
        goes_on_to_the_same_bits(&rule(method, 0.02), &start);
    }
}

#[test]
fn what_cannot_be_meant_is_refused() {
    let new =
        |rule: &FieldRule, start: &[f64]| FieldOptimizer::new(rule.clone(), start).unwrap_err();
    let ok = FieldRule::default();
    assert_eq!(new(&rule(Method::GAUSS_NEWTON, 0.1), &[0.0]), OptimizeError::FieldMethod);
    for rate in [-1.0, f64::NAN, f64::INFINITY] {
        let error = new(&rule(DESCENT, rate), &[0.0]).to_string();
        assert_eq!(error, format!("the learning rate is {rate}; expected 0 or a positive number"));
    }
    assert!(matches!(new(&ok, &[0.0, f64::NAN]), OptimizeError::NotFinite { variable: 1, .. }));
    let bounded = FieldRule { lower: 1.0, ..ok.clone() };
    assert!(matches!(new(&bounded, &[2.0, 0.0]), OptimizeError::Start { variable: 1, .. }));
    let crossed = FieldRule { lower: 1.0, upper: 0.0, ..ok.clone() };
    assert!(matches!(new(&crossed, &[0.5]), OptimizeError::Bounds { .. }));
    let logarithmic = FieldRule { logarithmic: true, ..ok.clone() };
    assert!(matches!(
        new(&logarithmic, &[1.0, 0.0]),
        OptimizeError::NotPositive { variable: 1, .. }
    ));

    let mut field = FieldOptimizer::new(ok.clone(), &[0.0; 2]).unwrap();
    field.step(&[1.0, -1.0], 0, 1.0).unwrap();
    let before = field.state().clone();
    assert!(matches!(field.step(&[1.0], 1, 1.0), Err(OptimizeError::Length { found: 1, .. })));
    for bad in [f64::NAN, f64::INFINITY] {
        let error = field.step(&[0.0, bad], 1, 1.0).unwrap_err();
        assert_eq!(error, OptimizeError::NotFinite { variable: 1, what: "the gradient" });
    }
    assert!(field.step(&[1e200, 0.0], 1, 1.0).is_err());
    assert!(field.step(&[1.0, 0.0], 1, f64::INFINITY).is_err());
    assert_eq!(*field.state(), before);
    field.shorten(0.0);
    assert_eq!(field.values(), [0.0; 2], "the last step is still the one before the refused ones");

    let short = FieldState { first: vec![0.0], ..before.clone() };
    assert!(matches!(FieldOptimizer::resume(ok, short), Err(OptimizeError::Length { .. })));
    // Squares are Adam's alone.
    assert!(FieldOptimizer::resume(rule(DESCENT, 0.1), before).is_err());
    assert_eq!(
        MeshLaplacian::new(3, &[[0, 1, 2], [0, 3, 1]]).unwrap_err(),
        OptimizeError::Triangle { triangle: 1, vertex: 3, vertices: 3 }
    );
    let mut gradient = [0.0; 4];
    assert!(total_variation([2, 2, 1], 1, &[0.0; 3], &mut gradient, 1.0).is_err());
    assert!(total_variation([2, 2, 2], 1, &[0.0; 8], &mut gradient, 1.0).is_err());
    assert_eq!(total_variation([usize::MAX, 2, 0], 1, &[], &mut [], 1.0), Ok(0.0));
    let laplacian = MeshLaplacian::new(3, &[[0, 1, 2]]).unwrap();
    assert!(laplacian_energy(&laplacian, 1, &[0.0; 4], &mut [0.0; 4], 1.0).is_err());
    assert!(laplacian.multiply(&mut [0.0; 4], 1).is_err());
}

/// Compares derivatives with central differences, and asks that they are added to what is there.
fn derivatives_are_right(values: &[f64], energy: &dyn Fn(&[f64], &mut [f64]) -> f64) {
    let mut gradient = vec![3.0; values.len()];
    energy(values, &mut gradient);
    let mut moved = values.to_vec();
    let mut unused = vec![0.0; values.len()];
    for i in 0..values.len() {
        let h = 1e-5;
        let mut at = |x| {
            moved[i] = x;
            energy(&moved, &mut unused)
        };
        let slope = (at(values[i] + h) - at(values[i] - h)) / (2.0 * h);
        moved[i] = values[i];
        assert!((gradient[i] - 3.0 - slope).abs() < 1e-6, "{i}: {} {slope}", gradient[i] - 3.0);
    }
}

#[test]
fn total_variation_has_the_derivatives_of_its_value() {
    for (shape, channels) in [([4, 3, 2], 1), ([5, 4, 1], 3), ([1, 1, 3], 2), ([1, 1, 1], 3)] {
        let values = noise(shape.iter().product::<usize>() * channels, 5);
        derivatives_are_right(&values, &|values, gradient| {
            total_variation(shape, channels, values, gradient, 0.7).unwrap()
        });
    }
}

#[test]
fn total_variation_sums_the_differences_along_every_axis() {
    let (shape, channels) = ([3, 4, 2], 2);
    let values = noise(48, 6);
    let at = |x: usize, y: usize, z: usize, c: usize| values[((z * 4 + y) * 3 + x) * channels + c];
    let mut expected = 0.0;
    for (x, y, z, c) in (0..48).map(|i| (i / 2 % 3, i / 6 % 4, i / 24, i % 2)) {
        let here = at(x, y, z, c);
        expected += if x < 2 { (at(x + 1, y, z, c) - here).abs() } else { 0.0 };
        expected += if y < 3 { (at(x, y + 1, z, c) - here).abs() } else { 0.0 };
        expected += if z < 1 { (at(x, y, z + 1, c) - here).abs() } else { 0.0 };
    }
    let found = total_variation(shape, channels, &values, &mut [0.0; 48], 2.0).unwrap();
    assert!((found - 2.0 * expected).abs() < 1e-8, "{found} {expected}");
}

#[test]
fn the_laplacian_is_degrees_less_neighbours() {
    // A fan whose last triangle repeats an edge of the others.
    let laplacian = MeshLaplacian::new(5, &[[0, 1, 2], [0, 2, 3], [1, 2, 0], [3, 3, 0]]).unwrap();
    let rows = [
        [3.0, -1.0, -1.0, -1.0, 0.0],
        [-1.0, 2.0, -1.0, 0.0, 0.0],
        [-1.0, -1.0, 3.0, -1.0, 0.0],
        [-1.0, 0.0, -1.0, 2.0, 0.0],
        [0.0; 5],
    ];
    for k in 0..5 {
        let mut unit = [0.0; 5];
        unit[k] = 1.0;
        laplacian.multiply(&mut unit, 1).unwrap();
        assert_eq!(unit, rows[k]);
    }
}

#[test]
fn laplacian_energy_has_the_derivatives_of_its_value() {
    let (positions, triangles) = seam();
    let sphere = icosphere(1);
    for laplacian in [
        MeshLaplacian::with_seams(&positions, &triangles).unwrap(),
        MeshLaplacian::new(6, &triangles).unwrap(),
        MeshLaplacian::new(sphere.positions.len(), &sphere.triangles).unwrap(),
    ] {
        let values = noise(3 * laplacian.vertices(), 7);
        derivatives_are_right(&values, &|values, gradient| {
            laplacian_energy(&laplacian, 3, values, gradient, 0.3).unwrap()
        });
        let mut bends = values.clone();
        laplacian.multiply(&mut bends, 3).unwrap();
        let energy = laplacian_energy(&laplacian, 3, &values, &mut bends.clone(), 0.3).unwrap();
        if laplacian.vertices() != 6 {
            let half: f64 = bends.iter().map(|b| 0.15 * b * b).sum();
            assert!((energy - half).abs() < 1e-10 * half);
        }
    }
    // A plane bends nowhere but at its rim.
    let plane = grid(4, 4);
    let laplacian = MeshLaplacian::new(plane.positions.len(), &plane.triangles).unwrap();
    let mut bends: Vec<f64> = plane.positions.iter().flat_map(|p| p.to_array()).collect();
    laplacian.multiply(&mut bends, 3).unwrap();
    let inner = plane.positions.iter().zip(bends.chunks(3));
    let inner = inner.filter(|(p, _)| p.x.abs().max(p.y.abs()) < 0.9);
    assert_eq!(inner.map(|(_, b)| assert!(farthest(b, &[0.0; 3]) < 1e-14)).count(), 9);
}

#[cfg(feature = "sparse")]
mod smoothing {
    use drt_motion::optimize::field::LaplacianSmoothing;

    use super::*;

    fn smoothed(smoothing: &LaplacianSmoothing, method: Method, rate: f64) -> FieldRule {
        FieldRule { smoothing: Some(smoothing.clone()), ..rule(method, rate) }
    }

    /// I + λL times some values.
    fn multiplied(smoothing: &LaplacianSmoothing, values: &[f64], columns: usize) -> Vec<f64> {
        let mut product = values.to_vec();
        smoothing.laplacian().multiply(&mut product, columns).unwrap();
        let both = product.iter().zip(values);
        both.map(|(l, x)| x + smoothing.lambda() * l).collect()
    }

    fn solved(smoothing: &LaplacianSmoothing, values: &[f64], columns: usize) -> Vec<f64> {
        let mut solution = values.to_vec();
        smoothing.solve(&mut solution, columns).unwrap();
        solution
    }

    #[test]
    fn solving_is_the_inverse_of_multiplying_and_symmetric() {
        let sphere = icosphere(3);
        let n = sphere.positions.len();
        for lambda in [0.0, 0.5, 19.0, 300.0] {
            let smoothing = LaplacianSmoothing::new(n, &sphere.triangles, lambda).unwrap();
            for columns in [1, 2, 3, 5] {
                let x = noise(n * columns, 11);
                let there = solved(&smoothing, &multiplied(&smoothing, &x, columns), columns);
                assert!(farthest(&there, &x) < 1e-10, "lambda {lambda}");
                let back = multiplied(&smoothing, &solved(&smoothing, &x, columns), columns);
                assert!(farthest(&back, &x) < 1e-10, "lambda {lambda}");
                let y = noise(n * columns, 12);
                let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                let [left, right] =
                    [(&x, &y), (&y, &x)].map(|(a, b)| dot(&solved(&smoothing, a, columns), b));
                assert!((left - right).abs() < 1e-10, "{left} {right}");
            }
            assert!(solved(&smoothing, &[], 0).is_empty());
        }
    }

    #[test]
    fn vertices_without_triangles_stay_by_themselves() {
        let smoothing = LaplacianSmoothing::new(4, &[[0, 1, 2]], 10.0).unwrap();
        assert_eq!(solved(&smoothing, &[0.0, 0.0, 0.0, 5.0], 1), [0.0, 0.0, 0.0, 5.0]);
        let nothing = LaplacianSmoothing::new(0, &[], 10.0).unwrap();
        assert!(solved(&nothing, &[], 3).is_empty());
    }

    #[test]
    fn plain_descent_steps_by_the_inverse_squared() {
        let sphere = icosphere(2);
        let n = sphere.positions.len();
        let smoothing = LaplacianSmoothing::new(n, &sphere.triangles, 8.0).unwrap();
        let (start, gradient) = (noise(3 * n, 13), noise(3 * n, 14));
        let mut field = FieldOptimizer::new(smoothed(&smoothing, DESCENT, 0.6), &start).unwrap();
        field.step(&gradient, 0, 0.5).unwrap();
        let twice = solved(&smoothing, &solved(&smoothing, &gradient, 3), 3);
        let expected: Vec<f64> = start.iter().zip(twice).map(|(x, s)| x - 0.3 * s).collect();
        assert!(farthest(field.values(), &expected) < 1e-10);
        // The same by u: what is added to (I + λL) x is the gradient by u.
        let [before, after] = [&start[..], field.values()].map(|x| multiplied(&smoothing, x, 3));
        let by_u = solved(&smoothing, &gradient, 3);
        let change: Vec<f64> = before.iter().zip(by_u).map(|(u, g)| u - 0.3 * g).collect();
        assert!(farthest(&after, &change) < 1e-10);
    }

    #[test]
    fn copies_at_a_seam_move_as_the_one_vertex_that_they_are() {
        let (positions, triangles) = seam();
        let split = LaplacianSmoothing::with_seams(&positions, &triangles, 5.0).unwrap();
        let whole = LaplacianSmoothing::new(4, &[[0, 1, 2], [2, 1, 3]], 5.0).unwrap();
        let places = [0, 1, 2, 2, 1, 3];
        let start: Vec<f64> = positions.iter().flat_map(|p| p.to_array()).collect();
        let once: Vec<f64> = [0, 1, 2, 5].iter().flat_map(|v| positions[*v].to_array()).collect();
        for method in [DESCENT, Method::ADAM, Method::Momentum { momentum: 0.9 }] {
            let mut split = FieldOptimizer::new(smoothed(&split, method, 0.1), &start).unwrap();
            let mut whole = FieldOptimizer::new(smoothed(&whole, method, 0.1), &once).unwrap();
            for i in 0..5 {
                let gradient = noise(18, 20 + u64::from(i));
                let mut sums = [0.0; 12];
                for (vertex, place) in places.iter().enumerate() {
                    for k in 0..3 {
                        sums[3 * place + k] += gradient[3 * vertex + k];
                    }
                }
                split.step(&gradient, i, 1.0).unwrap();
                whole.step(&sums, i, 1.0).unwrap();
            }
            let (split, whole) = (split.values(), whole.values());
            for (vertex, place) in places.iter().enumerate() {
                let [a, b] = [(split, vertex), (whole, *place)].map(|(x, v)| &x[3 * v..3 * v + 3]);
                assert!(farthest(a, b) < 1e-12, "{method:?} vertex {vertex}: {a:?} {b:?}");
            }
            assert_eq!(split[3..6], split[12..15]);
            assert_eq!(split[6..9], split[9..12]);
        }
    }

    /// Plain Adam makes steps of one length from every gradient, with a jump where its sign changes.
    #[test]
    fn one_second_moment_keeps_smooth_steps_smooth() {
        let sphere = icosphere(3);
        let n = sphere.positions.len();
        let smoothing = LaplacianSmoothing::new(n, &sphere.triangles, 20.0).unwrap();
        let roughness = |step: &[f64]| {
            let size: f64 = step.iter().map(|s| s * s).sum();
            laplacian_energy(smoothing.laplacian(), 1, step, &mut vec![0.0; n], 1.0).unwrap() / size
        };
        // A gradient that is smooth in itself and changes its sign over the sphere.
        let gradient: Vec<f64> = sphere.positions.iter().map(|p| p.x + 0.3 * p.y * p.z).collect();
        let step = |rule: FieldRule| {
            let mut field = FieldOptimizer::new(rule, &vec![0.0; n]).unwrap();
            field.step(&gradient, 0, 1.0).unwrap();
            field.values().to_vec()
        };
        let uniform = step(smoothed(&smoothing, Method::ADAM, 0.1));
        let plain = step(rule(Method::ADAM, 0.1));
        assert!(farthest(&uniform, &plain) > 0.05);
        assert!(roughness(&uniform) <= roughness(&gradient));
        assert!(roughness(&plain) > 20.0 * roughness(&uniform));
        // The first step of Adam: the largest derivative by u moves its u by the learning rate.
        let by_u = solved(&smoothing, &gradient, 1);
        let largest = by_u.iter().fold(0.0, |most, g: &f64| g.abs().max(most));
        let expected: Vec<f64> = by_u.iter().map(|g| -0.1 * g / largest).collect();
        assert!(farthest(&uniform, &solved(&smoothing, &expected, 1)) < 1e-10);
    }

    #[test]
    fn a_smoothed_state_goes_on_to_the_same_bits() {
        let sphere = icosphere(1);
        let positions = &sphere.positions;
        let smoothing = LaplacianSmoothing::with_seams(positions, &sphere.triangles, 3.0).unwrap();
        for method in [Method::ADAM, Method::Momentum { momentum: 0.7 }] {
            let start = noise(3 * positions.len(), 15);
            goes_on_to_the_same_bits(&smoothed(&smoothing, method, 0.02), &start);
        }
        let again = LaplacianSmoothing::with_seams(positions, &sphere.triangles, 3.0).unwrap();
        let x = noise(3 * positions.len(), 16);
        assert_eq!(solved(&smoothing, &x, 3), solved(&again, &x, 3));
    }

    #[test]
    fn what_cannot_be_smoothed_is_refused() {
        let triangles = [[0, 1, 2]];
        for lambda in [-1.0, f64::NAN, f64::INFINITY] {
            let error = LaplacianSmoothing::new(3, &triangles, lambda).unwrap_err().to_string();
            assert_eq!(error, format!("lambda is {lambda}; expected 0 or a positive number"));
        }
        for lambda in [1e13, 1e17, 1e300] {
            let lost = LaplacianSmoothing::new(3, &triangles, lambda).unwrap_err();
            assert_eq!(lost, OptimizeError::Factorisation { lambda });
        }
        assert!(matches!(
            LaplacianSmoothing::new(2, &triangles, 1.0),
            Err(OptimizeError::Triangle { triangle: 0, vertex: 2, vertices: 2 })
        ));
        let smoothing = LaplacianSmoothing::new(3, &triangles, 1.0).unwrap();
        assert!(smoothing.solve(&mut [0.0; 4], 1).is_err());
        let ok = smoothed(&smoothing, Method::ADAM, 0.1);
        let new =
            |rule: &FieldRule, start: &[f64]| FieldOptimizer::new(rule.clone(), start).unwrap_err();
        assert_eq!(new(&ok, &[1.0; 8]), OptimizeError::Columns { values: 8, vertices: 3 });
        for rule in [
            FieldRule { lower: 0.0, ..ok.clone() },
            FieldRule { upper: 9.0, ..ok.clone() },
            FieldRule { logarithmic: true, ..ok },
        ] {
            assert_eq!(new(&rule, &[1.0; 9]), OptimizeError::SmoothedBounds);
        }
    }

    /// What smoothing costs: cargo test --release -p drt-motion --features sparse --test all -- --ignored field:: --nocapture
    #[test]
    #[ignore = "prints times"]
    fn time_of_a_noisy_sphere() {
        use std::time::Instant;
        for (subdivisions, repeats) in [(5, 20), (6, 5)] {
            let sphere = icosphere(subdivisions);
            let n = sphere.positions.len();
            let rough = sphere.positions.iter().flat_map(|p| p.to_array()).zip(noise(3 * n, 17));
            let mut values: Vec<f64> = rough.map(|(x, noise)| x + 0.01 * noise).collect();
            let begin = Instant::now();
            let smoothing = LaplacianSmoothing::new(n, &sphere.triangles, 19.0).unwrap();
            let factorised = begin.elapsed();
            let begin = Instant::now();
            for _ in 0..repeats {
                smoothing.solve(&mut values, 3).unwrap();
            }
            let solve = begin.elapsed() / repeats;
            let rule = smoothed(&smoothing, Method::ADAM, 0.01);
            let mut field = FieldOptimizer::new(rule, &values).unwrap();
            let begin = Instant::now();
            for i in 0..repeats {
                field.step(&values, i, 1.0).unwrap();
            }
            let step = begin.elapsed() / repeats;
            println!(
                "{n} vertices: factorised in {factorised:.2?}, solved in {solve:.2?}, a step in {step:.2?}"
            );
        }
    }
}
