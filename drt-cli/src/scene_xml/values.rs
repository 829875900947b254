//! References to textures and spectra: each is replaced by a copy of what it means, so that nothing
//! after this need know where a value was written.

use std::collections::HashMap;

use super::element::{Element, MAX_ELEMENTS, MAX_NESTING};
use crate::CliError;

/// Tags of things that are nothing but values.
const VALUES: [&str; 5] = ["texture", "spectrum", "rgb", "srgb", "volume"];

/// Aliases of aliases beyond this length are taken for a circle.
pub(super) const MAX_ALIASES: usize = 64;

/// Replaces the references to values in a whole scene.
///
/// # Errors
/// Values that refer to themselves, or to so many others that the scene gets too large.
pub(super) fn substitute(root: &mut Element) -> Result<(), CliError> {
    let mut values =
        Values { by_id: HashMap::new(), aliases: HashMap::new(), open: Vec::new(), copies: 0 };
    values.collect(root);
    if values.by_id.is_empty() { Ok(()) } else { values.replace(root, 0) }
}

struct Values {
    by_id: HashMap<String, Element>,
    aliases: HashMap<String, String>,
    /// Ids of the values that are being filled in, outermost first.
    open: Vec<String>,
    /// Elements made so far.
    copies: usize,
}

impl Values {
    fn collect(&mut self, e: &Element) {
        for child in &e.children {
            let [id, name] = ["id", "as"].map(|key| child.attribute(key));
            match (child.tag.as_str(), id, name) {
                ("alias", Some(id), Some(name)) => {
                    self.aliases.entry(name.into()).or_insert_with(|| id.into());
                }
                (tag, Some(id), _) if VALUES.contains(&tag) => {
                    self.by_id.entry(id.into()).or_insert_with(|| child.clone());
                }
                _ => {}
            }
            self.collect(child);
        }
    }

    /// Replaces the references inside an element that is itself inside so many.
    fn replace(&mut self, e: &mut Element, depth: usize) -> Result<(), CliError> {
        if depth > MAX_NESTING {
            let message =
                format!("with what references mean, elements nest deeper than {MAX_NESTING}");
            return Err(e.error(message));
        }
        for child in &mut e.children {
            // The volumes of media are looked up where these are read.
            let may_be = |id: &String| e.tag == "texture" || self.by_id[id].tag != "volume";
            match self.meant(child).filter(may_be) {
                Some(id) => *child = self.copy(&id, child, depth)?,
                None => self.replace(child, depth + 1)?,
            }
        }
        Ok(())
    }

    /// The id of the value that a reference means.
    fn meant(&self, e: &Element) -> Option<String> {
        let mut id = e.id().filter(|_| e.tag == "ref")?;
        for _ in 0..MAX_ALIASES {
            if self.by_id.contains_key(id) {
                return Some(id.into());
            }
            id = self.aliases.get(id)?;
        }
        None
    }

    /// A copy of a value under the name of the reference, in its place.
    fn copy(&mut self, id: &str, at: &Element, depth: usize) -> Result<Element, CliError> {
        at.only_attributes(&["id", "name"])?;
        if self.open.iter().any(|o| o == id) {
            return Err(at.error(format!("`{id}` refers to itself")));
        }
        let mut copy = self.by_id[id].clone();
        copy.call(at.attribute("name"));
        self.copies += copy.count();
        if self.copies > MAX_ELEMENTS {
            return Err(at.error(format!("references stand for more than {MAX_ELEMENTS} elements")));
        }
        self.open.push(id.into());
        self.replace(&mut copy, depth + 1)?;
        self.open.pop();
        Ok(copy)
    }
}
