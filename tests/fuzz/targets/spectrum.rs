//! Spectra of files, in a scene and of lights.

#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use drt_fuzz::{folder, scene_in, write};
use libfuzzer_sys::fuzz_target;

static FOLDER: LazyLock<PathBuf> = LazyLock::new(folder);

fuzz_target!(|text: &str| {
    write(&FOLDER.join("spectrum.spd"), text.as_bytes());
    // The same text, as a value, as far as XML lets it be one.
    let value: String =
        text.chars().filter(|c| !c.is_control() && !"<>&\"$".contains(*c)).take(4096).collect();
    for attribute in ["filename=\"spectrum.spd\"".to_owned(), format!("value=\"{value}\"")] {
        let scene = format!(
            r#"<scene version="3.0.0"><bsdf type="diffuse"><spectrum name="reflectance" {attribute}/></bsdf>
               <emitter type="point"><spectrum name="intensity" {attribute}/></emitter></scene>"#
        );
        if let Some(scene) = scene_in(&FOLDER, &scene) {
            scene.emitters.iter().for_each(|e| {
                e.item.emitter.validate().expect("a reader's emitter is valid");
            });
        }
    }
});
