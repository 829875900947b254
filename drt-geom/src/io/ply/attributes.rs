//! Properties of vertices and faces that become attributes of the mesh.

use alloc::string::String;
use alloc::vec::Vec;

use super::header::Element;

/// The columns of one attribute: one, or three.
pub(super) struct Columns {
    pub(super) name: String,
    columns: Vec<usize>,
}

impl Columns {
    /// The attributes among an element's properties, as Mitsuba names them: `r g b` or `red green blue` are a `color`; others
    /// are columns that follow each other and are called alike but for what comes after the last underscore.
    pub(super) fn of(element: &Element, prefix: &str) -> Vec<Self> {
        let properties = &element.properties;
        let column = |name: &str| properties.iter().position(|p| p.name == name && !p.is_list());
        let colour = [["r", "g", "b"], ["red", "green", "blue"]]
            .iter()
            .find_map(|names| names.iter().map(|n| column(n)).collect::<Option<Vec<usize>>>());
        let named = |name: &str| alloc::format!("{prefix}_{name}");
        let mut found: Vec<Self> =
            colour.into_iter().map(|columns| Self { name: named("color"), columns }).collect();
        let mut last = None;
        for (i, property) in properties.iter().enumerate() {
            let stem = property.name.rsplit_once('_').map(|(stem, _)| stem);
            match stem.filter(|_| !property.is_list()) {
                Some(stem) if last == Some(stem) => {
                    if let Some(attribute) = found.last_mut() {
                        attribute.columns.push(i);
                    }
                }
                Some(stem) => found.push(Self { name: named(stem), columns: alloc::vec![i] }),
                None => {}
            }
            last = stem;
        }
        found.retain(|a| matches!(a.columns.len(), 1 | 3));
        found
    }

    /// The value in a row, the same in all channels where there is one.
    pub(super) fn value(&self, row: &[Vec<f64>]) -> [f32; 3] {
        core::array::from_fn(|c| {
            let column = self.columns[c.min(self.columns.len() - 1)];
            row[column].first().map_or(f32::NAN, |v| *v as f32)
        })
    }
}
