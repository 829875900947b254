use alloc::string::String;
use alloc::vec::Vec;

use super::PlyErrorKind;
use super::property::{Property, Scalar};

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

impl Encoding {
    pub(super) fn named(name: &str) -> Option<Self> {
        Some(match name {
            "ascii" => Self::Ascii,
            "binary_little_endian" => Self::LittleEndian,
            "binary_big_endian" => Self::BigEndian,
            _ => return None,
        })
    }
}

/// The data after the header, from where it has not been read.
pub(super) struct Body<'a> {
    pub(super) encoding: Encoding,
    pub(super) rest: &'a [u8],
    pub(super) line: usize,
}

impl Body<'_> {
    /// The line reading has come to, where the file has lines.
    pub(super) fn line(&self) -> Option<usize> {
        (self.encoding == Encoding::Ascii).then_some(self.line)
    }

    /// Reads a row's values of one property: a single number or the list.
    pub(super) fn read(&mut self, p: &Property, out: &mut Vec<f64>) -> Result<(), PlyErrorKind> {
        out.clear();
        let length = match p.length {
            None => 1.0,
            Some(kind) => self.number(kind)?,
        };
        if length < 0.0 {
            return Err(PlyErrorKind::BadLength(length as i64));
        }
        // Not reserved ahead: the length may be a lie.
        for _ in 0..length as u64 {
            out.push(self.number(p.kind)?);
        }
        Ok(())
    }

    fn number(&mut self, kind: Scalar) -> Result<f64, PlyErrorKind> {
        match kind {
            Scalar::I8 => self.typed(i8::from_be_bytes),
            Scalar::U8 => self.typed(u8::from_be_bytes),
            Scalar::I16 => self.typed(i16::from_be_bytes),
            Scalar::U16 => self.typed(u16::from_be_bytes),
            Scalar::I32 => self.typed(i32::from_be_bytes),
            Scalar::U32 => self.typed(u32::from_be_bytes),
            Scalar::F32 => self.typed(f32::from_be_bytes),
            Scalar::F64 => self.typed(f64::from_be_bytes),
        }
    }

    /// A number of `N` bytes, or a token that parses as one.
    fn typed<T, const N: usize>(
        &mut self,
        from_bytes: fn([u8; N]) -> T,
    ) -> Result<f64, PlyErrorKind>
    where
        T: core::str::FromStr + Into<f64>,
    {
        if self.encoding == Encoding::Ascii {
            let token = self.token()?;
            return token.parse::<T>().map(Into::into).map_err(|_| PlyErrorKind::BadNumber(token));
        }
        let (bytes, rest) = self.rest.split_first_chunk::<N>().ok_or(PlyErrorKind::Cut)?;
        self.rest = rest;
        let mut bytes = *bytes;
        if self.encoding == Encoding::LittleEndian {
            bytes.reverse();
        }
        Ok(from_bytes(bytes).into())
    }

    /// The next word of an ASCII file.
    fn token(&mut self) -> Result<String, PlyErrorKind> {
        while let [b, rest @ ..] = self.rest
            && b.is_ascii_whitespace()
        {
            self.line += usize::from(*b == b'\n');
            self.rest = rest;
        }
        let end = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        if word.is_empty() {
            return Err(PlyErrorKind::Cut);
        }
        Ok(String::from_utf8_lossy(word).into_owned())
    }
}
