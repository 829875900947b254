//! Parameters become tangents: the scene at the parameters' values, and its rate of change by each.

use alloc::borrow::Cow;
use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::ops::AddAssign;

use drt_math::{Affine, Rgb};
use drt_medium::{MediumChange, MediumTangent};
use drt_motion::parameter::{Applied, change_value, geometry_changes};
use drt_motion::surface::{ReachedTriangles, SmoothNormals, move_affine, move_mesh};
use drt_motion::{Change, GeometryChange, Parameter, PropertyChange, SurfaceMotion, Texels};

use crate::derivative::grid_deformation::{GridDeformation, GridDeformationError};
use crate::derivative::sensitivity::TextureUse;
use crate::model::emitter::{Emitter, EmitterError, EmitterTangent};
use crate::model::error::{EffectError, Error};
use crate::model::scene::{Scene, Target};
use crate::model::sensor::{Sensor, SensorTangent};
use crate::model::surface::{BsdfChange, BsdfTangent, Property, SurfaceError};
use crate::model::texture::{TexelChange, TexelError, TexelTangent};

/// What changes with each parameter: for every item of the scene, the parameters that change it
/// (by index) and how.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tangents {
    pub(crate) names: Vec<String>,
    pub(crate) shapes: Vec<Vec<(usize, SurfaceMotion)>>,
    /// Which of these are felt on which triangles.
    reached: Vec<ReachedTriangles>,
    /// Where a deformed shape's normals are recomputed: the map to pull gradients back through.
    pub(crate) smooth: Vec<Option<SmoothNormals>>,
    pub(crate) media: Vec<Vec<(usize, MediumTangent)>>,
    pub(crate) bsdfs: Vec<Vec<(usize, BsdfTangent)>>,
    /// BSDFs whose index of refraction turns light that goes on in a single direction.
    bending: Vec<bool>,
    pub(crate) texels: Vec<TexelMotion>,
    pub(crate) emitters: Vec<Vec<(usize, EmitterTangent)>>,
    /// Of every sensor.
    sensors: Vec<Vec<(usize, SensorTangent)>>,
    /// Of the one that is in use.
    pub(crate) sensor: Vec<(usize, SensorTangent)>,
    /// Why the first parameter that has finite differences only has no tangents.
    refused: Option<Error>,
}

/// How texels change with a parameter.
#[derive(Clone, Debug)]
pub(crate) struct TexelMotion {
    pub(crate) of: TextureUse,
    pub(crate) parameter: usize,
    pub(crate) tangent: TexelTangent,
}

/// Adds the rates with a parameter to those that earlier changes of the same texels gave.
fn add_texels(
    to: &mut Vec<TexelMotion>,
    of: TextureUse,
    parameter: usize,
    change: &TexelChange,
    tangent: TexelTangent,
) {
    let mut own = TexelMotion { of, parameter, tangent };
    to.iter_mut().filter(|t| t.of == of).for_each(|t| t.tangent.carry(change));
    match to.iter_mut().find(|t| t.of == of && t.parameter == parameter) {
        Some(sum) => sum.tangent.add(core::mem::take(&mut own.tangent)),
        None => to.push(own),
    }
}

impl Tangents {
    /// Those of the first so many parameters, in the scene at the values of all.
    pub(crate) fn of_first(mut self, count: usize, scene: &Scene) -> Self {
        fn first<T>(lists: &mut [Vec<(usize, T)>], count: usize) {
            lists.iter_mut().for_each(|list| list.retain(|(p, _)| *p < count));
        }
        self.names.truncate(count);
        first(&mut self.shapes, count);
        let of_shapes = self.shapes.iter().zip(&scene.shapes);
        let reached = of_shapes.map(|(motions, shape)| {
            ReachedTriangles::new(&shape.mesh, motions.iter().map(|(_, m)| m))
        });
        self.reached = reached.collect();
        first(&mut self.media, count);
        first(&mut self.bsdfs, count);
        first(&mut self.emitters, count);
        first(&mut self.sensors, count);
        self.texels.retain(|t| t.parameter < count);
        self
    }

