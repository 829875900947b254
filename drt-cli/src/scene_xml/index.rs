//! Who is called what, and in which order things are counted.

use std::collections::{HashMap, HashSet};

use super::element::Element;
use super::properties::Properties;
use super::values::MAX_ALIASES;
use crate::CliError;

/// The kinds of things that jobs can address, by tag.
const COUNTED: [&str; 5] = ["shape", "bsdf", "medium", "emitter", "sensor"];

/// The elements of a scene by id and by order.
pub(super) struct Index<'a> {
    by_id: HashMap<&'a str, &'a Element>,
    aliases: HashMap<&'a str, &'a str>,
    /// Per counted tag, its elements in document order.
    ordered: HashMap<&'static str, Vec<&'a Element>>,
    /// The place of an element among those of its tag.
    positions: HashMap<usize, usize>,
    /// Ordinals of what the image depends on: what stands in the scene by itself, and what that has in it or refers to.
    used: HashSet<usize>,
    /// BSDFs inside others that something refers to.
    referred: Vec<&'a Element>,
}

/// Tags of what counts where it stands, whether something refers to it or not.
const BY_THEMSELVES: [&str; 4] = ["shape", "emitter", "sensor", "integrator"];

/// Something inside an element: nested there, or referred to.
#[derive(Clone, Copy)]
pub(super) struct Inner<'a> {
    /// The child itself: the element or the reference.
    pub(super) child: &'a Element,
    /// The element meant.
    pub(super) target: &'a Element,
}

impl<'a> Index<'a> {
    pub(super) fn new(root: &'a Element) -> Result<Self, CliError> {
        let mut index = Self {
            by_id: HashMap::new(),
            aliases: HashMap::new(),
            ordered: COUNTED.into_iter().map(|tag| (tag, Vec::new())).collect(),
            positions: HashMap::new(),
            used: HashSet::new(),
            referred: Vec::new(),
        };
        index.register(root, true)?;
        index.check_references(root)?;
        index.check_circles(root)?;
        index.mark_used(root);
        Ok(index)
    }

    fn register(&mut self, e: &'a Element, counts: bool) -> Result<(), CliError> {
        for child in &e.children {
            if child.tag == "alias" {
                self.register_alias(e, child)?;
                continue;
            }
            if let Some(id) = child.id().filter(|_| child.tag != "ref") {
                self.check_new(child, id)?;
                self.by_id.insert(id, child);
            }
            let list = self.ordered.get_mut(child.tag.as_str()).filter(|_| counts);
            if let Some(list) = list {
                self.positions.insert(child.ordinal, list.len());
                list.push(child);
            }
            // What a two-sided bsdf is made of is part of it, not a thing of its own.
            self.register(child, counts && child.tag != "bsdf")?;
        }
        Ok(())
    }

    fn register_alias(&mut self, parent: &Element, alias: &'a Element) -> Result<(), CliError> {
        if parent.tag != "scene" {
            return Err(alias.error(format!("not supported inside {parent}")));
        }
        alias.only_attributes(&["id", "as"])?;
        let (id, name) = (alias.required("id")?, alias.required("as")?);
        self.check_new(alias, name)?;
        self.aliases.insert(name, id);
        Ok(())
    }

    fn check_new(&self, e: &Element, id: &str) -> Result<(), CliError> {
        match self.by_id.get(id) {
            Some(first) => {
                let line = first.place.line.unwrap_or(0);
                Err(e.error(format!("the id `{id}` is already taken at line {line}")))
            }
            None if self.aliases.contains_key(id) => {
                Err(e.error(format!("the id `{id}` is already taken by an <alias>")))
            }
            None => Ok(()),
        }
    }

    fn check_references(&self, e: &'a Element) -> Result<(), CliError> {
        for child in &e.children {
            match child.tag.as_str() {
                "ref" => {
                    child.only_attributes(&["id", "name"])?;
                    self.resolve(child, child.required("id")?)?;
                }
                "alias" => {
                    self.resolve(child, child.required("id")?)?;
                }
                _ => self.check_references(child)?,
            }
        }
        Ok(())
    }

