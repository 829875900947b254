//! Jobs.

#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use drt_cli::{Overrides, decode_job};
use drt_fuzz::{folder, use_scene};
use libfuzzer_sys::fuzz_target;

static FOLDER: LazyLock<PathBuf> = LazyLock::new(folder);

fuzz_target!(|bytes: &[u8]| {
    if let Ok(job) = decode_job(bytes, &FOLDER.join("job.toml"), &Overrides::default()) {
        use_scene(job.scene, &job.parameters, &job.settings);
    }
});
