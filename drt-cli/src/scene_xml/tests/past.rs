//! Scenes of the past and of others: what they leave out, what they have too much of, and what is mended with a note.

use std::path::Path;

use drt_estimators::Scene;
use drt_estimators::emitter::Emitter;
use drt_estimators::surface::{Bsdf, Ward, WardVariant};
use drt_math::Rgb;

use super::{old_scene, read, read_version, refused, scene};
use crate::scene_xml::parse_scene;
use crate::testing::Folder;
use crate::{Defaults, read_scene};

/// A scene with the notes on it.
fn noted(version: &str, body: &str) -> (Scene, Vec<String>) {
    let text = format!("<scene version=\"{version}\">{body}</scene>");
    let (scene, notes, _) = parse_scene(Path::new("s.xml"), &text, &Defaults::new()).unwrap();
    (scene, notes.iter().map(ToString::to_string).collect())
}

const FOG: &str = r#"<medium type="homogeneous" id="fog"><rgb name="sigma_t" value="1"/>
    <rgb name="albedo" value="0"/></medium><shape type="cube"><ref name="interior" id="fog"/></shape>"#;

#[test]
fn old_shapes_around_a_medium_without_a_bsdf_are_nothing_but_its_boundary() {
    let old = old_scene(FOG);
    assert_eq!(old.bsdfs[old.shapes[0].bsdf].item, Bsdf::Null);
    let new = scene(FOG);
    assert!(matches!(new.bsdfs[new.shapes[0].bsdf].item, Bsdf::Diffuse(_)));
    let alone = old_scene("<shape type=\"cube\"/>");
    assert!(matches!(alone.bsdfs[alone.shapes[0].bsdf].item, Bsdf::Diffuse(_)));
}

#[test]
fn properties_of_old_files_that_change_nothing_get_one_note() {
    let shape = r#"<shape type="cube"><boolean name="collapse" value="true"/></shape>"#;
    let (_, notes) = noted("0.6.0", &format!("{shape}{shape}"));
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert!(notes[0].contains("collapse") && notes[0].contains("no effect"), "{notes:?}");
    refused(shape, &["collapse", "not supported"]);
    // What changes the image is refused, whatever the version.
    let milk = r#"<medium type="homogeneous" id="m"><string name="material" value="Regular Milk"/></medium>
        <shape type="cube"><ref name="interior" id="m"/></shape>"#;
    let message = read_version("0.5.0", milk).unwrap_err().to_string();
    assert!(message.contains("material") && message.contains("sigma_t"), "{message}");
    let smooth = r#"<shape type="cube"><float name="maxSmoothAngle" value="3"/></shape>"#;
    assert!(read_version("0.6.0", smooth).is_err());
}

#[test]
fn misspelt_properties_of_old_files_are_refused() {
    let bsdf =
        |inside| format!("<shape type=\"cube\"><bsdf type=\"diffuse\">{inside}</bsdf></shape>");
    for inside in [
        r#"<rgb name="reflectence" value="1 0 0"/>"#,
        r#"<spectrum name="reflectence" value="1"/>"#,
        r#"<float name="alhpa" value="1"/>"#,
        // What is harmless in one element or as a number need not be so in others.
        r#"<float name="stepSize" value="1"/>"#,
        r#"<rgb name="sampleVisible" value="1"/>"#,
    ] {
        let message = read_version("0.6.0", &bsdf(inside)).unwrap_err().to_string();
        assert!(message.contains("takes") && message.contains("reflectance"), "{message}");
    }
    let medium = r#"<medium type="homogeneous" id="m"><spectrum name="sigmaS" value="1"/><spectrum name="sigmaA" value="1"/>
        <float name="stepSize" value="1"/></medium><shape type="cube"><ref name="interior" id="m"/></shape>"#;
    assert_eq!(noted("0.6.0", medium).1.len(), 1);
}

