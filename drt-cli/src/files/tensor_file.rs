//! Tensor files: named arrays of any shape (Mitsuba's `tensor_io`, and the format of the RGL material database).
//!
//! All numbers are little-endian. The file starts with `tensor_file`, a zero byte, the version as two bytes, 1 and 0, and the number of
//! fields (32 bits). For each follow the length of its name (16 bits) and the name, its number of dimensions (16 bits), the type of its
//! values (8 bits), the offset of the first one in the file (64 bits), and the sizes of all dimensions (64 bits each), the last one
//! of which is the next in the file.

use std::collections::BTreeMap;

const MAGIC: &[u8] = b"tensor_file\0";
const VERSION: [u8; 2] = [1, 0];

/// The types of values, and their lengths in bytes.
const TYPES: [(&str, usize); 11] = [
    ("uint8", 1),
    ("int8", 1),
    ("uint16", 2),
    ("int16", 2),
    ("uint32", 4),
    ("int32", 4),
    ("uint64", 8),
    ("int64", 8),
    ("float16", 2),
    ("float32", 4),
    ("float64", 8),
];

/// The fields of a file, all of which are within it.
pub(crate) struct TensorFile<'a> {
    fields: BTreeMap<&'a str, Field<'a>>,
}

struct Field<'a> {
    kind: &'static str,
    shape: Vec<usize>,
    bytes: &'a [u8],
}

impl<'a> TensorFile<'a> {
    /// Finds the fields of a file, and reads none of them.
    pub(crate) fn new(file: &'a [u8]) -> Result<Self, String> {
        let mut header = file.strip_prefix(MAGIC).ok_or("this is not a tensor file")?;
        let version = chunk(&mut header).ok_or_else(cut)?;
        if version != VERSION {
            let [major, minor] = version;
            return Err(format!("version {major}.{minor} of tensor files; expected 1.0"));
        }
        let count = u32::from_le_bytes(chunk(&mut header).ok_or_else(cut)?);
        let mut fields = BTreeMap::new();
        for i in 0..count {
            let name = name(&mut header).ok_or_else(|| format!("field {i}: {}", cut()))?;
            let name = std::str::from_utf8(name)
                .map_err(|_| format!("the name of field {i} is not UTF-8"))?;
            let field =
                Field::new(&mut header, file).map_err(|reason| format!("`{name}`: {reason}"))?;
            if fields.insert(name, field).is_some() {
                return Err(format!("`{name}` is there twice"));
            }
        }
        Ok(Self { fields })
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.fields.contains_key(name)
    }

    /// The shape and the values of a field of single precision.
    pub(crate) fn floats(&self, name: &str) -> Result<(Vec<usize>, Vec<f32>), String> {
        let field = self.field(name, "float32")?;
        let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        Ok((field.shape.clone(), field.bytes.chunks_exact(4).map(number).collect()))
    }

    /// The values of a field of bytes, whatever its shape.
    pub(crate) fn bytes(&self, name: &str) -> Result<&'a [u8], String> {
        Ok(self.field(name, "uint8")?.bytes)
    }

    fn field(&self, name: &str, kind: &str) -> Result<&Field<'a>, String> {
        let field = self.fields.get(name).ok_or_else(|| {
            let there: Vec<_> = self.fields.keys().copied().collect();
            format!("there is no `{name}`; there are {}", there.join(", "))
        })?;
        if field.kind != kind {
            return Err(format!("`{name}` is of {}; expected {kind}", field.kind));
        }
        Ok(field)
    }
}

impl<'a> Field<'a> {
    fn new(header: &mut &'a [u8], file: &'a [u8]) -> Result<Self, String> {
        let mut number = |width| unsigned(header, width).ok_or_else(cut);
        let (dimensions, kind, offset) = (number(2)?, number(1)?, number(8)?);
        let (kind, width) = usize::try_from(kind)
            .ok()
            .and_then(|kind| TYPES.get(kind.checked_sub(1)?))
            .copied()
            .ok_or_else(|| format!("has values of the type {kind}; expected 1 to 11"))?;
        let mut shape = Vec::new();
        for _ in 0..dimensions {
            shape.push(usize::try_from(number(8)?).map_err(|_| cut())?);
        }
        let length = shape.iter().try_fold(width, |length, n| length.checked_mul(*n));
        let start = usize::try_from(offset).ok();
        let end = start.zip(length).and_then(|(start, length)| start.checked_add(length));
        let bytes =
            start.zip(end).and_then(|(start, end)| file.get(start..end)).ok_or_else(|| {
                format!(
                    "has the shape {shape:?} at byte {offset}, beyond the {} of the file",
                    file.len()
                )
            })?;
        Ok(Self { kind, shape, bytes })
    }
}

