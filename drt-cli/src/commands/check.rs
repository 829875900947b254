//! `drt check`: derivatives against finite differences with common random numbers.

use drt_estimators::{Layer, Rendering, agreement};

use super::derivatives::derivatives;
use super::monitor::Monitor;
use super::noise::{noise_of_difference, relative_noise};
use super::options::Options;
use super::outputs::Outputs;
use super::table::Table;
use super::{Outcome, run, stop};
use crate::files::digest::Verdict;
use crate::{CliError, Job};

pub(super) fn run(options: &Options) -> Result<Outcome, CliError> {
    let job = run::open_with_parameters(options)?;
    if job.parameters.is_empty() {
        return Err(CliError::argument(format!(
            "{} has no [[parameter]] to check",
            job.path.display()
        )));
    }
    let outputs = Outputs::of_images(options, &job, "check")?;
    run::tell_one_sided(&job, options.changes.quiet)?;
    let monitor = Monitor::new(options.changes.quiet);
    let mut rendering = derivatives(&job, options, &monitor, 0.4, &mut run::Shared::default())?;
    let kept = rendering.complete.then(|| keep(&job, &outputs, &rendering));
    let differences = match rendering.complete {
        true => two_steps(&job, rendering.spp, &monitor)?,
        false => None,
    };
    monitor.finish();
    let _writing = stop::writing();
    // What is written from here on is more.
    drop(kept);
    let Some([coarse, fine]) = differences else {
        rendering.complete = false;
        outputs.write(&job, &rendering, &[], &[])?;
        return Ok(Outcome::Interrupted);
    };
    let verdicts = judge(&rendering, &coarse, &fine);
    let noise = noise_of_each(&rendering, &fine);
    let names = job.parameters.iter().map(|p| format!("fd_{}", p.name));
    let further: Vec<(String, &Layer)> = names.zip(&fine).collect();
    outputs.write(&job, &rendering, &further, &verdicts)?;
    let table = table(&verdicts, &noise);
    outputs.tell(&table.to_string())?;
    if verdicts.iter().any(|v| !v.agrees) {
        return Ok(Outcome::Failed);
    }
    let loudest = noise.into_iter().fold(0.0, f64::max);
    if loudest > TELLING {
        outputs.tell(&too_noisy(loudest, rendering.spp))?;
        return Ok(Outcome::Failed);
    }
    Ok(Outcome::Done)
}

/// Relative noise of the difference of a derivative and its finite difference above which nothing is told: half of it could be
/// missing.
const TELLING: f64 = 0.5;

/// The noise of what each derivative is compared by.
fn noise_of_each(rendering: &Rendering, differences: &[Layer]) -> Vec<f64> {
    let pairs = rendering.derivatives.iter().zip(differences);
    pairs.map(|(d, fine)| noise_of_difference(&d.total, fine, rendering)).collect()
}

/// What more samples would help.
fn too_noisy(noise: f64, spp: u32) -> String {
    // Noise falls with the square root of their number.
    let needed = f64::from(spp) * (noise / (0.5 * TELLING)).powi(2);
    let percent = 100.0 * noise;
    if needed.is_finite() && needed < f64::from(u32::MAX) {
        let needed = (needed.ceil() as u32).next_power_of_two();
        format!("too noisy to tell: differences have {percent:.0} % of noise; try --spp {needed}\n")
    } else {
        "too noisy to tell: the noise is larger than any derivative; expected more samples (--spp)\n".into()
    }
}

/// What is written where the program must end while differences are prepared.
fn keep(job: &Job, outputs: &Outputs, rendering: &Rendering) -> stop::Kept {
    let (job, outputs) = (job.clone(), outputs.clone());
    let rendering = Rendering { complete: false, ..rendering.clone() };
    // Nobody is left to be told that it cannot be written.
    stop::rescue(move || drop(outputs.write(&job, &rendering, &[], &[])))
}

