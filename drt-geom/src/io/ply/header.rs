use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

use super::body::{Body, Encoding};
use super::property::{Property, Scalar};
use super::{Failure, PlyErrorKind, place};

/// What a PLY file says it holds.
pub(super) struct Header {
    pub(super) elements: Vec<Element>,
}

/// A table: `count` rows of the same properties.
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Header {
    /// Reads the header and returns it with the data after it.
    pub(super) fn read(bytes: &[u8]) -> Result<(Self, Body<'_>), Failure> {
        let mut elements: Vec<Element> = Vec::new();
        let mut encoding = None;
        let mut rest = bytes;
        for number in 1.. {
            let at = || format!("line {number}");
            let Some(end) = rest.iter().position(|&b| b == b'\n') else {
                return Err((at(), PlyErrorKind::Cut));
            };
            let line = String::from_utf8_lossy(&rest[..end]);
            rest = &rest[end + 1..];
            let words: Vec<_> = line.split_ascii_whitespace().collect();
            let expected = |expected| {
                (at(), PlyErrorKind::Header { found: line.trim().to_string(), expected })
            };
            match (number, &words[..]) {
                (1, ["ply"]) => {}
                (1, _) => return Err(expected("`ply`")),
                (2, ["format", name, "1.0"]) => {
                    let named = Encoding::named(name);
                    encoding = Some(named.ok_or_else(|| {
                        expected("ascii, binary_little_endian or binary_big_endian")
                    })?);
                }
                (2, _) => return Err(expected("`format ENCODING 1.0`")),
                (_, ["comment" | "obj_info", ..]) | (_, []) => {}
                (_, ["element", name, count]) => {
                    let count =
                        count.parse().map_err(|_| expected("a count: `element NAME COUNT`"))?;
                    let name = (*name).to_string();
                    // Faces would count the vertices of one, and find those of the other.
                    if elements.iter().any(|e| e.name == name) {
                        return Err(expected("an element of another name: each is declared once"));
                    }
                    elements.push(Element { name, count, properties: Vec::new() });
                }
                (_, ["property", definition @ ..]) => {
                    let property = property(definition).ok_or_else(|| {
                        expected("`property TYPE NAME` or `property list INTEGER TYPE NAME`")
                    })?;
                    match elements.last_mut() {
                        Some(e) => e.properties.push(property),
                        None => return Err(expected("an element before its properties")),
                    }
                }
                (_, ["end_header"]) => {
                    let encoding = encoding.unwrap_or(Encoding::Ascii);
                    let body = Body { encoding, rest, line: number + 1 };
                    return Ok((Self { elements }, body));
                }
                _ => return Err(expected("element, property, comment or end_header")),
            }
        }
        Err(("header".to_string(), PlyErrorKind::Cut))
    }
}

fn property(definition: &[&str]) -> Option<Property> {
    let (length, kind, name) = match definition {
        ["list", length, kind, name] => (Some(Scalar::named(length)?), kind, name),
        [kind, name] => (None, kind, name),
        _ => return None,
    };
    let whole = length.is_none_or(|l| !l.is_float());
    let kind = Scalar::named(kind)?;
    whole.then(|| Property { name: (*name).to_string(), kind, length })
}

impl Element {
    /// Reads the rows one after the other; `row` gets each one's number and its values by property.
    pub(super) fn each(
        &self,
        body: &mut Body,
        mut row: impl FnMut(usize, &[Vec<f64>]) -> Result<(), PlyErrorKind>,
    ) -> Result<(), Failure> {
        if self.properties.is_empty() && self.count > 0 {
            let missing = PlyErrorKind::Missing("properties for this element");
            return Err((format!("element {}", self.name), missing));
        }
        let mut values = alloc::vec![Vec::new(); self.properties.len()];
        for index in 0..self.count {
            let mut read = || {
                for (property, out) in self.properties.iter().zip(&mut values) {
                    body.read(property, out)?;
                }
                row(index as usize, &values)
            };
            read().map_err(|kind| {
                let at = place(&self.name, index as usize);
                (body.line().map_or(at.clone(), |l| format!("line {l}, {at}")), kind)
            })?;
        }
        Ok(())
    }
}
