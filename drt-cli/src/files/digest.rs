//! The digest: a result in numbers, small enough to compare by programs.

use std::collections::BTreeMap;
use std::path::Path;

use drt_estimators::{Counters, Estimate, Layer, MediumPlan, Plan, Rendering};
use drt_math::Rgb;
use serde::{Serialize, Serializer};

use crate::CliError;
use crate::files::atomic::write_atomically;

/// What a digest says beyond the rendering itself.
#[derive(Clone, Debug)]
pub struct RunFacts {
    /// The command, such as `grad`.
    pub command: &'static str,
    /// The scene file.
    pub scene: String,
    /// The job file, where there was one.
    pub job: Option<String>,
    /// Names the random numbers.
    pub seed: u64,
    /// Wall time spent.
    pub seconds: f64,
    /// Processor time spent by all threads.
    pub cpu_seconds: f64,
    /// Threads used.
    pub threads: usize,
}

/// Agreement of one derivative with finite differences, as `check` reports it.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// The parameter's name.
    pub parameter: String,
    /// Root mean square of z over blocks and channels.
    pub rms_z: f64,
    /// Largest |z|.
    pub max_z: f64,
    /// What chance passes once in 1000 images.
    pub limit: f64,
    /// Root mean square standard error of the derivative over that of its value.
    pub relative_noise: f64,
    /// True when the two agree.
    pub agrees: bool,
}

#[derive(Serialize)]
struct Digest<'a> {
    program: &'static str,
    command: &'static str,
    scene: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    job: Option<&'a str>,
    width: u32,
    height: u32,
    seed: u64,
    spp: u32,
    seconds: f64,
    cpu_seconds: f64,
    threads: usize,
    complete: bool,
    non_finite: u64,
    image: Summary,
    #[serde(serialize_with = "as_map")]
    derivatives: Vec<(&'a str, Summary)>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    checks: &'a [Verdict],
    plan: PlanSummary<'a>,
    counters: WorkDone,
}

/// The plan under the names of the digest.
#[derive(Serialize)]
struct PlanSummary<'a> {
    estimators: &'a [String],
    #[serde(skip_serializing_if = "Option::is_none")]
    estimator: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sampling: Option<&'a str>,
    media: Vec<MediumSummary<'a>>,
    record: bool,
    moving_shapes: &'a [String],
    edges: [u64; 2],
    primary: bool,
    borders: bool,
    direct: bool,
    indirect: bool,
    flux_shapes: &'a [String],
    antithetic: bool,
    splatting: bool,
    guiding: &'a [String],
    skipped: &'a [String],
}

#[derive(Serialize)]
struct MediumSummary<'a> {
    medium: &'a str,
    tracking: &'a str,
    motion: BTreeMap<&'a str, &'a str>,
}

/// The plan as the digest has it.
#[cfg(feature = "command")]
pub(crate) fn plan_json(plan: &Plan) -> Option<serde_json::Value> {
    serde_json::to_value(PlanSummary::from(plan)).ok()
}

impl<'a> From<&'a Plan> for PlanSummary<'a> {
    fn from(plan: &'a Plan) -> Self {
        let medium = |m: &'a MediumPlan| MediumSummary {
            medium: &m.medium,
            tracking: &m.tracking,
            motion: m.motion.iter().map(|(p, how)| (p.as_str(), how.as_str())).collect(),
        };
        Self {
            estimators: &plan.estimators,
            estimator: plan.estimator.as_deref(),
            sampling: plan.sampling.as_deref(),
            media: plan.media.iter().map(medium).collect(),
            record: plan.record,
            moving_shapes: &plan.moving_shapes,
            edges: plan.edges,
            primary: plan.primary,
            borders: plan.borders,
            direct: plan.direct,
            indirect: plan.indirect,
            flux_shapes: &plan.flux_shapes,
            antithetic: plan.antithetic,
            splatting: plan.splatting,
            guiding: &plan.guiding,
            skipped: &plan.skipped,
        }
    }
}

/// The counters under the names of the digest.
#[derive(Serialize)]
struct WorkDone {
    paths: u64,
    rays: u64,
    recorded_vertices: u64,
    differentiated_paths: u64,
    boundary_samples: u64,
    border_samples: u64,
    guide_samples: u64,
    flux_samples: u64,
    tracking_steps: u64,
    probes: u64,
    turning_edges: u64,
}

impl From<&Counters> for WorkDone {
    fn from(c: &Counters) -> Self {
        Self {
            paths: c.paths,
            rays: c.rays,
            recorded_vertices: c.recorded_vertices,
            differentiated_paths: c.differentiated_paths,
            boundary_samples: c.boundary_samples,
            border_samples: c.border_samples,
            guide_samples: c.guide_samples,
            flux_samples: c.flux_samples,
            tracking_steps: c.tracking_steps,
            probes: c.probes,
            turning_edges: c.turning_edges,
        }
    }
}

#[derive(Serialize)]
struct Summary {
    mean: [f64; 3],
    stderr: [f64; 3],
    /// The largest sample's share of the second moment: standard errors of heavy tails are too small.
    largest_sample_share: f64,
    blocks: Blocks,
}