    /// Refuses parameters that have finite differences only.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.refused.clone().map_or(Ok(()), Err)
    }

    /// What changes with any parameter.
    pub(crate) fn targets(&self) -> impl Iterator<Item = Target> {
        fn some<T>(lists: &[Vec<T>]) -> impl Iterator<Item = usize> {
            lists.iter().enumerate().filter(|(_, l)| !l.is_empty()).map(|(i, _)| i)
        }
        let shapes = some(&self.shapes).map(Target::Shape);
        let media = some(&self.media).map(Target::Medium);
        let emitters = some(&self.emitters).map(Target::Emitter);
        let sensor = (!self.sensor.is_empty()).then_some(Target::Sensor(0));
        shapes.chain(media).chain(emitters).chain(sensor)
    }

    /// True when matter or an emitter moves, or refracted light turns.
    pub(crate) fn move_light(&self) -> bool {
        let mut light = self.targets().filter(|target| !matches!(target, Target::Sensor(_)));
        light.any(|target| self.moves(target)) || (0..self.bsdfs.len()).any(|b| self.bends(b))
    }

    /// True of a BSDF whose index of refraction changes, and turns light that goes on in a single direction.
    pub(crate) fn bends(&self, bsdf: usize) -> bool {
        let changes = |(_, t): &(usize, BsdfTangent)| !t.get(Property::Eta).is_zero();
        self.bending[bsdf] && self.bsdfs[bsdf].iter().any(changes)
    }

    /// True of what moves, not of what has other colours or coefficients alone.
    pub(crate) fn moves(&self, target: Target) -> bool {
        let of_media = |t: &MediumTangent| t.velocity != Affine::ZERO || !t.flows.is_empty();
        match target {
            Target::Shape(_) | Target::Sensor(_) => true,
            Target::Bsdf(_) | Target::Coefficients(_) => false,
            Target::Medium(m) => self.media[m].iter().any(|(_, t)| of_media(t)),
            Target::Emitter(e) => self.emitters[e].iter().any(|(_, t)| t.moves()),
        }
    }

    /// The motions of a shape that can be felt on one of its triangles, by parameters.
    pub(crate) fn felt_on(
        &self,
        shape: usize,
        triangle: u32,
    ) -> impl Iterator<Item = &(usize, SurfaceMotion)> {
        let motions = &self.shapes[shape];
        self.reached[shape].on(triangle).map(|n| &motions[n])
    }

    /// The same for one of the sensors; where there is no such sensor, none changes.
    pub(crate) fn seen_by(&self, sensor: usize) -> Self {
        let sensor = self.sensors.get(sensor).cloned().unwrap_or_default();
        Self { sensor, ..self.clone() }
    }
}

/// Looks up every effect's target, and follows property effects on a shape to what carries the
/// property.
fn resolve(scene: &Scene, parameters: &[Parameter]) -> Result<Vec<Parameter<Target>>, Error> {
    parameters
        .iter()
        .map(|p| {
            let effects = p
                .effects
                .iter()
                .map(|e| Ok((e, scene.find_all(&e.target)?)))
                .collect::<Result<Vec<_>, Error>>()?
                .into_iter()
                .flat_map(|(e, targets)| targets.into_iter().map(move |target| (e, target)))
                .map(|(e, mut target)| {
                    let fail = |reason| effect_error(p, &e.target, reason);
                    let change = match &e.change {
                        Change::Geometry(g) => {
                            if let Target::Bsdf(_) = target {
                                return Err(fail(EffectError::NotMovable));
                            }
                            Change::Geometry(g.clone())
                        }
                        Change::Property(c) => {
                            target = carrier(scene, target, c).map_err(fail)?;
                            Change::Property(c.clone())
                        }
                        // All shapes of an instance move alike.
                        Change::Follow(leader) => Change::Follow(scene.find_all(leader)?[0]),
                    };
                    Ok(drt_motion::Effect { target, change })
                })
                .collect::<Result<_, Error>>()?;
            Ok(Parameter { name: p.name.clone(), value: p.value, effects })
        })
        .collect()
}

