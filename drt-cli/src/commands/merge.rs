//! `drt merge`: shards to the result of the run in one piece.

use std::path::PathBuf;

use drt_estimators::fit::{Evaluation, Half};
use drt_estimators::{Rendering, ShardError, ShardSums};

use super::Outcome;
use super::console;
use super::destinations::check_ending;
use super::loss_gradient::refuse_with_gradient;
use super::options::MergeOptions;
use super::outputs::{Files, summarize};
use super::shard_file::{ShardFile, Sums, Total, view};
use super::stop;
use crate::error::Place;
use crate::files::digest::RunFacts;
use crate::files::npy::write_npy;
use crate::prepared::gradient::by_parameters;
use crate::{CliError, Provenance};

pub(super) fn run(options: &MergeOptions) -> Result<Outcome, CliError> {
    let MergeOptions { output, digest, preview, look, .. } = options;
    let files = Files { output, digest, preview, look: *look };
    files.check(options.shards.iter().map(PathBuf::as_path))?;
    // What has taken hours is put together in seconds, for which a first signal waits: reading counts as writing here.
    let _writing = stop::writing();
    let mut shards = Vec::new();
    for path in &options.shards {
        shards.push(Given { path: path.clone(), file: ShardFile::read(path)? });
    }
    let given = Shards::new(shards)?;
    let missing = given.missing();
    if !missing.is_empty() {
        let list = missing.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        let count = given.0[0].file.shard.count();
        if !options.partial {
            return Err(CliError::argument(format!(
                "of {count} shards, these are missing: {list}; --partial merges what there is"
            )));
        }
        if !options.quiet {
            console::note(format_args!(
                "drt: warning: of {count} shards, these are missing: {list}"
            ));
        }
    }
    match &given.0[0].file.sums {
        Sums::Images(_) => {
            files.check_images()?;
            let rendering = given.images()?;
            let (facts, provenance) = given.facts();
            files.write(&rendering, &[], &[], &facts, &provenance)?;
            if !options.quiet {
                summarize(&rendering, facts.seconds, None);
            }
        }
        Sums::Halves { .. } | Sums::Gradient { .. } => {
            let Some(output) = &options.output else {
                return Err(CliError::argument("a gradient needs -o FILE.npy to be written to"));
            };
            check_ending("-o", output, &["npy"])?;
            refuse_with_gradient([
                ("--digest", options.digest.is_some()),
                ("--preview", options.preview.is_some()),
                (look.given().unwrap_or_default(), look.given().is_some()),
            ])?;
            let gradient = given.gradient()?;
            write_npy(output, &gradient)?;
        }
    }
    Ok(Outcome::Done)
}

struct Given {
    path: PathBuf,
    file: ShardFile,
}

/// Shards of one run, in order.
struct Shards(Vec<Given>);

impl Shards {
    /// Refuses what does not belong together.
    fn new(mut shards: Vec<Given>) -> Result<Self, CliError> {
        shards.sort_by_key(|s| s.file.shard.index());
        let first = &shards[0];
        for other in &shards {
            let [a, b] = [&first.file, &other.file];
            let difference = if a.command != b.command {
                format!("is of `drt {}`, that of `drt {}`", b.command, a.command)
            } else if a.shard.count() != b.shard.count() {
                format!("is one of {} shards, that one of {}", b.shard.count(), a.shard.count())
            } else if a.seed != b.seed {
                format!("has the seed {}, that the seed {}", b.seed, a.seed)
            } else if a.inputs != b.inputs {
                "is of another job, scene or options".into()
            } else {
                continue;
            };
            let message =
                format!("it does not belong to {}: it {difference}", first.path.display());
            return Err(CliError::input(&Place::file(&other.path), message));
        }
        for pair in shards.windows(2) {
            if pair[0].file.shard == pair[1].file.shard {
                let message =
                    format!("it is shard {}, as is {}", pair[1].file.shard, pair[0].path.display());
                return Err(CliError::input(&Place::file(&pair[1].path), message));
            }
        }
        Ok(Self(shards))
    }

