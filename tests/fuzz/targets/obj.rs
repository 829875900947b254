//! Wavefront OBJ.

#![no_main]

use drt_fuzz::use_mesh;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(mesh) = drt_geom::decode_obj(bytes, "fuzz.obj") {
        use_mesh(&mesh);
    }
});
