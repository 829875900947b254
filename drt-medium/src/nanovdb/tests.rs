use std::string::ToString;
use std::vec::Vec;

use drt_math::{Affine, Mat3, Rng, Vec3, vec3};

use super::*;

/// Two blobs far from each other in a large box, in numbers that f32 has.
fn sparse(channels: usize) -> NanoVdb {
    let size = [150, 20, 9];
    let mut rng = Rng::new(5, 0, 0);
    let mut values = Vec::new();
    for i in 0..size[0] * size[1] * size[2] {
        let x = i % size[0];
        for _ in 0..channels {
            let value = f64::from(rng.next_f64() as f32);
            values.push(if (9..17).contains(&x) || x >= 140 { value } else { 0.0 });
        }
    }
    let linear = Mat3::from_rows(vec3(2.0, 0.5, 0.0), vec3(0.0, 1.0, -0.25), vec3(0.0, 0.0, 3.0));
    let placement = Affine { linear, translation: vec3(-1.0, 4.0, 0.5) };
    let grid = Grid::new(size, channels, values).unwrap();
    NanoVdb { name: "density".to_string(), grid, placement }
}

#[test]
fn what_is_written_is_read() {
    for channels in [1, 3] {
        let volume = sparse(channels);
        let bytes = encode(&volume).unwrap();
        for name in [None, Some("density")] {
            let found = decode(&bytes, "a.nvdb", name).unwrap();
            assert_eq!(found.grid, volume.grid);
            assert_eq!(found.name, volume.name);
            let at = |placement: &Affine, v: Vec3| placement.linear * v + placement.translation;
            let off = |v| (at(&found.placement, v) - at(&volume.placement, v)).length();
            assert!(off(Vec3::ZERO) + off(vec3(1.0, 1.0, 1.0)) < 1e-12);
        }
        let other = decode(&bytes, "a.nvdb", Some("heat")).unwrap_err().to_string();
        assert_eq!(
            other,
            "a.nvdb, byte 0: the list of grids is `density`, expected one with the name that is asked for"
        );
    }
}

#[test]
fn packed_grids_are_read() {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::ZlibEncoder;

    let volume = sparse(1);
    let plain = encode(&volume).unwrap();
    let start = 16 + 176 + 8;
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
    packed.write_all(&plain[start..]).unwrap();
    let packed = packed.finish().unwrap();
    let file = |size: u64, packed: &[u8]| {
        let mut file = plain[..start].to_vec();
        file[16..24].copy_from_slice(&size.to_le_bytes());
        file[24..32].copy_from_slice(&(8 + packed.len() as u64).to_le_bytes());
        file[16 + 168] = 1;
        file.extend((packed.len() as u64).to_le_bytes());
        file.extend(packed);
        file
    };
    let size = (plain.len() - start) as u64;
    assert_eq!(decode(&file(size, &packed), "a", None).unwrap().grid, volume.grid);
    let refused = |file: &[u8]| decode(file, "a", None).unwrap_err().to_string();
    for wrong in [size - 1, size + 1, 1 << 50] {
        let error = refused(&file(wrong, &packed));
        assert!(error.contains("expected as many bytes as are announced"), "{error}");
    }
    assert!(refused(&file(size, &packed[..packed.len() / 2])).contains("a packed grid"));
}

/// Any cut and any wrong number is an error, a grid of the same size, or a tree of other places, and none is a panic or takes long.
#[test]
fn hostile_files_are_refused() {
    let volume = sparse(1);
    let bytes = encode(&volume).unwrap();
    for length in (0..400).chain((400..bytes.len()).step_by(9973)) {
        assert!(decode(&bytes[..length], "a", None).is_err(), "{length}");
    }
    let root = 200 + 672 + 64;
    let mut rng = Rng::new(7, 0, 0);
    let numbers =
        (0..200).chain(200..200 + 48).chain(200 + 632..root + 140).chain(root + 8352..root + 8600);
    for at in numbers {
        for _ in 0..2 {
            let mut wrong = bytes.clone();
            wrong[at] ^= 1 << (rng.next_u32() % 8);
            if let Err(error) = decode(&wrong, "a", None) {
                let text = error.to_string();
                assert!(text.starts_with('a') && text.len() < 300, "{text}");
            }
        }
    }
    let with = |at: usize, number: &[u8]| {
        let mut wrong = bytes.clone();
        wrong[at..at + number.len()].copy_from_slice(number);
        decode(&wrong, "a", None).unwrap_err().to_string()
    };
    for (at, number, part) in [
        (8, 29_u32 << 21, "the major version is 29, expected 32"),
        (200 + 636, 13, "the kind of values is 13"),
        (200 + 632, 1, "the class of the grid is 1"),
        (root + 12, 1 << 30, "the box of active values"),
        (16 + 168, 2, "the packing of a grid is 2, expected 0 (none) or 1 (zlib)"),
    ] {
        let error = with(at, &number.to_le_bytes()[..if at == 184 { 2 } else { 4 }]);
        assert!(error.contains(part), "{error}");
    }
    // The root's only tile again and again.
    let error = with(root + 24, &1000_u32.to_le_bytes());
    assert!(!error.is_empty());
}

#[test]
fn what_cannot_be_stored_is_refused() {
    let refused = |change: fn(&mut NanoVdb)| {
        let mut volume = sparse(1);
        change(&mut volume);
        encode(&volume).unwrap_err().to_string()
    };
    assert!(refused(|v| v.name = "a".repeat(256)).contains("255 bytes"));
    assert!(refused(|v| v.placement.linear = Mat3::diagonal(Vec3::ZERO)).contains("no inverse"));
    let large = |v: &mut NanoVdb| v.grid = Grid::new([1, 1, 1], 1, Vec::from([1e300])).unwrap();
    assert!(refused(large).contains("float32"));
    let empty =
        NanoVdb { grid: Grid::new([2, 3, 4], 1, Vec::from([0.0; 24])).unwrap(), ..sparse(1) };
    let bytes = encode(&empty).unwrap();
    assert_eq!(decode(&bytes, "e", None).unwrap().grid, empty.grid);
}
