//! The stored finite differences of a stage.

use super::{Cell, Stage};
use crate::Result;
use crate::reference::{self, Reference, Wanted, fingerprint};

/// A stored reference takes this many times the samples that a cell asks for.
const LENGTH: u32 = 4;

/// The finite difference of a cell as it is stored.
///
/// # Errors
/// When the library rejects the scene or the parameter.
pub fn long(stage: &Stage, cell: &Cell, seed: u64) -> Result<Reference> {
    let Cell { parameter, step, .. } = cell;
    let reference =
        Reference::by_differences(&stage.scene, parameter, *step, cell.samples * LENGTH, seed)?;
    Ok(reference.standing_for(of(stage, cell)))
}

/// The finite difference of a cell with as many samples as it asks for.
///
/// # Errors
/// When the library rejects the scene or the parameter.
pub fn short(stage: &Stage, cell: &Cell) -> Result<Reference> {
    let Cell { parameter, step, samples, .. } = cell;
    Reference::by_differences(&stage.scene, parameter, *step, *samples, reference::SEED)
}

/// The stored references of a stage's cells, in their order.
///
/// # Errors
/// When one is missing, cannot be read, or stands for another scene than the stage has.
pub fn stored(stage: &Stage) -> Result<Vec<Reference>> {
    let wanted = stage.cells.iter().map(|cell| Wanted {
        name: &cell.parameter.name,
        fingerprint: of(stage, cell),
        samples: Some(cell.samples * LENGTH),
    });
    reference::stored(stage.name, &wanted.collect::<Vec<_>>())
}

fn of(stage: &Stage, cell: &Cell) -> u64 {
    fingerprint(stage.name, &stage.scene, &cell.parameter, cell.step)
}
