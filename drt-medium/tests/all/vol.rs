//! `.vol` files: read what is written, and refuse everything else with the place.

use drt_math::{Vec3, vec3};
use drt_medium::Grid;
use drt_medium::vol::{
    VolError, VolFile, decode, decode_matrices, encode, encode_matrices, read, read_matrices, write,
};
use proptest::prelude::*;

fn sample() -> VolFile {
    let values = (0..2 * 3 * 4 * 3).map(|i| f64::from(i) * 0.25).collect();
    let grid = Grid::new([2, 3, 4], 3, values).expect("a valid grid");
    VolFile { grid, bounds: [vec3(-1.0, 0.0, 2.0), vec3(1.0, 0.5, 4.0)] }
}

/// A header in the format of the documentation, written out by hand.
fn header(encoding: i32, size: [i32; 3], channels: i32) -> Vec<u8> {
    let mut bytes = vec![0x56, 0x4f, 0x4c, 0x03];
    for n in [encoding, size[0], size[1], size[2], channels] {
        bytes.extend(n.to_le_bytes());
    }
    for x in [0.0_f32, 0.0, 0.0, 1.0, 2.0, 4.0] {
        bytes.extend(x.to_le_bytes());
    }
    bytes
}

fn refusal(bytes: &[u8]) -> String {
    let error = decode(bytes, "cloud.vol").expect_err("a bad file").to_string();
    assert!(error.contains("cloud.vol"), "{error}");
    error
}

#[test]
fn written_files_come_back() {
    let volume = sample();
    let path = std::env::temp_dir().join(format!("drt-medium-{}.vol", std::process::id()));
    write(&path, &volume).expect("a writable folder");
    let again = read(&path).expect("what was written");
    std::fs::remove_file(&path).expect("the file just written");
    assert_eq!(again, volume);
    assert_eq!(again.placement().point(vec3(0.5, 1.0, 0.0)), vec3(0.0, 0.5, 2.0));
    let missing = read(&path).expect_err("no such file").to_string();
    assert!(missing.contains("drt-medium-"), "{missing}");
}

#[test]
fn written_matrices_come_back() {
    let [diagonal, mut others] = [sample(), sample()];
    let negative = others.grid.values().iter().map(|v| -0.5 * v).collect();
    others.grid = Grid::new([2, 3, 4], 3, negative).expect("a valid grid");
    let parts = [diagonal, others];
    let path = std::env::temp_dir().join(format!("drt-medium-s-{}.vol", std::process::id()));
    let bytes = encode_matrices(&parts).expect("numbers that fit");
    // Six channels side by side.
    assert_eq!(bytes[20], 6);
    assert_eq!(decode_matrices(&bytes, "s.vol").expect("what was written"), parts);
    std::fs::write(&path, bytes).expect("a writable folder");
    let again = read_matrices(&path);
    let alone = read(&path).expect_err("a file of matrices").to_string();
    std::fs::remove_file(&path).expect("the file just written");
    assert_eq!(again.expect("what was written"), parts);
    assert!(alone.contains("expected 1 or 3"), "{alone}");
    let [diagonal, _] = parts;
    let narrow = Grid::new([2, 3, 4], 1, vec![0.0; 24]).expect("a valid grid");
    let narrow = VolFile { grid: narrow, ..diagonal.clone() };
    assert!(matches!(encode_matrices(&[diagonal, narrow]), Err(VolError::NotStorable(_))));
}

#[test]
fn a_cut_file_is_refused_before_room_for_its_values_is_asked_for() {
    let path = std::env::temp_dir().join(format!("drt-medium-cut-{}.vol", std::process::id()));
    // A terabyte of values, of which one is there.
    for (sizes, found) in [([1 << 14, 1 << 12, 1 << 12], 52), ([i32::MAX; 3], 52)] {
        let mut bytes = header(1, sizes, 1);
        bytes.extend(1.0_f32.to_le_bytes());
        std::fs::write(&path, bytes).expect("a writable folder");
        let refusal = read(&path).expect_err("a cut file");
        std::fs::remove_file(&path).expect("the file just written");
        assert!(matches!(refusal, VolError::Cut { found: f, .. } if f == found), "{refusal}");
    }
}

