//! From text to one tree: parsing, `<default>` and `$name`, `<include>`, `<path>`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use roxmltree::{Document, Node};

use super::dialect::Dialect;
use super::element::{Element, MAX_ELEMENTS, MAX_NESTING};
use super::notes::Notes;
use super::values;
use crate::CliError;
use crate::error::Place;
use crate::files::input_file::read_text;
use crate::files::lines::Lines;

/// Values for the `<default>` names of a scene, as `-D NAME=VALUE` gives them.
pub type Defaults = BTreeMap<String, String>;

/// More files are refused: a few that include each other again and again can stand for billions.
const MAX_FILES: usize = 4096;
/// Longest text, in bytes, that values of `$name` may make; each can double the one before.
const MAX_TEXT: usize = 1 << 16;

/// Reads one scene file and all it includes.
pub(super) struct SceneFiles {
    /// Values given from outside, which win over the file's defaults.
    given: Defaults,
    /// Values seen so far.
    known: Defaults,
    /// Names of `given` that the scene has used or declared.
    used: BTreeSet<String>,
    /// The files being read, outermost first.
    open: Vec<PathBuf>,
    /// Folders that `<path>` elements have named, the latest first.
    paths: Vec<PathBuf>,
    /// Where files are searched at this place, after the folder of the file being read.
    folders: Arc<[PathBuf]>,
    /// All files included so far.
    included: Vec<PathBuf>,
    notes: Rc<Notes>,
    /// Files and elements read so far.
    files: usize,
    elements: usize,
}

impl SceneFiles {
    pub(super) fn new(given: &Defaults) -> Self {
        let (given, known) = (given.clone(), given.clone());
        let (used, open, paths, folders) =
            (BTreeSet::new(), Vec::new(), Vec::new(), Arc::default());
        let (included, notes) = (Vec::new(), Rc::default());
        Self { given, known, used, open, paths, folders, included, notes, files: 0, elements: 0 }
    }

    /// The tree of a scene's text, and the files that it includes; `path` names it in messages and anchors relative paths.
    pub(super) fn read(
        mut self,
        path: &Path,
        text: &str,
    ) -> Result<(Element, Vec<PathBuf>), CliError> {
        let mut root = self.parse(path, text, 0)?;
        if let Some(name) = self.given.keys().find(|k| !self.used.contains(*k)) {
            return Err(CliError::input(
                &Place::file(path),
                format!("-D {name}: the scene has neither <default name=\"{name}\"> nor ${name}"),
            ));
        }
        values::substitute(&mut root)?;
        root.number();
        Ok((root, self.included))
    }

    /// The tree of one file, whose root stands inside `depth` elements.
    fn parse(&mut self, path: &Path, text: &str, depth: usize) -> Result<Element, CliError> {
        self.files += 1;
        if self.files > MAX_FILES {
            let message = format!("the scene includes more than {MAX_FILES} files");
            return Err(CliError::input(&Place::file(path), message));
        }
        let document = Document::parse(text).map_err(|e| {
            let at = e.pos();
            let place = Place { line: Some(at.row), column: Some(at.col), ..Place::file(path) };
            CliError::input(&place, format!("not well-formed XML: {e}"))
        })?;
        let root = document.root_element();
        let file = Text { path: path.into(), lines: Lines::of(text) };
        let place = file.place(root);
        if root.tag_name().name() != "scene" {
            let found = root.tag_name().name();
            let message = format!("expected a <scene version=\"…\"> element, found <{found}>");
            return Err(CliError::input(&place, message));
        }
        let version = root.attribute("version").ok_or_else(|| {
            CliError::input(
                &place,
                "<scene>: the attribute `version` is missing, such as \"3.0.0\"",
            )
        })?;
        let dialect = Dialect::of_version(version, &place)?;
        self.open.push(path.into());
        self.search();
        let scene = self.element(&file, root, dialect, depth)?;
        self.open.pop();
        self.search();
        scene.only_attributes(&["version"])?;
        Ok(scene)
    }

    fn element(
        &mut self,
        file: &Text,
        node: Node<'_, '_>,
        dialect: Dialect,
        depth: usize,
    ) -> Result<Element, CliError> {
        let place = file.place(node);
        if depth > MAX_NESTING {
            let message = format!("elements nest deeper than {MAX_NESTING}");
            return Err(CliError::input(&place, message));
        }
        self.elements += 1;
        if self.elements > MAX_ELEMENTS {
            let message = format!("the scene has more than {MAX_ELEMENTS} elements");
            return Err(CliError::input(&place, message));
        }
        let mut attributes = node
            .attributes()
            .map(|a| Ok((a.name().to_owned(), self.substitute(a.value(), &place)?)))
            .collect::<Result<Vec<_>, CliError>>()?;
        let tag: String = node.tag_name().name().into();
        name_as_id(node, &tag, &mut attributes);
        let (folders, notes) = (self.folders.clone(), self.notes.clone());
        let mut element = Element::new(tag, attributes, place, dialect, folders, notes);
        for child in node.children() {
            if child.is_text() && !child.text().unwrap_or("").trim().is_empty() {
                return Err(element.error("text inside an element; expected elements only"));
            }
            if child.is_element() {
                let child = self.element(file, child, dialect, depth + 1)?;
                self.add(&mut element, child, depth + 1)?;
            }
        }
        Ok(element)
    }

