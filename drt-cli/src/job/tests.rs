use std::path::PathBuf;

use drt_estimators::{AuxiliarySamples, Depth, EstimatorKind, PathSampling, Warp, WarpKernel};
use drt_math::{Rgb, Vec3, vec3};
use drt_motion::{Change, GeometryChange, PropertyChange, ValueChange};

use super::*;
use crate::testing::Folder;

const SCENE: &str = r#"<scene version="3.0.0"><medium type="homogeneous" id="fog"/>
  <default name="n" value="8"/>
  <sensor type="perspective"/>
  <sensor type="perspective" id="cam"><film type="hdrfilm"><integer name="width" value="$n"/></film>
    <sampler type="independent"><integer name="sample_count" value="9"/></sampler></sensor>
  <shape type="cube" id="cube"/></scene>"#;

/// A medium of a grid.
const SMOKE: &str = r#"<medium type="heterogeneous" id="smoke"><volume name="sigma_t" type="gridvolume">
    <string name="filename" value="g.vol"/></volume></medium></scene>"#;

/// A tetrahedron.
const CAGE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

fn job(text: &str, set: &[(&str, &str)]) -> Result<Job, CliError> {
    let folder = Folder::new();
    folder.file("scene.xml", SCENE.replace("</scene>", SMOKE));
    folder.file("velocity.txt", "# one per vertex\n1 2 3\n\n4, 5, 6  # the last\n");
    folder.file("broken.txt", "1 2 3\n1 2\n");
    let ply = "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\n\
               property double z\nend_header\n1 2 3\n4 5 6\n";
    folder.file("velocity.ply", ply);
    folder.file("cage.obj", CAGE);
    folder.file("g.vol", grid());
    folder.file("open.obj", CAGE.split("f 1 4 3").next().unwrap());
    folder.file("cage.ply", "ply\nformat");
    let set = set.iter().map(|(k, v)| ((*k).into(), (*v).into())).collect();
    read_job(&folder.file("job.toml", text), &Overrides { set, ..Overrides::default() })
}

/// A grid of two voxels along each axis.
fn grid() -> Vec<u8> {
    let mut bytes = b"VOL\x03".to_vec();
    bytes.extend([1, 2, 2, 2, 1].iter().flat_map(|n: &i32| n.to_le_bytes()));
    let numbers = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0].iter().chain(&[0.5; 8]);
    bytes.extend(numbers.flat_map(|v: &f32| v.to_le_bytes()));
    bytes
}

#[track_caller]
fn refused(text: &str, set: &[(&str, &str)], parts: &[&str]) {
    let message = job(text, set).map(|_| ()).unwrap_err().to_string();
    for part in parts {
        assert!(message.contains(part), "expected `{part}` in: {message}");
    }
}

fn change(effect: &str) -> Change {
    change_of("cube", effect)
}

fn change_of(target: &str, effect: &str) -> Change {
    let text = format!(
        "scene = \"scene.xml\"\n[[parameter]]\nname = \"p\"\n[[parameter.effect]]\n\
         target = \"{target}\"\n{effect}"
    );
    job(&text, &[]).unwrap().parameters.remove(0).effects.remove(0).change
}

#[test]
fn defaults_are_the_contracts() {
    let j = job("scene = \"scene.xml\"", &[]).unwrap();
    let s = &j.settings;
    assert_eq!((s.sensor, j.spp(), s.boundary_ratio, s.max_depth), (0, 64, None, Depth::OfScene));
    assert_eq!((s.estimator, s.antithetic, s.step), (EstimatorKind::Auto, true, 1e-3));
    assert!(j.parameters.is_empty());
    j.require_derivatives().unwrap();
}

#[test]
fn every_estimator_key() {
    let text = r#"
        scene = "scene.xml"
        sensor = "cam"
        [estimator]
        kind = "finite-difference"
        sampling = "unidirectional"
        spp = 3
        boundary_spp = 5
        max_depth = -1
        antithetic = false
        guiding = false
        step = 0.5
    "#;
    let mut j = job(text, &[]).unwrap();
    let s = &j.settings;
    let ratio = Some(5.0 / 3.0);
    assert_eq!((s.sensor, j.spp(), s.boundary_ratio, s.max_depth), (1, 3, ratio, Depth::Unlimited));
    assert_eq!((s.estimator, s.antithetic, s.step), (EstimatorKind::FiniteDifference, false, 0.5));
    // Boundary samples stay as many as the job says.
    j.set_spp(10);
    assert_eq!((j.spp(), j.settings.boundary_ratio), (10, Some(0.5)));
}

