use drt_estimators::{Counters, Derivative, Estimate, Layer, Plan, Rendering, Tail, Term};
use drt_math::Rgb;

use super::*;
use crate::testing::Folder;

/// An image whose every number is different.
fn layer([w, h]: [u32; 2], offset: f64) -> Layer {
    let estimate = |i: u32| Estimate {
        mean: Rgb::new(f64::from(i), f64::from(i) + 0.25, -f64::from(i)) + Rgb::splat(offset),
        stderr: Rgb::splat(0.5 * f64::from(i) + offset),
    };
    Layer {
        size: [w, h],
        pixels: (0..w * h).map(estimate).collect(),
        blocks: (0..64).map(estimate).collect(),
        total: estimate(3),
        tail: Tail { second_moment: Rgb::splat(8.0), largest: Rgb::splat(2.0) },
    }
}

pub(crate) fn rendering(size: [u32; 2]) -> Rendering {
    let derivative = |name: &str, offset| Derivative {
        name: name.into(),
        total: layer(size, offset),
        terms: vec![(Term::Interior, layer(size, offset + 1.0))],
    };
    Rendering {
        image: layer(size, 100.0),
        derivatives: vec![derivative("cube-x", 200.0), derivative("été", 300.0)],
        plan: Plan::default(),
        counters: Counters { paths: 12, ..Counters::default() },
        non_finite: 1,
        non_finite_examples: Vec::new(),
        spp: 7,
        complete: false,
    }
}

#[test]
fn exr_round_trip() {
    let folder = Folder::new();
    let path = folder.file("a.exr", "something older");
    let rendering = rendering([5, 3]);
    let provenance = Provenance {
        scene: "s.xml".into(),
        job: Some(("j.toml".into(), "scene = \"s.xml\" # ü".into())),
        seed: u64::MAX,
        seconds: 1.5,
        inputs: None,
        attachment: None,
    };
    let differences = layer([5, 3], 400.0);
    write_exr(&path, &rendering, &[("fd_cube-x".into(), &differences)], &provenance).unwrap();
    let file = read_exr(&path).unwrap();
    assert_eq!(file.size, [5, 3]);
    let expected = [
        ("", "stderr", &rendering.image),
        ("d_cube-x", "d_cube-x_stderr", &rendering.derivatives[0].total),
        ("d_été", "d_été_stderr", &rendering.derivatives[1].total),
        ("d_cube-x.interior", "d_cube-x.interior_stderr", &rendering.derivatives[0].terms[0].1),
        ("d_été.interior", "d_été.interior_stderr", &rendering.derivatives[1].terms[0].1),
        ("fd_cube-x", "fd_cube-x_stderr", &differences),
    ];
    assert_eq!(file.layers.len(), 2 * expected.len());
    for (mean, stderr, layer) in expected {
        for (i, pixel) in layer.pixels.iter().enumerate() {
            assert_eq!(file.layers[mean][i], pixel.mean.to_array().map(|v| v as f32));
            assert_eq!(file.layers[stderr][i], pixel.stderr.to_array().map(|v| v as f32));
        }
    }
    for (name, value) in [
        ("software", crate::PROGRAM),
        ("drt_scene", "s.xml"),
        ("drt_job", "j.toml"),
        ("drt_job_text", "scene = \"s.xml\" # ü"),
        ("drt_seed", "18446744073709551615"),
        ("drt_spp", "7"),
        ("drt_seconds", "1.5"),
        ("drt_complete", "0"),
    ] {
        assert_eq!(file.attributes[name], value, "{name}");
    }
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 1, "drafts are gone");
}

#[test]
fn long_layer_names_survive() {
    let folder = Folder::new();
    let mut rendering = rendering([1, 1]);
    rendering.derivatives[0].name = "x".repeat(100);
    let path = folder.path().join("a.exr");
    write_exr(&path, &rendering, &[], &Provenance::default()).unwrap();
    assert!(read_exr(&path).unwrap().layers.contains_key(&format!("d_{}", "x".repeat(100))));
}

#[test]
fn unreadable_images_are_errors() {
    let folder = Folder::new();
    let path = folder.path().join("a.exr");
    write_exr(&path, &rendering([16, 16]), &[], &Provenance::default()).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    for file in [
        folder.file("cut.exr", &bytes[..bytes.len() / 2]),
        folder.file("text.exr", "no image"),
        folder.path().join("none.exr"),
    ] {
        let message = read_exr(&file).unwrap_err().to_string();
        assert!(message.starts_with(&file.display().to_string()), "{message}");
    }
}

#[test]
fn previews_hold_the_image_or_a_sheet() {
    let folder = Folder::new();
    let path = folder.path().join("a.png");
    let size = || {
        let decoder =
            png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&path).unwrap()));
        let reader = decoder.read_info().unwrap();
        (reader.info().width, reader.info().height)
    };
    let mut rendering = rendering([40, 30]);
    write_preview(&path, &rendering, &[], Tone::default()).unwrap();
    let (width, height) = size();
    assert!(width > 2 * 160 && height > 2 * 120, "three enlarged panels in two columns");
    rendering.derivatives.clear();
    write_preview(&path, &rendering, &[], Tone::default()).unwrap();
    assert_eq!(size(), (40, 30));
}

#[test]
fn places_that_cannot_be_written() {
    let folder = Folder::new();
    let nowhere = folder.path().join("none/a.exr");
    let error = write_exr(&nowhere, &rendering([1, 1]), &[], &Provenance::default()).unwrap_err();
    assert_eq!(error.exit_code(), 3);
    let error = crate::check_target(folder.path()).unwrap_err();
    assert!(error.to_string().contains("not a file that could be replaced"), "{error}");
}