/// The values of a field to be written.
pub(crate) enum Values {
    Bytes(Vec<u8>),
    Floats(Vec<f32>),
}

/// A file of named fields with their shapes, the values of each from a multiple of 8 bytes on.
pub(crate) fn encode(fields: &[(&str, (Vec<usize>, Values))]) -> Vec<u8> {
    let mut file = [MAGIC, &VERSION, &(fields.len() as u32).to_le_bytes()].concat();
    let mut offsets = Vec::new();
    for (name, (shape, values)) in fields {
        file.extend((name.len() as u16).to_le_bytes());
        file.extend(name.as_bytes());
        file.extend((shape.len() as u16).to_le_bytes());
        file.push(match values {
            Values::Bytes(_) => 1,
            Values::Floats(_) => 10,
        });
        offsets.push(file.len());
        file.extend([0; 8]);
        file.extend(shape.iter().flat_map(|n| (*n as u64).to_le_bytes()));
    }
    for ((_, (_, values)), offset) in fields.iter().zip(offsets) {
        file.resize(file.len().next_multiple_of(8), 0);
        let start = (file.len() as u64).to_le_bytes();
        file[offset..offset + 8].copy_from_slice(&start);
        match values {
            Values::Bytes(values) => file.extend(values),
            Values::Floats(values) => file.extend(values.iter().flat_map(|v| v.to_le_bytes())),
        }
    }
    file
}

fn cut() -> String {
    "the file is cut short".into()
}

fn name<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let length = unsigned(rest, 2)?;
    rest.split_off(..usize::try_from(length).ok()?)
}

fn chunk<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    rest.split_off(..N)?.try_into().ok()
}

/// A number of so many bytes.
fn unsigned(rest: &mut &[u8], width: usize) -> Option<u64> {
    let bytes = rest.split_off(..width)?;
    Some(bytes.iter().rev().fold(0, |n, byte| n << 8 | u64::from(*byte)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file() -> Vec<u8> {
        encode(&[
            ("b", (vec![3], Values::Bytes(vec![1, 2, 3]))),
            ("f", (vec![2, 2], Values::Floats(vec![0.5, -1.0, 2.0, 4.0]))),
            ("none", (vec![0, 7], Values::Floats(vec![]))),
        ])
    }

    #[test]
    fn fields_come_back() {
        let file = file();
        let file = TensorFile::new(&file).unwrap();
        assert_eq!(file.floats("f").unwrap(), (vec![2, 2], vec![0.5, -1.0, 2.0, 4.0]));
        assert_eq!(file.floats("none").unwrap(), (vec![0, 7], vec![]));
        assert_eq!(file.bytes("b").unwrap(), [1, 2, 3]);
        for (message, part) in [
            (file.floats("b").unwrap_err(), "`b` is of uint8; expected float32"),
            (file.bytes("f").unwrap_err(), "`f` is of float32; expected uint8"),
            (file.floats("g").unwrap_err(), "there is no `g`; there are b, f, none"),
        ] {
            assert!(message.contains(part), "{message}");
        }
    }

    #[test]
    fn broken_files_say_what_is_wrong() {
        let good = file();
        for end in 0..good.len() {
            assert!(TensorFile::new(&good[..end]).is_err(), "{end}");
        }
        // The second field: its name at 40, dimensions at 41, type at 43, offset at 44, sizes at 52.
        let at = good.windows(3).position(|w| w == b"\x01\0f").unwrap() + 2;
        let with = |offset: usize, bytes: &[u8]| {
            let mut file = good.clone();
            file[offset..offset + bytes.len()].copy_from_slice(bytes);
            TensorFile::new(&file).map(|_| ()).unwrap_err()
        };
        let huge = u64::MAX.to_le_bytes();
        for (message, part) in [
            (with(0, b"x"), "not a tensor file"),
            (with(12, &[2]), "version 2.0"),
            (with(14, &u32::MAX.to_le_bytes()), "field 3: the file is cut short"),
            (with(at, b"b"), "`b` is there twice"),
            (with(at, &[0xff]), "the name of field 1"),
            (with(at + 1, &[255, 255]), "`f`: the file is cut short"),
            (with(at + 3, &[12]), "`f`: has values of the type 12"),
            (with(at + 3, &[0]), "type 0"),
            (with(at + 4, &huge), "`f`: has the shape [2, 2] at byte 18446744073709551615"),
            (with(at + 12, &huge), "beyond the"),
            (with(at + 12, &[3]), "`f`: has the shape [3, 2]"),
        ] {
            assert!(message.contains(part), "{part}: {message}");
        }
    }
}
