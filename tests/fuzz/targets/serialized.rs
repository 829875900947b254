//! Mitsuba's serialized meshes: two of a file.

#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use drt_fuzz::{folder, scene_in, use_mesh, write};
use libfuzzer_sys::fuzz_target;

static FOLDER: LazyLock<PathBuf> = LazyLock::new(folder);

fuzz_target!(|bytes: &[u8]| {
    write(&FOLDER.join("mesh.serialized"), bytes);
    for index in 0..2 {
        let scene = format!(
            r#"<scene version="3.0.0"><shape type="serialized">
               <string name="filename" value="mesh.serialized"/>
               <integer name="shape_index" value="{index}"/></shape></scene>"#
        );
        if let Some(scene) = scene_in(&FOLDER, &scene) {
            scene.shapes.iter().for_each(|s| use_mesh(&s.mesh));
        }
    }
});
