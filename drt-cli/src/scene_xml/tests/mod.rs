mod emitters;
mod language;
mod materials;
mod media;
mod past;
mod sensors;
mod shapes;
mod support;
mod textures;

use std::path::Path;

use drt_estimators::Scene;

use crate::{CliError, Defaults, decode_scene};

/// A scene of version 3 around `body`, which starts at line 2.
fn read(body: &str) -> Result<Scene, CliError> {
    read_version("3.0.0", body)
}

fn read_version(version: &str, body: &str) -> Result<Scene, CliError> {
    decode(&format!("<scene version=\"{version}\">\n{body}\n</scene>"))
}

fn decode(text: &str) -> Result<Scene, CliError> {
    decode_scene(text.as_bytes(), Path::new("dir/scene.xml"), &Defaults::new())
}

fn scene(body: &str) -> Scene {
    read(body).unwrap()
}

fn old_scene(body: &str) -> Scene {
    read_version("0.6.0", body).unwrap()
}

/// Asserts that `body` is refused with a message that holds all of `parts`.
#[track_caller]
fn refused(body: &str, parts: &[&str]) {
    let message = read(body).map(|_| ()).unwrap_err().to_string();
    for part in parts {
        assert!(message.contains(part), "expected `{part}` in: {message}");
    }
}
