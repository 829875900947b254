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

/// Names tell the kind of file, and pictures are as bright as is asked for.
#[test]
fn names_tell_what_is_written() {
    let folder = Folder::new();
    folder.file("scene.xml", SCENE);
    folder.file("job.toml", JOB);
    let exists = |name: &str| folder.path().join(name).exists();
    // Without a name, beside the input.
    expect(&folder.run("render scene.xml"), 0, &["written to scene.exr"]);
    expect(&folder.run("grad job.toml"), 0, &["written to job.exr"]);
    assert!(exists("scene.exr") && folder.exr("job.exr").layers.contains_key("d_light"));
    // The sky's radiance is 1, which is white as it is, and half of it a stop below.
    let brightest = |options: &str| {
        expect(&folder.run(&format!("render scene.xml --quiet -o a.png {options}")), 0, &[]);
        assert_eq!(size(&folder, "a.png"), (8, 6));
        let picture = image::open(folder.path().join("a.png")).unwrap().into_rgb8();
        picture.pixels().map(|p| p[0]).max().unwrap()
    };
    assert_eq!(brightest(""), 255);
    assert!((187..=188).contains(&brightest("--exposure -1")), "half of white");
    assert!(brightest("--tonemap aces") < 255);
    for (line, part) in [
        ("render scene.xml -o a.jpg", "a.jpg: expected a file that ends in .exr or .png"),
        ("render scene.xml -o a", "a: expected a file"),
        ("render scene.xml --preview a.exr", "--preview: a.exr: expected"),
        ("render scene.xml -o b.exr --exposure 1", "--exposure: no picture is written"),
        ("render scene.xml --tonemap film", "aces"),
        ("render scene.xml --shard 1/2 -o b.png", "b.png: expected a file that ends in .exr"),
        ("batch scene.xml --list list", "b.png: expected a file that ends in .exr"),
        ("grad job.toml --loss scene.exr -o b.exr", "b.exr: expected a file that ends in .npy"),
        ("preview job.exr -o b.gif", "b.gif: expected"),
        ("info scene.xml -o b.exr", "-o"),
    ] {
        folder.file("list", "scene.xml -o b.png\n");
        expect(&folder.run(line), 2, &[part]);
        assert!(!exists("b.exr") && !exists("b.png"), "{line}");
    }
}

/// What has been exposed for a screen is no target; a picture of the light itself is.
#[test]
fn pictures_for_the_eye_are_no_targets() {
    let folder = Folder::new();
    folder.file("scene.xml", SCENE);
    folder.file("job.toml", JOB);
    let gradient = |target: &str| folder.run(&format!("grad job.toml --quiet --loss {target}"));
    expect(&folder.run("render scene.xml -o a.png --preview b.png"), 0, &[]);
    expect(&gradient("a.png"), 0, &[]);
    expect(&gradient("b.png"), 2, &["b.png: it was made to be looked at"]);
    expect(&folder.run("render scene.xml -o a.png --exposure 1"), 0, &[]);
    expect(&gradient("a.png"), 2, &["a.png: it was made to be looked at"]);
}

#[test]
fn contents_as_json() {
    let folder = Folder::new();
    folder.file("scene.xml", SCENE);
    folder.file("job.toml", JOB);
    let output = folder.run("info job.toml --digest -");
    expect(&output, 0, &[]);
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&found["command"], &found["job"]), (&"info".into(), &"job.toml".into()));
    let wall = &found["shapes"][0];
    assert_eq!((&wall["shape"], &wall["triangles"]), (&"wall".into(), &2.into()));
    assert_eq!(found["parameters"][0]["target"], "sky");
    assert!(found["plan"]["estimators"].is_array() && found["no_plan"].is_null());
    // In a file, beside the tables.
    expect(&folder.run("info scene.xml --digest b.json"), 0, &[]);
    assert_eq!(folder.json("b.json")["sensors"][0]["film"], "8x6");
    expect(&folder.run("info scene.xml --digest scene.xml"), 2, &["scene.xml is read"]);
}

