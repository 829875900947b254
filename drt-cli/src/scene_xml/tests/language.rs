//! Files, substitution, references and order.

use drt_estimators::Target;
use drt_estimators::surface::Bsdf;
use drt_math::Rgb;

use super::{read, refused, scene};
use crate::testing::Folder;
use crate::{Defaults, read_scene};

fn reflectance(b: &Bsdf) -> Rgb {
    match b {
        Bsdf::Diffuse(d) => d.reflectance,
        _ => panic!("not diffuse"),
    }
}

#[test]
fn defaults_fill_in_and_the_command_line_wins() {
    let folder = Folder::new();
    let file = folder.file(
        "s.xml",
        r#"<scene version="3.0.0"><default name="rho" value="0.25"/><default name="r" value="x"/>
           <bsdf type="$kind"><rgb name="reflectance" value="$rho 0 1"/></bsdf></scene>"#,
    );
    let with = |pairs: &[(&str, &str)]| {
        let defaults: Defaults = pairs.iter().map(|(k, v)| ((*k).into(), (*v).into())).collect();
        read_scene(&file, &defaults)
    };
    let s = with(&[("kind", "diffuse")]).unwrap();
    assert_eq!(reflectance(&s.bsdfs[0].item), Rgb::new(0.25, 0.0, 1.0));
    let s = with(&[("kind", "diffuse"), ("rho", "0.75")]).unwrap();
    assert_eq!(reflectance(&s.bsdfs[0].item).r, 0.75);
    let missing = with(&[]).unwrap_err().to_string();
    assert!(missing.contains("s.xml:2") && missing.contains("-D kind=VALUE"), "{missing}");
    let unused = with(&[("kind", "diffuse"), ("speed", "1")]).unwrap_err().to_string();
    assert!(unused.contains("-D speed"), "{unused}");
}

#[test]
fn included_files_have_their_own_folder_dialect_and_lines() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path().join("parts")).unwrap();
    folder.file("parts/mesh.obj", crate::testing::TETRAHEDRON);
    folder.file(
        "parts/a.xml",
        "<scene version=\"0.6.0\">\n<shape type=\"obj\"><string name=\"filename\" \
         value=\"mesh.obj\"/>\n<boolean name=\"faceNormals\" value=\"true\"/></shape></scene>",
    );
    let file = folder.file(
        "s.xml",
        "<scene version=\"3.0.0\"><include filename=\"parts/a.xml\"/><shape type=\"cube\"/></scene>",
    );
    let s = read_scene(&file, &Defaults::new()).unwrap();
    assert_eq!(s.shapes[0].mesh.triangles.len(), 4);
    assert_eq!(s.shapes[1].mesh.triangles.len(), 12);

    folder.file("parts/a.xml", "<scene version=\"3.0.0\">\n\n<shape type=\"pyramid\"/></scene>");
    let message = read_scene(&file, &Defaults::new()).unwrap_err().to_string();
    assert!(message.contains("a.xml:3: <shape type=\"pyramid\">"), "{message}");

    folder.file("parts/a.xml", "<scene version=\"3.0.0\"><include filename=\"../s.xml\"/></scene>");
    let message = read_scene(&file, &Defaults::new()).unwrap_err().to_string();
    assert!(message.contains("includes itself"), "{message}");
    refused("<include filename=\"nowhere.xml\"/>", &[":2:", "nowhere.xml"]);
}

/// Files are searched in the folder of their own scene file, in those of the files that include it,
/// and in folders that a `<path>` named, the latest first.
#[test]
fn files_are_searched_as_mitsuba_does() {
    let folder = Folder::new();
    for name in ["parts", "parts/deep", "common", "other"] {
        std::fs::create_dir(folder.path().join(name)).unwrap();
    }
    let mesh = |name: &str| {
        format!("<shape type=\"obj\"><string name=\"filename\" value=\"{name}\"/></shape>")
    };
    let part = |body: &str| format!("<scene version=\"3.0.0\">{body}</scene>");
    folder.file("parts/own.obj", crate::testing::TETRAHEDRON);
    folder.file("main.obj", crate::testing::TETRAHEDRON);
    folder.file("common/far.obj", crate::testing::TETRAHEDRON);
    folder.file("common/both.obj", "not read");
    folder.file("other/both.obj", crate::testing::TETRAHEDRON);
    let include = "<include filename=\"parts/deep/b.xml\"/>";
    let paths = "<path value=\"../common\"/><path value=\"other\"/>";
    let a = [paths, &mesh("own.obj"), include].concat();
    folder.file("parts/a.xml", part(&a));
    folder.file(
        "parts/deep/b.xml",
        part(&[mesh("main.obj"), mesh("far.obj"), mesh("both.obj")].concat()),
    );
    let file = folder.file("s.xml", part("<include filename=\"parts/a.xml\"/>"));
    assert_eq!(read_scene(&file, &Defaults::new()).unwrap().shapes.len(), 4);

    let file = folder.file("s.xml", part(&["<path value=\"common\"/>", &mesh("no.obj")].concat()));
    let message = read_scene(&file, &Defaults::new()).unwrap_err().to_string();
    assert!(message.contains("no file `no.obj`; searched"), "{message}");
    assert!(message.contains("s.xml:1") && message.contains("common"), "{message}");
    refused("<path value=\"nowhere\"/>", &[":2", "no file `nowhere`"]);
    let file = folder.file("s.xml", part("<path value=\"main.obj\"/>"));
    let message = read_scene(&file, &Defaults::new()).unwrap_err().to_string();
    assert!(message.contains("is not a folder"), "{message}");
}

