//! Steps of fits: unbiased gradients with honest errors, and the same bits whatever was kept.

use crate::common::*;
use drt_estimators::fit::{Evaluation, Fit, Misstep, View, check_step};
use drt_estimators::loss::{Loss, Reference};
use drt_estimators::{Scene, Session, Settings, Unattended, moved};
use drt_math::dense::{Cholesky, eigen};
use drt_math::{Rgb, Vec3, vec3};
use drt_motion::optimize::{Decay, Method, Optimizer, Variable};
use drt_motion::{GeometryChange, Parameter};

const PYRAMID: Loss = Loss::PyramidL2 { levels: 10, weight: 4.0 };

/// A ball over a floor, lit by a lamp and the sky.
fn room() -> Scene {
    surfaces_in_extended_light(diffuse(0.7, 0.5, 0.3), diffuse(0.4, 0.5, 0.6))
}

/// The ball moves, the floor and the lamp brighten.
fn parameters(values: [f64; 3]) -> Vec<Parameter> {
    vec![
        parameter("ball-x", values[0], vec![moves("ball", GeometryChange::Translate(Vec3::X))]),
        parameter("floor", values[1], vec![changes("floor", "reflectance", grey(0.3))]),
        parameter("lamp", values[2], vec![changes("lamp", "radiance", grey(1.0))]),
    ]
}

fn settings() -> Settings {
    Settings { threads: 1, ..Settings::default() }
}

fn image(scene: &Scene, parameters: &[Parameter], spp: u32) -> Vec<Rgb> {
    let mut session = Session::new(scene, parameters, &settings()).unwrap();
    assert!(session.run(spp, &Unattended));
    session.rendering().image.pixels.iter().map(|p| p.mean).collect()
}

fn fit(scene: &Scene, target: [f64; 3], loss: Loss) -> Fit {
    let pixels = image(&moved(scene, &parameters(target)).unwrap(), &[], 256);
    let view = View::new(0, Reference::new(FILM, pixels).unwrap());
    Fit::new(scene.clone(), parameters([0.0; 3]), vec![view], loss, settings()).unwrap()
}

fn evaluate(fit: &mut Fit, values: [f64; 3], spp: u32, seed: u64) -> Evaluation {
    fit.evaluate(&values, spp, seed, &Unattended).unwrap().unwrap()
}

/// Means and standard errors of a list of vectors.
fn statistics(samples: &[Vec<f64>]) -> Vec<[f64; 2]> {
    let n = samples.len() as f64;
    let of = |k: usize| {
        let mean = samples.iter().map(|s| s[k]).sum::<f64>() / n;
        let variance = samples.iter().map(|s| (s[k] - mean).powi(2)).sum::<f64>() / (n - 1.0);
        [mean, (variance / n).sqrt()]
    };
    (0..samples[0].len()).map(of).collect()
}

/// The gradient as it comes out when image and derivative share their samples.
fn shared(evaluation: &Evaluation, loss: Loss, reference: &Reference, n: usize) -> Vec<f64> {
    let adjoint = loss.adjoint(&evaluation.image(0), reference);
    let product =
        |p| -> f64 { adjoint.iter().zip(evaluation.derivative(0, p)).map(|(a, d)| a.dot(d)).sum() };
    (0..n).map(product).collect()
}

#[test]
fn gradients_are_unbiased() {
    let (scene, at) = (room(), [0.1, 0.2, 0.5]);
    for loss in [Loss::L2, PYRAMID] {
        let mut fit = fit(&scene, [0.15, 0.3, 0.7], loss);
        let pixels = image(&moved(&scene, &parameters([0.15, 0.3, 0.7])).unwrap(), &[], 256);
        let reference = Reference::new(FILM, pixels).unwrap();
        // With more than three times the samples of all evaluations together, and about half their noise.
        let exact = evaluate(&mut fit, at, 1 << 12, 7);
        let (gradient, errors) = (exact.gradient(), exact.gradient_errors());
        let evaluations: Vec<Evaluation> =
            (0..600).map(|seed| evaluate(&mut fit, at, 2, 100 + seed)).collect();
        let own: Vec<Vec<f64>> = evaluations.iter().map(Evaluation::gradient).collect();
        let biased: Vec<Vec<f64>> =
            evaluations.iter().map(|e| shared(e, loss, &reference, 3)).collect();
        let z = |samples: &[Vec<f64>]| -> Vec<f64> {
            let found = statistics(samples);
            let pairs = found.iter().zip(gradient.iter().zip(&errors));
            pairs.map(|([m, s], (g, e))| (m - g) / (s * s + e * e).sqrt()).collect()
        };
        let (fair, planted) = (z(&own), z(&biased));
        assert!(fair.iter().all(|z| z.abs() < 4.0), "{loss:?}: {fair:?}");
        // The lamp's derivative is in proportion to the image, and so is its noise.
        assert!(planted[2] > 6.0, "{loss:?}: {planted:?}");
    }
}