fn carrier(scene: &Scene, target: Target, change: &PropertyChange) -> Result<Target, EffectError> {
    let Target::Shape(i) = target else { return Ok(target) };
    let shape = &scene.shapes[i];
    if change.property == "radiance" {
        return shape.emitter.map(Target::Emitter).ok_or(EffectError::NotEmitting);
    }
    Ok(Target::Bsdf(shape.bsdf))
}

fn effect_error<T>(p: &Parameter<T>, target: &str, reason: EffectError) -> Error {
    Error::Effect { parameter: p.name.clone(), target_name: target.into(), reason }
}

/// The effects on one target, in the order in which they apply.
fn effects_on(
    parameters: &[Parameter<Target>],
    target: Target,
) -> impl Iterator<Item = (usize, &Parameter<Target>, &Change<Target>)> {
    parameters.iter().enumerate().flat_map(move |(i, p)| {
        p.effects.iter().filter(move |e| e.target == target).map(move |e| (i, p, &e.change))
    })
}

/// What a target follows by one parameter, directly or not.
fn leaders(parameter: &Parameter<Target>, target: Target) -> Vec<Target> {
    let mut found = alloc::vec![target];
    let mut next = 0;
    while let Some(&follower) = found.get(next) {
        for e in parameter.effects.iter().filter(|e| e.target == follower) {
            if let Change::Follow(leader) = e.change
                && !found.contains(&leader)
            {
                found.push(leader);
            }
        }
        next += 1;
    }
    found
}

/// The scene at its parameters' values.
///
/// # Errors
/// When an effect does not fit its target.
pub fn moved(scene: &Scene, parameters: &[Parameter]) -> Result<Scene, Error> {
    apply(scene, parameters).map(|(scene, _)| scene)
}

/// Applies the parameters to a scene and differentiates it, without a sensor in use.
pub(crate) fn apply(scene: &Scene, parameters: &[Parameter]) -> Result<(Scene, Tangents), Error> {
    let scene = &*if parameters.is_empty() { Cow::Borrowed(scene) } else { scene.expanded()? };
    let parameters = resolve(scene, parameters)?;
    let mut applied = Apply {
        scene: scene.clone(),
        tangents: Tangents {
            names: parameters.iter().map(|p| p.name.clone()).collect(),
            ..Tangents::default()
        },
        parameters: &parameters,
        given: scene,
    };
    for i in 0..scene.shapes.len() {
        applied.shape(i)?;
    }
    for i in 0..scene.media.len() {
        applied.medium(i)?;
    }
    for i in 0..scene.bsdfs.len() {
        applied.bsdf(i)?;
    }
    for i in 0..scene.emitters.len() {
        applied.emitter(i)?;
    }
    for i in 0..scene.sensors.len() {
        let tangents = applied.sensor(i)?;
        applied.tangents.sensors.push(tangents);
    }
    applied.tangents.texels.retain(|t| !t.tangent.is_zero());
    Ok((applied.scene, applied.tangents))
}

struct Apply<'a> {
    scene: Scene,
    tangents: Tangents,
    parameters: &'a [Parameter<Target>],
    /// The scene before the changes.
    given: &'a Scene,
}