#[test]
fn the_three_encodings() {
    let values = |v: VolFile| v.grid.values().to_vec();
    let mut bytes = header(1, [2, 1, 1], 1);
    bytes.extend([0x00, 0x00, 0x80, 0x3f, 0x00, 0x00, 0x20, 0xc0]);
    let float = decode(&bytes, "f").expect("float32");
    assert_eq!(float.bounds, [Vec3::ZERO, vec3(1.0, 2.0, 4.0)]);
    assert_eq!(values(float), [1.0, -2.5]);

    let mut bytes = header(2, [3, 2, 1], 1);
    for h in [0x3c00_u16, 0xc000, 0x0001, 0x7bff, 0x0400, 0x8000] {
        bytes.extend(h.to_le_bytes());
    }
    let halves = [1.0, -2.0, 2.0_f64.powi(-24), 65504.0, 2.0_f64.powi(-14), 0.0];
    assert_eq!(values(decode(&bytes, "h").expect("float16")), halves);

    let mut bytes = header(3, [1, 1, 1], 3);
    bytes.extend([0, 51, 255]);
    assert_eq!(values(decode(&bytes, "b").expect("bytes")), [0.0, 0.2, 1.0]);
}

#[test]
fn bad_files_are_refused_with_the_place() {
    let good = encode(&sample()).expect("storable");
    let cut = refusal(&good[..good.len() - 1]);
    assert!(cut.contains("cut off at byte 335") && cut.contains("336"), "{cut}");
    assert!(refusal(&good[..20]).contains("cut off at byte 20"));
    assert!(refusal(b"").contains("cut off at byte 0"));
    assert!(refusal(&[&b"VOL\x02"[..], &good[4..]].concat()).contains("byte 0"));
    assert!(refusal(&header(4, [1, 1, 1], 1)).contains("byte 4"));
    assert!(refusal(&header(1, [1, -1, 1], 1)).contains("byte 12"));
    assert!(refusal(&header(1, [1, 1, 0], 1)).contains("byte 16"));
    assert!(refusal(&header(1, [1, 1, 1], 2)).contains("byte 20"));
    // 2^93 values: more than any memory.
    assert!(refusal(&header(1, [i32::MAX; 3], 3)).contains("cut off"));
    // 2⁶⁴ - 1 bytes of values, which leave no room for the header.
    let largest = refusal(&header(3, [14_002_645, 65_537, 6_700_417], 3));
    assert!(largest.contains(&usize::MAX.to_string()), "{largest}");
    let mut nan = good.clone();
    nan[52..56].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(refusal(&nan).contains("byte 52: a grid value is NaN"));
    let mut bounds = good;
    bounds[28..32].copy_from_slice(&f32::INFINITY.to_le_bytes());
    assert!(refusal(&bounds).contains("byte 28: the bounding box is inf"));
}

#[test]
fn what_float32_cannot_hold_is_not_written() {
    let grid = Grid::new([1, 1, 1], 1, vec![1e300]).expect("a valid grid");
    let volume = VolFile { grid, bounds: [Vec3::ZERO; 2] };
    assert!(matches!(encode(&volume), Err(VolError::NotStorable(_))));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_bytes_make_it_panic(mut tail in proptest::collection::vec(any::<u8>(), 0..200), magic: bool) {
        if magic && tail.len() > 4 {
            tail[..4].copy_from_slice(b"VOL\x03");
        }
        let _ = decode(&tail, "noise");
    }

    #[test]
    fn no_damaged_header_makes_it_panic(position in 0_usize..48, byte: u8) {
        let mut bytes = encode(&sample()).expect("storable");
        bytes[position] = byte;
        let _ = decode(&bytes, "damaged");
    }
}
