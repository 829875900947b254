//! Files other than scenes and jobs: images, arrays, digests and tables of materials, and how files are read and written
//! whole.

pub mod atomic;
pub mod checksum;
pub mod digest;
pub mod image;
pub(crate) mod input_file;
pub(crate) mod lines;
pub mod measured_file;
pub(crate) mod memory;
pub mod mesh_file;
pub mod npy;
pub(crate) mod pfm;
pub(crate) mod tensor_file;