    fn missing(&self) -> Vec<u32> {
        let there = |i: &u32| self.0.iter().any(|s| s.file.shard.index() == *i);
        (1..=self.0[0].file.shard.count()).filter(|i| !there(i)).collect()
    }

    fn blame(&self, error: &ShardError) -> CliError {
        CliError::input(&Place::file(&self.0[0].path), error)
    }

    /// Those sums of every shard, merged.
    fn merged(&self, of: impl Fn(&Sums) -> Option<&ShardSums>) -> Result<Rendering, CliError> {
        let sums: Vec<ShardSums> =
            self.0.iter().filter_map(|s| of(&s.file.sums).cloned()).collect();
        ShardSums::merge(&sums).map(|m| m.rendering).map_err(|e| self.blame(&e))
    }

    fn images(&self) -> Result<Rendering, CliError> {
        let mut rendering = self.merged(|sums| match sums {
            Sums::Images(sums) => Some(sums),
            _ => None,
        })?;
        if self.0[0].file.command == "render" {
            rendering.derivatives.clear();
        }
        Ok(rendering)
    }

    fn gradient(self) -> Result<Vec<f64>, CliError> {
        let damaged = |path: &PathBuf, what: &str| {
            CliError::input(&Place::file(path), format!("it is damaged: {what}"))
        };
        match &self.0[0].file.sums {
            Sums::Images(_) => Ok(Vec::new()),
            Sums::Halves { loss, target, .. } => {
                let half = |k: usize| {
                    let merged = self.merged(|sums| match sums {
                        Sums::Halves { halves, .. } => Some(&halves[k]),
                        _ => None,
                    });
                    merged.map(|rendering| Half::from(&rendering))
                };
                let halves = [half(0)?, half(1)?];
                let parameters = halves[0].derivatives.len();
                let view = view(target.clone());
                let seen = Evaluation::of(*loss, vec![view], vec![halves], parameters)
                    .map_err(|e| CliError::input(&Place::file(&self.0[0].path), e))?;
                Ok(seen.gradient())
            }
            Sums::Gradient { adjoint, images, .. } => {
                let mut numbers = match images {
                    None => Vec::new(),
                    Some(_) => by_parameters(
                        &self.merged(|sums| match sums {
                            Sums::Gradient { images, .. } => images.as_ref(),
                            _ => None,
                        })?,
                        adjoint,
                    ),
                };
                let mut batches = Vec::new();
                for Given { path, file } in self.0 {
                    let Sums::Gradient { batches: own, .. } = file.sums else { continue };
                    batches.extend(own.into_iter().map(|batch| (path.clone(), batch)));
                }
                batches.sort_by_key(|(_, batch)| batch.number);
                let mut total = Total::default();
                for (path, batch) in batches {
                    if !total.add(&batch) {
                        return Err(damaged(&path, "its batches are of another gradient"));
                    }
                }
                numbers.extend(total.numbers());
                Ok(numbers)
            }
        }
    }

    /// What the results say of where they come from: times are those of all shards together.
    fn facts(&self) -> (RunFacts, Provenance) {
        let file = &self.0[0].file;
        let sum = |of: fn(&ShardFile) -> f64| self.0.iter().map(|s| of(&s.file)).sum();
        let facts = RunFacts {
            command: if file.command == "render" { "render" } else { "grad" },
            scene: file.scene.clone(),
            job: file.job.as_ref().map(|(path, _)| path.clone()),
            seed: file.seed,
            seconds: sum(|f| f.seconds),
            cpu_seconds: sum(|f| f.cpu_seconds),
            threads: self.0.iter().map(|s| s.file.threads).max().unwrap_or(0),
        };
        let provenance = Provenance {
            scene: facts.scene.clone(),
            job: file.job.clone(),
            seed: file.seed,
            seconds: facts.seconds,
            ..Provenance::default()
        };
        (facts, provenance)
    }
}
