//! What is run: a case of the oracle file, or one of the variants it lists.

use std::f64::consts::PI;

use drt_estimators::{EstimatorKind, InteriorMotion, SceneEmitter, Session, Settings};
use drt_motion::{Change, GeometryChange, Parameter};

use crate::Result;
use crate::motion::{moves, moves_everything, parameter};
use crate::oracle::{
    Case, Detector, Light, MediumText, NumberText, ParameterText, SceneText, SlabNumbers, SlabRow,
    Surface, Triple, Velocity,
};
use crate::scene::{Built, build};

/// A scene to run, with the numbers that must come out.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The case, and which variant of it.
    pub name: String,
    /// The scene.
    pub built: Built,
    /// What the measured values are multiplied with before they are judged.
    pub unit: f64,
    /// The value.
    pub value: f64,
    /// Parameters with their derivatives.
    pub parameters: Vec<(Parameter, f64)>,
    /// Relative deviation that the detector's own width may cause.
    pub bias: f64,
    /// Size of the largest derivative of the case, in all its rows.
    pub largest_of_case: f64,
    /// How the insides of its media move, where the plan is not to choose.
    pub insides: Option<InteriorMotion>,
    /// Of its derivatives.
    pub estimator: EstimatorKind,
}

impl Trial {
    /// A scene with its value, and parameters by their texts.
    ///
    /// # Errors
    /// When the scene cannot be built or lacks what a parameter changes.
    pub fn new(
        name: impl Into<String>,
        scene: &SceneText,
        detector: &Detector,
        value: f64,
        parameters: &[ParameterText],
    ) -> Result<Self> {
        let name = name.into();
        let fail = |e| format!("{name}: {e}");
        let built = build(scene, detector).map_err(fail)?;
        let largest_of_case = parameters.iter().fold(0.0, |m, p| f64::max(m, p.derivative.abs()));
        let parameters = parameters
            .iter()
            .map(|p| Ok((parameter(&built, p).map_err(fail)?, p.derivative)))
            .collect::<Result<_>>()?;
        let bias = match detector {
            Detector::Radiance { .. } => crate::detector::RAY_BIAS,
            _ => 1e-9,
        };
        Ok(Self {
            name,
            built,
            unit: 1.0,
            value,
            parameters,
            bias,
            largest_of_case,
            insides: None,
            estimator: EstimatorKind::default(),
        })
    }

    /// The same with insides that move in one way: `None` where that does not apply, or nothing moves
    /// that bounds a medium.
    #[must_use]
    pub fn with_insides(&self, name: &str, kind: InteriorMotion) -> Option<Self> {
        let mut trial = self.clone();
        trial.name = format!("{}: {name}", self.name);
        trial.insides = Some(kind);
        // Only motions are in question.
        trial
            .parameters
            .retain(|(p, _)| p.effects.iter().any(|e| matches!(e.change, Change::Geometry(_))));
        let parameters: Vec<Parameter> = trial.parameters.iter().map(|(p, _)| p.clone()).collect();
        let session = Session::new(&trial.built.scene, &parameters, &trial.settings()).ok()?;
        let moves = session.plan().media.iter().any(|m| !m.motion.is_empty());
        moves.then_some(trial)
    }

    /// The same by an estimator other than path space; `None` where no light fits that, and path space does it all.
    #[must_use]
    pub fn by(mut self, estimator: EstimatorKind) -> Option<Self> {
        self.name = format!("{}: {estimator:?}", self.name);
        self.estimator = estimator;
        let delta = |e: &SceneEmitter| e.emitter.is_delta();
        let emitters = self.built.scene.emitters.iter();
        let emissive = self.built.scene.media.iter().any(|m| m.item.is_emissive());
        let fits = emissive || emitters.clone().any(|e| !delta(&e.item));
        fits.then_some(self)
    }

    /// How it is run.
    #[must_use]
    pub fn settings(&self) -> Settings {
        let media = 0..self.built.scene.media.len();
        let insides = self.insides.iter().flat_map(|kind| media.clone().map(|m| (m, kind.clone())));
        // Tests run side by side; each keeps to one thread.
        Settings {
            threads: 1,
            seed: 2021,
            insides: insides.collect(),
            estimator: self.estimator,
            ..Settings::default()
        }
    }