#[test]
fn everything_can_be_referred_to() {
    let s = scene(
        r#"<spectrum id="grey" value="0.25"/>
           <texture type="srgb" id="red"><rgb name="color" value="0.5 0 0"/></texture>
           <alias id="red" as="crimson"/>
           <bsdf type="diffuse" id="a"><ref name="reflectance" id="grey"/></bsdf>
           <bsdf type="diffuse" id="b"><ref name="reflectance" id="crimson"/></bsdf>
           <phase type="hg" id="forward"><float name="g" value="0.5"/></phase>
           <volume type="constvolume" id="fog"><rgb name="value" value="0.5"/></volume>
           <medium type="homogeneous" id="m"><ref id="forward"/><ref name="sigma_t" id="fog"/></medium>
           <emitter type="area" id="lamp"><ref name="radiance" id="red"/></emitter>
           <film type="hdrfilm" id="film"><integer name="width" value="5"/><ref id="filter"/></film>
           <rfilter type="box" id="filter"/>
           <sensor type="perspective"><ref id="film"/></sensor>
           <shape type="cube"><ref id="a"/><ref id="lamp"/><ref name="interior" id="m"/></shape>
           <shape type="cube"><ref id="b"/></shape>"#,
    );
    assert_eq!(reflectance(&s.bsdfs[0].item), Rgb::splat(0.25));
    assert_eq!(reflectance(&s.bsdfs[1].item), Rgb::new(0.5, 0.0, 0.0));
    assert_eq!(s.shapes[0].emitter, Some(0));
    assert_eq!(s.shapes[0].boundary.unwrap().interior, Some(0));
    assert!(matches!(s.media[0].item.phase, drt_medium::Phase::HenyeyGreenstein { .. }));
    refused(
        "<emitter type=\"area\" id=\"lamp\"/><shape type=\"cube\"><ref id=\"lamp\"/></shape>\n\
         <shape type=\"cube\"><ref id=\"lamp\"/></shape>",
        &[":3", "only be on one shape"],
    );
    refused("<emitter type=\"area\" id=\"lamp\"/>", &["belongs inside a <shape>"]);
}

#[test]
fn circles_of_references_are_refused() {
    refused(
        r#"<texture type="srgb" id="a"><ref name="color" id="b"/></texture>
           <texture type="srgb" id="b"><ref name="color" id="a"/></texture>"#,
        &["refers to itself"],
    );
    refused(
        r#"<bsdf type="twosided" id="a"><ref id="b"/></bsdf>
           <bsdf type="twosided" id="b"><ref id="a"/></bsdf>"#,
        &["which it is part of"],
    );
    // Each doubles the one before.
    let mut body = String::from(
        "<texture type=\"srgb\" id=\"t0\"><rgb name=\"color\" value=\"1\"/></texture>",
    );
    for i in 1..40 {
        let last = format!("<ref name=\"color\" id=\"t{}\"/>", i - 1);
        body += &format!("<texture type=\"srgb\" id=\"t{i}\">{last}{last}</texture>");
    }
    refused(&body, &["elements"]);
}

#[test]
fn integrators_around_others_and_of_direct_light() {
    let depth = |body: &str| scene(body).integrator.max_depth;
    let path = r#"<integrator type="path"><integer name="max_depth" value="3"/></integrator>"#;
    assert_eq!(depth(path), Some(3));
    assert_eq!(depth(&format!("<integrator type=\"moment\">{path}</integrator>")), Some(3));
    assert_eq!(depth("<integrator type=\"direct\"/>"), Some(2));
    refused("<integrator type=\"depth\"/>", &["`depth` is not supported", "volpath"]);
    // One that nobody knows is taken for one of paths, with a note.
    assert_eq!(depth(&path.replace("\"path\"", "\"my_path\"")), Some(3));
    refused("<integrator type=\"moment\"/>", &["one integrator inside, found 0"]);
    refused("<integrator type=\"path\"><float name=\"foo\" value=\"1\"/></integrator>", &["foo"]);
}

