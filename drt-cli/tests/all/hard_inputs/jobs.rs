//! Jobs that cannot be done, and values out of their range.

use crate::common::{Folder, expect};
use crate::hard_inputs::{case, from_grid, job, refused, run, scene, vol};

#[test]
fn jobs() {
    let cube = || scene(r#"<shape type="cube" id="box"/>"#);
    let with = |name, text: String, parts| case(name, [("s.xml", cube()), ("j.toml", text)], parts);
    let moving = |more: &str| job(&format!("target = \"box\"\n{more}"));
    let velocities = |name, file: &str, parts| {
        let job = moving("vertex_velocity = \"v.txt\"");
        case(name, [("s.xml", cube()), ("j.toml", job), ("v.txt", file.into())], parts)
    };
    let ok = moving("translate = [1, 0, 0]");
    refused([
        with("empty", String::new(), &["j.toml", "scene"]),
        with("cut", ok[..ok.len() - 6].into(), &["j.toml:6"]),
        with("deep", format!("scene = {}", "[".repeat(100_000)), &["j.toml:1"]),
        with("own scene", "scene = \"j.toml\"\n".into(), &["j.toml:1", "not well-formed"]),
        case("no scene", [("j.toml", ok.clone())], &["s.xml", "cannot read"]),
        with("unknown key", format!("{ok}speed = 1\n"), &["j.toml:7", "`speed`"]),
        with("dangling", ok.replace("box", "ball"), &["j.toml:4", "`ball`", "box"]),
        with("nan", moving("translate = [nan, 0, 0]"), &["j.toml:2", "`p`", "translation"]),
        with("infinite", ok.replace("\"p\"", "\"p\"\nvalue = inf"), &["j.toml:2", "value"]),
        with(
            "far",
            ok.replace("\"p\"", "\"p\"\nvalue = 1e300").replace("[1, 0, 0]", "[1e300, 0, 0]"),
            &["j.toml:2", "`p`"],
        ),
        with("negative", format!("{ok}[estimator]\nspp = -1\n"), &["j.toml:8", "spp"]),
        with("too large", format!("{ok}[estimator]\nspp = 99999999999\n"), &["j.toml:8", "spp"]),
        with("step", format!("{ok}[estimator]\nstep = 0\n"), &["j.toml:8", "step"]),
        with(
            "twice",
            format!("{ok}{}", ok.replace("scene = \"s.xml\"\n", "")),
            &["j.toml:7", "taken"],
        ),
        with("itself", job("target = \"box\"\nfollow = \"box\""), &["j.toml", "follow"]),
        with(
            "vertex",
            moving("vertex = { index = 99999, direction = [0, 0, 1] }"),
            &["j.toml:2", "99999"],
        ),
        with("no velocities", moving("vertex_velocity = \"v.txt\""), &["v.txt", "cannot read"]),
        with("no name", ok.replace("s.xml", ""), &["j.toml:1", "`scene` is empty"]),
        with("list", moving("translate = [1, 0, 0, 5]"), &["j.toml:6", "4 values; expected 3"]),
        with("short list", moving("translate = [1, 0]"), &["j.toml:6", "2 values; expected 3"]),
        with(
            "rows",
            moving("matrix = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"),
            &["j.toml:6", "4 values; expected 3"],
        ),
        with(
            "name of an error",
            format!(
                "{ok}{}",
                ok.replace("\"p\"", "\"p_stderr\"").replace("scene = \"s.xml\"\n", "")
            ),
            &["j.toml:7", "`p_stderr`", "`p`"],
        ),
        with(
            "long name",
            ok.replace("\"p\"", &format!("\"{}\"", "p".repeat(300))),
            &["j.toml:2", "300"],
        ),
        with(
            "echo",
            ok.replace("\"box\"", &format!("\"{}\\u001b[2J\"", "b".repeat(5000))),
            &["j.toml:4", "bbb…`; known ids", "known ids"],
        ),
        with(
            "small",
            moving("translate = [1, 0, 0]\n[estimator]\nstep = -1e-300"),
            &["`step` is -1e-300;"],
        ),
        velocities("few velocities", "0 0 1\n", &["j.toml:2", "expected 8 velocities", "found 1"]),
        velocities("nan velocity", "0 0 1\n0 nan 0\n", &["v.txt:2", "finite"]),
        velocities("cut velocity", "0 0 1\n0 0\n", &["v.txt:2", "three"]),
    ]);
}

/// A scene with something of every kind whose numbers have a range.
fn ranges() -> String {
    scene(
        r#"<medium type="homogeneous" id="fog"><rgb name="sigma_t" value="0.5"/><rgb name="albedo" value="0.5"/>
<phase type="hg"><float name="g" value="0.5"/></phase></medium>
<bsdf type="diffuse" id="gray"><rgb name="reflectance" value="0.5"/></bsdf>
<bsdf type="roughconductor" id="metal"><float name="alpha" value="0.5"/></bsdf>
<shape type="cube"><bsdf type="null"/><ref name="interior" id="fog"/></shape>
<shape type="rectangle"><ref id="gray"/></shape><shape type="rectangle"><ref id="metal"/></shape>
<emitter type="constant" id="sky"><rgb name="radiance" value="0.5"/></emitter>"#,
    )
}

#[test]
fn values_out_of_range() {
    let at = |target: &str, property: &str, value: &str, name: &'static str, parts| {
        let effect = format!("target = \"{target}\"\nproperty = \"{property}\"\nadd = [1, 1, 1]");
        let job = job(&effect).replace("\"p\"", &format!("\"p\"\nvalue = {value}"));
        case(name, [("s.xml", ranges()), ("j.toml", job)], parts)
    };
    refused([
        at(
            "fog",
            "sigma_t",
            "-1",
            "sigma_t",
            &["j.toml:2", "`p`", "sigma_t is -0.5", "not negative"],
        ),
        at(
            "fog",
            "albedo",
            "1",
            "albedo",
            &["j.toml:2", "`p`", "albedo is 1.5", "between 0 and 1"],
        ),
        at(
            "fog",
            "albedo",
            "-1",
            "black",
            &["j.toml:2", "`p`", "albedo is -0.5", "between 0 and 1"],
        ),
        at(
            "fog",
            "emission",
            "-1",
            "emission",
            &["j.toml:2", "`p`", "emission is -1", "not negative"],
        ),
        at("fog", "g", "0.5", "g", &["j.toml:2", "`p`", "g is 1", "-1"]),
        at("gray", "reflectance", "-1", "reflectance", &["j.toml:2", "`p`", "-0.5", "0 or more"]),
        at("metal", "alpha", "-0.5", "alpha", &["j.toml:2", "`p`", "\"alpha\" is 0"]),
        at("sky", "radiance", "-1", "radiance", &["j.toml:2", "`p`", "-0.5", "negative"]),
        at("lamp", "intensity", "-2", "intensity", &["j.toml:2", "`p`", "-1", "negative"]),
        at("cam", "fov", "200", "fov", &["j.toml:2", "`p`", "field of view", "180"]),
    ]);
    let effect = |more: &str| job(&format!("target = \"smoke\"\n{more}"));
    let files = |name, job: String, parts| {
        let grid = ("g.vol", vol([2, 2, 2], &[1.0; 8]));
        case(
            name,
            [("s.xml", from_grid(grid.0).into_bytes()), ("j.toml", job.into_bytes()), grid],
            parts,
        )
    };
    let voxel = "property = \"sigma_t\"\nadd = [1, 1, 1]\nvoxels = [0, 1, 0]";
    let down = effect(voxel).replace("\"p\"", "\"p\"\nvalue = -2");
    let of = |property: &str, voxels: &str| {
        effect(&format!("property = \"{property}\"\nmultiply = 1\nvoxels = {voxels}"))
    };
    refused([
        files("voxel", down, &["j.toml:2", "`p`", "sigma_t is -1", "not negative"]),
        files("voxel of g", of("g", "[0, 0, 0]"), &["j.toml:4", "g of `smoke` has no grid"]),
        files(
            "voxels of albedo",
            of("albedo", "\"all\""),
            &["j.toml:4", "albedo of `smoke` has no grid"],
        ),
        files("too many", of("sigma_t", "[0, 0, 0, 0]"), &["j.toml:8", "[i, j, k]"]),
    ]);
}

