//! The groups of unknowns of a fit: where they are, how they step, and the files that they become.

use std::io::Write as _;
use std::path::Path;
use std::sync::Arc;

use drt_estimators::fit::{Evaluation, Fit, Group, GroupKind};
use drt_estimators::{Scene, Target};
use drt_geom::Mesh;
use drt_math::vec3;
use drt_medium::Property;
use drt_medium::vol::{self, VolFile};
use drt_motion::optimize::OptimizeError;
use drt_motion::optimize::field::FieldState;

use super::problem::Problem;
use crate::error::Place;
use crate::files::atomic::write_atomically;
use crate::files::image::encode_texels;
use crate::files::mesh_file;
use crate::job::ParameterGroup;
use crate::prepared::FieldSteps;
use crate::{CliError, Job};

/// All groups of a fit.
#[derive(Clone)]
pub(super) struct Fields<'a> {
    problem: &'a Problem<'a>,
    optimizers: Vec<FieldSteps>,
    /// Where each group began.
    starts: Vec<Vec<f64>>,
}

impl<'a> Fields<'a> {
    /// Begins with the values of the scene.
    pub(super) fn begin(problem: &'a Problem<'a>) -> Result<Self, CliError> {
        Self::new(problem, |i, start| {
            let job = problem.job;
            let (method, rate) = (problem.plan.method, problem.plan.group_rates[i]);
            FieldSteps::new(&job.scene, &job.groups[i], start, method, rate)
        })
    }

    /// Goes on from the states of a checkpoint.
    pub(super) fn resume(
        problem: &'a Problem<'a>,
        states: Vec<FieldState>,
    ) -> Result<Self, CliError> {
        if states.len() != problem.job.groups.len() {
            let message = "its checkpoint has another number of groups; --restart begins anew";
            return Err(CliError::input(&Place::file(&problem.job.path), message));
        }
        Self::new(problem, |i, start| {
            let (job, state) = (problem.job, states[i].clone());
            let (method, rate) = (problem.plan.method, problem.plan.group_rates[i]);
            FieldSteps::resume(&job.scene, &job.groups[i], start, method, rate, state)
        })
    }

    fn new(
        problem: &'a Problem<'a>,
        make: impl Fn(usize, &[f64]) -> Result<FieldSteps, OptimizeError>,
    ) -> Result<Self, CliError> {
        let (mut optimizers, mut starts) = (Vec::new(), Vec::new());
        for (i, group) in problem.job.groups.iter().enumerate() {
            let values = group.group.values(&problem.job.scene);
            optimizers.push(make(i, &values).map_err(|e| {
                let message = format!("group `{}`: {e}", group.group.name);
                CliError::input(&Place::file(&problem.job.path), message)
            })?);
            starts.push(values);
        }
        Ok(Self { problem, optimizers, starts })
    }

    fn groups(&self) -> impl Iterator<Item = (&'a ParameterGroup, &FieldSteps)> {
        self.problem.job.groups.iter().zip(&self.optimizers)
    }

    /// Gives a fit the present values.
    pub(super) fn give(&self, fit: &mut Fit) -> Result<(), CliError> {
        for (i, optimizer) in self.optimizers.iter().enumerate() {
            fit.set_group(i, optimizer.values()).map_err(|e| self.problem.job.blame(&e))?;
        }
        Ok(())
    }

    /// Gives a job's scene the present values.
    pub(super) fn apply(&self, job: &mut Job) -> Result<(), CliError> {
        let mut scene = job.scene.clone();
        for (group, optimizer) in self.groups() {
            let applied = group.group.apply(&job.scene, optimizer.values(), &mut scene);
            applied.map_err(|e| job.blame(&e))?;
        }
        job.scene = scene;
        Ok(())
    }

    /// A row of the table of values: the parameters', and the root mean square change of each group from where it began.
    pub(super) fn row(&self, parameters: &[f64]) -> Vec<f64> {
        let change = |(optimizer, values): (&FieldSteps, &Vec<f64>)| {
            let squares = optimizer.values().iter().zip(values).map(|(v, s)| (v - s) * (v - s));
            (squares.sum::<f64>() / values.len().max(1) as f64).sqrt()
        };
        let changes = self.optimizers.iter().zip(&self.starts).map(change);
        parameters.iter().copied().chain(changes).collect()
    }

    /// Refuses a group that nothing depends on.
    pub(super) fn check_first(&self, seen: &Evaluation) -> Result<(), CliError> {
        for (i, (group, _)) in self.groups().enumerate() {
            if seen.group_gradient(i).iter().all(|g| *g == 0.0) {
                let message = format!(
                    "group `{}` changes nothing that its targets show: its gradient is zero everywhere; expected \
                     something in view",
                    group.group.name
                );
                return Err(CliError::input(&Place::file(&self.problem.job.path), message));
            }
        }
        Ok(())
    }

    /// Steps all groups.
    pub(super) fn step(&mut self, i: u32, seen: &Evaluation, factor: f64) -> Result<(), CliError> {
        let groups = self.problem.job.groups.iter();
        for (g, (group, optimizer)) in groups.zip(&mut self.optimizers).enumerate() {
            optimizer.step(seen.group_gradient(g), i, factor).map_err(|e| {
                CliError::unsolved(format!("iteration {i}: group `{}`: {e}", group.group.name))
            })?;
        }
        Ok(())
    }