#[test]
fn geometry_effects() {
    let geometry = |effect: &str| match change(effect) {
        Change::Geometry(g) => g,
        other => panic!("{other:?}"),
    };
    let (x, one) = (Vec3::X, vec3(1.0, 2.0, 3.0));
    assert_eq!(geometry("translate = [1, 2, 3]"), GeometryChange::Translate(one));
    let rotate = GeometryChange::Rotate { axis: x, pivot: one };
    assert_eq!(geometry("rotate = { axis = [1, 0, 0], pivot = [1, 2, 3] }"), rotate);
    let scale = GeometryChange::Scale { factor: one, pivot: Vec3::ZERO };
    assert_eq!(geometry("scale = { factor = [1, 2, 3] }"), scale);
    let matrix = geometry("matrix = [[1, 2, 3, 4], [5, 6, 7, 8], [9, 10, 11, 12]]");
    let GeometryChange::Matrix(m) = matrix else { panic!() };
    assert_eq!(m.translation, vec3(4.0, 8.0, 12.0));
    assert_eq!(m.vector(x), vec3(1.0, 5.0, 9.0));
    let vertex = GeometryChange::Vertex { index: 7, direction: one };
    assert_eq!(geometry("vertex = { index = 7, direction = [1, 2, 3] }"), vertex);
    for file in ["velocity.txt", "velocity.ply"] {
        let GeometryChange::VertexVelocity(v) = geometry(&format!("vertex_velocity = \"{file}\""))
        else {
            panic!()
        };
        assert_eq!(v[..], [one, vec3(4.0, 5.0, 6.0)]);
    }
    let cage = geometry("cage = { mesh = \"cage.obj\", vertex = 3, direction = [1, 2, 3] }");
    let GeometryChange::Cage { mesh, vertices } = cage else { panic!() };
    assert_eq!((mesh.source_vertex_count, &vertices[..]), (4, &[(3, one)][..]));
    assert_eq!(change("follow = \"fog\""), Change::Follow("fog".into()));
}

#[test]
fn property_effects() {
    let of = |keys: &str| change_of("smoke", &format!("property = \"sigma_t\"\n{keys}"));
    let expected = |op, voxels| {
        Change::Property(PropertyChange { property: "sigma_t".into(), op, voxels, texels: None })
    };
    let add = ValueChange::Add(Rgb::new(1.0, 2.0, 3.0));
    assert_eq!(of("add = [1, 2, 3]"), expected(add, None));
    assert_eq!(of("multiply = 2"), expected(ValueChange::Multiply(2.0), None));
    assert_eq!(of("multiply = 2\nlog = true"), expected(ValueChange::MultiplyLog(2.0), None));
    assert_eq!(of("add = [1, 2, 3]\nvoxels = \"all\""), expected(add, None));
    assert_eq!(of("add = [1, 2, 3]\nvoxels = [0, 1, 2]"), expected(add, Some([0, 1, 2])));
}

