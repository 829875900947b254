//! A number that changes when a scene, or what is differentiated in it, does.
//!
//! It is a hash of all numbers of the scene and of the parameter in the order of their text form, and of what these are called.
//! Numbers are rounded, so that elementary functions of another platform give the same; names of types and fields do not
//! count, and the numbers of surfaces are sorted, so that moving code leaves references valid.

use drt_estimators::Scene;
use drt_motion::Parameter;

/// Significant digits of the numbers that are compared.
const DIGITS: usize = 8;

/// Numbers below this are zero but for rounding.
const ZERO: f64 = 1e-12;

/// The fingerprint of a scene, of a parameter of it, and of the step of finite differences.
#[must_use]
pub fn fingerprint(name: &str, scene: &Scene, parameter: &Parameter, step: f64) -> u64 {
    let mut hash = Hash::new();
    let in_order = [
        format!("{:?}", scene.shapes),
        format!("{:?}", scene.emitters),
        format!("{:?}", scene.media),
        format!("{:?}", scene.sensors),
        format!("{:?}", scene.integrator),
        format!("{:?} {:?}", parameter.effects, parameter.value),
        format!("{step:?}"),
    ];
    for text in in_order {
        numbers(&text).iter().for_each(|n| hash.add(n));
        hash.add(";");
    }
    let mut surfaces = numbers(&format!("{:?}", scene.bsdfs));
    surfaces.sort_unstable();
    surfaces.iter().for_each(|n| hash.add(n));
    hash.add(&format!("{name} {}", parameter.name));
    hash.0
}

/// The numbers in a text, rounded.
fn numbers(text: &str) -> Vec<String> {
    let is_part = |c: char| c.is_ascii_alphanumeric() || "+-._".contains(c);
    let words = text.split(|c: char| !is_part(c));
    words.filter_map(|word| word.parse::<f64>().ok()).map(rounded).collect()
}

fn rounded(number: f64) -> String {
    if number.abs() < ZERO { "0".into() } else { format!("{number:.*e}", DIGITS - 1) }
}

/// The hash FNV-1a.
struct Hash(u64);

impl Hash {
    const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, word: &str) {
        for byte in word.bytes().chain([b' ']) {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Result;
    use crate::matrix::{Cell, Stage, surfaces};

    fn of(stage: &Stage, cell: &Cell) -> u64 {
        fingerprint(stage.name, &stage.scene, &cell.parameter, cell.step)
    }

    #[test]
    fn what_changes_a_scene_changes_its_fingerprint() -> Result<()> {
        let stage = surfaces::room()?;
        let (cell, other) = (&stage.cells[0], &stage.cells[1]);
        let original = of(&stage, cell);
        assert_eq!(original, of(&surfaces::room()?, cell));
        assert_ne!(original, of(&stage, other));
        assert_ne!(original, of(&stage, &cell.clone().step(0.07)));
        assert_ne!(original, of(&stage, &cell.clone().at(0.1)));
        let changed = |change: &dyn Fn(&mut Stage)| {
            let mut stage = stage.clone();
            change(&mut stage);
            of(&stage, cell)
        };
        let edits: [&dyn Fn(&mut Stage); 4] = [
            &|s| s.scene.shapes.truncate(2),
            &|s| s.scene.integrator.max_depth = Some(9),
            &|s| s.scene.bsdfs[0] = s.scene.bsdfs[1].clone(),
            &|s| std::sync::Arc::make_mut(&mut s.scene.shapes[0].mesh).positions[0].x += 1e-5,
        ];
        for edit in edits {
            assert_ne!(original, changed(edit));
        }
        // Rounding does not count.
        let round = |s: &mut Stage| {
            std::sync::Arc::make_mut(&mut s.scene.shapes[0].mesh).positions[0].x *= 1.0 + 1e-15;
        };
        assert_eq!(original, changed(&round));
        Ok(())
    }
}
