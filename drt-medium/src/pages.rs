//! Bytes of a file or of a grid of it, none of which is read before it is known to be there.

use std::string::{String, ToString};

use crate::vol_error::VolError;

/// Bytes with a name for errors.
#[derive(Clone, Copy)]
pub(crate) struct Pages<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) file: &'a str,
}

impl<'a> Pages<'a> {
    pub(crate) fn slice(&self, offset: usize, length: usize) -> Result<&'a [u8], VolError> {
        let end = offset.checked_add(length);
        end.and_then(|end| self.bytes.get(offset..end)).ok_or_else(|| VolError::Cut {
            file: self.file.to_string(),
            found: self.bytes.len(),
            expected: end.unwrap_or(usize::MAX),
        })
    }

    fn array<const N: usize>(&self, offset: usize) -> Result<[u8; N], VolError> {
        let slice = self.slice(offset, N)?;
        Ok(core::array::from_fn(|i| slice[i]))
    }

    pub(crate) fn u16(&self, offset: usize) -> Result<u16, VolError> {
        self.array(offset).map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&self, offset: usize) -> Result<u32, VolError> {
        self.array(offset).map(u32::from_le_bytes)
    }

    pub(crate) fn i32(&self, offset: usize) -> Result<i32, VolError> {
        self.array(offset).map(i32::from_le_bytes)
    }

    pub(crate) fn u64(&self, offset: usize) -> Result<u64, VolError> {
        self.array(offset).map(u64::from_le_bytes)
    }

    /// A number of bytes, from one place or to one.
    pub(crate) fn length(&self, offset: usize, field: &'static str) -> Result<usize, VolError> {
        let n = self.u64(offset)?;
        usize::try_from(n).ok().filter(|n| *n < usize::MAX / 4).ok_or_else(|| {
            self.field(offset, field, n.to_string(), "a number of bytes that a file can have")
        })
    }

    pub(crate) fn f64(&self, offset: usize, field: &'static str) -> Result<f64, VolError> {
        self.finite(offset, field, f64::from_le_bytes(self.array(offset)?))
    }

    pub(crate) fn f32(&self, offset: usize, field: &'static str) -> Result<f64, VolError> {
        self.finite(offset, field, f64::from(f32::from_le_bytes(self.array(offset)?)))
    }

    pub(crate) fn finite(
        &self,
        offset: usize,
        field: &'static str,
        value: f64,
    ) -> Result<f64, VolError> {
        match value.is_finite() {
            true => Ok(value),
            false => Err(self.field(offset, field, value.to_string(), "a finite number")),
        }
    }

    pub(crate) fn signature(
        &self,
        offset: usize,
        among: [[u8; 8]; 2],
        expected: &'static str,
    ) -> Result<(), VolError> {
        let found: [u8; 8] = self.array(offset)?;
        match among.contains(&found) {
            true => Ok(()),
            false => {
                let shown = String::from_utf8_lossy(&found).escape_debug().to_string();
                Err(self.field(offset, "the signature", shown, expected))
            }
        }
    }

    pub(crate) fn field(
        &self,
        offset: usize,
        field: &'static str,
        found: String,
        expected: &'static str,
    ) -> VolError {
        VolError::Field { file: self.file.to_string(), offset, field, found, expected }
    }
}
