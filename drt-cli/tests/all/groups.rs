//! `drt optimize` with groups of unknowns, from outside.

use drt_medium::vol::{self, VolFile};

use crate::common::{Folder, expect};

const SCENE: &str = r#"<scene version="3.0.0">
  <default name="radius" value="0.5"/>
  <integrator type="path"><integer name="max_depth" value="2"/></integrator>
  <sensor type="perspective" id="cam"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0 -4 3" target="0 0 0" up="0 0 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="24"/>
      <rfilter type="tent"/></film></sensor>
  <shape type="obj" id="ball"><string name="filename" value="ball.obj"/>
    <transform name="to_world"><scale value="$radius"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.7 0.4 0.3"/></bsdf></shape>
  <shape type="rectangle" id="floor">
    <transform name="to_world"><scale value="2"/><translate z="-0.6"/></transform>
    <bsdf type="diffuse" id="paint"><texture type="bitmap" name="reflectance">
      <string name="filename" value="texels.exr"/><boolean name="raw" value="true"/></texture></bsdf></shape>
  <shape type="obj" id="hidden"><string name="filename" value="ball.obj"/>
    <transform name="to_world"><translate z="-9"/></transform></shape>
  <emitter type="point" id="lamp"><point name="position" value="0.5 -1.5 3"/><rgb name="intensity" value="20"/></emitter>
</scene>"#;

const JOB: &str = r#"scene = "scene.xml"
[estimator]
spp = 16
[[parameter]]
name = "power"
[[parameter.effect]]
target = "lamp"
property = "intensity"
multiply = 1.0
[optimize]
targets = ["target.exr"]
checkpoint = "run"
optimizer = { kind = "adam", learning_rate = { power = 0.02, paint = 0.01 }, iterations = 24 }
[[parameter_group]]
name = "body"
target = "ball"
vertices = "all"
laplacian = 10.0
learning_rate = [[0, 0.2], [12, 0.1]]
[[parameter_group]]
name = "paint"
target = "floor"
property = "reflectance"
texels = "all"
smooth = 1e-3
"#;