    /// Everything a case asks for.
    ///
    /// # Errors
    /// When the case has a part of unknown kind.
    pub fn of_case(case: &Case) -> Result<Vec<Self>> {
        if !case.rows.is_empty() {
            let rows = case.rows.iter().map(|row| slab(&case.id, row));
            let mut trials: Vec<Self> =
                rows.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect();
            let largest = trials.iter().fold(0.0, |m, t| f64::max(m, t.largest_of_case));
            trials.iter_mut().for_each(|t| t.largest_of_case = largest);
            return Ok(trials);
        }
        let value = case.value.ok_or_else(|| format!("{}: has no value", case.id))?;
        let case = &in_wide_pixels(case);
        // A parameter without a place where the derivative is taken stands for any motion.
        let (named, any): (Vec<ParameterText>, Vec<_>) =
            case.parameters.iter().cloned().partition(|p| p.theta0.is_some());
        let mut plain = Self::new(&case.id, &case.scene, &case.detector, value, &named)?;
        for text in any {
            plain.parameters.extend(motions_of_walls(&plain.built, text.derivative));
        }
        let mut trials = vec![plain];
        trials.extend(truncated_furnaces(case)?);
        trials.extend(filled_furnace(case)?);
        trials.extend(identical_layers(case)?);
        Ok(trials)
    }
}

fn scalar(name: &str, derivative: f64) -> ParameterText {
    ParameterText { name: name.into(), theta0: Some(0.0), velocity: [].into(), derivative }
}

fn motion(name: &str, what: &str, v: Triple, derivative: f64) -> ParameterText {
    let velocity = [(what.into(), Velocity::Uniform(v))].into();
    ParameterText { velocity, ..scalar(name, derivative) }
}

/// A corner that moves alone, a wall that moves as a whole, and everything but the detector stretched:
/// the walls stay closed.
fn motions_of_walls(built: &Built, derivative: f64) -> Vec<(Parameter, f64)> {
    let Some((id, walls)) =
        built.scene.shapes.first().and_then(|s| Some((s.id.as_ref()?, &s.mesh)))
    else {
        return Vec::new();
    };
    let corner = GeometryChange::Vertex { index: 0, direction: drt_math::vec3(0.5, -0.3, 0.7) };
    let bounds = walls.bounds();
    let outward = |p: &drt_math::Vec3| drt_math::vec3(f64::from(p.x == bounds.max.x), 0.0, 0.0);
    let wall = GeometryChange::VertexVelocity(walls.positions.iter().map(outward).collect());
    let stretch = drt_math::Affine {
        linear: drt_math::Mat3::diagonal(drt_math::vec3(0.4, -0.2, 0.3)),
        translation: drt_math::vec3(0.1, 0.0, -0.2),
    };
    let mut all = moves_everything(built, &stretch);
    all.retain(|e| e.target != crate::scene::DETECTOR);
    [("a corner", vec![moves(id, corner)]), ("a wall", vec![moves(id, wall)]), ("stretch", all)]
        .into_iter()
        .map(|(name, effects)| (Parameter { name: name.into(), value: 0.0, effects }, derivative))
        .collect()
}

/// The radiance in a furnace is the same everywhere, so that a wide pixel measures that of a ray,
/// with less noise.
fn in_wide_pixels(case: &Case) -> Case {
    let mut case = case.clone();
    if case.medium_variant.is_some() || !case.truncated.is_empty() {
        case.detector = case.detector.widened(0.3);
    }
    case
}

fn truncated_furnaces(case: &Case) -> Result<Vec<Trial>> {
    let of = |t: &crate::oracle::TruncatedFurnace| {
        let name = format!("{}, {} bounces", case.id, t.max_bounces);
        let rho = [scalar("rho", t.d_rho)];
        let mut trial = Trial::new(name, &case.scene, &case.detector, t.value, &rho)?;
        trial.built.scene.integrator.max_depth = Some(t.max_bounces + 1);
        Ok(trial)
    };
    case.truncated.iter().map(of).collect()
}

fn filled_furnace(case: &Case) -> Result<Option<Trial>> {
    let Some(filled) = &case.medium_variant else { return Ok(None) };
    let number = |what: &str| -> Result<f64> {
        let text = &filled.medium;
        let found = text.split([' ', ',']).find_map(|w| w.strip_prefix(what)?.strip_prefix('='));
        let word = found.ok_or_else(|| format!("no `{what}=` in `{text}`"))?;
        Ok(word.parse::<f64>()?)
    };
    let mut scene = case.scene.clone();
    let walls = scene.surfaces.first().ok_or("a furnace has no walls")?;
    scene.media.push(MediumText {
        region: "all space".into(),
        lo: walls.lo,
        hi: walls.hi,
        sigma_t: Some(NumberText::Number(number("sigma_t")?)),
        albedo: number("albedo")?,
        phase: Some("HG".into()),
        g: Some(number("g")?),
        ..MediumText::default()
    });
    let scalars = [scalar("sigma_t", filled.d_sigma_t), scalar("g", filled.d_g)];
    let name = format!("{}, filled", case.id);
    let mut trial = Trial::new(name, &scene, &case.detector, filled.value, &scalars)?;
    trial.parameters.extend(motions_of_walls(&trial.built, 0.0));
    Ok(Some(trial))
}