    /// Adds a child, unless it is an instruction to the reader itself.
    fn add(&mut self, parent: &mut Element, child: Element, depth: usize) -> Result<(), CliError> {
        match child.tag.as_str() {
            "default" => {
                child.only_attributes(&["name", "value"])?;
                let (name, value) = (child.required("name")?, child.required("value")?);
                if name.is_empty() {
                    return Err(child.error("the name is empty"));
                }
                self.used.insert(name.into());
                self.known.entry(name.into()).or_insert_with(|| value.into());
            }
            "include" => {
                child.only_attributes(&["filename"])?;
                parent.children.extend(self.include(&child, depth)?.children);
            }
            "path" => {
                child.only_attributes(&["value"])?;
                let folder = child.resolve(child.required("value")?)?;
                if !folder.is_dir() {
                    return Err(child.error(format!("{} is not a folder", folder.display())));
                }
                self.paths.insert(0, folder);
                self.search();
            }
            _ => parent.children.push(child),
        }
        Ok(())
    }

    /// Lists the folders in which files are searched from here on: those of the files that include
    /// this one, innermost first, and those of `<path>` elements.
    fn search(&mut self) {
        let including = self.open.iter().rev().skip(1);
        let including = including.map(|file| file.parent().unwrap_or(Path::new("")).to_path_buf());
        self.folders = including.chain(self.paths.iter().cloned()).collect();
    }

    fn include(&mut self, at: &Element, depth: usize) -> Result<Element, CliError> {
        let missing = || at.error("the attribute `filename` is missing");
        let path = at.resolve(at.file_name().ok_or_else(missing)?)?;
        let text = read_text(&path, Some(&at.place))?;
        let same = |a: &Path, b: &Path| {
            a == b || a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b))
        };
        if self.open.iter().any(|open| same(open, &path)) {
            return Err(at.error(format!("{} includes itself", path.display())));
        }
        self.included.push(path.clone());
        self.parse(&path, &text, depth)
    }

    /// The text with every `$name` replaced by the value of the longest known name that fits.
    fn substitute(&mut self, text: &str, place: &Place) -> Result<String, CliError> {
        let mut out = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            out.push_str(&rest[..at]);
            rest = &rest[at + 1..];
            let fits = self.known.iter().filter(|(name, _)| rest.starts_with(name.as_str()));
            let Some((name, value)) = fits.max_by_key(|(name, _)| name.len()) else {
                let word = |c: char| !(c.is_alphanumeric() || c == '_');
                let name = rest.split(word).next().unwrap_or(rest);
                let message = format!(
                    "${name} has no value; give one with -D {name}=VALUE or with a \
                     <default name=\"{name}\" value=\"…\"/> before it"
                );
                return Err(CliError::input(place, message));
            };
            out.push_str(value);
            if out.len() > MAX_TEXT {
                let message = format!("${name} makes a text longer than {MAX_TEXT} bytes");
                return Err(CliError::input(place, message));
            }
            rest = &rest[name.len()..];
            self.used.insert(name.clone());
        }
        out.push_str(rest);
        Ok(out)
    }
}

/// Gives a thing that stands directly in a scene its name as its id where it has no id.
fn name_as_id(node: Node<'_, '_>, tag: &str, attributes: &mut Vec<(String, String)>) {
    let in_scene = node.parent_element().is_some_and(|parent| parent.has_tag_name("scene"));
    let is_thing = in_scene && !["default", "path", "include", "alias"].contains(&tag);
    let find = |key: &str| attributes.iter().find(|(k, _)| k == key).map(|(_, v)| v.clone());
    if let (true, None, Some(name)) = (is_thing, find("id"), find("name")) {
        attributes.push(("id".into(), name));
    }
}

/// A file being read.
struct Text {
    path: Arc<Path>,
    lines: Lines,
}

impl Text {
    fn place(&self, node: Node<'_, '_>) -> Place {
        let line = self.lines.line(node.range().start);
        Place { file: self.path.clone(), line: Some(line), column: None }
    }
}
