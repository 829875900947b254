//! The judge of the oracles rejects what is wrong: one scene of each kind, spoiled in three ways.

use drt_estimators::emitter::Emitter;
use drt_tests::judge::{Row, rows};
use drt_tests::measure::{Effort, measure};
use drt_tests::motion::scaled;
use drt_tests::oracle::OracleFile;
use drt_tests::trial::Trial;

const EFFORT: Effort = Effort { noise: 0.02, near_zero: 1.0, of_case: false, samples: 1 << 20 };

/// Each kind's first scene.
fn trials() -> Vec<Trial> {
    let cases = OracleFile::read().unwrap().cases;
    cases.iter().map(|c| Trial::of_case(c).unwrap().swap_remove(0)).collect()
}

fn judged(trial: &Trial) -> Vec<Row> {
    rows(trial, &measure(trial, &EFFORT).unwrap(), &EFFORT)
}

/// The derivatives that stand out in their scene are rejected when every change is `factor` times
/// what it should be.
fn rejects_changes_scaled_by(factor: f64) {
    for mut trial in trials() {
        let largest = trial.parameters.iter().fold(0.0_f64, |m, (_, d)| m.max(d.abs()));
        trial.parameters.retain(|(_, d)| *d != 0.0 && d.abs() >= 0.5 * largest);
        for (parameter, _) in &mut trial.parameters {
            parameter.effects = scaled(&parameter.effects, factor);
        }
        for row in &judged(&trial)[1..] {
            assert!(!row.passes(), "{}, {}: {:?} passed", row.trial, row.what, row.measured);
        }
    }
}

#[test]
fn the_wrong_sign_is_rejected() {
    rejects_changes_scaled_by(-1.0);
}

#[test]
fn a_wrong_jacobian_is_rejected() {
    rejects_changes_scaled_by(1.5);
}

#[test]
fn too_bright_a_light_is_rejected() {
    for mut trial in trials() {
        trial.parameters.clear();
        for emitter in &mut trial.built.scene.emitters {
            match &mut emitter.item.emitter {
                Emitter::Area { radiance: strength }
                | Emitter::Constant { radiance: strength }
                | Emitter::Point { intensity: strength, .. }
                | Emitter::Spot { intensity: strength, .. }
                | Emitter::Directional { irradiance: strength, .. } => *strength *= 2.0,
                other => panic!("{} is not known here", other.kind()),
            }
        }
        for row in judged(&trial) {
            assert!(!row.passes(), "{}: {:?} passed", row.trial, row.measured);
        }
    }
}
