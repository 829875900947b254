//! Scenes.

#![no_main]

use std::path::Path;

use drt_cli::{Defaults, decode_scene};
use drt_estimators::Settings;
use drt_fuzz::use_scene;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    // A folder that is not there: scenes that name files are refused when they open them.
    if let Ok(scene) = decode_scene(bytes, Path::new("/nowhere/scene.xml"), &Defaults::new()) {
        use_scene(scene, &[], &Settings::default());
    }
});