    /// Refuses what refers to itself, over others or not.
    fn check_circles(&self, root: &'a Element) -> Result<(), CliError> {
        // Depth first, on a stack of its own: a chain of references may be as long as the scene.
        // Each entry is an element and how many of its children were followed.
        let mut stack = vec![(root, 0)];
        let (mut open, mut done) = (HashSet::from([root.ordinal]), HashSet::new());
        while let Some((e, next)) = stack.last_mut() {
            let Some(child) = e.children.get(*next) else {
                open.remove(&e.ordinal);
                done.insert(e.ordinal);
                stack.pop();
                continue;
            };
            *next += 1;
            let target = match child.tag.as_str() {
                "ref" => self.resolve(child, child.required("id")?)?,
                _ => child,
            };
            if open.contains(&target.ordinal) {
                return Err(child.error(format!("refers to {target}, which it is part of")));
            }
            if !done.contains(&target.ordinal) {
                open.insert(target.ordinal);
                stack.push((target, 0));
            }
        }
        Ok(())
    }

    fn mark_used(&mut self, root: &'a Element) {
        let by_themselves = |e: &&Element| BY_THEMSELVES.contains(&e.tag.as_str());
        let mut open: Vec<&Element> = root.children.iter().filter(by_themselves).collect();
        while let Some(e) = open.pop() {
            if !self.used.insert(e.ordinal) {
                continue;
            }
            for child in &e.children {
                let referred = match child.tag.as_str() {
                    "ref" => child.id().and_then(|id| self.resolve(child, id).ok()),
                    _ => None,
                };
                if let Some(target) = referred.filter(|t| t.tag == "bsdf" && e.tag == "shape")
                    && self.position(target).is_none()
                    && !self.referred.iter().any(|known| known.ordinal == target.ordinal)
                {
                    self.referred.push(target);
                }
                open.push(referred.unwrap_or(child));
            }
        }
    }

    /// Whether the image may depend on an element. One without an id, which nothing could refer to, is taken for one that is meant.
    pub(super) fn is_used(&self, e: &Element) -> bool {
        e.id().is_none() || self.used.contains(&e.ordinal)
    }

    /// The BSDFs inside others that shapes refer to.
    pub(super) fn referred(&self) -> &[&'a Element] {
        &self.referred
    }

    fn resolve(&self, at: &Element, id: &str) -> Result<&'a Element, CliError> {
        let mut name = id;
        for _ in 0..MAX_ALIASES {
            match (self.by_id.get(name), self.aliases.get(name)) {
                (Some(e), _) => return Ok(e),
                (None, Some(next)) => name = next,
                (None, None) => break,
            }
        }
        let mut known: Vec<_> = self.by_id.keys().copied().collect();
        known.sort_unstable();
        let known = if known.is_empty() { "none".into() } else { known.join(", ") };
        Err(at.error(format!("nothing has the id `{id}`; known ids: {known}")))
    }

    /// All elements of a counted tag, in order.
    pub(super) fn all(&self, tag: &str) -> &[&'a Element] {
        self.ordered.get(tag).map_or(&[], Vec::as_slice)
    }

    /// The place of an element among those of its tag.
    pub(super) fn position(&self, e: &Element) -> Option<usize> {
        self.positions.get(&e.ordinal).copied()
    }

    /// Everything of a tag inside a plugin, nested or referred to, in order; with a `name`, only
    /// what carries it.
    pub(super) fn inner(
        &self,
        properties: &Properties<'a>,
        tag: &str,
        name: Option<&str>,
    ) -> Vec<Inner<'a>> {
        let target = |child: &'a Element| match child.tag.as_str() {
            // References were checked when the index was made.
            "ref" => child.id().and_then(|id| self.resolve(child, id).ok()),
            _ => Some(child),
        };
        let wanted = |child: &'a Element| {
            name.is_none_or(|n| child.attribute("name") == Some(n))
                && target(child).is_some_and(|t| t.tag == tag)
        };
        properties
            .children(wanted)
            .into_iter()
            .filter_map(|child| target(child).map(|target| Inner { child, target }))
            .collect()
    }

    /// The only thing of a tag, and of a name where one is given, inside a plugin.
    pub(super) fn single(
        &self,
        properties: &Properties<'a>,
        tag: &str,
        name: Option<&str>,
    ) -> Result<Option<Inner<'a>>, CliError> {
        match *self.inner(properties, tag, name) {
            [] => Ok(None),
            [one] => Ok(Some(one)),
            [_, second, ..] => {
                let called = name.map_or(String::new(), |n| format!(" called `{n}`"));
                let message = format!("{} takes only one {tag}{called}", properties.element);
                Err(second.child.error(message))
            }
        }
    }
}
