//! Scenes.

#![no_main]

use std::path::Path;

use drt_estimators::Settings;
use drt_fuzz::use_scene;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    // A folder that is not there: scenes that name files are refused when they open them.
    if let Ok(scene) = drt_cli::parse_scene_str(text, Path::new("/nowhere")) {
        use_scene(scene, &[], &Settings::default());
    }
});
