//! The example in Python, where there is one with NumPy; by PyTorch, where there is that.

use std::path::Path;
use std::process::Command;

use crate::common::Folder;

fn python(program: &str, arguments: &[&str]) -> Option<String> {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/python");
    let mut command = Command::new("python3");
    command.current_dir(&examples).env("DRT", env!("CARGO_BIN_EXE_drt"));
    command.env("PYTHONDONTWRITEBYTECODE", "1").arg(program).args(arguments);
    let output = command.output().ok()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{program}: {errors}");
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Whether Python has a module.
fn has(module: &str) -> bool {
    let command = Command::new("python3").args(["-c", &format!("import {module}")]).output();
    let there = command.is_ok_and(|o| o.status.success());
    if !there {
        eprintln!("not tested: there is no Python with {module}");
    }
    there
}

/// The losses that a fit prints.
fn losses(text: &str) -> Vec<f64> {
    let loss = |l: &str| l.split("loss ").nth(1)?.split_whitespace().next()?.parse().ok();
    text.lines().filter_map(loss).collect()
}

#[test]
fn a_painting_and_a_vase_are_fitted() {
    for (program, modules) in [("fit.py", &["numpy"][..]), ("fit_torch.py", &["numpy", "torch"])] {
        if !modules.iter().all(|m| has(m)) {
            continue;
        }
        let folder = Folder::new();
        let picture = folder.path().join("fit.png");
        let picture = picture.to_str().expect("a plain name");
        let options = ["--iterations", "6", "--size", "16", "--spp", "8", "--picture", picture];
        let losses = losses(&python(program, &options).expect("Python runs"));
        let [first, .., last] = losses[..] else { panic!("{losses:?}") };
        assert!(last < 0.5 * first, "{program}: {losses:?}");
        assert!(image::image_dimensions(picture).expect("a picture").0 > 100);
    }
}

/// What NumPy writes is read, and the other way round.
#[test]
fn files_go_both_ways() {
    if !has("numpy") {
        return;
    }
    let folder = Folder::new();
    let path = |name: &str| folder.path().join(name).to_str().expect("a plain name").to_owned();
    let check = "import sys, numpy as np, drt\n\
                 own, loose, npy, out = sys.argv[1:]\n\
                 image = np.random.default_rng(1).random((5, 7, 3), dtype=np.float32)\n\
                 drt.write_exr(loose, image)\n\
                 assert (drt.read_exr(loose)[''] == image).all()\n\
                 drt.run('preview', loose, '-o', out)\n\
                 layers = drt.read_exr(own)\n\
                 assert sorted(layers) == ['', 'd_light', 'd_light_stderr', 'stderr'], layers.keys()\n\
                 assert np.abs(layers['d_light'] + layers['']).mean() < 0.05, layers['d_light'].mean()\n\
                 assert 0.5 < layers[''].mean() < 1.5\n\
                 np.save(npy, layers[''])\n";
    folder.file("check.py", check);
    folder.file(
        "scene.xml",
        r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm">
           <integer name="width" value="40"/><integer name="height" value="37"/></film></sensor>
           <emitter type="constant" id="sky"><rgb name="radiance" value="1.1"/></emitter></scene>"#,
    );
    folder.file(
        "job.toml",
        "scene = \"scene.xml\"\n[estimator]\nspp = 4\n[[parameter]]\nname = \"light\"\n\
         [[parameter.effect]]\ntarget = \"sky\"\nproperty = \"radiance\"\nmultiply = -1.0\n",
    );
    crate::common::expect(&folder.run("grad job.toml --quiet -o own.exr"), 0, &[]);
    // The module is that of the examples.
    let there = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/python");
    let command = Command::new("python3")
        .env("PYTHONPATH", there)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("DRT", env!("CARGO_BIN_EXE_drt"))
        .arg(path("check.py"))
        .args(["own.exr", "loose.exr", "image.npy", "loose.png"].map(path))
        .output()
        .expect("Python runs");
    assert!(command.status.success(), "{}", String::from_utf8_lossy(&command.stderr));
    // The image itself as the target has no loss, its array as an adjoint the gradient that sums it.
    for (option, file) in [("--loss", "image.npy"), ("--adjoint", "image.npy")] {
        let line = format!("grad job.toml --quiet {option} {file} -o g.npy");
        crate::common::expect(&folder.run(&line), 0, &[]);
    }
    crate::common::expect(
        &folder.run("grad job.toml --adjoint g.npy -o h.npy"),
        2,
        &["rows x columns x 3"],
    );
}
