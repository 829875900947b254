//! Geometry that is odd but harmless: it must be rendered.

use std::fmt::Write as _;

use crate::common::{Folder, expect};
use crate::hard_inputs::{from_file, job, run, scene};

/// What must be rendered: the image is finite, and the time is that of a scene of this size.
#[track_caller]
fn rendered(files: &[(&str, String)], line: &str) -> serde_json::Value {
    let folder = Folder::new();
    for (name, content) in files {
        folder.file(name, content);
    }
    let out = run(&folder, &format!("{line} --size 8x8 --spp 16 --digest a.json"));
    expect(&out, 0, &[]);
    let digest = folder.json("a.json");
    assert_eq!(digest["non_finite"], 0, "{digest}");
    assert!(red(&digest).is_finite(), "{digest}");
    digest
}

fn red(digest: &serde_json::Value) -> f64 {
    digest["image"]["mean"][0].as_f64().unwrap()
}

const SQUARE: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv 0 0 0\n";

#[test]
fn harmless_triangles_are_dropped() {
    let scene = from_file("obj", "m.obj");
    let render = |faces: &str| {
        rendered(&[("s.xml", scene.clone()), ("m.obj", format!("{SQUARE}{faces}"))], "render s.xml")
    };
    let clean = render("f 1 2 3\nf 1 3 4\n");
    assert!(red(&clean) > 0.0);
    let dirty = render("f 1 2 3\nf 1 3 4\nf 1 1 2\nf 1 5 3\nf 3 1 2\nf 4 4 4\n");
    assert_eq!(clean["image"], dirty["image"]);
}

#[test]
fn dropped_triangles_are_told() {
    let folder = Folder::new();
    folder.file("s.xml", from_file("obj", "m.obj"));
    folder.file("m.obj", format!("{SQUARE}f 1 2 3\nf 1 1 2\nf 2 3 1\nf 1 3 2\n"));
    let path = folder.path().join("s.xml");
    let job = drt_cli::Job::read_scene(&path, &drt_cli::Defaults::new()).unwrap();
    let told: Vec<_> = job.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(told.len(), 1);
    for part in ["s.xml:6: <shape type=\"obj\" id=\"mesh\">", "dropped 2 of 4 triangles"] {
        assert!(told[0].contains(part), "{told:?}");
    }
    assert_eq!(job.scene.shapes[0].mesh.triangles.len(), 2);
}

/// Of those that cannot be merged each ray at one meets all: their cost is quadratic, and shows with few.
#[test]
fn thousands_of_coincident_triangles() {
    let repeated = "f 1 2 3\nf 1 3 4\n".repeat(5000);
    // On one another, but no two alike: what cannot be merged.
    let mut shifted = String::from("v -1 -1 0\nv 1 -1 0\n");
    // One edge that all of them share.
    let mut fan = shifted.clone();
    for i in 0..3_000 {
        let _ = writeln!(shifted, "v {} 1 0\nf 1 2 {}", 1e-9 * f64::from(i), i + 3);
        let angle = f64::from(i) * 1e-3;
        let _ = writeln!(fan, "v 0 {} {}\nf 1 2 {}", angle.cos() - 1.0, angle.sin(), i + 3);
    }
    let job = job("target = \"mesh\"\ntranslate = [0, 0, 1]");
    for mesh in [format!("{SQUARE}{repeated}"), shifted, fan] {
        let files =
            [("s.xml", from_file("obj", "m.obj")), ("m.obj", mesh), ("j.toml", job.clone())];
        assert!(red(&rendered(&files, "grad j.toml")) > 0.0);
    }
}

#[test]
fn cameras_on_edges_and_faces() {
    // Camera and lights on a vertex, on an edge, on a face, and in the plane of a face.
    let cube = "<shape type=\"cube\" id=\"box\"/><emitter type=\"constant\"/>";
    let job = job("target = \"box\"\ntranslate = [1, 0.5, 0.25]");
    let centre = rendered(&[("s.xml", scene(cube)), ("j.toml", job.clone())], "grad j.toml");
    assert!(red(&centre) > 0.0);
    for origin in ["1 1 1", "1 1 0", "1 0.25 0.5", "1 -3 0", "1 -3 1", "0 0 0"] {
        let text = scene(cube)
            .replace("origin=\"0 -4 1\"", &format!("origin=\"{origin}\""))
            .replace("value=\"1 -2 3\"", &format!("value=\"{origin}\""));
        let text = text.replace("target=\"0 0 0.5\"", "target=\"3 4 0.1\"");
        rendered(&[("s.xml", text), ("j.toml", job.clone())], "grad j.toml");
    }
}