/// Gauss and Newton's matrix from two samples per pixel averages to that of many, and each is between what
/// the halves see by themselves and its negative, in every direction.
#[test]
fn curvatures_are_unbiased_and_bounded() {
    let (scene, at) = (room(), [0.1, 0.2, 0.5]);
    for loss in [Loss::L2, PYRAMID] {
        let mut fit = fit(&scene, [0.15, 0.3, 0.7], loss);
        let many = (0..16).map(|seed| evaluate(&mut fit, at, 1 << 8, 9000 + seed));
        let exact = statistics(&many.map(|seen| seen.curvature().concat()).collect::<Vec<_>>());
        let z = |samples: &[Vec<f64>]| -> Vec<f64> {
            let found = statistics(samples);
            let pairs = found.iter().zip(&exact);
            pairs.map(|([m, s], [g, e])| (m - g) / (s * s + e * e).sqrt()).collect()
        };
        let (mut fair, mut own, mut indefinite) = (Vec::new(), Vec::new(), 0);
        for seed in 0..480 {
            let seen = evaluate(&mut fit, at, 2, 100 + seed);
            let (signal, noise) = (seen.curvature(), seen.curvature_noise());
            let sum = |sign: f64| -> Vec<Vec<f64>> {
                let rows = signal.iter().zip(&noise);
                rows.map(|(s, n)| s.iter().zip(n).map(|(s, n)| n + s + sign * s).collect())
                    .collect()
            };
            // M + H and M - H, with M = H + N.
            for bound in [sum(1.0), sum(-1.0)] {
                let scale = bound.iter().flatten().fold(0.0, |m: f64, v| m.max(v.abs()));
                let (values, _) = eigen(&bound);
                assert!(values.iter().all(|v| *v > -1e-12 * scale), "{values:?}");
            }
            indefinite += u32::from(Cholesky::new(&signal, 0.0).is_none());
            own.push(sum(0.0).concat());
            fair.push(signal.concat());
        }
        assert!(indefinite > 0, "two samples are too many for this test");
        let (fair, planted) = (z(&fair), z(&own));
        assert!(fair.iter().all(|z| z.abs() < 4.0), "{loss:?}: {fair:?}");
        // Squares of the same samples' derivatives are not it.
        assert!(planted[0] > 6.0, "{loss:?}: {planted:?}");
    }
}

#[test]
fn errors_are_honest_where_noise_is_not_all() {
    for loss in [Loss::L2, PYRAMID] {
        let mut fit = fit(&room(), [0.15, 0.3, 0.7], loss);
        let evaluations: Vec<Evaluation> =
            (0..150).map(|seed| evaluate(&mut fit, [0.1, 0.2, 0.5], 64, seed)).collect();
        let gradients: Vec<Vec<f64>> = evaluations.iter().map(Evaluation::gradient).collect();
        for (k, [_, stderr]) in statistics(&gradients).iter().enumerate() {
            let scatter = stderr * (gradients.len() as f64).sqrt();
            let variances = evaluations.iter().map(|e| vec![e.covariance()[k][k]]);
            let said = statistics(&variances.collect::<Vec<_>>())[0][0].sqrt();
            let ratio = said / scatter;
            assert!((0.75..1.35).contains(&ratio), "{loss:?}, parameter {k}: {ratio}");
        }
    }
}

#[test]
fn what_is_kept_changes_no_bit() {
    let scene = room();
    let mut kept = fit(&scene, [0.15, 0.3, 0.7], PYRAMID);
    // Colours change, then the ball moves, then it returns.
    for values in [[0.1, 0.0, 0.0], [0.1, 0.2, 0.5], [0.2, 0.2, 0.5], [0.1, 0.0, 0.0]] {
        let mut fresh = fit(&scene, [0.15, 0.3, 0.7], PYRAMID);
        let [a, b] = [&mut kept, &mut fresh].map(|fit| evaluate(fit, values, 8, 3));
        assert_eq!(a.image(0), b.image(0));
        assert_eq!(a.gradient(), b.gradient());
        // And they are the bits of a scene that never was anything else.
        let at_rest = moved(&scene, &parameters(values)).unwrap();
        let again = moved(&scene, &parameters(values)).unwrap();
        assert_eq!(image(&at_rest, &[], 8), image(&again, &[], 8));
    }
}

/// Tetrahedra around a ball that deforms serve two cameras, and are made anew as it does.
#[test]
fn views_share_what_they_can() {
    let mut scene = fog();
    scene.sensors.push(scene.sensors[0].clone());
    let black = || Reference::new(FILM, vec![Rgb::ZERO; (FILM[0] * FILM[1]) as usize]).unwrap();
    let wobbling = || {
        let effects = vec![moves("ball", wobble(&scene, "ball", 1))];
        let views = [0, 1].map(|sensor| View::new(sensor, black()));
        let parameters = vec![parameter("wobble", 0.0, effects)];
        Fit::new(scene.clone(), parameters, views.into(), Loss::L2, settings()).unwrap()
    };
    let mut kept = wobbling();
    for value in [0.0, 0.1, 0.1, 0.0] {
        let [a, b] = [&mut kept, &mut wobbling()]
            .map(|fit| fit.evaluate(&[value], 4, 3, &Unattended).unwrap().unwrap());
        assert_eq!(a.image(0), a.image(1));
        assert_eq!((a.image(1), a.derivative(1, 0)), (b.image(1), b.derivative(1, 0)));
        assert!(!a.is_blind_to(0));
    }
}

