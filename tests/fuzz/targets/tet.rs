//! Tetrahedra: Medit's `.mesh`, or TetGen's `.node` and `.ele` with a line `---` between them.

#![no_main]

use drt_fuzz::use_tetrahedra;
use libfuzzer_sys::fuzz_target;

const BETWEEN: &[u8] = b"\n---\n";

fuzz_target!(|bytes: &[u8]| {
    let cut = bytes.windows(BETWEEN.len()).position(|w| w == BETWEEN);
    let mesh = match cut {
        Some(at) => {
            let (nodes, tets) = (&bytes[..at], &bytes[at + BETWEEN.len()..]);
            drt_geom::decode_tetgen([(nodes, "fuzz.node"), (tets, "fuzz.ele")])
        }
        None => drt_geom::decode_medit(bytes, "fuzz.mesh"),
    };
    if let Ok(mesh) = mesh {
        use_tetrahedra(&mesh);
    }
});
