//! Two scenes that must look and change alike, and the verdict on them.

use std::fmt;

use drt_estimators::{
    InteriorMotion, Layer, Rendering, Scene, Session, Settings, Target, Unattended, gradient,
};
use drt_math::{Affine, Mat3, Rgb, Vec3};
use drt_motion::{Change, Effect, GeometryChange, Parameter, ValueChange};

use super::pairing::{pair, targets};
use crate::Result;
use crate::comparison::{Difference, compare};
use crate::judge::LIMIT;
use crate::motion::{changes, moves};

/// A scene with what is differentiated in it.
#[derive(Clone, Debug)]
pub struct Case {
    /// The scene.
    pub scene: Scene,
    /// Parameters at value zero.
    pub parameters: Vec<Parameter>,
}

/// An extreme scene and its well-conditioned equivalent: equal images, and equal derivatives by
/// parameters in the same order.
#[derive(Clone, Debug)]
pub struct Condition {
    /// What is extreme.
    pub name: String,
    /// The extreme scene.
    pub hard: Case,
    /// The equivalent one.
    pub easy: Case,
    /// Samples per pixel of each.
    pub samples: u32,
}

/// An image, or the derivative by one parameter, of both scenes.
#[derive(Clone, Debug)]
pub struct Row {
    /// The condition.
    pub condition: String,
    /// `value`, or the parameter.
    pub what: String,
    /// The extreme scene against the other, as images.
    pub difference: Difference,
    /// Deviation of the image means in standard errors, the largest over channels.
    pub total_z: f64,
    /// Standard error of the mean relative to the mean.
    pub noise: f64,
    /// Whether an equivalent 3 % (values) or 20 % (derivatives) larger would have been rejected.
    pub sees_fault: bool,
    /// Relative deviation of the reverse mode from its transpose, for derivatives.
    pub transposed: Option<f64>,
    /// True when nothing was infinite or NaN.
    pub finite: bool,
}

impl Case {
    /// A scene with parameters by name and effects.
    #[must_use]
    pub fn new(scene: Scene, parameters: Vec<(&str, Vec<Effect>)>) -> Self {
        let parameter = |(name, effects): (&str, Vec<Effect>)| Parameter {
            name: name.into(),
            value: 0.0,
            effects,
        };
        Self { scene, parameters: parameters.into_iter().map(parameter).collect() }
    }

    fn render(&self, samples: u32, seed: u64) -> Result<Rendering> {
        let settings = Settings { threads: 1, seed, ..Settings::default() };
        let mut session = Session::new(&self.scene, &self.parameters, &settings)?;
        session.run(samples, &Unattended);
        Ok(session.rendering())
    }
}

impl Condition {
    /// A condition of 256 samples per pixel.
    #[must_use]
    pub fn new(name: impl Into<String>, hard: Case, easy: Case) -> Self {
        Self { name: name.into(), hard, easy, samples: 256 }
    }

    /// The same with other samples.
    #[must_use]
    pub fn samples(self, samples: u32) -> Self {
        Self { samples, ..self }
    }
}

/// Factors of the planted faults: of values, and of derivatives, which have more noise.
const FAULTS: [f64; 2] = [1.03, 1.2];
/// Rounding that reverse mode may differ by from forward mode.
const ROUNDING: f64 = 1e-8;

/// Renders both scenes and compares.
///
/// # Errors
/// When the library rejects a scene or parameter.
pub fn examine(condition: &Condition) -> Result<Vec<Row>> {
    // Other random numbers, so that the errors are independent.
    let hard = condition.hard.render(condition.samples, 31)?;
    let easy = condition.easy.render(condition.samples, 32)?;
    if easy.non_finite > 0 {
        return Err("the well-conditioned scene is none".into());
    }
    let value = easy.image.rms_value();
    let row = |what: &str, a: &Layer, b: &Layer, fault: f64, transposed: Option<Transposed>| {
        let wrong = scaled(b, fault);
        Row {
            condition: condition.name.clone(),
            what: what.into(),
            difference: compare(a, b, value),
            total_z: total_z(a, b, value),
            noise: a.total.stderr.g.hypot(b.total.stderr.g) / b.total.mean.g.abs(),
            sees_fault: !compare(a, &wrong, value).agrees || total_z(a, &wrong, value) > LIMIT,
            transposed: transposed.map(|t| t.deviation),
            finite: hard.non_finite == 0 && is_finite(a) && transposed.is_none_or(|t| t.finite),
        }
    };
    let mut rows = vec![row("value", &hard.image, &easy.image, FAULTS[0], None)];
    for (i, parameter) in condition.hard.parameters.iter().enumerate() {
        let [a, b] = [&hard, &easy].map(|r| &r.derivatives[i].total);
        let transposed = transposed(&condition.hard.scene, parameter)?;
        rows.push(row(&parameter.name, a, b, FAULTS[1], Some(transposed)));
    }
    Ok(rows)
}

/// Reverse mode against forward mode.
#[derive(Clone, Copy, Debug)]
struct Transposed {
    deviation: f64,
    finite: bool,
}

