//! Jobs.

#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use drt_cli::{Overrides, load_job};
use drt_fuzz::{folder, use_scene, write};
use libfuzzer_sys::fuzz_target;

static FOLDER: LazyLock<PathBuf> = LazyLock::new(folder);

fuzz_target!(|text: &str| {
    let path = FOLDER.join("job.toml");
    write(&path, text.as_bytes());
    if let Ok(job) = load_job(&path, &Overrides::default()) {
        use_scene(job.scene, &job.parameters, &job.settings);
    }
});
