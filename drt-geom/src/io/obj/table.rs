use alloc::string::{String, ToString};
use alloc::vec::Vec;
use std::io::Read;

use drt_math::Vec3;
use tobj::{LoadError, LoadOptions};

use super::ObjErrorKind;
use crate::{MeshError, NONE};

/// Vectors of one kind and the faces that refer to them, as a file for `tobj` with nothing else in it.
pub(super) struct Table {
    /// One statement in a line, v or f, in the order of the file.
    text: String,
    /// Where each stands in the file.
    lines: Vec<usize>,
    /// The number of vectors.
    count: usize,
    /// What a vector's statement is called in the file, and a vector in messages.
    keyword: &'static str,
    what: &'static str,
}

impl Table {
    pub(super) fn new(keyword: &'static str, what: &'static str) -> Self {
        Self { text: String::new(), lines: Vec::new(), count: 0, keyword, what }
    }

    pub(super) fn vector<'a>(&mut self, line: usize, words: impl Iterator<Item = &'a str>) {
        self.count += 1;
        self.statement(line, "v", words);
    }

    /// Adds a face of at least one corner.
    pub(super) fn face<'a>(&mut self, line: usize, words: impl Iterator<Item = &'a str>) {
        let mut words = words.peekable();
        if words.peek().is_some() {
            self.statement(line, "f", words);
        }
    }

    fn statement<'a>(&mut self, line: usize, letter: &str, words: impl Iterator<Item = &'a str>) {
        self.lines.push(line);
        self.text.push_str(letter);
        for word in words {
            self.text.push(' ');
            self.text.push_str(word);
        }
        self.text.push('\n');
    }

    /// The vectors in the file's order and the indices, from 0, of all faces in a row; or what is
    /// wrong, and the line.
    pub(super) fn load(&self) -> Result<(Vec<Vec3>, Vec<u32>), (usize, ObjErrorKind)> {
        let Self { count, what, .. } = *self;
        if count >= NONE as usize {
            return Err((self.last_line(), MeshError::TooLarge { what, count }.into()));
        }
        // Vectors are numbered by their first use: here, in order.
        let all: String = (1..=count).map(|i| format!(" {i}")).collect();
        let all = format!("f{all}\n");
        let mut reader = all.as_bytes().chain(self.text.as_bytes());
        let no_materials = |_: &std::path::Path| Err(LoadError::OpenFileFailed);
        let loaded = tobj::load_obj_buf(&mut reader, &LoadOptions::default(), no_materials);
        let unread = reader.into_inner().1.len();
        let (models, _) = loaded.map_err(|error| self.fault(error, unread))?;
        let (mut vectors, mut indices) = (Vec::with_capacity(count), Vec::new());
        // Without names of objects, groups and materials it is one.
        for model in models {
            let rows = model.mesh.positions.chunks_exact(3);
            vectors.extend(rows.map(|v| Vec3::from([v[0], v[1], v[2]])));
            indices.extend(model.mesh.indices.into_iter().skip(count));
        }
        let is_vector = |(statement, _): &(&str, usize)| statement.starts_with('v');
        for (v, (statement, line)) in vectors.iter().zip(self.statements().filter(is_vector)) {
            if !v.is_finite() {
                return Err((line, self.bad_numbers(statement)));
            }
        }
        Ok((vectors, indices))
    }

    fn statements(&self) -> impl Iterator<Item = (&str, usize)> {
        self.text.lines().zip(self.lines.iter().copied())
    }

    fn last_line(&self) -> usize {
        self.lines.last().copied().unwrap_or(1)
    }

    /// What is wrong, when `tobj` has left so many bytes unread.
    fn fault(&self, error: LoadError, unread: usize) -> (usize, ObjErrorKind) {
        let read = &self.text.as_bytes()[..self.text.len() - unread];
        let last = read.iter().filter(|b| **b == b'\n').count().saturating_sub(1);
        let (statement, line) = self.statements().nth(last).unwrap_or(("", self.last_line()));
        match error {
            LoadError::PositionParseError => (line, self.bad_numbers(statement)),
            LoadError::FaceParseError => {
                let bad = words(statement).find(|w| w.parse::<isize>().is_err());
                (line, ObjErrorKind::BadCorner(bad.unwrap_or(statement).to_string()))
            }
            // Told when all is read, and not of which face.
            LoadError::FaceVertexOutOfBounds => {
                self.missing_item().unwrap_or((line, ObjErrorKind::Other(error)))
            }
            _ => (line, ObjErrorKind::Other(error)),
        }
    }

    fn bad_numbers(&self, statement: &str) -> ObjErrorKind {
        let found = words(statement).collect::<Vec<_>>().join(" ");
        ObjErrorKind::BadNumbers { statement: self.keyword, found }
    }

    /// The first index that has no vector.
    fn missing_item(&self) -> Option<(usize, ObjErrorKind)> {
        let mut so_far = 0;
        for (statement, line) in self.statements() {
            if statement.starts_with('v') {
                so_far += 1;
                continue;
            }
            for word in words(statement) {
                let index = word.parse::<i64>().ok()?;
                let count = if index < 0 { so_far } else { self.count };
                if index == 0 {
                    return Some((line, ObjErrorKind::BadCorner(word.to_string())));
                }
                if index.unsigned_abs() > count as u64 {
                    let what = self.what;
                    return Some((line, ObjErrorKind::MissingItem { what, index, count }));
                }
            }
        }
        None
    }
}

/// The words behind the first.
fn words(statement: &str) -> impl Iterator<Item = &str> {
    statement.split(' ').skip(1)
}
