//! A column of a table, and the types of the numbers in it.

use alloc::string::String;

/// A column: a number per row, or a list of numbers.
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Scalar,
    /// The type of the list's length.
    pub(super) length: Option<Scalar>,
}

/// The types of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Property {
    pub(super) fn is_list(&self) -> bool {
        self.length.is_some()
    }
}

impl Scalar {
    pub(super) fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    pub(super) fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}
