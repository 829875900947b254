//! Image files: EXR with everything, PNG to look at.

mod contact_sheet;
mod exr_file;
mod font;
mod picture;
#[cfg(test)]
pub(crate) mod tests;
pub(crate) mod tone;

pub use contact_sheet::write_preview;
pub(crate) use contact_sheet::{is_error, write_layers};
pub use exr_file::{ExrFile, Provenance, read_exr, write_exr};
pub(crate) use exr_file::{attachment, is_result_of};
pub(crate) use picture::{encode_png, read_picture};