/// A folder with a ball of some hundred vertices.
fn with_ball() -> Folder {
    let folder = Folder::new();
    let mesh = drt_geom::procedural::icosphere(3);
    let mut text = String::new();
    for p in &mesh.positions {
        text += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    for [a, b, c] in &mesh.triangles {
        text += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    folder.file("ball.obj", text);
    folder
}

/// A folder with a scene, a job, and a target that has a larger ball.
fn folder() -> Folder {
    let folder = with_ball();
    // An image of some size, in the place of a texture.
    let gray = SCENE.replace("texels.exr", "gray.exr").replace("bitmap", "checkerboard");
    let gray = gray.replace(
        r#"<string name="filename" value="gray.exr"/><boolean name="raw" value="true"/>"#,
        "",
    );
    folder.file("gray.xml", gray);
    expect(&folder.run("render gray.xml --quiet --size 8x8 --spp 64 -o texels.exr"), 0, &[]);
    folder.file("scene.xml", SCENE);
    folder.file("job.toml", JOB);
    expect(&folder.run("render scene.xml --quiet --spp 256 -D radius=0.6 -o target.exr"), 0, &[]);
    folder
}

fn bytes(folder: &Folder, name: &str) -> Vec<u8> {
    std::fs::read(folder.path().join("run").join(name)).unwrap()
}

#[test]
fn shapes_and_textures_are_fitted_beside_parameters() {
    let folder = folder();
    expect(&folder.run("optimize job.toml --quiet"), 0, &[]);
    let table = String::from_utf8(bytes(&folder, "loss.csv")).unwrap();
    let losses: Vec<f64> =
        table.lines().skip(1).map(|l| l.split(',').nth(1).unwrap().parse().unwrap()).collect();
    assert!(losses.len() == 25 && losses[24] < 0.35 * losses[0], "{losses:?}");
    let values = String::from_utf8(bytes(&folder, "params.csv")).unwrap();
    assert!(values.starts_with("iteration,power,body,paint\n0,0.0,0.0,0.0\n"), "{values}");
    let text = String::from_utf8(bytes(&folder, "body.obj")).unwrap();
    let ply = bytes(&folder, "body.ply");
    let mesh = drt_geom::decode_ply(&ply, "body.ply").unwrap();
    assert_eq!(text.lines().filter(|l| l.starts_with("v ")).count(), mesh.positions.len());
    // It has grown where the camera sees it.
    let radius = mesh.positions.iter().map(|p| p.length()).fold(0.0, f64::max);
    assert!(radius > 0.54, "{radius}");
    // The page has each group's row and curve beside those of the parameter.
    let page = String::from_utf8(bytes(&folder, "report.html")).unwrap();
    for part in ["<td>power</td>", "<td>paint</td><td>192</td><td>8 × 8 × 3</td>", "body: change"]
    {
        assert!(page.contains(part), "{part}");
    }
    // What came out can be rendered again.
    std::fs::copy(folder.path().join("run/paint.exr"), folder.path().join("texels.exr")).unwrap();
    let ball = r#"type="obj" id="ball"><string name="filename" value="ball.obj"/>"#;
    let own = r#"type="ply" id="ball"><string name="filename" value="run/body.ply"/>"#;
    folder.file("fitted.xml", SCENE.replacen(ball, own, 1));
    expect(&folder.run("render fitted.xml --quiet --spp 16 -D radius=1 -o fitted.exr"), 0, &[]);
}

/// Stopped and gone on with, or by another number of threads, a fit ends in the same bits.
#[test]
fn a_fit_of_groups_ends_in_the_same_bits() {
    let results = ["body.ply", "body.obj", "paint.exr", "loss.csv", "params.csv"];
    let after = |runs: &[&str]| -> Vec<Vec<u8>> {
        let folder = folder();
        for options in runs {
            expect(&folder.run(&format!("optimize job.toml --quiet {options}")), 0, &[]);
        }
        results.iter().map(|name| bytes(&folder, name)).collect()
    };
    let whole = after(&["--iterations 6 --threads 1"]);
    assert!(whole == after(&["--iterations 6 --threads 3"]));
    assert!(whole == after(&["--iterations 2", "--iterations 3 --threads 2", "--iterations 6"]));
}

/// A body on a turntable: one camera, pictures in known poses, two of three in an iteration.
#[test]
fn views_in_known_poses() {
    let folder = with_ball();
    // A ball beside the axis of the table tells how far that has turned.
    let radius = r#"<scale value="$radius"/>"#;
    let off = format!(r#"{radius}<translate x="0.4"/>"#);
    let plain = SCENE.replace(radius, &off).replace("bitmap", "checkerboard").replace(
        r#"<string name="filename" value="texels.exr"/><boolean name="raw" value="true"/>"#,
        "",
    );
    folder.file("scene.xml", plain);
    let turn = "target = \"ball\"\nrotate = { axis = [0, 0, 1], pivot = [0, 0, 0] }\n";
    let table = format!(
        "scene = \"scene.xml\"\n[[parameter]]\nname = \"turn\"\n[[parameter.effect]]\n{turn}"
    );
    folder.file("table.toml", table);
    let poses = [0.0, 2.1, 4.2];
    for (k, pose) in poses.iter().enumerate() {
        let at = format!("-D radius=0.4 --set parameter.turn.value={pose} -o t{k}.exr");
        expect(&folder.run(&format!("render table.toml --quiet --spp 128 {at}")), 0, &[]);
    }
    let job = |sign: f64| {
        let view = |(k, pose): (usize, &f64)| {
            let amount = sign * pose;
            format!("[[view]]\ntarget = \"t{k}.exr\"\n[[view.effect]]\n{turn}amount = {amount:?}\n")
        };
        let views: String = poses.iter().enumerate().map(view).collect();
        format!(
            "scene = \"scene.xml\"\n[estimator]\nspp = 16\n[optimize]\nviews_per_iteration = 2\n\
             checkpoint = \"run\"\noptimizer = {{ kind = \"adam\", iterations = 12 }}\n{views}\
             [[parameter_group]]\nname = \"body\"\ntarget = \"ball\"\nvertices = \"all\"\n\
             laplacian = 10.0\nlearning_rate = [[0, 1.0], [6, 0.4]]\n"
        )
    };
    let losses = |job: String, runs: &[&str]| -> Vec<f64> {
        folder.file("job.toml", job);
        for options in runs {
            expect(&folder.run(&format!("optimize job.toml --quiet {options}")), 0, &[]);
        }
        let table = String::from_utf8(bytes(&folder, "loss.csv")).unwrap();
        table.lines().skip(1).map(|l| l.split(',').nth(1).unwrap().parse().unwrap()).collect()
    };
    let whole = losses(job(1.0), &["--restart"]);
    assert!(whole.len() == 13 && whole[12] < 0.6 * whole[0], "{whole:?}");
    let body = bytes(&folder, "body.ply");
    // The page has no section about parameters, of which there are none.
    let page = String::from_utf8(bytes(&folder, "report.html")).unwrap();
    assert!(page.contains("<h2>Groups</h2>") && page.contains("body: change"));
    for absent in ["<h2>Parameters</h2>", "<h2>Derivatives</h2>", "red bar"] {
        assert!(!page.contains(absent), "{absent}");
    }
    // A run that was stopped goes on with the views that were next.
    let parts = losses(job(1.0), &["--restart --seconds 0.01", "--threads 1"]);
    assert!(parts == whole, "{parts:?} {whole:?}");
    assert!(bytes(&folder, "body.ply") == body);
    // Poses of the wrong sense do not fit.
    let wrong = losses(job(-1.0), &["--restart --iterations 1"]);
    assert!(wrong[0] > 1.5 * whole[0], "{wrong:?} {whole:?}");
    for (from, to, message) in [
        ("views_per", "targets = [\"t0.exr\"]\nviews_per", "[[view]] takes the place of `targets`"),
        ("iteration = 2", "iteration = 4", "`views_per_iteration` is 4; expected 1 to 3"),
        ("t1.exr", "missing.exr", "missing.exr"),
        ("amount = 2.1", "amount = inf", "`amount` is inf"),
    ] {
        folder.file("bad.toml", job(1.0).replace(from, to));
        expect(&folder.run("optimize bad.toml --quiet"), 2, &[message, "bad.toml:"]);
    }
}

#[test]
fn groups_that_cannot_be_fitted_are_refused_before_anything_is_written() {
    let folder = folder();
    let group = |from: &str, to: &str| JOB.replace(from, to);
    for (job, message) in [
        (
            group("target = \"ball\"", "target = \"hidden\""),
            "group `body` changes nothing that its targets show",
        ),
        (group("laplacian = 10.0", "laplacian = -1"), "`laplacian` is -1"),
        (group("smooth = 1e-3", "laplacian = 2.0"), "`laplacian` goes with `vertices`"),
        (group("smooth = 1e-3", "bounds = [1.0, 0.0]"), "`bounds`: [1, 0]; expected a range"),
        (group("name = \"paint\"", "name = \"body\""), "there are two groups `body`"),
        (group("name = \"paint\"", "name = \"a/b\""), "cannot be the name of a file"),
        (group(", paint = 0.01", ""), "`learning_rate` has no entry for group `paint`"),
        (
            group("kind = \"adam\"", "kind = \"gauss-newton\""),
            "does not go with [[parameter_group]]",
        ),
        (
            group(
                "[[parameter_group]]\nname = \"paint\"",
                "[[parameter_group]]\nname = \"more\"\ntarget = \"ball\"\nvertices = \"all\"\nlearning_rate = 0.1\n[[parameter_group]]\nname = \"paint\"",
            ),
            "group body changes the same values",
        ),
    ] {
        folder.file("bad.toml", job);
        expect(&folder.run("optimize bad.toml --quiet"), 2, &[message]);
        assert!(!folder.path().join("run/checkpoint.json").exists(), "{message}");
    }
}

/// A cube of microflakes in two voxels.
const FLAKES: &str = r#"<scene version="3.0.0">
  <default name="flakes" value="s.vol"/>
  <integrator type="volpath"><integer name="max_depth" value="3"/></integrator>
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0 -4 3" target="0 0 0" up="0 0 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film></sensor>
  <medium type="homogeneous" id="cloud"><rgb name="sigma_t" value="1.5"/><rgb name="albedo" value="0.9"/>
    <phase type="sggx"><volume name="S" type="gridvolume"><string name="filename" value="$flakes"/>
      <transform name="to_world"><translate x="-0.5" y="-0.5" z="-0.5"/><scale value="2"/></transform>
    </volume></phase></medium>
  <shape type="cube"><bsdf type="null"/><ref name="interior" id="cloud"/></shape>
  <emitter type="directional"><vector name="direction" x="0.3" y="1" z="-1"/><rgb name="irradiance" value="3"/></emitter>
</scene>"#;

const FLAKES_JOB: &str = r#"scene = "flakes.xml"
[estimator]
spp = 16
[optimize]
targets = ["target.exr"]
checkpoint = "run"
optimizer = { kind = "adam", learning_rate = 0.02, iterations = 2 }
[[parameter_group]]
name = "widths"
target = "cloud"
property = "sggx_diagonal"
voxels = "all"
[[parameter_group]]
name = "tilts"
target = "cloud"
property = "sggx_off_diagonal"
voxels = "all"
"#;

#[test]
fn fitted_microflakes_can_be_read_again() {
    let folder = Folder::new();
    let matrices = |name: &str, numbers: [f64; 12]| {
        let part = |first: usize| {
            let own = numbers.chunks(6).flat_map(|six| six[first..first + 3].to_vec());
            let grid = drt_medium::Grid::new([2, 1, 1], 3, own.collect()).unwrap();
            VolFile { bounds: grid.world_bounds(), grid }
        };
        folder.file(name, vol::encode_matrices(&[part(0), part(3)]).unwrap());
    };
    let even = [0.6, 0.6, 0.6, 0.0, 0.0, 0.0];
    let tilted = [0.9, 0.4, 0.5, 0.2, -0.1, 0.1];
    matrices("s.vol", [even, even].concat().try_into().unwrap());
    matrices("truth.vol", [tilted, even].concat().try_into().unwrap());
    folder.file("flakes.xml", FLAKES);
    folder.file("job.toml", FLAKES_JOB);
    let render = "render flakes.xml --quiet --spp 64";
    expect(&folder.run(&format!("{render} -D flakes=truth.vol -o target.exr")), 0, &[]);
    expect(&folder.run("optimize job.toml --quiet"), 0, &[]);
    // Both groups are in either file.
    assert!(bytes(&folder, "widths.vol") == bytes(&folder, "tilts.vol"));
    let [widths, tilts] = vol::read_matrices(folder.path().join("run/widths.vol")).unwrap();
    assert!(widths.grid.values().iter().any(|v| (v - 0.6).abs() > 0.01));
    assert!(tilts.grid.values().iter().any(|v| v.abs() > 0.01));
    expect(&folder.run(&format!("{render} -D flakes=run/tilts.vol -o fitted.exr")), 0, &[]);
}
