//! Input that is broken, hostile or absurd: one error that names file and place, exit code 2,
//! nothing written, in bounded time. Input that is only odd is rendered.

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

fn ply(vertices: &str, faces: &str) -> String {
    let header = "property float x\nproperty float y\nproperty float z\n";
    let list = "property list uchar int vertex_indices\n";
    format!(
        "ply\nformat ascii 1.0\nelement vertex 3\n{header}element face 1\n{list}end_header\n{vertices}{faces}"
    )
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

fn in_scene(name: &'static str, body: &str, parts: &'static [&'static str]) -> Case {
    only_scene(name, scene(body), parts)
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

#[test]
fn scenes_that_are_no_scenes() {
    let whole = scene(r#"<shape type="cube"/>"#);
    let deep = format!("<scene version=\"3.0.0\">{}", "<a>".repeat(300_000));
    let deep_closed = format!("{deep}{}</scene>", "</a>".repeat(300_000));
    refused([
        only_scene("empty", "", &["s.xml:1:1: not well-formed"]),
        only_scene("cut", &whole[..whole.len() - 20], &["s.xml:", "not well-formed"]),
        only_scene("bytes", [0xff, 0xfe, 0, 1], &["s.xml: cannot read this file"]),
        only_scene("zeros", [0; 64], &["s.xml:1:1: not well-formed"]),
        only_scene("deep", deep, &["s.xml:"]),
        only_scene("deep and closed", deep_closed, &["s.xml:1", "nest"]),
        only_scene(
            "entities",
            "<!DOCTYPE s [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;&a;\">]><scene>&b;</scene>",
            &["s.xml:1:1: not well-formed"],
        ),
        case("no file", [] as [(&str, &str); 0], &["s.xml: cannot read"]),
    ]);
}

#[test]
fn elements_that_do_not_fit() {
    let ring = r#"<bsdf type="twosided" id="a"><ref id="b"/></bsdf>
<bsdf type="twosided" id="b"><ref id="a"/></bsdf>"#;
    refused([
        in_scene(
            "unknown element",
            "<texture type=\"bitmap\"/>",
            &["s.xml:6: <texture", "<scene>"],
        ),
        in_scene(
            "unknown inside",
            "<shape type=\"cube\">\n<rotor/></shape>",
            &["s.xml:7: <rotor>"],
        ),
        in_scene("unknown type", "<shape type=\"torus\"/>", &["s.xml:6", "torus", "sphere"]),
        in_scene(
            "dangling",
            "<shape type=\"cube\">\n<ref id=\"x\"/></shape>",
            &["s.xml:7", "`x`", "cam"],
        ),
        in_scene(
            "wrong kind",
            "<shape type=\"cube\"><ref id=\"cam\"/></shape>",
            &["s.xml:6", "cam"],
        ),
        in_scene("taken", "<shape type=\"cube\" id=\"cam\"/>", &["s.xml:6", "`cam`", "line 2"]),
        in_scene(
            "itself",
            "<bsdf type=\"twosided\" id=\"a\"><ref id=\"a\"/></bsdf>",
            &["s.xml:6", "twosided"],
        ),
        in_scene("ring", ring, &["s.xml:7", "twosided"]),
        in_scene(
            "alias ring",
            "<alias id=\"a\" as=\"b\"/><alias id=\"b\" as=\"a\"/>",
            &["s.xml:6"],
        ),
        in_scene("no sensor twice", "<integrator type=\"path\"/>", &["s.xml:6", "one integrator"]),
    ]);
}

#[test]
fn includes_and_defaults_without_end() {
    let include =
        |name: &str| format!("<scene version=\"3.0.0\">\n<include filename=\"{name}\"/></scene>");
    // Each file includes the next one twice, and each default repeats the one before it.
    const NAMES: [&str; 31] = [
        "s.xml", "1.xml", "2.xml", "3.xml", "4.xml", "5.xml", "6.xml", "7.xml", "8.xml", "9.xml",
        "10.xml", "11.xml", "12.xml", "13.xml", "14.xml", "15.xml", "16.xml", "17.xml", "18.xml",
        "19.xml", "20.xml", "21.xml", "22.xml", "23.xml", "24.xml", "25.xml", "26.xml", "27.xml",
        "28.xml", "29.xml", "30.xml",
    ];
    let twice = |next: &str| {
        let include = format!("<include filename=\"{next}\"/>");
        format!("<scene version=\"3.0.0\"><bsdf type=\"null\"/>{include}\n{include}</scene>")
    };
    let mut tree: Vec<_> = NAMES.windows(2).map(|w| (w[0], twice(w[1]))).collect();
    tree.push((NAMES[30], "<scene version=\"3.0.0\"/>".into()));
    let mut doubling = String::from("<default name=\"d0\" value=\"1 2 3 4 5 6 7 8\"/>\n");
    for i in 1..=40 {
        let _ = writeln!(doubling, "<default name=\"d{i}\" value=\"$d{0} $d{0}\"/>", i - 1);
    }
    refused([
        only_scene("itself", include("s.xml"), &["s.xml:2", "includes itself"]),
        case(
            "ring",
            [("s.xml", include("b.xml")), ("b.xml", include("s.xml"))],
            &["b.xml:2", "s.xml includes itself"],
        ),
        only_scene("missing", include("b.xml"), &["s.xml:2", "b.xml"]),
        only_scene("folder", include("."), &["s.xml:2", "cannot read"]),
        case("tree", tree, &[".xml", "more than 4096 files"]),
        in_scene("doubling", &doubling, &["s.xml:", "longer than"]),
        in_scene("undefined", "<float name=\"$x\" value=\"1\"/>", &["s.xml:6", "$x has no value"]),
    ]);
}

#[test]
fn numbers_beyond_reason() {
    let placed = |step: &str| {
        format!("<shape type=\"cube\">\n<transform name=\"to_world\">{step}</transform></shape>")
    };
    let camera =
        |inside: &str| format!("<sensor type=\"perspective\" id=\"other\">\n{inside}</sensor>");
    let film = |w: &str| {
        camera(&format!(
            "<film type=\"hdrfilm\"><integer name=\"width\" value=\"{w}\"/>\
             <integer name=\"height\" value=\"65536\"/></film>"
        ))
    };
    let looking =
        |at: &str| camera(&format!("<transform name=\"to_world\"><lookat {at}/></transform>"));
    let wide_filter = scene("<shape type=\"cube\"/>").replace(
        "</film>",
        "<rfilter type=\"gaussian\"><float name=\"stddev\" value=\"1e300\"/></rfilter></film>",
    );
    refused([
        in_scene("nan", &placed("<translate x=\"nan\"/>"), &["s.xml:7", "`nan`", "finite"]),
        in_scene("infinite", &placed("<scale value=\"1e999\"/>"), &["s.xml:7", "`1e999`"]),
        in_scene(
            "overflow",
            &placed("<scale value=\"1e200\"/><scale value=\"1e200\"/>"),
            &["s.xml:7", "overflows"],
        ),
        in_scene("huge", &placed("<scale value=\"1e200\"/>"), &["s.xml:6", "cube", "1e100"]),
        in_scene("far", &placed("<translate x=\"1e150\"/>"), &["s.xml:6", "cube", "1e100"]),
        in_scene(
            "flat emitter",
            "<shape type=\"rectangle\">\n<transform name=\"to_world\"><scale x=\"0\"/></transform><emitter type=\"area\"/></shape>",
            &["s.xml:6", "area"],
        ),
        in_scene(
            "a point",
            "<shape type=\"sphere\"><transform name=\"to_world\"><scale value=\"0\"/></transform></shape>",
            &["s.xml:6"],
        ),
        in_scene(
            "no radius",
            "<shape type=\"sphere\"><float name=\"radius\" value=\"0\"/></shape>",
            &["s.xml:6", "radius"],
        ),
        in_scene(
            "resolution",
            "<shape type=\"sphere\"><integer name=\"resolution\" value=\"1000000000\"/></shape>",
            &["s.xml:6", "resolution"],
        ),
        in_scene("wide film", &film("99999999999"), &["s.xml:7", "width"]),
        in_scene("large film", &film("65536"), &["s.xml:7", "pixels"]),
        in_scene(
            "no view",
            &looking("origin=\"1 1 1\" target=\"1 1 1\" up=\"0 0 1\""),
            &["s.xml:7: <lookat>"],
        ),
        in_scene(
            "no up",
            &looking("origin=\"0 0 1\" target=\"0 0 0\" up=\"0 0 1\""),
            &["s.xml:7: <lookat>"],
        ),
        in_scene(
            "flat camera",
            &camera("<transform name=\"to_world\"><scale x=\"0\"/></transform>"),
            &["s.xml:6"],
        ),
        in_scene(
            "no angle",
            &camera("<float name=\"fov\" value=\"0\"/>"),
            &["s.xml:6", "field of view"],
        ),
        in_scene(
            "samples",
            &camera(
                "<sampler type=\"independent\"><integer name=\"sample_count\" value=\"1e9\"/></sampler>",
            ),
            &["s.xml:7", "1e9"],
        ),
        only_scene("filter", wide_filter, &["s.xml:4", "rfilter"]),
        in_scene(
            "fog",
            "<medium type=\"homogeneous\">\n<float name=\"sigma_t\" value=\"-1\"/></medium>",
            &["s.xml:6", "sigma_t"],
        ),
        in_scene(
            "albedo",
            "<medium type=\"homogeneous\">\n<float name=\"albedo\" value=\"1.5\"/></medium>",
            &["s.xml:6", "albedo"],
        ),
        in_scene(
            "asymmetry",
            "<medium type=\"homogeneous\"><phase type=\"hg\">\n<float name=\"g\" value=\"1\"/></phase></medium>",
            &["s.xml:6", "g"],
        ),
        in_scene(
            "roughness",
            "<bsdf type=\"roughconductor\"><float name=\"alpha\" value=\"0\"/></bsdf>",
            &["s.xml:6", "alpha"],
        ),
        in_scene(
            "radiance",
            "<emitter type=\"constant\"><rgb name=\"radiance\" value=\"1 -1 1\"/></emitter>",
            &["s.xml:6", "negative"],
        ),
        in_scene(
            "direction",
            "<emitter type=\"directional\"><vector name=\"direction\" value=\"0 0 0\"/></emitter>",
            &["s.xml:6", "direction"],
        ),
    ]);
}

#[test]
fn mesh_files() {
    let obj = |name, text: &str, parts| {
        case(name, [("s.xml", from_file("obj", "m.obj")), ("m.obj", text.into())], parts)
    };
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let ply_file = |name, text: String, parts| {
        case(name, [("s.xml", from_file("ply", "m.ply")), ("m.ply", text)], parts)
    };
    let three = "0 0 0\n1 0 0\n0 1 0\n";
    refused([
        only_scene(
            "no file",
            from_file("obj", "m.obj"),
            &["s.xml:6: <shape type=\"obj\"", "m.obj"],
        ),
        only_scene("a folder", from_file("obj", "."), &["s.xml:6", "cannot read"]),
        obj("empty obj", "", &["s.xml:6", "m.obj:1", "no faces"]),
        obj("no faces", triangle, &["s.xml:6", "m.obj:3", "no faces"]),
        obj("cut obj", "v 0 0 0\nv 1 0", &["s.xml:6", "m.obj:2", "three finite numbers"]),
        obj("nan obj", "v 0 nan 0\nf 1 1 1\n", &["s.xml:6", "m.obj:1", "finite"]),
        obj("index", &format!("{triangle}f 1 2 4\n"), &["s.xml:6", "m.obj:4", "vertex 4"]),
        obj("far back", &format!("{triangle}f 1 2 -9223372036854775808\n"), &["m.obj:4"]),
        obj("too large", "v 0 0 0\nv 1e200 0 0\nv 0 1e200 0\nf 1 2 3\n", &["s.xml:6", "1e100"]),
        ply_file("empty ply", String::new(), &["s.xml:6", "m.ply: line 1"]),
        ply_file(
            "cut ply",
            ply("0 0 0\n1 0", ""),
            &["s.xml:6", "m.ply: line 11, vertex 1", "ends"],
        ),
        ply_file(
            "nan ply",
            ply("0 0 0\n1 nan 0\n0 1 0\n", "3 0 1 2\n"),
            &["m.ply: line 11, vertex 1", "finite"],
        ),
        ply_file("ply index", ply(three, "3 0 1 3\n"), &["m.ply: line 13, face 0", "vertex 3"]),
        ply_file(
            "ply count",
            ply(three, "").replace("face 1", "face 999999999999"),
            &["m.ply:", "face 0", "ends"],
        ),
        ply_file("ply list", ply(three, "255 0 1 2\n"), &["m.ply:", "face 0", "ends"]),
    ]);
}

#[test]
fn grid_files() {
    let grid = |name, bytes: Vec<u8>, parts| {
        case(name, [("s.xml", from_grid("g.vol").into_bytes()), ("g.vol", bytes)], parts)
    };
    let whole = vol([2, 2, 2], &[1.0; 8]);
    let flat = from_grid("g.vol")
        .replace("</volume>", "<transform name=\"to_world\"><scale x=\"0\"/></transform></volume>");
    refused([
        only_scene("no file", from_grid("g.vol"), &["s.xml:7: <volume", "g.vol"]),
        grid("empty", Vec::new(), &["s.xml:7", "g.vol is cut off at byte 0"]),
        grid("cut", whole[..whole.len() - 1].to_vec(), &["s.xml:7", "g.vol is cut off at byte 79"]),
        grid("nan", vol([1, 1, 1], &[f32::NAN]), &["s.xml:7", "g.vol, byte 48", "finite"]),
        grid("infinite", vol([1, 1, 2], &[1.0, f32::INFINITY]), &["s.xml:7", "g.vol, byte 52"]),
        grid("negative", vol([1, 1, 1], &[-1.0]), &["s.xml:6", "negative"]),
        grid("absurd", vol([i32::MAX; 3], &[1.0]), &["s.xml:7", "g.vol is cut off"]),
        grid("no voxels", vol([0, 1, 1], &[]), &["s.xml:7", "g.vol, byte 8", "at least 1"]),
        grid("no grid", b"VOL\x02".repeat(20), &["s.xml:7", "g.vol, byte 0", "version 3"]),
        case("flat", [("s.xml", flat.into_bytes()), ("g.vol", whole)], &["s.xml:7"]),
    ]);
}

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
    let out = run(&folder, "check j.toml --spp 64 --size 8x8 --set estimator.step=0.6");
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
    let job = drt_cli::Job::from_scene(&path, &drt_cli::Defaults::new()).unwrap();
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
