//! Measured materials, which then scatter light.

#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use drt_estimators::Settings;
use drt_fuzz::{folder, scene_in, use_scene, write};
use libfuzzer_sys::fuzz_target;

const SCENE: &str = r#"<scene version="3.0.0"><sensor type="perspective"><transform name="to_world">
    <lookat origin="0,1,4" target="0,0,0" up="0,1,0"/></transform></sensor>
    <shape type="rectangle"><bsdf type="measured"><string name="filename" value="m.bsdf"/></bsdf></shape>
    <emitter type="constant"/></scene>"#;

static FOLDER: LazyLock<PathBuf> = LazyLock::new(folder);

fuzz_target!(|bytes: &[u8]| {
    write(&FOLDER.join("m.bsdf"), bytes);
    if let Some(scene) = scene_in(&FOLDER, SCENE) {
        use_scene(scene, &[], &Settings::default());
    }
});