impl Apply<'_> {
    fn fail(&self, parameter: usize, target: Target, reason: impl Into<EffectError>) -> Error {
        effect_error(&self.parameters[parameter], &self.scene.name_of(target), reason.into())
    }

    fn geometry(&self, target: Target) -> Result<Vec<Applied<'_, GeometryChange>>, Error> {
        geometry_changes(self.parameters, &target)
            .map_err(|e| self.fail(e.parameter, target, e.cause))
    }

    fn shape(&mut self, i: usize) -> Result<(), Error> {
        let target = Target::Shape(i);
        let changes = self.geometry(target)?;
        let (mut motions, mut smooth) = (Vec::new(), None);
        if !changes.is_empty() {
            let moved = move_mesh(&self.scene.shapes[i].mesh, &changes, self.parameters.len())
                .map_err(|e| self.fail(e.parameter, target, e.cause))?;
            motions = keep(moved.motions, |m| !m.is_rest());
            smooth = moved.smooth;
            // What has not moved yet stays what it is to the last bit.
            let rests = |c: &Applied<'_, GeometryChange>| {
                c.theta == 0.0 && c.change.affine(c.theta).is_some()
            };
            if !changes.iter().all(rests) {
                self.scene.shapes[i].mesh = Arc::new(moved.mesh);
            }
        }
        let mesh = &self.scene.shapes[i].mesh;
        self.tangents.reached.push(ReachedTriangles::new(mesh, motions.iter().map(|(_, m)| m)));
        self.tangents.shapes.push(motions);
        self.tangents.smooth.push(smooth);
        Ok(())
    }

    fn medium(&mut self, i: usize) -> Result<(), Error> {
        let target = Target::Medium(i);
        let mut tangents = alloc::vec![MediumTangent::zero(); self.parameters.len()];
        // Who may have taken a property out of its range: effects together may leave it in.
        let mut pushed: Vec<(usize, drt_medium::Property)> = Vec::new();
        let parameters = self.parameters;
        for (p, parameter, change) in effects_on(parameters, target) {
            let theta = parameter.value;
            let Change::Property(change) = change else { continue };
            if change.texels.is_some() {
                return Err(self.fail(p, target, EffectError::NoTexels));
            }
            let change = self.medium_change(p, target, change)?;
            for t in &mut tangents {
                t.push_through(&change, theta);
            }
            let medium = &mut self.scene.media[i].item;
            let own = medium.apply(&change, theta).and_then(|()| medium.tangent(&change, theta));
            let own = own.map_err(|e| self.fail(p, target, e))?;
            tangents[p] = tangents[p].clone().plus(&own);
            if let Some(property) = change.pushes(theta) {
                pushed.retain(|(_, other)| *other != property);
                pushed.push((p, property));
            }
        }
        for (p, property) in pushed {
            let checked = self.scene.media[i].item.check(property);
            checked.map_err(|e| self.fail(p, target, e))?;
        }
        // Coefficients do not depend on where they are: what moves the grids can come last.
        self.move_grids(i, &mut tangents)?;
        self.tangents.media.push(keep(tangents, |t| !t.is_zero()));
        Ok(())
    }

    fn move_grids(&mut self, i: usize, tangents: &mut [MediumTangent]) -> Result<(), Error> {
        let target = Target::Medium(i);
        let changes = self.geometry(target)?;
        let Some(first) = changes.first().map(|c| c.parameter) else { return Ok(()) };
        let n = self.parameters.len();
        let mut medium = self.scene.media[i].item.clone();
        match (self.deforming_leader(target)?, medium.carried_bounds()) {
            (Some(_), _) if medium.phase.sggx().is_some() => {
                return Err(self.fail(first, target, drt_medium::MediumError::SggxMotion));
            }
            (Some(leader), Some(bounds)) => {
                let shape = &self.given.shapes[leader].mesh;
                let deformation =
                    GridDeformation::new(bounds, shape, &changes, n).map_err(|e| match e {
                        GridDeformationError::Motion(e) => self.fail(e.parameter, target, e.cause),
                        GridDeformationError::Shape(p, reason) => self.fail(p, target, reason),
                    })?;
                for (p, t) in tangents.iter_mut().enumerate() {
                    t.flows.extend(Some(deformation.flow(p)).filter(|flow| !flow.is_zero()));
                }
                deformation.apply(&mut medium).map_err(|e| self.fail(first, target, e))?;
            }
            // Surfaces bound it; it has nothing of its own that could deform.
            (Some(_), None) if medium.homogeneous().is_some() => {}
            (Some(_), None) => {
                return Err(self.fail(first, target, drt_medium::MediumError::CustomField));
            }
            (None, _) => {
                let frame = move_affine(&changes, n)
                    .map_err(|e| self.fail(e.parameter, target, e.cause))?;
                medium.place(&frame.map).map_err(|e| self.fail(first, target, e))?;
                if medium.is_carried() {
                    for (t, velocity) in tangents.iter_mut().zip(&frame.velocities) {
                        t.velocity = *velocity;
                    }
                    for (p, t) in tangents.iter().enumerate() {
                        medium.admits(&t.velocity).map_err(|e| self.fail(p, target, e))?;
                    }
                }
            }
        }
        self.scene.media[i].item = medium;
        Ok(())
    }

    /// The shape that a target follows while it deforms.
    fn deforming_leader(&self, target: Target) -> Result<Option<usize>, Error> {
        let mut found: Option<usize> = None;
        for (p, parameter) in self.parameters.iter().enumerate() {
            let deforms = |leader: &Target| {
                let of = parameter.effects.iter().filter(|e| e.target == *leader);
                let changes = of.filter_map(|e| match &e.change {
                    Change::Geometry(g) => Some(g),
                    _ => None,
                });
                changes.into_iter().any(|g| g.affine(parameter.value).is_none())
            };
            for leader in leaders(parameter, target).into_iter().filter(deforms) {
                let Target::Shape(shape) = leader else {
                    return Err(self.fail(p, leader, drt_motion::Cause::NotAffine));
                };
                if found.is_some_and(|other| other != shape) {
                    return Err(self.fail(p, target, EffectError::TwoLeaders));
                }
                found = Some(shape);
            }
        }
        Ok(found)
    }

    /// What a property effect does to a medium.
    fn medium_change(
        &self,
        p: usize,
        target: Target,
        change: &PropertyChange,
    ) -> Result<MediumChange, Error> {
        let PropertyChange { op, voxels, .. } = *change;
        let property = drt_medium::Property::from_name(&change.property).ok_or_else(|| {
            self.fail(p, target, EffectError::MediumProperty(change.property.clone()))
        })?;
        Ok(MediumChange::Value { property, op, voxels })
    }

    fn bsdf(&mut self, i: usize) -> Result<(), Error> {
        let target = Target::Bsdf(i);
        let mut tangents = alloc::vec![BsdfTangent::zeros(self.scene.bsdfs[i].item.differentiated()); self.parameters.len()];
        let parameters = self.parameters;
        for (p, parameter, change) in effects_on(parameters, target) {
            let Change::Property(c) = change else {
                return Err(self.fail(p, target, EffectError::NotMovable));
            };
            if c.voxels.is_some() {
                return Err(self.fail(p, target, EffectError::NoVoxels));
            }
            let theta = parameter.value;
            let bsdf = &self.scene.bsdfs[i].item;
            let property = bsdf.named_property(&c.property).map_err(|e| self.fail(p, target, e))?;
            let change = BsdfChange { property, op: c.op };
            let refused = bsdf.undifferentiated(property).map(|reason| {
                let bsdf = bsdf.name();
                self.fail(p, target, SurfaceError::NotDifferentiated { bsdf, property, reason })
            });
            self.tangents.refused = self.tangents.refused.take().or(refused);
            let bsdf = &mut self.scene.bsdfs[i].item;
            let texels = bsdf.change_texels(&change, c.texels.and_then(Texels::one), theta);
            if let Some((change, rates)) = texels.map_err(|e| self.fail(p, target, e))? {
                let of = TextureUse::Bsdf(i, property);
                add_texels(&mut self.tangents.texels, of, p, &change, rates);
                continue;
            }
            if c.texels.is_some() {
                let reason = TexelError::NoTexture(c.property.clone());
                return Err(self.fail(p, target, SurfaceError::Texels(reason)));
            }
            let bsdf = &mut self.scene.bsdfs[i].item;
            let own = bsdf.tangent(&change, theta);
            let own = own.and_then(|t| bsdf.apply(&change, theta).map(|()| t));
            let own = own.map_err(|e| self.fail(p, target, e))?;
            for t in &mut tangents {
                change.carry(t, theta);
            }
            tangents[p].scatter(&own, Rgb::ONE);
        }
        self.tangents.bending.push(self.scene.bsdfs[i].item.bends());
        self.tangents.bsdfs.push(keep(tangents, |t| !t.is_zero()));
        Ok(())
    }

    fn emitter(&mut self, i: usize) -> Result<(), Error> {
        let target = Target::Emitter(i);
        let given = self.scene.emitters[i].item.emitter.clone();
        let emitter = given.checked().map_err(|e| Error::Element {
            element: self.scene.name_of(target),
            reason: e.into(),
        })?;
        let changes = self.geometry(target)?;
        let turns = matches!(emitter, Emitter::Envmap { .. });
        let is_turn = |c: &&Applied<'_, _>| matches!(c.change, GeometryChange::Rotate { .. });
        if let Some(other) = changes.iter().find(|c| turns && !is_turn(c)) {
            return Err(self.fail(other.parameter, target, EmitterError::OnlyTurns));
        }
        let placeless = !turns && (emitter.is_environment() || emitter.is_area());
        if let Some(first) = changes.first().filter(|_| placeless) {
            return Err(self.fail(first.parameter, target, EffectError::NoPlace));
        }
        let (mut emitter, tangents) = self.placed(target, emitter)?;
        let parameters = self.parameters;
        for (p, parameter, change) in effects_on(parameters, target) {
            let Change::Property(PropertyChange { property, op, texels: Some(texels), .. }) =
                change
            else {
                continue;
            };
            emitter.property(property).map_err(|e| self.fail(p, target, e))?;
            let found = emitter.change_texels(texels.one(), *op, parameter.value);
            let (change, rates) = found.map_err(|e| self.fail(p, target, e))?;
            let of = TextureUse::Emitter(i);
            add_texels(&mut self.tangents.texels, of, p, &change, rates);
        }
        let changes =
            effects_on(parameters, target).filter(|(.., c)| matches!(c, Change::Property(_)));
        if let Some((p, ..)) = changes.last() {
            emitter.validate().map_err(|e| self.fail(p, target, e))?;
        }
        self.scene.emitters[i].item.emitter = emitter;
        self.tangents.emitters.push(keep(tangents, |t| !t.is_zero()));
        Ok(())
    }

    fn sensor(&mut self, i: usize) -> Result<Vec<(usize, SensorTangent)>, Error> {
        let given = self.scene.sensors[i].item.sensor.clone();
        let (sensor, tangents) = self.placed(Target::Sensor(i), given)?;
        self.scene.sensors[i].item.sensor = sensor;
        Ok(keep(tangents, |t| !t.is_zero()))
    }

    /// An emitter or sensor at the parameters' values, with its rate of change by each.
    fn placed<T: Placed>(
        &self,
        target: Target,
        mut item: T,
    ) -> Result<(T, Vec<T::Tangent>), Error> {
        let n = self.parameters.len();
        let mut tangents = alloc::vec![T::Tangent::default(); n];
        let changes = self.geometry(target)?;
        if let Some(first) = changes.first() {
            let frame =
                move_affine(&changes, n).map_err(|e| self.fail(e.parameter, target, e.cause))?;
            item =
                item.at(&frame.map).map_err(|reason| self.fail(first.parameter, target, reason))?;
            for (t, v) in tangents.iter_mut().zip(&frame.velocities) {
                item.check_rate(v).map_err(|reason| self.fail(first.parameter, target, reason))?;
                *t += item.rate(v);
            }
        }
        self.properties(target, |property, changed| {
            let before = item.value(property)?;
            item = item.with(property, changed.map.value(before))?;
            for (t, rate) in tangents.iter_mut().zip(&changed.rates) {
                *t += item.rate_of(property, rate.value(before))?;
            }
            Ok(())
        })?;
        Ok((item, tangents))
    }

    /// Calls `change` for each property that effects on the target name.
    fn properties(
        &self,
        target: Target,
        mut change: impl FnMut(&str, &drt_motion::parameter::ChangedValue) -> Result<(), EffectError>,
    ) -> Result<(), Error> {
        let mut done: Vec<&str> = Vec::new();
        for (p, _, effect) in effects_on(self.parameters, target) {
            let Change::Property(c) = effect else { continue };
            if done.contains(&c.property.as_str()) {
                continue;
            }
            if c.voxels.is_some() {
                return Err(self.fail(p, target, EffectError::NoVoxels));
            }
            match target {
                // That is another matter.
                Target::Emitter(_) if c.texels.is_some() => continue,
                _ if c.texels.is_some() => {
                    return Err(self.fail(p, target, EffectError::NoTexels));
                }
                _ => done.push(&c.property),
            }
            let mut changes =
                drt_motion::parameter::property_changes(self.parameters, &target, &c.property);
            changes.retain(|c| c.change.texels.is_none());
            let changed = change_value(&changes, None, self.parameters.len())
                .map_err(|e| self.fail(e.parameter, target, e.cause))?;
            change(&c.property, &changed).map_err(|reason| self.fail(p, target, reason))?;
        }
        Ok(())
    }
}