    /// Takes back all but a part of the last step.
    pub(super) fn shorten(&mut self, part: f64) {
        self.optimizers.iter_mut().for_each(|optimizer| optimizer.shorten(part));
    }

    /// What a checkpoint stores.
    pub(super) fn states(&self) -> Vec<FieldState> {
        self.optimizers.iter().map(|optimizer| optimizer.state().clone()).collect()
    }

    /// What the groups have become, to be written at any time.
    pub(super) fn results(&self) -> Vec<FieldResult> {
        let given = &self.problem.job.scene;
        let mut scene = given.clone();
        // They have been given to the fit already. A file may hold the values of several groups.
        let applied = self.groups().all(|(group, optimizer)| {
            group.group.apply(given, optimizer.values(), &mut scene).is_ok()
        });
        let result = |(group, optimizer): (&ParameterGroup, &FieldSteps)| {
            Some(FieldResult { files: files(&group.group, optimizer.values(), &scene)? })
        };
        self.groups().filter(|_| applied).filter_map(result).collect()
    }

    /// The shapes that groups of vertices or of a cage move, as they were and as they are now, by the groups' names.
    pub(super) fn shapes(&self) -> Vec<(&'a str, [Arc<Mesh>; 2])> {
        let given = &self.problem.job.scene;
        let mut scene = given.clone();
        let shape = |(group, optimizer): (&'a ParameterGroup, &FieldSteps)| {
            let Group { name, kind, target: Target::Shape(s), .. } = &group.group else {
                return None;
            };
            if !matches!(kind, GroupKind::Vertices | GroupKind::Cage(_)) {
                return None;
            }
            // They have been given to the fit already.
            group.group.apply(given, optimizer.values(), &mut scene).ok()?;
            Some((name.as_str(), [given, &scene].map(|scene| scene.shapes[*s].mesh.clone())))
        };
        self.groups().filter_map(shape).collect()
    }

    /// The names of the files that results are written to.
    pub(super) fn names(problem: &Problem<'_>) -> impl Iterator<Item = String> {
        problem.job.groups.iter().flat_map(|g| {
            let name = &g.group.name;
            endings(&g.group.kind).iter().map(move |ending| format!("{name}.{ending}"))
        })
    }
}

/// The files that a group becomes.
pub(super) struct FieldResult {
    files: Vec<(String, Vec<u8>)>,
}

impl FieldResult {
    pub(super) fn write(&self, folder: &Path) -> Result<(), CliError> {
        for (name, bytes) in &self.files {
            write_atomically(&folder.join(name), |out| Ok(out.write_all(bytes)?))?;
        }
        Ok(())
    }
}

fn endings(kind: &GroupKind) -> &'static [&'static str] {
    match kind {
        GroupKind::Vertices | GroupKind::Cage(_) => &["ply", "obj"],
        GroupKind::Voxels(_) => &["vol"],
        _ => &["exr"],
    }
}

/// The files of a group's values, in a scene that has them.
fn files(group: &Group, values: &[f64], scene: &Scene) -> Option<Vec<(String, Vec<u8>)>> {
    let name = |ending: &str| format!("{}.{ending}", group.name);
    Some(match (&group.kind, group.target) {
        (GroupKind::Vertices, Target::Shape(s)) => {
            let mesh = &scene.shapes[s].mesh;
            vec![
                (name("ply"), mesh_file::ply(mesh)),
                (name("obj"), mesh_file::obj(mesh).into_bytes()),
            ]
        }
        (GroupKind::Cage(cage), _) => {
            let mut cage = (**cage).clone();
            for (p, v) in cage.positions.iter_mut().zip(values.chunks_exact(3)) {
                *p = vec3(v[0], v[1], v[2]);
            }
            vec![
                (name("ply"), mesh_file::ply(&cage)),
                (name("obj"), mesh_file::obj(&cage).into_bytes()),
            ]
        }
        (GroupKind::Voxels(property), Target::Medium(m)) => {
            let file = |property| {
                let grid = scene.media[m].item.voxels(property)?.clone();
                Some(VolFile { bounds: grid.world_bounds(), grid })
            };
            let bytes = match property {
                // What reads `S` takes it as a whole.
                Property::SggxDiagonal | Property::SggxOffDiagonal => {
                    let entries = [Property::SggxDiagonal, Property::SggxOffDiagonal].map(file);
                    let [diagonal, others] = entries;
                    vol::encode_matrices(&[diagonal?, others?])
                }
                _ => vol::encode(&file(*property)?),
            };
            vec![(name("vol"), bytes.ok()?)]
        }
        (GroupKind::Texels { property, .. }, Target::Bsdf(b)) => {
            let bsdf = &scene.bsdfs[b].item;
            let texels = bsdf.texel_values(*property)?;
            vec![(name("exr"), encode_texels(bsdf.texels(*property)?, &texels)?)]
        }
        (GroupKind::LightTexels, Target::Emitter(e)) => {
            let emitter = &scene.emitters[e].item.emitter;
            vec![(name("exr"), encode_texels(emitter.texels()?, &emitter.texel_values()?)?)]
        }
        _ => return None,
    })
}
