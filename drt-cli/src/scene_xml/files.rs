//! The files that a scene is read from.

use std::path::{Path, PathBuf};

use super::element::Element;

/// The scene's own file, those included, and all that its elements name.
pub(super) fn of_scene(path: &Path, included: Vec<PathBuf>, root: &Element) -> Vec<PathBuf> {
    fn visit(e: &Element, found: &mut Vec<PathBuf>) {
        found.extend(e.file().and_then(Result::ok));
        e.children.iter().for_each(|child| visit(child, found));
    }
    let mut found = included;
    found.push(path.into());
    visit(root, &mut found);
    found.sort();
    found.dedup();
    found
}
