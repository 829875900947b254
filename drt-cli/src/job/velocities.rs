//! Files of one velocity per vertex: text with three numbers per line, or PLY with x, y and z.

use std::path::Path;

use drt_math::Vec3;

use super::refusal::Refusal;
use crate::CliError;
use crate::error::Place;
use crate::files::input_file;

/// Reads a file; its first bytes tell which of the two it is.
pub(super) fn read(path: &Path) -> Result<Vec<Vec3>, Refusal> {
    let place = Place::file(path);
    let bytes = input_file::read(path).map_err(|e| Refusal::unreadable(path, &e))?;
    if bytes.starts_with(b"ply") {
        return drt_geom::decode_vertex_vectors(&bytes, &path.to_string_lossy())
            .map_err(|e| CliError::input(&place, e).into());
    }
    let text = std::str::from_utf8(&bytes).map_err(|_| {
        CliError::input(&place, "neither text nor PLY; expected three numbers per line")
    })?;
    text.lines()
        .enumerate()
        .map(|(i, line)| (i, line.split('#').next().unwrap_or("").trim()))
        .filter(|(_, line)| !line.is_empty())
        .map(|(i, line)| {
            vector(line).ok_or_else(|| {
                let place = Place { line: Some(i as u32 + 1), ..place.clone() };
                CliError::input(&place, format!("`{line}` is not three finite numbers")).into()
            })
        })
        .collect()
}

fn vector(line: &str) -> Option<Vec3> {
    let words = line.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty());
    let numbers: Option<Vec<f64>> =
        words.map(|w| w.parse().ok().filter(|v: &f64| v.is_finite())).collect();
    match *numbers? {
        [x, y, z] => Some(Vec3 { x, y, z }),
        _ => None,
    }
}
