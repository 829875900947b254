//! Mitsuba's `.serialized` files: several meshes in one file, each deflated (Mitsuba 0.6
//! documentation, section 8.2.5; the `serialized` plugin of Mitsuba 3).
//!
//! All numbers are little-endian. The file ends with the offset of each mesh (64 bits; 32 in version
//! 3) and their count (32 bits). A mesh starts with the magic number and the version, 16 bits each;
//! deflated follow flags, in version 4 a name that a zero ends, the numbers of vertices and triangles
//! (64 bits), and arrays: positions, normals, texture coordinates, colours, indices.

use std::io::Read;
use std::path::Path;

use drt_geom::Mesh;
use drt_math::{Vec3, vec3};
use flate2::read::ZlibDecoder;

use super::mesh_file;
use crate::CliError;
use crate::files::memory;
use crate::scene_xml::element::Element;

/// More vertices or triangles are refused: they would take many gigabytes, which a small file can inflate to.
const MOST: u64 = 1 << 27;
const MAGIC: u16 = 0x041C;
const HAS_NORMALS: u32 = 0x0001;
const HAS_TEXTURE_COORDINATES: u32 = 0x0002;
const HAS_COLOURS: u32 = 0x0008;
const FACE_NORMALS: u32 = 0x0010;
const DOUBLE_PRECISION: u32 = 0x2000;

/// Reads mesh number `index` of a file for the shape `e`.
pub(super) fn read(e: &Element, path: &Path, index: u32) -> Result<Mesh, CliError> {
    let bytes = mesh_file::bytes(e, path)?;
    let mesh = part(&bytes, index).and_then(mesh);
    mesh.map_err(|reason| e.error(format!("{}: {reason}", path.display())))
}

/// The version and the deflated part of a mesh.
fn part(bytes: &[u8], index: u32) -> Result<(u16, &[u8]), String> {
    let short = || "the file is cut short".to_owned();
    let header = |at: usize| {
        let bytes = bytes.get(at..)?.first_chunk::<4>()?;
        Some([u16::from_le_bytes([bytes[0], bytes[1]]), u16::from_le_bytes([bytes[2], bytes[3]])])
    };
    let version_at = |at: usize| match header(at) {
        Some([MAGIC, version @ (3 | 4)]) => Ok(version),
        Some([MAGIC, version]) => Err(format!("version {version} is not known; expected 3 or 4")),
        Some(_) => Err("this is not a .serialized file".to_owned()),
        None => Err(short()),
    };
    let width = if version_at(0)? == 3 { 4 } else { 8 };
    let (rest, count) = bytes.split_last_chunk::<4>().ok_or_else(short)?;
    let count = u32::from_le_bytes(*count);
    if index >= count {
        return Err(format!("`shape_index` is {index}, but the file has {count} meshes"));
    }
    let back = (count - index) as usize * width;
    let entry = rest.len().checked_sub(back).map(|at| &rest[at..at + width]).ok_or_else(short)?;
    let offset = entry.iter().rev().fold(0_u64, |n, byte| n << 8 | u64::from(*byte));
    let offset = usize::try_from(offset).map_err(|_| short())?;
    let version = version_at(offset)?;
    Ok((version, &bytes[offset + 4..]))
}

fn mesh((version, deflated): (u16, &[u8])) -> Result<Mesh, String> {
    let length = deflated.len() as u64;
    let mut stream = Stream { inflated: ZlibDecoder::new(deflated), deflated: length };
    let flags = u32::from_le_bytes(stream.chunk()?);
    if version == 4 {
        while stream.chunk::<1>()? != [0] {}
    }
    let vertices = u64::from_le_bytes(stream.chunk()?);
    let triangles = u64::from_le_bytes(stream.chunk()?);
    let double = flags & DOUBLE_PRECISION != 0;
    let positions = triples(&stream.floats(vertices, 3, double)?);
    let normals = match flags & HAS_NORMALS {
        0 => None,
        _ => Some(triples(&stream.floats(vertices, 3, double)?)),
    };
    let texcoords = match flags & HAS_TEXTURE_COORDINATES {
        0 => Vec::new(),
        _ => stream.floats(vertices, 2, double)?,
    };
    if flags & HAS_COLOURS != 0 {
        stream.floats(vertices, 3, double)?;
    }
    // Wider indices come with more vertices than a mesh can have.
    let indices = stream.bytes(triangles, 12)?;
    let indices: Vec<u32> =
        indices.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let triangles = indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    let mut mesh = Mesh::new(positions, triangles).map_err(|err| err.to_string())?;
    if !texcoords.is_empty() {
        let at = |v: u32| [0, 1].map(|k| texcoords[2 * v as usize + k]);
        let corners = mesh.triangles.iter().map(|t| t.map(at)).collect();
        mesh = mesh.with_texcoords(corners).map_err(|err| err.to_string())?;
    }
    match normals.filter(|_| flags & FACE_NORMALS == 0) {
        Some(normals) => mesh.with_normals(normals).map_err(|err| err.to_string()),
        None => Ok(mesh),
    }
}

fn triples(numbers: &[f64]) -> Vec<Vec3> {
    numbers.chunks_exact(3).map(|v| vec3(v[0], v[1], v[2])).collect()
}

struct Stream<'a> {
    inflated: ZlibDecoder<&'a [u8]>,
    /// Bytes of what is deflated.
    deflated: u64,
}

impl Stream<'_> {
    fn chunk<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut chunk = [0; N];
        self.inflated.read_exact(&mut chunk).map_err(|err| err.to_string())?;
        Ok(chunk)
    }

    /// `count` items of `size` bytes. Memory grows with what is there, not with what is claimed, and no further than there is.
    fn bytes(&mut self, count: u64, size: u64) -> Result<Vec<u8>, String> {
        let length =
            count.checked_mul(size).filter(|_| count <= MOST).ok_or("the mesh is too large")?;
        memory::plausible(length, self.deflated)?;
        // As bytes and as numbers.
        let all = 3 * u128::from(length);
        memory::check(all).map_err(|reason| format!("its numbers would {reason}"))?;
        let mut bytes = Vec::new();
        let read = self.inflated.by_ref().take(length).read_to_end(&mut bytes);
        match read.map_err(|err| err.to_string())? {
            n if n as u64 == length => Ok(bytes),
            _ => Err("the mesh is cut short".into()),
        }
    }

    fn floats(&mut self, count: u64, each: u64, double: bool) -> Result<Vec<f64>, String> {
        let single = |b: &[u8]| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let wide = |b: &[u8]| f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]);
        Ok(if double {
            self.bytes(count, 8 * each)?.chunks_exact(8).map(wide).collect()
        } else {
            self.bytes(count, 4 * each)?.chunks_exact(4).map(single).collect()
        })
    }
}