#[test]
fn lights_films_and_integrators_of_old_files() {
    let body = r#"<integrator type="photonmapper"><integer name="maxDepth" value="3"/><integer name="globalPhotons" value="9"/></integrator>
        <sensor type="perspective"><film type="ldrfilm"><float name="gamma" value="2.2"/></film></sensor>
        <emitter type="constant"><blackbody name="radiance" temperature="5000K" scale="2"/>
            <float name="samplingWeight" value="2"/></emitter>"#;
    let (s, notes) = noted("0.6.0", body);
    assert_eq!(s.integrator.max_depth, Some(3));
    assert_eq!(notes.len(), 2, "{notes:?}");
    let light = |s: &Scene| match s.emitters[0].item.emitter {
        Emitter::Constant { radiance } => radiance,
        _ => panic!("another emitter"),
    };
    let same = scene(
        r#"<emitter type="constant"><spectrum name="radiance" type="blackbody"><float name="temperature" value="5000"/></spectrum></emitter>"#,
    );
    assert_eq!(light(&s), light(&same) * 2.0);
    let strict =
        r#"<integrator type="path"><boolean name="strictNormals" value="true"/></integrator>"#;
    assert_eq!(noted("0.6.0", strict).1.len(), 1);
    scene(
        r#"<emitter type="constant"><float name="sampling_weight" value="2"/></emitter>
        <integrator type="volpath"/>"#,
    );
    refused("<integrator type=\"ao\"/>", &["ao"]);
    refused("<emitter type=\"sky\"/>", &["sky", "envmap"]);
}