/// A picture as text: as many lines of half blocks as the picture's shape asks for.
#[test]
fn pictures_in_the_terminal() {
    let folder = Folder::new();
    folder.file("scene.xml", SCENE);
    folder.file("job.toml", JOB);
    expect(&folder.run("grad job.toml --quiet -o a.exr --preview a.png"), 0, &[]);
    let view = |line: &str| {
        let output = folder.run(&format!("view {line}"));
        expect(&output, 0, &[]);
        String::from_utf8(output.stdout).unwrap()
    };
    let blocks = |text: &str| text.matches(['\u{2580}', '\u{2584}']).count();
    // 8 by 6 pixels, of which two lie above each other in a character.
    let image = view("a.exr --layer image");
    assert_eq!((blocks(&image), image.trim_end().lines().count()), (24, 3), "{image:?}");
    assert!(image.contains("38;2;"), "colours of 24 bits: {image:?}");
    assert_eq!(blocks(&view("a.exr --layer image --width 4")), 8);
    assert_eq!(blocks(&view("a.exr --layer image --width 1")), 1);
    // A derivative has other colours, and all layers are beside each other, as in the preview.
    assert_ne!(view("a.exr --layer d_light"), image);
    assert_eq!(view("a.exr --width 60"), view("a.png --width 60"));
    for (line, part) in [
        ("view a.exr --layer d_lite", "no layer `d_lite`; it has image, stderr, d_light"),
        ("view a.png --layer image", "a.png: it has no layer `image`; only OpenEXR"),
        ("view a.png --exposure 1", "a.png: --exposure: it holds no light"),
        ("view scene.xml", "scene.xml: "),
        ("view none.png", "none.png: "),
        ("view .", ".: "),
        ("view a.png --width 0", "--width"),
    ] {
        expect(&folder.run(line), 2, &[part]);
    }
}

/// Layers are in the job's order wherever they are listed, though the format of the file sorts them by name.
#[test]
fn layers_have_one_order() {
    let folder = Folder::new();
    folder.file("scene.xml", SCENE);
    let parameter = |name: &str| {
        format!(
            "[[parameter]]\nname = \"{name}\"\n[[parameter.effect]]\ntarget = \"sky\"\n\
             property = \"radiance\"\nmultiply = 1.0\n"
        )
    };
    let names = ["z", "B", "a", "ab"];
    let parameters: String = names.map(parameter).concat();
    folder.file("job.toml", format!("scene = \"scene.xml\"\n[estimator]\nspp = 1\n{parameters}"));
    expect(&folder.run("grad job.toml --terms -o a.exr --digest a.json"), 0, &[]);
    let file = folder.exr("a.exr");
    let layers: Vec<&str> = file.in_order().map(|(name, _)| name).collect();
    assert_eq!(layers[..2], ["", "stderr"]);
    let derivatives = layers.iter().filter_map(|name| name.strip_prefix("d_"));
    let of_parameters: Vec<&str> =
        derivatives.filter(|name| !name.contains('.') && !name.ends_with("_stderr")).collect();
    assert_eq!(of_parameters, names);
    let known = format!("it has {}", layers.join(", ").replacen(',', "image,", 1));
    expect(&folder.run("preview a.exr --layer none"), 2, &[&known]);
    let digest = std::fs::read_to_string(folder.path().join("a.json")).unwrap();
    let info = folder.run("info job.toml --digest -").stdout;
    for (listed, quote) in [(digest, "\""), (String::from_utf8(info).unwrap(), "\"")] {
        let places = names.map(|name| listed.find(&format!("{quote}{name}{quote}")).unwrap());
        assert!(places.is_sorted(), "{places:?}");
    }
}

/// What is finished is there to be looked at, and the result is the same as without looking.
#[test]
fn a_picture_grows() {
    let folder = Folder::new();
    folder.file("scene.xml", SCENE);
    expect(&folder.run("render scene.xml --quiet -o a.exr --preview b.png"), 0, &[]);
    let output = folder.run("render scene.xml --watch -o w.exr");
    expect(&output, 0, &["w.png grows while it is rendered"]);
    assert_eq!(folder.exr("a.exr").layers, folder.exr("w.exr").layers);
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(bytes("b.png"), bytes("w.png"), "at the end it is whole");
    expect(&folder.run("render scene.xml --watch --shard 1/2 -o s.exr"), 2, &["--shard"]);
    // Long before the end, some of it is there and some is not.
    let line = "render scene.xml --size 64x64 --spp 1000000 --threads 1 --watch -o g.exr";
    let mut child = folder.command(line).stderr(std::process::Stdio::null()).spawn().unwrap();
    let picture = folder.path().join("g.png");
    let mut last = (0, 0);
    for _ in 0..100 {
        std::thread::sleep(std::time::Duration::from_millis(100));
        let Ok(image) = image::open(&picture) else { continue };
        let image = image.into_rgb8();
        last = (image.pixels().filter(|p| p.0 != [0; 3]).count(), image.pixels().count());
        if last.0 > 0 {
            break;
        }
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(0 < last.0 && last.0 < last.1, "{last:?}");
}