#[test]
fn a_restarted_session_is_a_new_one() {
    let scene = room();
    let with_seed = |seed| Settings { seed, terms: true, ..settings() };
    let mut session = Session::new(&scene, &parameters([0.1; 3]), &with_seed(1)).unwrap();
    session.run(6, &Unattended);
    session.restart(2);
    session.run(8, &Unattended);
    let mut fresh = Session::new(&scene, &parameters([0.1; 3]), &with_seed(2)).unwrap();
    fresh.run(8, &Unattended);
    let [a, b] = [session.rendering(), fresh.rendering()];
    assert_eq!(a.image.pixels, b.image.pixels);
    assert_eq!(a.spp, b.spp);
    for (a, b) in a.derivatives.iter().zip(&b.derivatives) {
        assert_eq!((&a.total.pixels, &a.total.blocks), (&b.total.pixels, &b.total.blocks));
        assert_eq!(a.terms.len(), b.terms.len());
    }
}

#[test]
fn a_descent_arrives() {
    let (scene, target) = (room(), [0.1, 0.5, 1.0]);
    let mut fit = fit(&scene, target, PYRAMID);
    let variable = |learning_rate| Variable { learning_rate, ..Variable::default() };
    // The lamp's brightness is known.
    let variables = vec![variable(0.02), variable(0.1), variable(0.0)];
    let mut optimizer = Optimizer::new(Method::ADAM, variables, &[0.0, 0.0, 1.0]).unwrap();
    let (n, decay) = (60, Decay::Cosine { end: 0.02 });
    let at = |values: &[f64]| [values[0], values[1], values[2]];
    for i in 0..n {
        let seen = evaluate(&mut fit, at(optimizer.values()), 256, u64::from(i));
        optimizer.step(&seen.gradient(), decay.factor(i, n)).unwrap();
    }
    let values = at(optimizer.values());
    let known = evaluate(&mut fit, values, 256, 999).uncertainty().expect("they differ");
    for k in 0..2 {
        let error = (values[k] - target[k]).abs();
        assert!(error < 0.1 * target[k] && error < 3.0 * known[k], "{values:?} ± {known:?}");
    }
}

#[test]
fn parameters_that_change_nothing_are_seen() {
    let scene = room();
    let reference = Reference::new(FILM, image(&scene, &[], 4)).unwrap();
    let mut all = parameters([0.0; 3]);
    all.push(parameter("nothing", 0.0, vec![]));
    let views = vec![View::new(0, reference)];
    let mut fit = Fit::new(scene, all, views, Loss::L2, settings()).unwrap();
    let seen = fit.evaluate(&[0.0; 4], 4, 0, &Unattended).unwrap().unwrap();
    assert_eq!([0, 1, 2, 3].map(|p| seen.is_blind_to(p)), [false, false, false, true]);
    assert!(seen.uncertainty().is_none());
}

#[test]
fn missteps_are_told() {
    let scene = surfaces(phong(), diffuse(0.5, 0.5, 0.5));
    let step =
        |parameter: Parameter| check_step(&scene, &moved(&scene, &[parameter]).unwrap(), &[0]);
    let down = |target: &str, by: f64| {
        let change = GeometryChange::Translate(vec3(0.0, -by, 0.0));
        parameter("down", 1.0, vec![moves(target, change)])
    };
    assert_eq!(step(down("camera", 0.1)), Ok(()));
    let through = |item: &str| Misstep::Through { item: item.into(), wall: "floor".into() };
    assert_eq!(step(down("camera", 50.0)), Err(through("camera")));
    assert_eq!(step(down("bulb", 50.0)), Err(through("bulb")));
}

#[test]
fn targets_must_fit_the_film() {
    let scene = room();
    let view = |sensor, size: [u32; 2]| {
        let pixels = vec![Rgb::ZERO; (size[0] * size[1]) as usize];
        View::new(sensor, Reference::new(size, pixels).unwrap())
    };
    let fail = |views| {
        Fit::new(scene.clone(), vec![], views, Loss::L2, settings()).err().unwrap().to_string()
    };
    assert!(fail(vec![view(0, [3, 5])]).contains("3x5 pixels; the film of its sensor has 6x5"));
    assert!(fail(vec![view(1, FILM)]).contains("there is no sensor 1"));
    assert!(fail(vec![]).contains("nothing to fit to"));
}
