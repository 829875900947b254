//! What must hold for everything that a reader accepts: it can be used without a panic.
//!
//! ```sh
//! cargo install cargo-fuzz
//! cargo run --manifest-path tests/fuzz/Cargo.toml --example seeds
//! cargo +nightly fuzz run --fuzz-dir tests/fuzz xml -- -timeout=20
//! ```

#![forbid(unsafe_code)]

use std::path::{Path, PathBuf};

use drt_cli::{Defaults, decode_scene};
use drt_estimators::{Depth, Scene, Session, Settings, Unattended};
use drt_geom::{Mesh, Ray, Skip, TetLocator, TetMesh, TriangleBvh};
use drt_math::{Vec3, vec3};
use drt_motion::Parameter;

/// A scene with something of every kind for jobs to name.
pub const SCENE: &str = include_str!("../scene.xml");

/// Checks the indices of a mesh, and traces a ray where it can be traced at all.
pub fn use_mesh(mesh: &Mesh) {
    let valid = Mesh::new(mesh.positions.clone(), mesh.triangles.clone());
    valid.expect("a reader's mesh is valid");
    for i in 0..mesh.positions.len() as u32 {
        assert!(mesh.source_vertex(i) < mesh.source_vertex_count);
    }
    if let Ok(bvh) = TriangleBvh::of(mesh) {
        let ray = Ray::new(bvh.bounds().center(), vec3(0.3, -0.5, 0.8));
        let hit = bvh.closest(&ray, Skip::default());
        assert!(hit.is_none_or(|h| h.t.is_finite()));
    }
}

/// Locates points in tetrahedra, where they are any that points can be located in.
pub fn use_tetrahedra(mesh: &TetMesh) {
    let _ = mesh.validate();
    let Ok(locator) = TetLocator::new(mesh) else { return };
    for tet in 0..mesh.tets.len() as u32 {
        let middle = mesh.tet(tet).into_iter().fold(Vec3::ZERO, |sum, p| sum + p * 0.25);
        for hint in [None, Some(tet)] {
            let found = locator.locate(middle, hint);
            assert!(found.is_none_or(|p| (p.tet as usize) < mesh.tets.len()));
        }
    }
}

/// Reads a scene whose files are in a folder; `None` where it is refused.
#[must_use]
pub fn scene_in(folder: &Path, text: &str) -> Option<Scene> {
    decode_scene(text.as_bytes(), &folder.join("scene.xml"), &Defaults::new()).ok()
}

/// Renders a few pixels. A scene may still be refused, but not crash, nor have infinite pixels.
pub fn use_scene(mut scene: Scene, parameters: &[Parameter], settings: &Settings) {
    for sensor in &mut scene.sensors {
        let small = sensor.item.sensor.with_film([3, 2]);
        sensor.item.sensor = small.expect("two sides that are not zero");
    }
    let settings = Settings { max_depth: Depth::AtMost(3), threads: 1, ..settings.clone() };
    if let Ok(mut session) = Session::new(&scene, parameters, &settings) {
        session.run(2, &Unattended);
        let rendering = session.rendering();
        let layers = rendering.derivatives.iter().map(|d| &d.total);
        for pixel in layers.chain([&rendering.image]).flat_map(|l| &l.pixels) {
            assert!(pixel.mean.is_finite());
        }
    }
}

/// A folder of this process alone that holds [`SCENE`] as `scene.xml`, and velocities of four vertices.
///
/// # Panics
/// When it cannot be written.
pub fn folder() -> PathBuf {
    let folder = std::env::temp_dir().join(format!("drt-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("the temporary folder can be written");
    write(&folder.join("scene.xml"), SCENE.as_bytes());
    write(&folder.join("velocity.txt"), b"0 0 1\n0 0 0\n0 1 0\n1 0 0\n");
    folder
}

/// Writes a file.
///
/// # Panics
/// When it cannot be written.
pub fn write(path: &Path, bytes: &[u8]) {
    std::fs::write(path, bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}