#[test]
fn effects_that_make_no_sense() {
    let text = |effect: &str| {
        format!(
            "scene = \"scene.xml\"\n[[parameter]]\nname = \"p\"\n[[parameter.effect]]\n\
             target = \"cube\"\n{effect}"
        )
    };
    for (effect, part) in [
        ("", "the effect does nothing"),
        ("translate = [1, 2, 3]\nfollow = \"fog\"", "does 2 things"),
        ("translate = [1, 2]", "job.toml:6"),
        ("translate = [1, 2, 3]\nmultiply = 2", "`multiply` belongs to a `property`"),
        ("property = \"g\"", "either `add` or `multiply`"),
        ("property = \"g\"\nadd = [1, 1, 1]\nlog = true", "`log` belongs to `multiply`"),
        ("property = \"g\"\nmultiply = inf", "not finite"),
        ("property = \"g\"\nmultiply = 1\nvoxels = \"some\"", "\"all\" or [i, j, k]"),
        (
            "cage = { mesh = \"none.obj\", vertex = 1, direction = [1, 0, 0] }",
            "none.obj: No such file",
        ),
        (
            "cage = { mesh = \"open.obj\", vertex = 1, direction = [1, 0, 0] }",
            "open.obj: unusable as a `cage`: the surface is not closed: the edge from vertex",
        ),
        ("cage = { mesh = \"cage.ply\", vertex = 1, direction = [1, 0, 0] }", "cage.ply"),
        (
            "cage = { mesh = \"cage.obj\", vertex = 4, direction = [1, 0, 0] }",
            "cage.obj: vertex 4 does not exist: the cage has 4 vertices, counted from 0",
        ),
        ("cage = { mesh = \"cage.obj\", direction = [1, 0, 0] }", "`cage` lacks `vertex`"),
        ("cage = { mesh = \"cage.obj\", vertex = 1 }", "`cage` lacks `direction`"),
        ("cage = { mesh = \"cage.obj\", vertex = -1, direction = [1, 0, 0] }", "job.toml:6"),
        ("vertex_velocity = \"broken.txt\"", "broken.txt:2: `1 2` is not three finite numbers"),
        ("vertex_velocity = \"none.txt\"", "none.txt: No such file"),
        ("stretch = [1, 2, 3]", "unknown field `stretch`"),
    ] {
        refused(&text(effect), &[], &[part]);
    }
    refused(&text("").replace("cube", "cone"), &[], &["job.toml:4", "parameter `p`"]);
    let target = text("translate = [1, 2, 3]").replace("cube", "cone");
    refused(&target, &[], &["`cone`", "known ids: cube, fog, smoke, cam"]);
}

#[test]
fn unknown_keys_name_their_place_and_the_known_ones() {
    refused("scene = \"scene.xml\"\n\n  sensors = \"cam\"", &[], &["job.toml:3:3", "`sensor`"]);
    refused("scene = \"scene.xml\"\n[estimator]\nssp = 3", &[], &["job.toml:3:1", "`spp`"]);
    refused("[estimator]\nspp = 3", &[], &["missing field `scene`"]);
    refused("scene = scene.xml", &[], &["job.toml:1"]);
    refused("scene = \"scene.xml\"\n[estimator]\nspp = 0", &[], &["job.toml:3:7", "`spp` is 0"]);
    refused("scene = \"scene.xml\"\n[estimator]\nmax_depth = -2", &[], &["-1 (unlimited)"]);
    refused("scene = \"scene.xml\"\n[estimator]\nstep = 0.0", &[], &["a positive number"]);
    refused("scene = \"scene.xml\"\nsensor = \"cube\"", &[], &["job.toml:2", "not a sensor"]);
    refused("scene = \"nothing.xml\"", &[], &["nothing.xml: No such file"]);
    refused(
        "scene = \"scene.xml\"\n[estimator]\nkind = \"magic\"",
        &[],
        &["`magic`", "`radiative`"],
    );
    let twice = "scene = \"scene.xml\"\n[[parameter]]\nname = \"p\"\n[[parameter]]\nname = \"p\"";
    refused(twice, &[], &["job.toml:4", "already taken"]);
}

#[test]
fn assignments_reach_every_key() {
    let text = "scene = \"scene.xml\"\n[[parameter]]\nname = \"a\"\n[[parameter]]\nname = \"a.b\"\n\
                [[parameter.effect]]\ntarget = \"cube\"\ntranslate = [1, 0, 0]";
    let j = job(
        text,
        &[
            ("parameter.a.value", "0.5"),
            ("parameter.a.b.value", "2"),
            ("parameter.1.effect.0.translate", "[0, 0, 4]"),
            ("estimator.spp", "7"),
            ("estimator.kind", "finite-difference"),
            ("sensor", "cam"),
        ],
    )
    .unwrap();
    assert_eq!(j.parameters.iter().map(|p| p.value).collect::<Vec<_>>(), [0.5, 2.0]);
    let translated = Change::Geometry(GeometryChange::Translate(vec3(0.0, 0.0, 4.0)));
    assert_eq!(j.parameters[1].effects[0].change, translated);
    assert_eq!((j.spp(), j.settings.sensor), (7, 1));
    assert_eq!(j.settings.estimator, EstimatorKind::FiniteDifference);
    for (key, value, parts) in [
        ("estimator.ssp", "7", ["--set estimator.ssp", "unknown field `ssp`"]),
        ("estimator.spp", "many", ["--set estimator.spp", "invalid type"]),
        ("parameter.c.value", "1", ["--set parameter.c.value", "it has a, a.b"]),
        ("scene.file", "1", ["--set scene.file", "`scene` is a string"]),
        ("estimator..spp", "1", ["--set estimator..spp", "empty part"]),
        ("parameter.a.value", "nan", ["parameter `a`", "not finite"]),
    ] {
        refused(text, &[("estimator.step", "1"), (key, value)], &parts);
    }
}