fn identical_layers(case: &Case) -> Result<Option<Trial>> {
    let Some(numbers) = &case.identical_media_variant else { return Ok(None) };
    let mut scene = case.scene.clone();
    let [lower, upper] = &mut scene.media[..] else {
        return Err("identical layers need two media".into());
    };
    *lower = MediumText { lo: lower.lo, hi: lower.hi, ..upper.clone() };
    let derivative = numbers.derivative_interface_motion;
    let interface = [motion("interface", "interface", [0.0, 0.0, 1.0], derivative)];
    let name = format!("{}, identical", case.id);
    Ok(Some(Trial::new(name, &scene, &case.detector, numbers.value, &interface)?))
}

/// A slab in place of the infinite one: a box this many thicknesses wide. Past its rim a meter below sees
/// the sky itself, in proportion to the inverse square of the width.
const SLAB_WIDTH: f64 = 120.0;
/// Not 1, so that the two derivatives by the optical thickness differ.
const SLAB_THICKNESS: f64 = 0.8;

/// The four measurements of a slab under a sky, above a black ground that hides the sky below. By
/// reciprocity the radiance along the normal is the reflected or transmitted part of a beam.
fn slab(case: &str, row: &SlabRow) -> Result<Vec<Trial>> {
    let (w, d) = (SLAB_WIDTH * SLAB_THICKNESS, SLAB_THICKNESS);
    let ground = 20.0 * w;
    let sigma_t = row.tau / d;
    let scene = SceneText {
        surfaces: vec![Surface {
            name: "ground".into(),
            vertices: vec![
                [-ground, -ground, -d],
                [ground, -ground, -d],
                [ground, ground, -d],
                [-ground, ground, -d],
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            bsdf: "black".into(),
            ..Surface::default()
        }],
        media: vec![MediumText {
            region: "box".into(),
            lo: Some([-w, -w, 0.0]),
            hi: Some([w, w, d]),
            sigma_t: Some(NumberText::Number(sigma_t)),
            albedo: row.albedo,
            phase: Some("HG".into()),
            g: Some(row.g),
            ..MediumText::default()
        }],
        lights: vec![Light::Environment { radiance: NumberText::Number(1.0) }],
        max_order: None,
    };
    let ([above, below], [down, up]) = ([1.5 * d, -0.5 * d], [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]);
    // Off the diagonals, where the triangles of each face meet.
    let at = |z| [0.013 * d, 0.007 * d, z];
    let ray = |z, direction| Detector::Radiance { origin: at(z), direction };
    let meter = |z, normal| Detector::Irradiance { point: at(z), normal };
    type Pick = fn(&SlabNumbers) -> f64;
    let measurements: [(&str, Detector, f64, Pick); 4] = [
        ("R_normal", ray(above, down), 1.0, |n| n.r_normal),
        ("T_normal_total", ray(below, up), 1.0, |n| n.t_normal),
        ("R_diffuse", meter(above, down), 1.0 / PI, |n| n.r_diffuse),
        ("T_diffuse_total", meter(below, up), 1.0 / PI, |n| n.t_diffuse),
    ];
    let name = format!("{case} tau {} albedo {} g {}", row.tau, row.albedo, row.g);
    let of = |(what, detector, unit, pick): (&str, Detector, f64, Pick)| {
        let by_tau = pick(&row.d_tau);
        let raise = |what| motion(what, what, up, sigma_t * by_tau);
        let parameters = [
            scalar("sigma_t", d * by_tau),
            raise("face z=hi"),
            raise("face z=hi (values advected)"),
            scalar("albedo", pick(&row.d_albedo)),
            scalar("g", pick(&row.d_g)),
        ];
        let name = format!("{name} {what}");
        let trial = Trial::new(name, &scene, &detector, pick(&row.values), &parameters)?;
        Ok(Trial { unit, ..trial })
    };
    measurements.into_iter().map(of).collect()
}
