//! Input that is broken, hostile or absurd: one error that names file and place, exit code 2,
//! nothing written, in bounded time. Input that is only odd is rendered.

mod files;
mod geometry;
mod jobs;
mod scenes;

use std::fmt::Write as _;
use std::process::{Output, Stdio};
use std::time::{Duration, Instant};

use crate::common::{Folder, expect};

/// Longest that any refusal may take, on a busy machine.
const PATIENCE: Duration = Duration::from_secs(90);

/// A scene of version 3 with a camera and a light; `body` starts at line 6.
fn scene(body: &str) -> String {
    format!(
        r#"<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="3"/></integrator>
<sensor type="perspective" id="cam"><transform name="to_world">
  <lookat origin="0 -4 1" target="0 0 0.5" up="0 0 1"/></transform>
  <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film></sensor>
<emitter type="point" id="lamp"><point name="position" value="1 -2 3"/></emitter>
{body}
</scene>"#
    )
}

/// A shape from a file.
fn from_file(kind: &str, file: &str) -> String {
    scene(&format!(
        r#"<shape type="{kind}" id="mesh"><string name="filename" value="{file}"/></shape>"#
    ))
}

/// A grid from a file, in a box.
fn from_grid(file: &str) -> String {
    scene(&format!(
        r#"<medium type="heterogeneous" id="smoke">
<volume name="sigma_t" type="gridvolume"><string name="filename" value="{file}"/></volume></medium>
<shape type="cube"><bsdf type="null"/><ref name="interior" id="smoke"/></shape>"#
    ))
}

/// A job on the scene `s.xml` with one parameter, whose effect starts at line 5.
fn job(effect: &str) -> String {
    format!("scene = \"s.xml\"\n[[parameter]]\nname = \"p\"\n[[parameter.effect]]\n{effect}\n")
}

fn vol(size: [i32; 3], values: &[f32]) -> Vec<u8> {
    let mut bytes = b"VOL\x03".to_vec();
    for n in [1, size[0], size[1], size[2], 1] {
        bytes.extend(n.to_le_bytes());
    }
    for v in [0.0, 0.0, 0.0, 1.0, 1.0, 1.0].iter().chain(values) {
        bytes.extend(f32::to_le_bytes(*v));
    }
    bytes
}

/// Runs a command and kills it when it takes too long.
fn run(folder: &Folder, line: &str) -> Output {
    let mut command = folder.command(line);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("`{line}` still runs after {PATIENCE:?}");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

/// What is wrong, the files of the input, and what the message must hold. The job `j.toml` is run
/// where there is one, else the scene `s.xml`.
struct Case {
    name: &'static str,
    files: Vec<(&'static str, Vec<u8>)>,
    parts: &'static [&'static str],
}

fn case(
    name: &'static str,
    files: impl IntoIterator<Item = (&'static str, impl Into<Vec<u8>>)>,
    parts: &'static [&'static str],
) -> Case {
    Case { name, files: files.into_iter().map(|(n, f)| (n, f.into())).collect(), parts }
}

fn only_scene(
    name: &'static str,
    text: impl Into<Vec<u8>>,
    parts: &'static [&'static str],
) -> Case {
    case(name, [("s.xml", text)], parts)
}

/// Every failure that a case shows, so that one run tells all.
#[track_caller]
fn refused(cases: impl IntoIterator<Item = Case>) {
    let mut failures = String::new();
    for Case { name, files, parts } in cases {
        let folder = Folder::new();
        for (file, content) in &files {
            folder.file(file, content);
        }
        let is_job = files.iter().any(|(file, _)| *file == "j.toml");
        let line = if is_job { "grad j.toml" } else { "render s.xml" };
        let out = run(&folder, &format!("{line} --spp 1 -o a.exr --digest a.json --preview a.png"));
        let stderr = String::from_utf8_lossy(&out.stderr).into_owned();
        let mut wrong = Vec::new();
        if out.status.code() != Some(2) {
            wrong.push(format!("ended with {}", out.status));
        }
        let errors = stderr.lines().filter(|l| l.starts_with("drt: error: ")).count();
        if errors != 1 || stderr.contains("panicked") {
            wrong.push(format!("told {errors} errors"));
        }
        wrong.extend(
            parts.iter().filter(|p| !stderr.contains(**p)).map(|p| format!("does not say `{p}`")),
        );
        let written = std::fs::read_dir(folder.path()).unwrap().count();
        if written != files.len() || !out.stdout.is_empty() {
            wrong.push("wrote something".into());
        }
        if !wrong.is_empty() {
            let told: String = stderr.chars().take(600).collect();
            let _ = writeln!(failures, "{name}: {}\n    {told}", wrong.join(", "));
        }
    }
    assert!(failures.is_empty(), "\n{failures}");
}
