//! How a group of unknowns is stepped against the gradient of a loss.

use drt_estimators::fit::{Group, GroupKind};
use drt_estimators::{Scene, Target};
use drt_math::{Vec3, vec3};
use drt_motion::optimize::field::{
    FieldOptimizer, FieldRule, FieldState, LaplacianSmoothing, MeshLaplacian, laplacian_energy,
    total_variation,
};
use drt_motion::optimize::{Method, OptimizeError, Stages};

use crate::job::{GroupSteps, ParameterGroup};

/// The steps of a group as the keys of its `[[parameter_group]]` say: learning rate, preconditioner, regulariser and bounds.
#[derive(Clone, Debug)]
pub struct FieldSteps {
    optimizer: FieldOptimizer,
    /// The shape of the values without their channels, and the number of channels.
    shape: (Vec<usize>, usize),
    /// The Laplacian of the mesh whose vertices the group has, if it has one.
    laplacian: Option<MeshLaplacian>,
    /// Weight of the regulariser.
    smooth: f64,
}

impl FieldSteps {
    /// Begins with the values `start` of a group of this scene. The rate is for groups that have none of their own.
    ///
    /// # Errors
    /// When a number of the rule or a value is out of its range.
    pub fn new(
        scene: &Scene,
        group: &ParameterGroup,
        start: &[f64],
        method: Method,
        rate: f64,
    ) -> Result<Self, OptimizeError> {
        Self::with(scene, group, start, method, rate, |rule| FieldOptimizer::new(rule, start))
    }

    /// Goes on from a state, of a fit that began with the values `start`.
    ///
    /// # Errors
    /// As [`new`](Self::new), and when the state is not that of such a group.
    pub fn resume(
        scene: &Scene,
        group: &ParameterGroup,
        start: &[f64],
        method: Method,
        rate: f64,
        state: FieldState,
    ) -> Result<Self, OptimizeError> {
        Self::with(scene, group, start, method, rate, |rule| FieldOptimizer::resume(rule, state))
    }

    fn with(
        scene: &Scene,
        group: &ParameterGroup,
        start: &[f64],
        method: Method,
        rate: f64,
        make: impl FnOnce(FieldRule) -> Result<FieldOptimizer, OptimizeError>,
    ) -> Result<Self, OptimizeError> {
        let laplacian = laplacian(scene, &group.group, start)?;
        let mut shape = group.group.shape(scene);
        let dimensions = match &group.group.kind {
            GroupKind::Voxels(_) => 3,
            GroupKind::Texels { .. } | GroupKind::LightTexels => 2,
            _ => 1,
        };
        let channels = shape.split_off(dimensions.min(shape.len())).iter().product();
        let optimizer = make(rule(&group.steps, laplacian.as_ref(), method, rate)?)?;
        Ok(Self { optimizer, shape: (shape, channels), laplacian, smooth: group.steps.smooth })
    }

    /// Begins with the value of one number, which has neither preconditioner nor regulariser.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of_number(
        steps: &GroupSteps,
        value: f64,
        method: Method,
        rate: f64,
    ) -> Result<Self, OptimizeError> {
        let optimizer = FieldOptimizer::new(rule(steps, None, method, rate)?, &[value])?;
        Ok(Self { optimizer, shape: (Vec::new(), 1), laplacian: None, smooth: 0.0 })
    }

    /// The values reached.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        self.optimizer.values()
    }

    /// What to store in order to [`resume`](Self::resume).
    #[must_use]
    pub fn state(&self) -> &FieldState {
        self.optimizer.state()
    }

    /// Takes one step against the gradient of the loss and of the regulariser, with the learning rate of this iteration
    /// times `factor`.
    ///
    /// # Errors
    /// When the gradient has another length than the group, or is not finite, or so is what the step leads to; nothing
    /// changes then.
    pub fn step(
        &mut self,
        gradient: &[f64],
        iteration: u32,
        factor: f64,
    ) -> Result<(), OptimizeError> {
        if self.smooth <= 0.0 {
            return self.optimizer.step(gradient, iteration, factor);
        }
        let mut all = gradient.to_vec();
        let (values, weight) = (self.optimizer.values(), self.smooth);
        match (&self.laplacian, &self.shape) {
            (Some(laplacian), _) => laplacian_energy(laplacian, 3, values, &mut all, weight)?,
            (None, (shape, channels)) => {
                let mut axes = [1; 3];
                axes.iter_mut().zip(shape.iter().rev()).for_each(|(axis, length)| *axis = *length);
                total_variation(axes, *channels, values, &mut all, weight)?
            }
        };
        self.optimizer.step(&all, iteration, factor)
    }

    /// Takes back all but a part of the last step.
    pub fn shorten(&mut self, part: f64) {
        self.optimizer.shorten(part);
    }
}

/// The rule that the keys of a group say, for a mesh of this Laplacian if the group has one.
fn rule(
    steps: &GroupSteps,
    laplacian: Option<&MeshLaplacian>,
    method: Method,
    rate: f64,
) -> Result<FieldRule, OptimizeError> {
    let GroupSteps { learning_rate, laplacian: lambda, bounds, log, .. } = steps;
    let smoothing = match laplacian.filter(|_| *lambda > 0.0) {
        Some(laplacian) => Some(LaplacianSmoothing::of(laplacian.clone(), *lambda)?),
        None => None,
    };
    Ok(FieldRule {
        method,
        learning_rate: learning_rate.clone().unwrap_or_else(|| Stages::new(rate, Vec::new())),
        lower: bounds[0],
        upper: bounds[1],
        logarithmic: *log,
        smoothing,
    })
}

/// The Laplacian of the mesh whose vertices a group has, in its order.
fn laplacian(
    scene: &Scene,
    group: &Group,
    values: &[f64],
) -> Result<Option<MeshLaplacian>, OptimizeError> {
    let mesh = match (&group.kind, group.target) {
        (GroupKind::Vertices, Target::Shape(s)) => &scene.shapes[s].mesh,
        (GroupKind::Cage(cage), _) => cage,
        _ => return Ok(None),
    };
    let positions: Vec<Vec3> = values.chunks_exact(3).map(|c| vec3(c[0], c[1], c[2])).collect();
    let triangles: Vec<[u32; 3]> =
        mesh.triangles.iter().map(|t| t.map(|v| mesh.source_vertex(v))).collect();
    MeshLaplacian::with_seams(&positions, &triangles).map(Some)
}
