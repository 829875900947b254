//! Which jobs there are, and where their results go.

use std::fmt;
use std::path::{Path, PathBuf};

use clap::Parser;
use serde::Deserialize;

use crate::CliError;
use crate::commands::options::{BatchOptions, ListLine, Options};
use crate::error::Place;
use crate::files::input_file::read_text;
use crate::job::name_of;

/// A job of a batch, with all its options.
#[derive(Debug)]
pub(super) struct Entry {
    pub(super) options: Options,
    /// The line that it stands in, where it was listed.
    place: Option<Place>,
}

impl fmt::Display for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.options.input.display())?;
        match self.place.as_ref().and_then(|p| p.line) {
            Some(line) => write!(f, " (line {line})"),
            None => Ok(()),
        }
    }
}

impl Entry {
    /// A message about the job, which names it once.
    pub(super) fn blamed_for(&self, message: &str) -> String {
        let name = self.options.input.display().to_string();
        match message.strip_prefix(&name).and_then(|rest| rest.strip_prefix(':')) {
            Some(rest) if rest.starts_with(' ') => format!("{self}:{rest}"),
            // A place in the file follows its name.
            Some(_) if self.place.is_none() => message.to_owned(),
            _ => format!("{self}: {message}"),
        }
    }

    /// Where its image goes.
    pub(super) fn output(&self) -> &Path {
        self.options.output.as_deref().unwrap_or(Path::new(""))
    }
}

/// All jobs; those of one scene in a row, so that they can share what is prepared for it.
pub(super) fn entries(options: &BatchOptions) -> Result<Vec<Entry>, CliError> {
    let given = options.inputs.iter();
    let mut entries: Vec<Entry> =
        given.map(|input| Entry { options: Options::of(input.clone()), place: None }).collect();
    if let Some(list) = &options.list {
        entries.extend(listed(list)?);
    }
    for entry in &mut entries {
        complete(&mut entry.options, options)?;
    }
    Ok(by_scene(entries))
}

/// The jobs of a list. Blank lines, and what follows a `#`, do not count; file names start from the folder the
/// command runs in, as on a command line.
fn listed(list: &Path) -> Result<Vec<Entry>, CliError> {
    let text = read_text(list, None)?;
    let mut entries = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let place = Place { line: Some(i as u32 + 1), ..Place::file(list) };
        let words = shlex::split(line)
            .ok_or_else(|| CliError::input(&place, "a quotation mark has no partner"))?;
        if words.is_empty() {
            continue;
        }
        let line = ListLine::try_parse_from(words).map_err(|e| {
            let text = e.to_string();
            let message = text.strip_prefix("error: ").unwrap_or(&text);
            let message = message.split("\n\nUsage:").next().unwrap_or(message);
            CliError::input(&place, message.trim_end())
        })?;
        entries.push(Entry { options: line.options, place: Some(place) });
    }
    if entries.is_empty() {
        return Err(CliError::input(&Place::file(list), "it lists nothing; expected a job a line"));
    }
    Ok(entries)
}

/// Fills in what a job does not say itself.
fn complete(own: &mut Options, all: &BatchOptions) -> Result<(), CliError> {
    if own.digest.as_deref() == Some(Path::new("-")) {
        return Err(CliError::argument("--digest -: the jobs of a batch write files"));
    }
    own.changes = std::mem::take(&mut own.changes).over(&all.changes);
    // What a job has to say goes to the log.
    own.changes.quiet = true;
    own.spp = own.spp.or(all.spp);
    let output = own.output.take().unwrap_or_else(|| all.output.join(name_of(&own.input) + ".exr"));
    own.digest.get_or_insert_with(|| output.with_extension("json"));
    if all.previews {
        own.preview.get_or_insert_with(|| output.with_extension("png"));
    }
    own.output = Some(output);
    Ok(())
}

/// The scene that a job names; only to put what belongs together side by side, so what cannot be read has
/// none.
fn scene_of(input: &Path) -> Option<PathBuf> {
    #[derive(Deserialize)]
    struct Named {
        scene: PathBuf,
    }
    if !input.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        return Some(input.into());
    }
    let named: Named = toml::from_str(&read_text(input, None).ok()?).ok()?;
    Some(input.parent().unwrap_or(Path::new("")).join(named.scene))
}

fn by_scene(entries: Vec<Entry>) -> Vec<Entry> {
    let mut scenes: Vec<Option<PathBuf>> = Vec::new();
    let mut groups: Vec<Vec<Entry>> = Vec::new();
    for entry in entries {
        let scene = scene_of(&entry.options.input);
        match scenes.iter().position(|s| s.is_some() && *s == scene) {
            Some(i) => groups[i].push(entry),
            None => {
                scenes.push(scene);
                groups.push(vec![entry]);
            }
        }
    }
    groups.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Folder;

    #[test]
    fn lines_have_options_of_their_own() {
        let folder = Folder::new();
        let list = folder.file("list", "# a sweep\na.xml\n\n'b c.xml' -o x.exr --seed 3 # last\n");
        let entries = listed(&list).unwrap();
        assert_eq!(entries.len(), 2);
        assert_eq!(entries[1].options.input, Path::new("b c.xml"));
        assert_eq!(
            (entries[1].options.changes.seed, entries[1].output()),
            (Some(3), Path::new("x.exr"))
        );
        for (text, part) in [
            ("a.xml\nb.xml --sede 3", "list:2: "),
            ("'a.xml", "list:1: "),
            ("# none", "lists nothing"),
        ] {
            let error = listed(&folder.file("list", text)).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn jobs_of_one_scene_come_together() {
        let folder = Folder::new();
        for (job, scene) in [("1", "a.xml"), ("2", "b.xml"), ("3", "a.xml")] {
            folder.file(&format!("{job}.toml"), format!("scene = \"{scene}\""));
        }
        let entry = |name: &str| {
            let options = Options::of(folder.path().join(name));
            Entry { options, place: None }
        };
        let names = ["1.toml", "2.toml", "none.toml", "3.toml", "b.xml"];
        let ordered = by_scene(names.map(entry).into());
        let names: Vec<_> = ordered.iter().map(|e| e.options.input.file_name().unwrap()).collect();
        assert_eq!(names, ["1.toml", "3.toml", "2.toml", "b.xml", "none.toml"]);
    }
}