/// Differences at the job's step and at half of it.
fn two_steps(job: &Job, spp: u32, monitor: &Monitor) -> Result<Option<[Vec<Layer>; 2]>, CliError> {
    let step = job.settings.step;
    monitor.stage("differences, step 1", 0.4, 0.7);
    let Some(coarse) = run::differences(job, spp, step, monitor)? else { return Ok(None) };
    monitor.stage("differences, step 2", 0.7, 1.0);
    let fine = run::differences(job, spp, 0.5 * step, monitor)?;
    Ok(fine.map(|fine| [coarse, fine]))
}

fn judge(rendering: &Rendering, coarse: &[Layer], fine: &[Layer]) -> Vec<Verdict> {
    let pairs = rendering.derivatives.iter().zip(coarse.iter().zip(fine));
    pairs
        .map(|(d, (coarse, fine))| {
            let a = agreement(&d.total, fine, Some(&difference(coarse, fine)));
            Verdict {
                parameter: d.name.clone(),
                rms_z: a.rms_z,
                max_z: a.max_z,
                limit: a.limit,
                relative_noise: relative_noise(&d.total, rendering),
                agrees: a.agrees,
            }
        })
        .collect()
}

/// What the choice of the step changes.
fn difference(coarse: &Layer, fine: &Layer) -> Layer {
    let mut difference = fine.clone();
    for (d, c) in difference.blocks.iter_mut().zip(&coarse.blocks) {
        d.mean = c.mean - d.mean;
    }
    difference
}

fn table(verdicts: &[Verdict], noise: &[f64]) -> Table<6> {
    let rows = verdicts.iter().zip(noise).map(|(v, noise)| {
        [
            v.parameter.clone(),
            format!("{:.3}", v.rms_z),
            format!("{:.3}", v.max_z),
            format!("{:.3}", v.limit),
            format!("{:.2} %", 100.0 * v.relative_noise),
            match v.agrees {
                false => "DISAGREES",
                true if *noise > TELLING => "too noisy to tell",
                true => "agrees",
            }
            .into(),
        ]
    });
    Table::new(["parameter", "rms z", "max z", "limit", "relative noise", "verdict"], rows)
}

#[cfg(test)]
mod tests {
    use drt_math::{Rgb, Rng};

    use super::*;
    use crate::files::image::tests::rendering;

    /// A derivative with noise of the size it claims, around `scale` times the truth.
    fn noisy(truth: &Layer, scale: f64, rng: &mut Rng) -> Layer {
        let mut layer = truth.clone();
        for block in &mut layer.blocks {
            // Twelve uniform numbers make a variance of one.
            let mut normal = || (0..12).map(|_| rng.next_f64()).sum::<f64>() - 6.0;
            let error = Rgb::new(normal(), normal(), normal());
            block.stderr = Rgb::splat(2.0);
            block.mean = block.mean * scale + error * 2.0;
        }
        layer
    }

    #[test]
    fn faults_of_two_percent_disagree_and_noise_does_not() {
        let mut rng = Rng::new(1, 2, 0);
        let mut result = rendering([8, 8]);
        let mut truth = result.derivatives[0].total.clone();
        truth.blocks.iter_mut().for_each(|b| b.stderr = Rgb::ZERO);
        for (scale, agrees) in [(1.0, true), (1.02, false), (-1.0, false)] {
            for d in &mut result.derivatives {
                d.total = noisy(&truth, scale, &mut rng);
            }
            let differences = [(); 2].map(|()| noisy(&truth, 1.0, &mut rng));
            let exact = [truth.clone(), truth.clone()];
            // Errors of the step would excuse the fault: between exact differences there is none.
            for v in judge(&result, &exact, &exact) {
                assert_eq!(v.agrees, agrees, "{v:?}");
            }
            let excused = judge(&result, &exact, &differences);
            assert!(scale != 1.0 || excused.iter().all(|v| v.agrees));
        }
    }
}
