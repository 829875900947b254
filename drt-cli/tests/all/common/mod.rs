//! What tests of the `drt` program share: a folder to run it in, and what to expect of it.
#![allow(unreachable_pub, reason = "a program has no users")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::{AtomicU32, Ordering};

/// The text of a job with samples per pixel, whose parameters are the reflectance of the scene's `gray` and the place of its `lamp`; of
/// the latter with a line more.
macro_rules! gray_and_lamp {
    ($spp:literal, $lamp:literal) => {
        concat!(
            "scene = \"scene.xml\"\n[estimator]\nspp = ",
            $spp,
            "\n[[parameter]]\nname = \"gray\"\n[[parameter.effect]]\ntarget = \"gray\"\n",
            "property = \"reflectance\"\nadd = [1.0, 1.0, 1.0]\n",
            "[[parameter]]\nname = \"lamp-x\"\n",
            $lamp,
            "[[parameter.effect]]\ntarget = \"lamp\"\ntranslate = [1.0, 0.0, 0.0]\n",
        )
    };
}

pub(crate) use gray_and_lamp;

/// A folder of its own for a test, removed at its end.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let n = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("drt-command-{}-{n}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Writes a file.
    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.0.join(name), content).unwrap();
    }

    /// The program in this folder, with the arguments of a line.
    pub fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_drt"));
        command.current_dir(&self.0).args(line.split_whitespace());
        command
    }

    pub fn run(&self, line: &str) -> Output {
        self.command(line).output().unwrap()
    }

    pub fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(self.0.join(name)).unwrap()).unwrap()
    }

    pub fn exr(&self, name: &str) -> drt_cli::ExrFile {
        drt_cli::read_exr(&self.0.join(name)).unwrap()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[track_caller]
pub fn expect(output: &Output, code: i32, parts: &[&str]) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    for part in parts {
        assert!(stderr.contains(part), "expected `{part}` in: {stderr}");
    }
}