#[test]
fn materials_of_old_files() {
    let old = |text: &str| old_scene(text).bsdfs.remove(0).item;
    let varnish = r#"<bsdf type="coating"><float name="intIOR" value="1.7"/><float name="thickness" value="2"/>
        <rgb name="sigmaA" value="0.1,0.2,0.5"/><bsdf type="roughconductor"/></bsdf>"#;
    let Bsdf::Coated(c) = old(varnish) else { panic!("no coating") };
    assert_eq!(
        (c.bsdf.name(), c.thickness, c.sigma_a),
        ("roughconductor", 2.0, Rgb::new(0.1, 0.2, 0.5))
    );
    assert!(c.coating.facets().is_none() && (c.coating.eta() - 1.7 / 1.000_277).abs() < 1e-12);
    let plain = old(r#"<bsdf type="coating"><bsdf type="diffuse"/></bsdf>"#);
    assert!(
        matches!(plain, Bsdf::Coated(c) if (c.coating.eta() - 1.504_183_3).abs() < 1e-6 && c.sigma_a.is_zero())
    );
    let rough = old(
        r#"<bsdf type="roughcoating"><string name="distribution" value="ggx"/><float name="alpha" value="0.3"/>
        <rgb name="specularReflectance" value="0.5"/><bsdf type="coating"><bsdf type="plastic"/></bsdf></bsdf>"#,
    );
    let Bsdf::Coated(c) = rough else { panic!("no coating") };
    assert!(
        c.coating.facets().is_some_and(|(_, alpha)| alpha == 0.3) && c.bsdf.name() == "coating"
    );
    // A roughness that varies would be that of what is inside.
    let squares = r#"<texture name="alpha" type="checkerboard"/><bsdf type="roughconductor"/>"#;
    refused(&format!("<bsdf type=\"roughcoating\">{squares}</bsdf>"), &["`alpha` of a coating"]);
    refused("<bsdf type=\"coating\"/>", &["expected a bsdf inside"]);
    refused(
        "<bsdf type=\"coating\"><bsdf type=\"dielectric\"/></bsdf>",
        &["cannot hold a dielectric"],
    );
    let thin =
        r#"<bsdf type="coating"><float name="int_ior" value="1"/><bsdf type="diffuse"/></bsdf>"#;
    refused(thin, &["\"eta\" is 0.99"]);

    let Bsdf::RoughDiffuse(d) = old("<bsdf type=\"roughdiffuse\"/>") else { panic!("no grooves") };
    assert_eq!((d.reflectance, d.alpha, d.fast), (Rgb::splat(0.5), 0.2, false));
    let fast = old(
        r#"<bsdf type="roughdiffuse"><boolean name="useFastApprox" value="true"/><float name="alpha" value="0.4"/>
        <rgb name="diffuseReflectance" value="0.7"/></bsdf>"#,
    );
    assert!(
        matches!(fast, Bsdf::RoughDiffuse(d) if d.fast && d.alpha == 0.4 && d.reflectance.g == 0.7)
    );

    let Bsdf::Ward(w) = old("<bsdf type=\"ward\"/>") else { panic!("no Ward") };
    assert_eq!(w, Ward::default());
    let w = old(
        r#"<bsdf type="ward"><string name="variant" value="ward-duer"/><float name="alphaU" value="0.3"/></bsdf>"#,
    );
    assert!(matches!(w, Bsdf::Ward(w) if w.variant == WardVariant::Duer && w.alpha == [0.3, 0.1]));
    refused(
        "<bsdf type=\"ward\"><string name=\"variant\" value=\"phong\"/></bsdf>",
        &["ward-duer"],
    );
    for none in ["hk", "hair"] {
        refused(&format!("<bsdf type=\"{none}\"/>"), &[&format!("`{none}` is not supported")]);
    }
}

/// A sphere under a layer, as it stands in a file that was refused.
#[test]
fn a_coated_sphere_is_a_scene() {
    let s = old_scene(
        r#"<integrator type="path"><integer name="maxDepth" value="3"/></integrator><emitter type="constant"/>
        <shape type="sphere"><bsdf type="coating"><bsdf type="diffuse"/></bsdf></shape>"#,
    );
    assert_eq!(s.bsdfs[s.shapes[0].bsdf].item.name(), "coating");
    assert!(s.bsdfs[s.shapes[0].bsdf].item.is_smooth());
}

#[test]
fn textures_of_old_files_are_scaled_and_moved() {
    let body = r#"<bsdf type="diffuse"><texture type="scale" name="reflectance"><float name="scale" value="0.5"/>
        <texture type="checkerboard"><float name="uscale" value="3"/><float name="voffset" value="0.1"/></texture>
        </texture></bsdf>"#;
    let s = old_scene(body);
    let Bsdf::Textured(textured) = &s.bsdfs[0].item else { panic!("no texture") };
    let text = format!("{textured:?}");
    assert!(text.contains("3.0") && text.contains("0.1"), "{text}");
    let one = r#"<bsdf type="diffuse"><texture type="scale" name="reflectance"><rgb name="scale" value="0.5 1 1"/>
        <spectrum value="0.4"/></texture></bsdf>"#;
    match &old_scene(one).bsdfs[0].item {
        Bsdf::Diffuse(d) => assert_eq!(d.reflectance, Rgb::new(0.2, 0.4, 0.4)),
        other => panic!("{other:?}"),
    }
    assert!(read(body).is_err());
}

#[test]
fn what_is_not_used_is_not_built() {
    let unused = r#"<bsdf type="diffuse" id="nobody"><texture type="volume" name="reflectance"/></bsdf>
        <medium type="strange" id="m"/><texture type="strange" id="t"/><shape type="cube" id="c"/>"#;
    let (s, notes) = noted("3.0.0", unused);
    assert_eq!(notes.len(), 3, "{notes:?}");
    assert!(notes.iter().all(|n| n.contains("is not used")), "{notes:?}");
    assert_eq!(s.shapes.len(), 1);
    refused(&unused.replace("id=\"c\"/>", "id=\"c\"><ref id=\"nobody\"/></shape>"), &["volume"]);
    refused(
        &unused.replace("id=\"c\"/>", "id=\"c\"><ref name=\"interior\" id=\"m\"/></shape>"),
        &["strange"],
    );
}

#[test]
fn what_is_inside_another_can_be_referred_to() {
    let s = scene(
        r#"<bsdf type="twosided" id="both"><bsdf type="diffuse" id="red"><rgb name="reflectance" value="0.7,0.1,0.1"/></bsdf></bsdf>
        <shape type="sphere"><ref id="red"/></shape><shape type="rectangle"><ref id="both"/></shape>
        <shape type="disk"><ref id="red"/></shape><shape type="cube"/>"#,
    );
    let of = |i: usize| &s.bsdfs[s.shapes[i].bsdf].item;
    assert!(matches!(of(0), Bsdf::Diffuse(d) if d.reflectance.r == 0.7));
    assert!(matches!(of(1), Bsdf::TwoSided(_)));
    assert_eq!(s.shapes[0].bsdf, s.shapes[2].bsdf);
    assert!(matches!(of(3), Bsdf::Diffuse(d) if d.reflectance.r == 0.5));
    // A job can change what is in `both` by its name alone.
    assert!(s.find("red").is_err() && s.find("both").is_ok());
}

#[test]
fn names_are_ids_of_what_has_none() {
    let s = scene(
        "<bsdf type=\"null\" name=\"Glass A\"/><shape type=\"cube\"><ref id=\"Glass A\"/></shape>",
    );
    assert_eq!(s.bsdfs[0].id.as_deref(), Some("Glass A"));
    let s = scene("<shape type=\"cube\" name=\"a\" id=\"b\"/>");
    assert_eq!(s.shapes[0].id.as_deref(), Some("b"));
}

#[test]
fn shapes_without_area_are_left_out() {
    let folder = Folder::new();
    folder.file("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    let flat = r#"<shape type="obj"><string name="filename" value="flat.obj"/></shape>"#;
    let body =
        |inner: &str| format!("<scene version=\"3.0.0\">{inner}<shape type=\"cube\"/></scene>");
    let file = folder.file("s.xml", body(flat));
    assert_eq!(read_scene(&file, &Defaults::new()).unwrap().shapes.len(), 1);
    let text = body(flat);
    let (_, notes, _) = parse_scene(&file, &text, &Defaults::new()).unwrap();
    assert!(notes.len() == 1 && notes[0].message.contains("flat.obj"), "{notes:?}");
    let lamp = flat.replace("</shape>", "<emitter type=\"area\"/></shape>");
    let message = parse_scene(&file, &body(&lamp), &Defaults::new()).unwrap_err().to_string();
    assert!(message.contains("light"), "{message}");
}

#[test]
fn polygons_whose_edges_cross_are_fans() {
    let folder = Folder::new();
    folder.file("bow.obj", "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1.2 0\nv -1 0.5 0\nf 1 2 3 4 5\n");
    let text = r#"<scene version="3.0.0"><shape type="obj"><string name="filename" value="bow.obj"/></shape></scene>"#;
    let (s, notes, _) = parse_scene(&folder.path().join("s.xml"), text, &Defaults::new()).unwrap();
    assert!(notes.len() == 1 && notes[0].message.contains("bow.obj"), "{notes:?}");
    assert_eq!(s.shapes[0].mesh.triangles.len(), 3);
}

#[test]
fn metals_with_negative_numbers_are_clamped() {
    let body = r#"<bsdf type="roughconductor"><rgb name="eta" value="0.7,0.3,-0.05"/><rgb name="k" value="9,6,4"/></bsdf>"#;
    let (s, notes) = noted("3.0.0", body);
    assert!(notes.len() == 1 && notes[0].contains("eta"), "{notes:?}");
    match &s.bsdfs[0].item {
        Bsdf::RoughConductor(c) => assert_eq!(c.eta, Rgb::new(0.7, 0.3, 0.0)),
        other => panic!("{other:?}"),
    }
}

#[test]
fn many_shapes_of_one_resolution_share_a_mesh() {
    let ball = |i: usize| {
        format!(
            r#"<shape type="sphere" id="s{i}"><point name="center" x="{i}" y="0" z="0"/><float name="radius" value="0.25"/>
            <transform name="to_world"><scale value="2"/></transform></shape>"#
        )
    };
    let all: String = (0..12).map(ball).collect();
    let s =
        scene(&format!("{all}<shape type=\"sphere\" id=\"lamp\"><emitter type=\"area\"/></shape>"));
    assert_eq!((s.shapes.len(), s.instances.len()), (13, 12));
    assert!(s.shapes[..12].iter().all(|b| std::sync::Arc::ptr_eq(&b.mesh, &s.shapes[0].mesh)));
    // As those of few, which have meshes of their own.
    let few: String = (0..3).map(ball).collect();
    let (few, shared) = (scene(&few), s.expanded().unwrap());
    assert!(few.instances.is_empty());
    for i in 0..3 {
        let pairs = few.shapes[i].mesh.positions.iter().zip(&shared.shapes[i].mesh.positions);
        assert!(pairs.clone().count() > 1000);
        assert!(pairs.clone().all(|(a, b)| (*a - *b).max_abs() < 1e-12), "{i}");
    }
}

#[test]
fn grids_a_little_below_zero_are_clamped() {
    let folder = Folder::new();
    let file = |least: f64| {
        let grid = drt_medium::Grid::new([2, 1, 1], 1, vec![least, 1.0]).unwrap();
        let bounds = [drt_math::Vec3::ZERO, drt_math::Vec3::splat(1.0)];
        let path = folder.path().join("g.vol");
        drt_medium::vol::write(&path, &drt_medium::vol::VolFile { grid, bounds }).unwrap();
        let text = r#"<scene version="3.0.0"><medium type="heterogeneous" id="m"><volume name="sigma_t" type="gridvolume">
            <string name="filename" value="g.vol"/></volume></medium><shape type="cube"><bsdf type="null"/>
            <ref name="interior" id="m"/></shape></scene>"#;
        parse_scene(&folder.path().join("s.xml"), text, &Defaults::new())
    };
    let (_, notes, _) = file(-0.004).unwrap();
    assert!(notes.len() == 1 && notes[0].message.contains("below zero"), "{notes:?}");
    assert!(file(0.0).unwrap().1.is_empty());
    assert!(file(-0.5).unwrap_err().to_string().contains("negative"));
}

/// Tests run in the folder of the crate.
#[test]
fn files_are_searched_in_the_working_directory_last() {
    let folder = Folder::new();
    let body = r#"<scene version="3.0.0"><shape type="obj"><string name="filename" value="Cargo.toml"/></shape></scene>"#;
    let file = folder.file("s.xml", body);
    let message = read_scene(&file, &Defaults::new()).unwrap_err().to_string();
    assert!(!message.contains("no file"), "{message}");
    folder.file("Cargo.toml", crate::testing::TETRAHEDRON);
    assert_eq!(read_scene(&file, &Defaults::new()).unwrap().shapes[0].mesh.triangles.len(), 4);
}

#[cfg(unix)]
#[test]
fn devices_are_no_files_to_read() {
    for body in [
        "<shape type=\"obj\"><string name=\"filename\" value=\"/dev/zero\"/></shape>",
        "<bsdf type=\"diffuse\" id=\"b\"><texture type=\"bitmap\" name=\"reflectance\"><string name=\"filename\" value=\"/dev/zero\"/></texture></bsdf><shape type=\"cube\"><ref id=\"b\"/></shape>",
        "<include filename=\"/dev/zero\"/>",
        "<emitter type=\"constant\"><spectrum name=\"radiance\" filename=\"/dev/zero\"/></emitter>",
    ] {
        refused(body, &["/dev/zero", "regular file"]);
    }
    let message = read_scene(Path::new("/dev/zero"), &Defaults::new()).unwrap_err().to_string();
    assert!(message.contains("regular file"), "{message}");
}

/// Chains of references, shared or deep, end at a limit and not where memory or the stack does.
#[test]
fn chains_of_references_end() {
    let links = 3000;
    let phases = |first: String, link: &dyn Fn(usize) -> String| {
        let chain: String = (1..links).map(link).collect();
        format!(
            "{first}{chain}<medium type=\"homogeneous\" id=\"m\"><ref id=\"p{}\"/></medium><shape type=\"cube\"><ref name=\"interior\" id=\"m\"/></shape>",
            links - 1
        )
    };
    let blend = |i: usize, second: &str| {
        format!(
            "<phase type=\"blendphase\" id=\"p{i}\"><float name=\"weight\" value=\"0.5\"/><ref id=\"p{}\"/>{second}</phase>",
            i - 1
        )
    };
    let leaf = "<phase type=\"isotropic\" id=\"p0\"/>".to_owned();
    refused(
        &phases(leaf.clone(), &|i| blend(i, &format!("<ref id=\"p{}\"/>", i - 1))),
        &["64 phase functions"],
    );
    refused(&phases(leaf, &|i| blend(i, "<phase type=\"hg\"/>")), &["64 phase functions"]);
    let textures: String = (1..links)
        .map(|i| format!("<texture type=\"checkerboard\" id=\"t{i}\"><ref name=\"color0\" id=\"t{}\"/></texture>", i - 1))
        .collect();
    refused(&format!("<rgb id=\"t0\" value=\"1\"/>{textures}"), &["nest deeper than 64"]);
}

/// Reading takes time in proportion to the file, whether its elements stand on many lines or on one.
#[test]
fn many_elements_are_read_in_time() {
    for end in ["\n", " "] {
        let one = format!(
            "<shape type=\"cube\"><transform name=\"to_world\"><translate x=\"1\"/></transform></shape>{end}"
        );
        let start = std::time::Instant::now();
        assert_eq!(scene(&one.repeat(20_000)).shapes.len(), 20_000);
        let seconds = start.elapsed().as_secs_f64();
        assert!(seconds < 20.0, "{seconds}");
    }
}

/// What a header claims is held against the length of its file before memory is asked for.
#[test]
fn claims_that_no_file_can_hold_are_refused() {
    use std::io::Write as _;

    let folder = Folder::new();
    let mut deflated = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    for part in [&0_u32.to_le_bytes()[..], &[0], &(1_u64 << 26).to_le_bytes(), &8_u64.to_le_bytes()]
    {
        deflated.write_all(part).unwrap();
    }
    let mut bytes = [0x041C_u16, 4].map(u16::to_le_bytes).concat();
    bytes.extend(deflated.finish().unwrap());
    bytes.extend(0_u64.to_le_bytes());
    bytes.extend(1_u32.to_le_bytes());
    std::fs::write(folder.path().join("b.serialized"), bytes).unwrap();
    let text = r#"<scene version="3.0.0"><shape type="serialized"><string name="filename" value="b.serialized"/></shape></scene>"#;
    let read = parse_scene(&folder.path().join("s.xml"), text, &Defaults::new());
    let message = read.unwrap_err().to_string();
    assert!(message.contains("b.serialized") && message.contains("cannot hold"), "{message}");
}
