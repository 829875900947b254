//! Image files: EXR with everything, PNG to look at.

mod contact_sheet;
mod exr_file;
mod font;
pub(crate) mod picture;
#[cfg(test)]
pub(crate) mod tests;
pub(crate) mod tone;

#[cfg(feature = "command")]
pub(crate) use contact_sheet::{Canvas, show_layers};
pub use contact_sheet::{is_error, write_layers, write_preview};
pub use exr_file::{
    ExrFile, NamedLayer, Provenance, attachment, decode_exr, encode_texels, is_result_of, read_exr,
    write_exr,
};
pub use picture::{Picture, read_picture};
pub use tone::{Tone, ToneCurve};
