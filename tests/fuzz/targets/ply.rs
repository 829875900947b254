//! PLY, as a mesh and as a list of vectors.

#![no_main]

use drt_fuzz::use_mesh;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(mesh) = drt_geom::decode_ply(bytes, "fuzz.ply") {
        use_mesh(&mesh);
    }
    if let Ok(vectors) = drt_geom::decode_vertex_vectors(bytes, "fuzz.ply") {
        assert!(vectors.iter().all(|v| v.is_finite()));
    }
});