#[derive(Serialize)]
struct Blocks {
    grid: [usize; 2],
    mean: Vec<[f64; 3]>,
    stderr: Vec<[f64; 3]>,
}

impl Summary {
    fn of(layer: &Layer) -> Self {
        let all =
            |part: fn(&Estimate) -> Rgb| layer.blocks.iter().map(|b| part(b).to_array()).collect();
        Self {
            mean: layer.total.mean.to_array(),
            stderr: layer.total.stderr.to_array(),
            largest_sample_share: layer.tail.share(),
            blocks: Blocks {
                grid: [drt_estimators::BLOCKS; 2],
                mean: all(|e| e.mean),
                stderr: all(|e| e.stderr),
            },
        }
    }
}

/// Pairs as a map that keeps their order.
fn as_map<S: Serializer>(pairs: &[(&str, Summary)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pairs.iter().map(|(name, value)| (name, value)))
}

/// The digest as JSON text.
#[must_use]
pub fn digest(rendering: &Rendering, facts: &RunFacts, checks: &[Verdict]) -> String {
    let derivatives = rendering.derivatives.iter();
    let digest = Digest {
        program: crate::PROGRAM,
        command: facts.command,
        scene: &facts.scene,
        job: facts.job.as_deref(),
        width: rendering.image.size[0],
        height: rendering.image.size[1],
        seed: facts.seed,
        spp: rendering.spp,
        seconds: facts.seconds,
        cpu_seconds: facts.cpu_seconds,
        threads: facts.threads,
        complete: rendering.complete,
        non_finite: rendering.non_finite,
        image: Summary::of(&rendering.image),
        derivatives: derivatives.map(|d| (d.name.as_str(), Summary::of(&d.total))).collect(),
        checks,
        plan: (&rendering.plan).into(),
        counters: (&rendering.counters).into(),
    };
    // Serialising plain numbers and strings to memory has no way to fail.
    serde_json::to_string(&digest).unwrap_or_default()
}

/// Writes a digest, a line of JSON.
///
/// # Errors
/// When it cannot be written.
pub fn write_digest(path: &Path, text: &str) -> Result<(), CliError> {
    use std::io::Write;
    write_atomically(path, |out| Ok(writeln!(out, "{text}")?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::image::tests::rendering;
    use crate::testing::Folder;

    fn facts() -> RunFacts {
        RunFacts {
            command: "grad",
            scene: "s.xml".into(),
            job: None,
            seed: 3,
            seconds: 1.5,
            cpu_seconds: 2.5,
            threads: 2,
        }
    }

    #[test]
    fn shape_is_the_contracts() {
        let text = digest(&rendering([4, 2]), &facts(), &[]);
        let d: serde_json::Value = serde_json::from_str(&text).unwrap();
        for (key, value) in [
            ("program", serde_json::json!(crate::PROGRAM)),
            ("command", "grad".into()),
            ("scene", "s.xml".into()),
            ("width", 4.into()),
            ("height", 2.into()),
            ("seed", 3.into()),
            ("spp", 7.into()),
            ("seconds", 1.5.into()),
            ("cpu_seconds", 2.5.into()),
            ("threads", 2.into()),
            ("complete", false.into()),
            ("non_finite", 1.into()),
        ] {
            assert_eq!(d[key], value, "{key}");
        }
        assert_eq!(d["image"]["mean"], serde_json::json!([103.0, 103.25, 97.0]));
        assert_eq!(d["image"]["blocks"]["grid"], serde_json::json!([8, 8]));
        let cube = &d["derivatives"]["cube-x"];
        assert_eq!(cube["blocks"]["mean"].as_array().unwrap().len(), 64);
        assert_eq!(cube["blocks"]["stderr"][2], serde_json::json!([201.0, 201.0, 201.0]));
        assert_eq!(cube["largest_sample_share"], 0.25);
        assert_eq!(d["counters"]["paths"], 12);
        assert!(d["counters"]["rays"].is_u64() && d["counters"]["boundary_samples"].is_u64());
        assert!(d["plan"].is_object() && d.get("checks").is_none() && d.get("job").is_none());
        // In the order of the job, not of the alphabet.
        assert!(text.find("cube-x").unwrap() < text.find("\u{e9}t\u{e9}").unwrap());
    }

    #[test]
    fn verdicts_join_when_there_are_any() {
        let verdict = Verdict {
            parameter: "p".into(),
            rms_z: 1.0,
            max_z: 2.0,
            limit: 4.5,
            relative_noise: 0.1,
            agrees: true,
        };
        let text = digest(&rendering([1, 1]), &facts(), &[verdict]);
        let d: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(d["checks"][0]["agrees"], true);
    }

    #[test]
    fn files_are_replaced_whole() {
        let folder = Folder::new();
        let path = folder.file("d.json", "a longer text than what comes");
        write_digest(&path, "{}").unwrap();
        assert_eq!(std::fs::read_to_string(path).unwrap(), "{}\n");
    }
}