#[test]
fn keys_of_later_versions_are_read_and_stand_in_the_way_of_derivatives_only() {
    let text = |more: &str| format!("scene = \"scene.xml\"\n{more}");
    let group = "[[parameter_group]]\ntarget = \"cube\"\nvertices = \"all\"";
    let j = job(&text(group), &[]).unwrap();
    let message = j.require_derivatives().unwrap_err().to_string();
    assert!(message.contains("[[parameter_group]]") && message.contains("job.toml:"), "{message}");
    refused(&text("[estimator]\nsampling = \"both\""), &[], &["`both`"]);
    let j = job(&text("[estimator]\nsampling = \"bidirectional\""), &[]).unwrap();
    assert_eq!(j.settings.sampling, PathSampling::Bidirectional);
    let j = job(&text("[estimator]\nsampling = \"auto\""), &[]).unwrap();
    assert_eq!(j.settings.sampling, PathSampling::Auto);
    refused(&text("[[motion]]\nmedium = \"fog\"\nkind = \"liquid\""), &[], &["`liquid`"]);
    let motion = |more: &str| text(&format!("[[motion]]\nmedium = \"fog\"\n{more}"));
    refused(&motion("kind = \"affine\"\nmesh = \"a.mesh\""), &[], &["`tetrahedral`"]);
    let velocities = "kind = \"tetrahedral\"\nvelocities = \"v.txt\"";
    refused(&motion(velocities), &[], &["`mesh`, which is missing"]);
    let unnamed = format!("{velocities}\nmesh = \"a.mesh\"");
    refused(&motion(&unnamed), &[], &["need each other"]);
    refused(&motion("kind = \"tetrahedral\"\nmesh = \"a.mesh\""), &[], &["a.mesh"]);
    let maker = |kind: &str, maker: &str| {
        motion(&format!("kind = \"{kind}\"\ntetrahedralizer = \"{maker}\""))
    };
    refused(&maker("static", "own"), &[], &["job.toml:2", "`tetrahedralizer` belongs to"]);
    refused(&maker("tetrahedral", "gmsh"), &[], &["`gmsh`", "`own`", "`tetgen`"]);
    let inside = |text: &str| job(text, &[]).map(|j| j.settings.insides[0].1.clone());
    use drt_estimators::InteriorMotion::{Tetgen, Tetrahedral};
    assert_eq!(inside(&maker("tetrahedral", "own")).unwrap(), Tetrahedral(None));
    let tetgen = maker("tetrahedral", "tetgen");
    if cfg!(feature = "tetgen") {
        assert_eq!(inside(&tetgen).unwrap(), Tetgen);
    } else {
        refused(&tetgen, &[], &["job.toml:2", "--features tetgen", "AGPL"]);
    }
    let still = "[[motion]]\nmedium = \"fog\"\nkind = \"static\"";
    let j = job(&text(still), &[]).unwrap();
    j.require_derivatives().unwrap();
    assert_eq!(j.settings.insides, [(0, drt_estimators::InteriorMotion::Static)]);
    refused(&text(&still.replace("fog", "cube")), &[], &["`cube` is not a medium"]);
    let fit = text(
        "[optimize]\ntargets = [\"t.exr\"]\nloss = { pyramid-l2 = { levels = 10, weight = 4 } }\n\
         optimizer = { kind = \"adam\", learning_rate = 0.05, iterations = 100 }\n\
         checkpoint = \"run/\"",
    );
    job(&fit, &[]).unwrap().require_derivatives().unwrap();
    job(&text("[optimize]\ntargets = []\nloss = \"l2\""), &[]).unwrap();
}

#[test]
fn errors_of_the_estimators_get_the_place_of_their_cause() {
    let text = "scene = \"scene.xml\"\n[[parameter]]\nname = \"p\"";
    let j = job(text, &[]).unwrap();
    let blame = |parameter: &str| {
        let (parameter, target_name) = (parameter.into(), "cube".into());
        let reason = drt_estimators::EffectError::NotMovable;
        j.blame(&drt_estimators::Error::Effect { parameter, target_name, reason }).to_string()
    };
    assert!(blame("p").contains("job.toml:2"));
    assert!(blame("q").contains("job.toml: "));
}

