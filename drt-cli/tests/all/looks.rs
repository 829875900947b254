//! Previews, completions, manual pages and lists, by the `drt` program.

use crate::common::{Folder, expect};

const SCENE: &str = r#"<scene version="3.0.0">
  <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="8"/>
    <integer name="height" value="6"/></film></sensor>
  <shape type="rectangle" id="wall"><bsdf type="diffuse" id="paint">
    <texture name="reflectance" type="checkerboard"/></bsdf>
    <transform name="to_world"><translate z="5"/></transform></shape>
  <emitter type="constant" id="sky"/>
</scene>"#;

const JOB: &str = "scene = \"scene.xml\"\n[estimator]\nspp = 4\n[[parameter]]\nname = \"light\"\n\
                   [[parameter.effect]]\ntarget = \"sky\"\nproperty = \"radiance\"\nmultiply = -1.0\n";

fn size(folder: &Folder, name: &str) -> (u32, u32) {
    image::image_dimensions(folder.path().join(name)).unwrap()
}

#[test]
fn layers_are_looked_at() {
    let folder = Folder::new();
    folder.file("scene.xml", SCENE);
    folder.file("job.toml", JOB);
    expect(&folder.run("grad job.toml --quiet -o a.exr"), 0, &[]);
    expect(&folder.run("preview a.exr"), 0, &[]);
    // Image and derivative side by side, enlarged.
    let (width, height) = size(&folder, "a.png");
    assert!(width > 200 && height > 100, "{width}x{height}");
    expect(&folder.run("preview a.exr --layer d_light -o d.png"), 0, &[]);
    assert_eq!(size(&folder, "d.png"), (8, 6));
    let blue = image::open(folder.path().join("d.png")).unwrap().into_rgb8();
    assert!(blue.pixels().all(|p| p[2] >= p[0]), "less light is blue");
    assert!(blue.pixels().any(|p| p[2] > p[0]), "there is some");
    expect(
        &folder.run("preview a.exr --layer d_lite"),
        2,
        &["a.exr", "no layer `d_lite`", "d_light"],
    );
    expect(&folder.run("preview scene.xml"), 2, &["scene.xml"]);
    expect(&folder.run("preview a.exr -o a.exr"), 2, &["another file"]);
}

#[test]
fn shells_and_manuals_know_the_commands() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = folder.run(&format!("completions {shell}"));
        expect(&output, 0, &[]);
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(text.contains("optimize") && text.contains("max-depth"), "{shell}");
    }
    let output = folder.run("man");
    expect(&output, 0, &[]);
    assert!(String::from_utf8(output.stdout).unwrap().contains(".TH drt 1"));
    expect(&folder.run("man -o ."), 0, &[]);
    for page in ["drt.1", "drt-render.1", "drt-preview.1"] {
        assert!(folder.path().join(page).exists(), "{page}");
    }
    expect(&folder.run("man -o none"), 3, &["there is no folder none"]);
}

#[test]
fn textures_and_missing_files_are_listed() {
    let folder = Folder::new();
    folder.file("scene.xml", SCENE);
    let output = folder.run("info scene.xml");
    expect(&output, 0, &[]);
    let text = String::from_utf8(output.stdout).unwrap();
    let line = text.lines().find(|l| l.contains("checkerboard")).unwrap();
    assert!(line.contains("paint") && line.contains("reflectance"), "{line}");
    let file = |name: &str| {
        format!("<shape type=\"obj\"><string name=\"filename\" value=\"{name}\"/></shape>\n")
    };
    let wrong = format!("<scene version=\"3.0.0\">\n{}{}</scene>", file("a.obj"), file("b.obj"));
    folder.file("wrong.xml", wrong);
    let parts = ["2 files are missing", "wrong.xml:2", "`a.obj`", "wrong.xml:3", "`b.obj`"];
    expect(&folder.run("info wrong.xml"), 2, &parts);
}
