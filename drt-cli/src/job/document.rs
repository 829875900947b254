//! The text of a job with the command line's `--set KEY=VALUE` laid over it, and where in both an
//! error lies.

use std::path::Path;

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue, Deserializer, Error};

use crate::CliError;
use crate::error::Place;
use crate::files::lines::Lines;

/// A job's text and the assignments laid over it, with spans that tell them apart: those of the
/// text lie within it, those of each assignment in a range of its own beyond.
pub(super) struct Document<'a> {
    path: &'a Path,
    text: &'a str,
    lines: Lines,
    /// Each assignment as TOML, preceded by as many blanks as bytes come before it.
    assignments: Vec<Assignment>,
}

struct Assignment {
    key: String,
    source: String,
    start: usize,
}

impl<'a> Document<'a> {
    pub(super) fn new(path: &'a Path, text: &'a str, set: &[(String, String)]) -> Self {
        let mut start = text.len();
        let assignments = set
            .iter()
            .map(|(key, value)| {
                let assignment = Assignment::new(key, value, start);
                start = assignment.source.len();
                assignment
            })
            .collect();
        Self { path, text, lines: Lines::of(text), assignments }
    }

    /// The whole as a value of `T`.
    pub(super) fn parse<T: DeserializeOwned>(&self) -> Result<T, CliError> {
        let mut root = DeTable::parse(self.text).map_err(|e| self.error(&e))?;
        for assignment in &self.assignments {
            let mut value = DeTable::parse(&assignment.source).map_err(|e| self.error(&e))?;
            let Some((_, value)) = value.get_mut().remove_entry("v") else { continue };
            assign(root.get_mut(), &assignment.key, value).map_err(|reason| {
                CliError::argument(format!("--set {}: {reason}", assignment.key))
            })?;
        }
        T::deserialize(Deserializer::from(root)).map_err(|e| self.error(&e))
    }

    fn error(&self, e: &Error) -> CliError {
        self.error_at(e.span().map_or(0, |s| s.start), e.message())
    }

    /// An error at an offset as spans give it.
    pub(super) fn error_at(&self, offset: usize, message: impl std::fmt::Display) -> CliError {
        match self.assignments.iter().rev().find(|a| a.start <= offset) {
            Some(a) => CliError::argument(format!("--set {}: {message}", a.key)),
            None => CliError::input(&self.place(offset), message),
        }
    }

    /// The line and column of an offset in the text.
    pub(super) fn place(&self, offset: usize) -> Place {
        self.lines.place(self.path, self.text, offset)
    }
}

impl Assignment {
    /// What is not a TOML value by itself is taken for a string.
    fn new(key: &str, value: &str, start: usize) -> Self {
        let quoted;
        let value = if DeValue::parse(value).is_ok() {
            value
        } else {
            quoted = toml::Value::from(value).to_string();
            &quoted
        };
        Self { key: key.into(), source: format!("{:start$}v = {value}", ""), start }
    }
}

/// Puts a value under a dotted key, in which an array's entry goes by its `name` or its number.
fn assign<'i>(
    table: &mut DeTable<'i>,
    key: &str,
    value: Spanned<DeValue<'i>>,
) -> Result<(), String> {
    let (head, rest) = match key.split_once('.') {
        Some((head, rest)) => (head, Some(rest)),
        None => (key, None),
    };
    if head.is_empty() {
        return Err("the key has an empty part; expected one like estimator.spp".into());
    }
    if !table.contains_key(head) {
        let empty = DeValue::Table(DeTable::new());
        let key = Spanned::new(value.span(), head.to_owned().into());
        table.insert(key, Spanned::new(value.span(), empty));
    }
    let Some(slot) = table.get_mut(head) else { return Ok(()) };
    assign_in(slot, head, rest, value)
}

fn assign_in<'i>(
    slot: &mut Spanned<DeValue<'i>>,
    name: &str,
    rest: Option<&str>,
    value: Spanned<DeValue<'i>>,
) -> Result<(), String> {
    let Some(rest) = rest else {
        *slot = value;
        return Ok(());
    };
    match slot.get_mut() {
        DeValue::Table(table) => assign(table, rest, value),
        DeValue::Array(array) => {
            let (i, rest) = entry(array, rest).ok_or_else(|| {
                format!("`{name}` has no entry of this name or number; it has {}", names(array))
            })?;
            array.get_mut(i).map_or(Ok(()), |slot| assign_in(slot, name, rest, value))
        }
        other => Err(format!("`{name}` is a {} and has nothing inside", other.type_str())),
    }
}

/// The entry that the start of a key names, and the rest of the key. Names may contain dots.
fn entry<'k>(array: &DeArray<'_>, key: &'k str) -> Option<(usize, Option<&'k str>)> {
    let tail = |word: &str| match key.strip_prefix(word)? {
        "" => Some(None),
        tail => tail.strip_prefix('.').map(Some),
    };
    let named = array.iter().enumerate().filter_map(|(i, e)| {
        let name = e.get_ref().get("name")?.get_ref().as_str()?;
        Some((name.len(), i, tail(name)?))
    });
    if let Some((_, i, rest)) = named.max_by_key(|(length, ..)| *length) {
        return Some((i, rest));
    }
    let number = key.split('.').next()?;
    let i = number.parse::<usize>().ok().filter(|i| *i < array.len())?;
    Some((i, tail(number)?))
}

fn names(array: &DeArray<'_>) -> String {
    let name = |e: &Spanned<DeValue<'_>>| Some(e.get_ref().get("name")?.get_ref().as_str()?.into());
    let names: Vec<String> = array.iter().filter_map(name).collect();
    if names.is_empty() { format!("{} without names", array.len()) } else { names.join(", ") }
}