/// The derivative of the image's sum in both modes, from the same random numbers.
fn transposed(scene: &Scene, parameter: &Parameter) -> Result<Transposed> {
    let parameter = by_item(scene, parameter)?;
    // Directions of unit length, as the library makes them.
    let mut scene = scene.clone();
    for named in &mut scene.emitters {
        named.item.emitter = named.item.emitter.checked()?;
    }
    let scene = &scene;
    // Reverse mode leaves insides at rest.
    let insides = (0..scene.media.len()).map(|m| (m, InteriorMotion::Static)).collect();
    let settings = Settings { threads: 1, guiding: false, insides, ..Settings::default() };
    let spp = 4;
    let mut forward = Session::new(scene, core::slice::from_ref(&parameter), &settings)?;
    forward.run(spp, &Unattended);
    let forward = forward.rendering();
    let pixels = &forward.derivatives[0].total.pixels;
    let sum: f64 = pixels.iter().map(|p| p.mean.sum()).sum();
    let size: f64 = pixels.iter().map(|p| (p.mean.abs() + p.stderr).sum()).sum();
    let ones = vec![Rgb::ONE; pixels.len()];
    let wanted = targets(scene, &parameter);
    let gradient = gradient(scene, &wanted, &settings, spp, &ones, &Unattended)?;
    let reverse = pair(scene, &parameter, &gradient);
    let off = (reverse - sum).abs();
    Ok(Transposed {
        deviation: if off == 0.0 { 0.0 } else { off / size },
        finite: forward.non_finite == 0 && gradient.non_finite == 0 && reverse.is_finite(),
    })
}

/// The parameter with every change stated for the item that has it: properties for materials and
/// emitters instead of shapes, motions for those that follow, a vertex as one of all.
fn by_item(scene: &Scene, parameter: &Parameter) -> Result<Parameter> {
    let mut effects = Vec::new();
    for effect in &parameter.effects {
        match (&effect.change, scene.find(&effect.target)?) {
            (Change::Follow(leader), _) => {
                let led = parameter.effects.iter().filter(|e| e.target == *leader);
                effects.extend(led.map(|e| Effect { target: effect.target.clone(), ..e.clone() }));
            }
            (Change::Geometry(GeometryChange::Vertex { index, direction }), Target::Shape(s)) => {
                let mut velocities = vec![Vec3::ZERO; scene.shapes[s].mesh.positions.len()];
                velocities[*index as usize] = *direction;
                let all = GeometryChange::VertexVelocity(velocities.into());
                effects.push(moves(&effect.target, all));
            }
            (Change::Property(_), Target::Emitter(e))
                if scene.emitters[e].item.emitter.is_delta() =>
            {
                // The same for what lights without a shape move by.
                let linear = Mat3::skew(Vec3::splat(1e-100));
                let least = GeometryChange::Matrix(Affine { linear, translation: Vec3::ZERO });
                effects.extend([effect.clone(), moves(&effect.target, least)]);
            }
            (Change::Property(p), Target::Shape(s)) => {
                let shape = &scene.shapes[s];
                let target = match shape.emitter {
                    Some(e) if p.property == "radiance" => format!("emitter[{e}]"),
                    _ => format!("bsdf[{}]", shape.bsdf),
                };
                effects.push(Effect { target, ..effect.clone() });
            }
            (Change::Property(_), Target::Medium(_)) => {
                // Reverse mode samples for changes of every coefficient. So that forward mode does
                // as well, the albedo changes by what no sum can hold.
                let least = ValueChange::Add(Rgb::splat(1e-100));
                effects.extend([effect.clone(), changes(&effect.target, "albedo", least)]);
            }
            _ => effects.push(effect.clone()),
        }
    }
    Ok(Parameter { effects, ..parameter.clone() })
}

fn is_finite(layer: &Layer) -> bool {
    layer.pixels.iter().all(|p| p.mean.is_finite() && p.stderr.is_finite())
}

/// The largest deviation of the means over channels, in standard errors.
fn total_z(a: &Layer, b: &Layer, value: f64) -> f64 {
    let (a, b) = (a.total, b.total);
    let off = (a.mean - b.mean).abs();
    let stderr = (a.stderr * a.stderr + b.stderr * b.stderr).map(f64::sqrt);
    let size = value.max(a.mean.max_abs()).max(b.mean.max_abs());
    let pairs = off.to_array().into_iter().zip(stderr.to_array());
    let z = pairs.map(|(off, s)| if off <= 1e-6 * size { 0.0 } else { off / s });
    z.fold(0.0, f64::max)
}

fn scaled(layer: &Layer, factor: f64) -> Layer {
    let mut layer = layer.clone();
    for e in layer.blocks.iter_mut().chain([&mut layer.total]) {
        e.mean *= factor;
    }
    layer
}

impl Row {
    /// True when both scenes agree, in numbers that are.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.finite
            && self.difference.agrees
            && self.total_z <= LIMIT
            && self.transposed.is_none_or(|t| t <= ROUNDING)
    }
}

/// Rows for a reader of test output.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a>(pub &'a [Row]);

impl fmt::Display for Table<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for row in self.0 {
            let Difference { left, right, rms_z, .. } = row.difference;
            write!(
                f,
                "{:<44} {:<22} {left:>11.4e} {right:>11.4e} ±{:>6.2}%  z {:>5.2}  rms z {rms_z:>5.2}  {}",
                row.condition,
                row.what,
                100.0 * row.noise,
                row.total_z,
                if row.sees_fault { "sharp" } else { "     " },
            )?;
            if let Some(t) = row.transposed {
                write!(f, "  reverse {t:.0e}")?;
            }
            if !row.finite {
                write!(f, "  not finite")?;
            }
            writeln!(f, "{}", if row.passes() { "" } else { "  <<< FAILS" })?;
        }
        Ok(())
    }
}
