//! Parameters as data: a name, a value, and lists of effects on geometry and on properties.

use alloc::string::String;
use alloc::vec::Vec;

use crate::error::{Cause, MotionError};

mod geometry;
mod property;

pub use geometry::GeometryChange;

pub use property::{ChangedValue, PropertyChange, Texels, change_value};

/// One scalar unknown of a scene, theta: a name, the value it has now, and all it changes.
///
/// `T` names the things that change. Job files use string ids; a program that embeds the renderer
/// may use its own handles.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Parameter<T = String> {
    /// Name of the derivative with respect to this parameter.
    pub name: String,
    /// theta, where derivatives are taken.
    pub value: f64,
    /// What changes with theta, in the order of application.
    pub effects: Vec<Effect<T>>,
}

impl<T> Parameter<T> {
    /// A parameter of value 0 that changes nothing yet.
    ///
    /// ```
    /// use drt_motion::drt_math::{Rgb, ValueChange, Vec3};
    /// use drt_motion::{GeometryChange, Parameter, PropertyChange};
    ///
    /// let lift: Parameter = Parameter::new("lift")
    ///     .at(0.5)
    ///     .effect("square", GeometryChange::Translate(Vec3::Z))
    ///     .effect("lamp", PropertyChange::new("intensity", ValueChange::Add(Rgb::ONE)));
    /// assert_eq!((lift.value, lift.effects.len()), (0.5, 2));
    /// ```
    #[must_use]
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), value: 0.0, effects: Vec::new() }
    }

    /// The parameter at another value of theta.
    #[must_use]
    pub fn at(self, value: f64) -> Self {
        Self { value, ..self }
    }

    /// The parameter with a further effect, which is applied after those before it.
    #[must_use]
    pub fn effect(mut self, target: impl Into<T>, change: impl Into<Change<T>>) -> Self {
        self.effects.push(Effect { target: target.into(), change: change.into() });
        self
    }
}

/// One thing that changes with a parameter.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Effect<T = String> {
    /// What changes.
    pub target: T,
    /// How it changes.
    pub change: Change<T>,
}

/// How a target changes with theta.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Change<T = String> {
    /// It moves or deforms.
    Geometry(GeometryChange),
    /// One of its numbers changes.
    Property(PropertyChange),
    /// It follows whatever this same parameter does to the geometry of another target.
    Follow(T),
}

impl<T> From<GeometryChange> for Change<T> {
    fn from(change: GeometryChange) -> Self {
        Self::Geometry(change)
    }
}

impl<T> From<PropertyChange> for Change<T> {
    fn from(change: PropertyChange) -> Self {
        Self::Property(change)
    }
}

/// A change at a value of its parameter, ready to be applied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Applied<'a, C> {
    /// Index of the parameter in the list of all parameters.
    pub parameter: usize,
    /// The parameter's value.
    pub theta: f64,
    /// What it does.
    pub change: &'a C,
}

impl Applied<'_, GeometryChange> {
    pub(crate) fn error(&self, cause: Cause) -> MotionError {
        MotionError { parameter: self.parameter, change: self.change.kind(), cause }
    }
}

/// Everything that moves `target`, in the order of application: parameters in the order given,
/// each parameter's effects in theirs.
///
/// `Follow` stands for the geometric changes that the same parameter makes to the followed target,
/// inserted at its place.
///
/// # Errors
/// When targets of one parameter follow each other in a circle.
pub fn geometry_changes<'a, T: PartialEq>(
    parameters: &'a [Parameter<T>],
    target: &T,
) -> Result<Vec<Applied<'a, GeometryChange>>, MotionError> {
    let mut changes = Vec::new();
    for (index, parameter) in parameters.iter().enumerate() {
        // A chain longer than the number of effects must visit one of them twice.
        parameter.collect(index, target, parameter.effects.len(), &mut changes)?;
    }
    Ok(changes)
}

/// Everything that changes the property `name` of `target`, in the order of application, with the
/// voxels it is confined to.
pub fn property_changes<'a, T: PartialEq>(
    parameters: &'a [Parameter<T>],
    target: &T,
    name: &str,
) -> Vec<Applied<'a, PropertyChange>> {
    let mut changes = Vec::new();
    for (index, parameter) in parameters.iter().enumerate() {
        for effect in parameter.effects.iter().filter(|e| e.target == *target) {
            match &effect.change {
                Change::Property(change) if change.property == name => {
                    changes.push(Applied { parameter: index, theta: parameter.value, change });
                }
                _ => {}
            }
        }
    }
    changes
}

impl<T: PartialEq> Parameter<T> {
    fn collect<'a>(
        &'a self,
        index: usize,
        target: &T,
        follows_left: usize,
        changes: &mut Vec<Applied<'a, GeometryChange>>,
    ) -> Result<(), MotionError> {
        for effect in self.effects.iter().filter(|e| e.target == *target) {
            match &effect.change {
                Change::Geometry(change) => {
                    changes.push(Applied { parameter: index, theta: self.value, change });
                }
                Change::Follow(_) if follows_left == 0 => {
                    return Err(MotionError {
                        parameter: index,
                        change: "follow",
                        cause: Cause::FollowCycle,
                    });
                }
                Change::Follow(leader) => {
                    self.collect(index, leader, follows_left - 1, changes)?;
                }
                Change::Property(_) => {}
            }
        }
        Ok(())
    }
}