#[test]
fn references_aliases_and_order() {
    let s = scene(
        r#"<shape type="cube" id="late"><ref id="other"/></shape>
           <bsdf type="diffuse" id="gray"/>
           <alias id="gray" as="other"/>
           <shape type="cube"><bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>
           <shape type="cube"><bsdf type="null" id="null"/></shape>
           <shape type="cube"/>"#,
    );
    assert_eq!(s.shapes.iter().map(|s| s.bsdf).collect::<Vec<_>>(), [0, 1, 2, 3]);
    assert_eq!(s.bsdfs.len(), 4);
    assert_eq!(s.find("late").unwrap(), Target::Shape(0));
    assert_eq!(s.find("bsdf[2]").unwrap(), s.find("null").unwrap());
    assert_eq!(reflectance(&s.bsdfs[3].item), Rgb::splat(0.5));
}

#[test]
fn mistakes_are_told_with_their_line() {
    refused("\n<shape type=\"cube\"><ref id=\"b\"/></shape>", &["scene.xml:3", "the id `b`"]);
    refused("<bsdf type=\"null\" id=\"a\"/>\n<bsdf type=\"null\" id=\"a\"/>", &[":3", "line 2"]);
    refused("<shape type=\"cube\">\n<float name=\"size\" value=\"1\"/></shape>", &[":3", "size"]);
    refused("<shape type=\"cube\"><rotor/></shape>", &["<rotor>: not supported inside"]);
    refused("<film type=\"hdrfilm\"/>", &["<film type=\"hdrfilm\">: not supported directly"]);
    refused("<shape type=\"cube\" color=\"red\"/>", &["unknown attribute `color`"]);
    refused("<shape/>", &["the attribute `type` is missing"]);
    refused("<shape type=\"cube\">cube</shape>", &["text inside an element"]);
    refused("<shape type=\"cube\">", &["not well-formed XML"]);
    refused("<alias id=\"a\" as=\"b\"/><alias id=\"b\" as=\"a\"/>", &["nothing has the id"]);
    refused("<default name=\"\" value=\"\"/>", &["the name is empty"]);
    let twice = "<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"1\"/>\n\
                 <rgb name=\"reflectance\" value=\"1\"/></bsdf>";
    refused(twice, &[":3", "given twice"]);
    let deep = format!("{}{}", "<bsdf type=\"twosided\">".repeat(70), "</bsdf>".repeat(70));
    refused(&deep, &["nest deeper"]);
    for (text, part) in [
        ("<scene/>", "`version` is missing"),
        ("<scene version=\"1.0\"/>", "version `1.0`"),
        ("<mesh/>", "found <mesh>"),
        ("", "not well-formed"),
    ] {
        let message = super::decode(text).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn names_of_the_other_dialect_are_unknown() {
    assert!(
        read(r#"<integrator type="path"><integer name="maxDepth" value="3"/></integrator>"#)
            .is_err()
    );
    let old = super::old_scene(
        r#"<integrator type="path"><integer name="maxDepth" value="3"/></integrator>"#,
    );
    assert_eq!(old.integrator.max_depth, Some(3));
}

/// Whatever is done to a scene's text, it is read or refused.
#[test]
fn damaged_text_never_panics() {
    let text = r##"<scene version="0.6.0"><default name="a" value="1, 2, 3"/>
        <integrator type="volpath"><integer name="maxDepth" value="-1"/></integrator>
        <medium type="heterogeneous" id="m"><volume name="density" type="constvolume">
        <spectrum name="value" value="$a"/><transform name="toWorld"><scale x="2"/></transform>
        </volume><float name="albedo" value="0.5"/><phase type="hg"/></medium>
        <shape type="sphere" id="s"><integer name="resolution" value="3"/><ref name="interior" id="m"/>
        <bsdf type="twosided"><bsdf type="phong"><rgb name="reflectance" value="#a0b0c0"/></bsdf>
        </bsdf><transform name="toWorld"><rotate x="1" y="0" z="1" angle="4"/><matrix value="1 0 0
        0 1 0 0 0 1"/><lookAt origin="1 2 3" target="0 0 0"/></transform></shape><alias id="s" as="t"/>
        <emitter type="spot"><float name="cutoffAngle" value="30"/></emitter>
        <sensor type="perspective"><float name="fov" value="30"/><film type="hdrfilm">
        <integer name="width" value="3"/><rfilter type="tent"/></film></sensor></scene>"##;
    super::decode(text).unwrap();
    let mut rng = drt_math::Rng::new(7, 0, 0);
    let mut below = |n: usize| (rng.next_f64() * n as f64) as usize;
    let words = ["", "-1", "1e308", "nan", "\"", ">", "<", "/", "$", "&#0;", "0 0 0", "é", "ref"];
    let mut read = 0;
    for _ in 0..3000 {
        let mut bytes = text.as_bytes().to_vec();
        for _ in 0..1 + below(3) {
            let at = below(bytes.len());
            let end = (at + below(6)).min(bytes.len());
            bytes.splice(at..end, words[below(words.len())].bytes());
        }
        let path = std::path::Path::new("scene.xml");
        read += usize::from(crate::decode_scene(&bytes, path, &Defaults::new()).is_ok());
    }
    assert!(read > 0, "some damage is harmless");
}
