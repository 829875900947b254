//! The tree of a scene file after substitution: defaults filled in, includes spliced, names in one
//! spelling. Nothing after this knows of several files or several spellings.

use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use crate::CliError;
use crate::error::Place;
use crate::scene_xml::dialect::Dialect;
use crate::scene_xml::notes::Notes;

/// Elements inside each other beyond this depth are refused: no scene needs them, and reading them
/// takes stack.
pub(super) const MAX_NESTING: usize = 64;
/// More elements are refused, all included files together.
pub(super) const MAX_ELEMENTS: usize = 1 << 20;

/// One XML element.
#[derive(Clone, Debug)]
pub(super) struct Element {
    /// The tag, such as `shape` or `float`.
    pub(super) tag: String,
    attributes: Vec<(String, String)>,
    /// The elements inside.
    pub(super) children: Vec<Element>,
    /// Where it stands.
    pub(super) place: Place,
    /// The dialect of its file.
    pub(super) dialect: Dialect,
    /// Folders in which its files are searched after that of its own file.
    folders: Arc<[PathBuf]>,
    /// Where its scene keeps notes.
    notes: Rc<Notes>,
    /// Its number in document order: an identity.
    pub(super) ordinal: usize,
}

impl Element {
    /// An element whose property name, if it has one, is put into the common spelling. The name in
    /// a `<default>` is the scene's own and stays.
    pub(super) fn new(
        tag: String,
        mut attributes: Vec<(String, String)>,
        place: Place,
        dialect: Dialect,
        folders: Arc<[PathBuf]>,
        notes: Rc<Notes>,
    ) -> Self {
        for (key, value) in &mut attributes {
            if key == "name" && tag != "default" {
                *value = dialect.property_name(value);
            }
        }
        Self { tag, attributes, children: Vec::new(), place, dialect, folders, notes, ordinal: 0 }
    }

    /// An attribute's text.
    pub(super) fn attribute(&self, key: &str) -> Option<&str> {
        self.attributes.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str())
    }

    /// An attribute that must be there.
    pub(super) fn required(&self, key: &str) -> Result<&str, CliError> {
        self.attribute(key).ok_or_else(|| self.error(format!("the attribute `{key}` is missing")))
    }

    /// Refuses attributes other than those listed.
    pub(super) fn only_attributes(&self, known: &[&str]) -> Result<(), CliError> {
        match self.attributes.iter().find(|(k, _)| !known.contains(&k.as_str())) {
            None => Ok(()),
            Some((k, _)) => Err(self
                .error(format!("unknown attribute `{k}`; expected one of {}", known.join(", ")))),
        }
    }

    /// The id under which others refer to it.
    pub(super) fn id(&self) -> Option<&str> {
        self.attribute("id")
    }

    /// True in files of version 0.5 and 0.6.
    pub(super) fn is_legacy(&self) -> bool {
        self.dialect == Dialect::Legacy
    }

    /// An error at this element.
    pub(super) fn error(&self, message: impl std::fmt::Display) -> CliError {
        CliError::input(&self.place, format!("{self}: {message}"))
    }

    /// Notes something harmless here that is passed over or mended.
    pub(super) fn note(&self, message: impl std::fmt::Display) {
        self.notes.add(&self.place, format!("{self}: {message}"));
    }

    /// Notes what holds for all things of a `kind`, at the first of them.
    pub(super) fn note_once(&self, kind: &str, message: impl std::fmt::Display) {
        self.notes.add_once(kind, &self.place, format!("{self}: {message}"));
    }

    /// The notes on the scene that it is of.
    pub(super) fn notes(&self) -> &Notes {
        &self.notes
    }

    /// The file (or folder) that a path means: in the folder of the scene file in which the element
    /// stands, in those of the files that include that one, in one that a `<path>` names, or in the working directory.
    ///
    /// # Errors
    /// When none of them has it.
    pub(super) fn resolve(&self, path: &str) -> Result<PathBuf, CliError> {
        let own = self.place.file.parent().unwrap_or(Path::new(""));
        let named = || self.folders.iter().map(PathBuf::as_path);
        let folders = || std::iter::once(own).chain(named()).chain([Path::new("")]);
        let found = folders().map(|folder| folder.join(path)).find(|file| file.exists());
        if let Some(file) = &found
            && !file.is_file()
            && !file.is_dir()
        {
            return Err(self.error(format!("{} is not a regular file", file.display())));
        }
        found.ok_or_else(|| {
            let mut searched: Vec<String> = Vec::new();
            for folder in folders() {
                let folder = if folder == Path::new("") { Path::new(".") } else { folder };
                let name = folder.display().to_string();
                if !searched.contains(&name) {
                    searched.push(name);
                }
            }
            self.error(format!("there is no file `{path}`; searched {}", searched.join(", ")))
        })
    }

    /// The file that the element names, as it is written: by its value where it is a property `filename`, or by
    /// the attribute `filename` of an inclusion or a spectrum.
    pub(super) fn file_name(&self) -> Option<&str> {
        match self.attribute("name") {
            Some("filename") if self.tag == "string" => self.attribute("value"),
            _ => self.attribute("filename"),
        }
    }

    /// The [named](Self::file_name) file, wherever it is found.
    pub(super) fn file(&self) -> Option<Result<PathBuf, CliError>> {
        self.file_name().map(|name| self.resolve(name))
    }

    /// Gives it the `name` of the place it is used in, and no id.
    pub(super) fn call(&mut self, name: Option<&str>) {
        self.attributes.retain(|(key, _)| key != "id" && key != "name");
        self.attributes.extend(name.map(|n| ("name".into(), n.into())));
    }

    /// How many elements it is, with all inside.
    pub(super) fn count(&self) -> usize {
        1 + self.children.iter().map(Element::count).sum::<usize>()
    }

    /// Numbers the tree in document order.
    pub(super) fn number(&mut self) {
        fn visit(e: &mut Element, next: &mut usize) {
            e.ordinal = *next;
            *next += 1;
            e.children.iter_mut().for_each(|c| visit(c, next));
        }
        visit(self, &mut 0);
    }
}

impl std::fmt::Display for Element {
    /// As in the file, with what identifies it: `<float name="alpha">`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "<{}", self.tag)?;
        for key in ["type", "name", "id"] {
            if let Some(v) = self.attribute(key) {
                write!(f, " {key}=\"{v}\"")?;
            }
        }
        f.write_str(">")
    }
}
