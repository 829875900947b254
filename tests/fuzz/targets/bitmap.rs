//! Images, as a texture and as an environment. The first byte says which kind of file the others are.

#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use drt_estimators::Settings;
use drt_fuzz::{folder, scene_in, use_scene, write};
use libfuzzer_sys::fuzz_target;

const KINDS: [&str; 5] = ["png", "jpg", "bmp", "hdr", "exr"];

static FOLDER: LazyLock<PathBuf> = LazyLock::new(folder);

fuzz_target!(|bytes: &[u8]| {
    let Some((kind, bytes)) = bytes.split_first() else { return };
    let file = format!("image.{}", KINDS[usize::from(*kind) % KINDS.len()]);
    write(&FOLDER.join(&file), bytes);
    let file = format!(r#"<string name="filename" value="{file}"/>"#);
    for inside in [
        format!(
            r#"<shape type="rectangle"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">
               {file}</texture></bsdf></shape><emitter type="constant"/>"#
        ),
        format!(r#"<emitter type="envmap">{file}</emitter>"#),
        format!(
            r#"<shape type="rectangle"/><emitter type="projector"><texture type="bitmap" name="irradiance">
               {file}</texture></emitter>"#
        ),
    ] {
        let scene = format!(
            r#"<scene version="3.0.0"><sensor type="perspective"><transform name="to_world">
               <lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform></sensor>{inside}</scene>"#
        );
        if let Some(scene) = scene_in(&FOLDER, &scene) {
            use_scene(scene, &[], &Settings::default());
        }
    }
});