/// Without any of both files; messages are those of files of these names.
#[test]
fn jobs_and_scenes_are_decoded_from_bytes() {
    let decoded = |text: &str, scene: Option<&str>| {
        let scene = scene.map(|s| s.as_bytes().to_vec());
        let overrides = Overrides { scene, ..Overrides::default() };
        decode_job(text.as_bytes(), "open/job.toml".as_ref(), &overrides)
    };
    let text = "scene = \"in/room.xml\"\n[[parameter]]\nname = \"p\"\n\
                effect = [{ target = \"cube\", translate = [1, 0, 0] }]";
    let j = decoded(text, Some(SCENE)).unwrap();
    assert_eq!((j.parameters.len(), j.name().as_str()), (1, "open"));
    assert_eq!(j.scene_path, PathBuf::from("open/in/room.xml"));
    let mesh = r#"<shape type="obj"><string name="filename" value="g.obj"/></shape></scene>"#;
    let broken = SCENE.replace("</scene>", mesh);
    for (text, scene, place, part) in [
        (text, None, "open/job.toml:1:9: ", "cannot read open/in/room.xml: "),
        ("scene = \"room.xml\"\nscenes = 1", Some(SCENE), "open/job.toml:2:1: ", "`scenes`"),
        (text, Some("<scene>"), "open/in/room.xml:1:1: ", "never closed"),
        (text, Some(&*broken), "open/in/room.xml:6: ", "no file `g.obj`; searched open/in, "),
    ] {
        let found = decoded(text, scene).unwrap_err().to_string();
        assert!(found.starts_with(place) && found.contains(part), "{found}");
    }
    let no_text = decode_job(&[255], "open/job.toml".as_ref(), &Overrides::default());
    assert_eq!(
        no_text.unwrap_err().to_string(),
        "open/job.toml: cannot read this file: it is not UTF-8 text"
    );

    let path = "open/room.xml".as_ref();
    let alone = Job::decode_scene(SCENE.as_bytes(), path, &Defaults::new()).unwrap();
    assert_eq!((alone.spp(), alone.text, alone.scene_path.as_path()), (64, None, path));
    let unknown = Defaults::from([("m".into(), "1".into())]);
    let error = Job::decode_scene(SCENE.as_bytes(), path, &unknown).unwrap_err();
    assert!(error.to_string().starts_with("open/room.xml: -D m: "), "{error}");
}

#[test]
fn a_scene_alone_brings_its_own_sample_count() {
    let folder = Folder::new();
    let file: PathBuf = folder.file("s.xml", SCENE);
    let mut j = Job::read_scene(&file, &Defaults::new()).unwrap();
    assert_eq!(j.spp(), 64);
    j.select_sensor("cam").unwrap();
    assert_eq!((j.settings.sensor, j.spp()), (1, 9));
    assert!(j.select_sensor("cube").is_err());
    assert_eq!(j.scene.sensors[1].item.sensor.film()[0], 8);
}

#[test]
fn edges_move_vertices_by_one_of_three_ways() {
    let text =
        |warp: &str| format!("scene = \"scene.xml\"\n[estimator]\nkind = \"warped\"\n{warp}");
    let settings = |warp: &str| job(&text(warp), &[]).unwrap().settings;
    let plain = settings("");
    assert_eq!((plain.estimator, plain.warp), (EstimatorKind::Warped, Warp::Edges));
    let eight = AuxiliarySamples::default();
    assert_eq!(settings("warp.by = \"points\"").warp, Warp::Points(eight));
    let asked =
        "warp = { by = \"directions\", samples = 3, kernel = \"year-2020\", debiased = true }";
    let samples = AuxiliarySamples { count: 3, kernel: WarpKernel::Year2020, debiased: true };
    assert_eq!(settings(asked).warp, Warp::Directions(samples));
    refused(&text("warp.by = \"nothing\""), &[], &["job.toml:4", "`nothing`"]);
    refused(&text("warp = { by = \"points\", samples = 0 }"), &[], &["`samples` is 0"]);
    refused(&text("warp = { by = \"edges\", samples = 3 }"), &[], &["no auxiliary samples"]);
}
