//! A scene with groups of unknowns, at any of their values.

use alloc::borrow::Cow;
use alloc::sync::Arc;
use alloc::vec::Vec;

use crate::fit::group::Group;
use crate::model::error::{Error, SettingError};
use crate::model::scene::{Scene, Target};
use crate::model::sensor::Sensor;

/// A scene and groups of its unknowns, which can be given other values.
///
/// What is set depends on the values alone, and not on those that were set before.
#[derive(Clone, Debug)]
pub struct GroupedScene {
    given: Scene,
    scene: Scene,
    groups: Vec<Group>,
    /// The values of each group; `None` where they are those of the given scene.
    values: Vec<Option<Arc<[f64]>>>,
}

impl GroupedScene {
    /// Groups that were made for the scene `given`, at the values that they have there.
    #[must_use]
    pub fn new(given: Scene, groups: Vec<Group>) -> Self {
        let values = alloc::vec![None; groups.len()];
        Self { scene: given.clone(), given, groups, values }
    }

    /// The scene as it was given.
    #[must_use]
    pub fn given(&self) -> &Scene {
        &self.given
    }

    /// The scene at the present values.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// All groups.
    #[must_use]
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// The present values of a group, in the order of [`Group::values`]; `None` where there is no such group.
    #[must_use]
    pub fn values(&self, group: usize) -> Option<Cow<'_, [f64]>> {
        Some(match self.values.get(group)? {
            Some(values) => Cow::Borrowed(&**values),
            None => Cow::Owned(self.groups[group].values(&self.given)),
        })
    }

    /// Gives the scene another sensor in the place of one of its own, whose index is given; nothing happens where there is
    /// no such sensor.
    pub fn set_sensor(&mut self, index: usize, sensor: Sensor) {
        for scene in [&mut self.given, &mut self.scene] {
            if let Some(known) = scene.sensors.get_mut(index) {
                known.item.sensor = sensor.clone();
            }
        }
    }

    /// Gives some groups, which are named by their numbers, other values.
    ///
    /// # Errors
    /// When there is no such group, the number of values is wrong, one is out of its range, or two groups decide the
    /// same values; everything then stays as it was.
    pub fn set(&mut self, changes: &[(usize, &[f64])]) -> Result<(), Error> {
        let count = self.groups.len();
        if let Some((index, _)) = changes.iter().find(|(group, _)| *group >= count) {
            let reason = SettingError::NoGroup { index: *index, count };
            return Err(Error::Setting { setting: "group", reason });
        }
        Group::check_together(&self.groups)?;
        let mut after = self.values.clone();
        for (group, values) in changes {
            // What is given need not be computed anew, which would change its last bits.
            let given = self.groups[*group].values(&self.given) == *values;
            after[*group] = (!given).then(|| (*values).into());
        }
        let changed =
            |group: &Group| changes.iter().any(|(g, _)| self.groups[*g].target == group.target);
        let mut scene = self.scene.clone();
        // From what was given, so that nothing depends on values on the way.
        for group in self.groups.iter().filter(|group| changed(group)) {
            reset(&mut scene, &self.given, group.target);
        }
        for (group, values) in self.groups.iter().zip(&after).filter(|(group, _)| changed(group)) {
            if let Some(values) = values {
                group.apply(&self.given, values, &mut scene)?;
            }
        }
        self.values = after;
        self.scene = scene;
        Ok(())
    }
}

/// Makes of an item what it was.
fn reset(scene: &mut Scene, given: &Scene, target: Target) {
    match target {
        Target::Shape(s) => scene.shapes[s].mesh = given.shapes[s].mesh.clone(),
        Target::Medium(m) | Target::Coefficients(m) => {
            scene.media[m].item = given.media[m].item.clone()
        }
        Target::Bsdf(b) => scene.bsdfs[b].item = given.bsdfs[b].item.clone(),
        Target::Emitter(e) => scene.emitters[e].item = given.emitters[e].item.clone(),
        Target::Sensor(_) => {}
    }
}