/// Where a range ends within a step, differences look to one side.
#[test]
fn differences_at_the_end_of_a_range() {
    let effect = "target = \"gray\"\nproperty = \"reflectance\"\nadd = [1, 1, 1]";
    let folder = Folder::new();
    folder.file("s.xml", ranges());
    folder.file("j.toml", job(effect).replace("\"p\"", "\"p\"\nvalue = -0.5"));
    let out = run(&folder, "check j.toml --spp 64 --size 8x8");
    expect(&out, 0, &["finite differences by `p` look to one side and are of second order"]);
    // On the other side the range ends within two steps, too.
    let effect = "target = \"fog\"\nproperty = \"albedo\"\nadd = [1, 1, 1]";
    folder.file("j.toml", job(effect).replace("\"p\"", "\"p\"\nvalue = -0.5"));
    let out = run(&folder, "check j.toml --spp 1024 --size 8x8 --set estimator.step=0.6");
    expect(&out, 0, &["finite differences by `p` look to one side and are of first order"]);
}

/// Pictures to fit to; `t.exr` has the channels and pixels that are given.
#[test]
fn pictures() {
    use exr::prelude::{Image, SpecificChannels, WritableImage, write_rgb_file};

    let folder = Folder::new();
    folder.file("s.xml", ranges());
    folder.file("j.toml", job("target = \"gray\"\nproperty = \"reflectance\"\nmultiply = 1"));
    let path = |name: &str| folder.path().join(name);
    for name in ["R", "Y"] {
        let channels = SpecificChannels::build().with_channel(name).with_pixel_fn(|_| (0.25_f32,));
        let image = Image::from_channels((8, 8), channels);
        image.write().to_file(path(&format!("{name}.exr"))).unwrap();
    }
    write_rgb_file(path("rgb.exr"), 8, 8, |_, _| (0.25_f32, 0.25_f32, 0.25_f32)).unwrap();
    let broken = |x, y| if (x, y) == (3, 5) { f32::NAN } else { 0.0 };
    write_rgb_file(path("nan.exr"), 8, 8, |x, y| (0.0_f32, broken(x, y), 0.0_f32)).unwrap();
    write_rgb_file(path("large.exr"), 9, 8, |_, _| (0.0_f32, 0.0_f32, 0.0_f32)).unwrap();
    // A header that promises a gigabyte, and nothing after it.
    let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x40\0\0\0\x40\0\x08\x02\0\0\0".to_vec();
    png.extend(crc32fast::hash(&png[12..]).to_be_bytes());
    png.extend(b"\0\0\x10\0IDAT");
    png.extend([0; 5000]);
    folder.file("bomb.png", png);
    let gradient = |line: &str| run(&folder, &format!("grad j.toml --spp 4 -o g.npy {line}"));
    for option in ["--loss", "--adjoint"] {
        for (name, parts) in [
            ("R.exr", &["R.exr: its channels are R; expected R, G and B"][..]),
            ("nan.exr", &["nan.exr: channel G of the pixel in column 3, row 5 is NaN"]),
            ("large.exr", &["large.exr: it has 9x8 pixels", "8x8"]),
            ("bomb.png", &["bomb.png: it has 16384x16384 pixels", "8x8"]),
            ("none.exr", &["none.exr: cannot read"]),
        ] {
            expect(&gradient(&format!("{option} {name}")), 2, parts);
            assert!(!path("g.npy").exists());
        }
    }
    let bytes = |name: &str| {
        expect(&gradient(&format!("--loss {name}")), 0, &[]);
        std::fs::read(path("g.npy")).unwrap()
    };
    assert_eq!(bytes("Y.exr"), bytes("rgb.exr"), "luminance alone is grey");
}