/// What has a frame and named numbers: emitters and sensors.
trait Placed: Sized {
    type Tangent: Clone + Default + AddAssign;
    fn at(&self, map: &Affine) -> Result<Self, EffectError>;
    /// Whether it stays what it is under a velocity field.
    fn check_rate(&self, _field: &Affine) -> Result<(), EffectError> {
        Ok(())
    }
    fn rate(&self, field: &Affine) -> Self::Tangent;
    fn value(&self, property: &str) -> Result<Rgb, EffectError>;
    fn with(&self, property: &str, value: Rgb) -> Result<Self, EffectError>;
    fn rate_of(&self, property: &str, rate: Rgb) -> Result<Self::Tangent, EffectError>;
}

macro_rules! placed {
    ($($item:ty => $tangent:ty { $($check:item)* })*) => {$(
        impl Placed for $item {
            type Tangent = $tangent;
            fn at(&self, map: &Affine) -> Result<Self, EffectError> {
                self.moved(map).map_err(Into::into)
            }
            $($check)*
            fn rate(&self, field: &Affine) -> $tangent {
                self.velocity(field)
            }
            fn value(&self, property: &str) -> Result<Rgb, EffectError> {
                self.property(property).map_err(Into::into)
            }
            fn with(&self, property: &str, value: Rgb) -> Result<Self, EffectError> {
                self.with_property(property, value).map_err(Into::into)
            }
            fn rate_of(&self, property: &str, rate: Rgb) -> Result<$tangent, EffectError> {
                self.property_tangent(property, rate).map_err(Into::into)
            }
        }
    )*};
}

placed! {
    Emitter => EmitterTangent {}
    Sensor => SensorTangent {
        fn check_rate(&self, field: &Affine) -> Result<(), EffectError> {
            self.check_velocity(field).map_err(Into::into)
        }
    }
}

/// The entries to keep, with their parameters' indices.
fn keep<T>(items: Vec<T>, kept: impl Fn(&T) -> bool) -> Vec<(usize, T)> {
    items.into_iter().enumerate().filter(|(_, t)| kept(t)).collect()
}
