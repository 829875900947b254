use drt_estimators::{MediumBoundary, Scene, Shape};
use drt_math::{Vec3, vec3};

use super::{refused, scene};
use crate::testing::{Folder, TETRAHEDRON};
use crate::{Defaults, read_scene};

fn shape(body: &str) -> Shape {
    scene(body).shapes.remove(0)
}

fn from_folder(folder: &Folder, body: &str) -> Scene {
    let file = folder.file("s.xml", format!("<scene version=\"3.0.0\">{body}</scene>"));
    read_scene(&file, &Defaults::new()).unwrap()
}

#[test]
fn primitives_stand_where_mitsuba_has_them() {
    let cube = shape(r#"<shape type="cube"/>"#);
    assert!((cube.mesh.volume() - 8.0).abs() < 1e-12);
    let rectangle = shape(r#"<shape type="rectangle"/>"#);
    assert!((rectangle.mesh.surface_area() - 4.0).abs() < 1e-12);
    assert_eq!(rectangle.mesh.normal(0), Vec3::Z);
    let disk = shape(r#"<shape type="disk"><integer name="resolution" value="6"/></shape>"#);
    assert!((disk.mesh.surface_area() - 1.5 * 3f64.sqrt()).abs() < 1e-12);
    let sphere = shape(
        r#"<shape type="sphere"><float name="radius" value="2"/><point name="center" value="1 2 3"/>
           </shape>"#,
    );
    let exact = 32.0 / 3.0 * std::f64::consts::PI;
    // Images tell half as many bands from a sphere: its silhouette lacks 4e-4 there.
    let lacks = |mesh: &drt_geom::Mesh| 1.0 - mesh.volume() / exact;
    assert!((0.0..5e-4).contains(&lacks(&sphere.mesh)));
    let coarse = r#"<shape type="sphere"><integer name="resolution" value="64"/>
        <float name="radius" value="2"/></shape>"#;
    assert!(lacks(&shape(coarse).mesh) > 1e-3);
    let normals = sphere.mesh.normals.as_ref().unwrap();
    let outward = sphere.mesh.positions[7] - vec3(1.0, 2.0, 3.0);
    assert!((normals[7] - outward.normalize()).max_abs() < 1e-12);
    refused(r#"<shape type="sphere"><float name="radius" value="0"/></shape>"#, &["`radius` is 0"]);
}

#[test]
fn cylinders_stand_between_their_ends() {
    let cylinder = shape(
        r#"<shape type="cylinder"><float name="radius" value="2"/><point name="p0" value="1 0 0"/>
           <point name="p1" value="1 0 3"/></shape>"#,
    );
    let exact = 12.0 * std::f64::consts::PI;
    assert!((cylinder.mesh.surface_area() / exact - 1.0).abs() < 1e-4);
    let normals = cylinder.mesh.normals.as_ref().unwrap();
    for (p, n) in cylinder.mesh.positions.iter().zip(normals) {
        let out = (*p - vec3(1.0, 0.0, 0.0)).reject(Vec3::Z);
        assert!((*n - out / 2.0).max_abs() < 1e-12 && (p.z == 0.0 || (p.z - 3.0).abs() < 1e-12));
    }
    let flat = cylinder.mesh.normal(0);
    assert!(flat.dot(normals[0]) > 0.9, "faces outward");
    let inward =
        shape(r#"<shape type="cylinder"><boolean name="flip_normals" value="true"/></shape>"#);
    assert!(inward.mesh.normals.as_ref().unwrap()[0].x < 0.0);
    let same = r#"<shape type="cylinder"><point name="p1" value="0 0 0"/></shape>"#;
    refused(same, &["same point"]);
    refused(r#"<shape type="sdfgrid"/>"#, &["`sdfgrid` is not supported", "cylinder"]);
    refused(r#"<shape type="linearcurve"/>"#, &["curves are no triangles"]);
}

/// A file of one or two meshes: the unit right triangle at the heights given.
fn serialized(version: u16, flags: u32, heights: &[f32]) -> Vec<u8> {
    use std::io::Write;
    let (mut file, mut offsets) = (Vec::new(), Vec::new());
    for z in heights {
        offsets.push(file.len() as u64);
        file.extend([0x041C_u16, version].iter().flat_map(|v| v.to_le_bytes()));
        let mut out = flate2::write::ZlibEncoder::new(&mut file, flate2::Compression::fast());
        out.write_all(&flags.to_le_bytes()).unwrap();
        if version == 4 {
            out.write_all(b"name\0").unwrap();
        }
        for count in [3_u64, 1] {
            out.write_all(&count.to_le_bytes()).unwrap();
        }
        let mut floats = |values: &[f32]| {
            for v in values {
                if flags & 0x2000 == 0 {
                    out.write_all(&v.to_le_bytes()).unwrap();
                } else {
                    out.write_all(&f64::from(*v).to_le_bytes()).unwrap();
                }
            }
        };
        floats(&[0.0, 0.0, *z, 1.0, 0.0, *z, 0.0, 1.0, *z]);
        if flags & 1 != 0 {
            floats(&[0.0, 1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0]);
        }
        if flags & 2 != 0 {
            floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        }
        for i in [0_u32, 1, 2] {
            out.write_all(&i.to_le_bytes()).unwrap();
        }
        out.finish().unwrap();
    }
    for offset in &offsets {
        let bytes = offset.to_le_bytes();
        file.extend(&bytes[..if version == 3 { 4 } else { 8 }]);
    }
    file.extend((heights.len() as u32).to_le_bytes());
    file
}

#[test]
fn serialized_files() {
    let folder = Folder::new();
    let read = |bytes: &[u8], inside: &str| {
        folder.file("m.serialized", bytes);
        let body = format!(
            "<scene version=\"3.0.0\"><shape type=\"serialized\"><string name=\"filename\" \
             value=\"m.serialized\"/>{inside}</shape></scene>"
        );
        read_scene(&folder.file("s.xml", body), &Defaults::new())
    };
    let second = r#"<integer name="shape_index" value="1"/>"#;
    for (version, flags) in [(3, 0x1003), (4, 0x1003), (4, 0x2003), (4, 0x1000)] {
        let file = serialized(version, flags, &[1.0, 2.0]);
        let mesh = read(&file, second).unwrap().shapes.remove(0).mesh;
        assert_eq!(mesh.positions[1], vec3(1.0, 0.0, 2.0));
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        let y = if flags & 1 != 0 { 0.5_f64.sqrt() } else { 0.0 };
        assert!((mesh.normals.as_ref().unwrap()[0].y - y).abs() < 1e-12);
    }
    let flat =
        read(&serialized(4, 0x1013, &[1.0]), r#"<boolean name="face_normals" value="true"/>"#);
    assert!(flat.unwrap().shapes[0].mesh.normals.is_none());

    let refused = |bytes: &[u8], inside: &str, part: &str| {
        let message = read(bytes, inside).unwrap_err().to_string();
        assert!(message.contains(part), "expected `{part}` in: {message}");
    };
    let good = serialized(4, 0x1003, &[1.0]);
    refused(&good, second, "`shape_index` is 1, but the file has 1 meshes");
    refused(b"v 0 0 0\n", "", "not a .serialized file");
    refused(&[0x1c, 4, 9, 0, 0, 0, 0, 0], "", "version 9");
    refused(&good[..3], "", "cut short");
    // Whatever is broken, it is read or refused.
    for i in 0..good.len() {
        let mut bytes = good.clone();
        bytes[i] ^= 0x55;
        drop(read(&bytes, ""));
        drop(read(&good[..i], ""));
    }
}

#[test]
fn transform_steps_apply_in_file_order() {
    let first = |steps: &str| {
        let body = format!(
            "<shape type=\"rectangle\"><transform name=\"to_world\">{steps}</transform></shape>"
        );
        // The corner that was at (-1, -1, 0).
        shape(&body).mesh.positions[0]
    };
    let close = |a: Vec3, b: Vec3| assert!((a - b).max_abs() < 1e-12, "{a:?} {b:?}");
    close(first(r#"<translate x="3"/><scale x="2"/>"#), vec3(4.0, -1.0, 0.0));
    close(first(r#"<scale value="2"/><translate value="0, 0, 1"/>"#), vec3(-2.0, -2.0, 1.0));
    close(first(r#"<rotate z="2" angle="90"/>"#), vec3(1.0, -1.0, 0.0));
    close(first(r#"<matrix value="1 0 0 5  0 1 0 6  0 0 1 7  0 0 0 1"/>"#), vec3(4.0, 5.0, 7.0));
    close(first(r#"<matrix value="0 1 0  1 0 0  0 0 1"/>"#), vec3(-1.0, -1.0, 0.0));
    // The camera's left is the first axis.
    let lookat = r#"<lookat origin="0 0 5" target="0 0 0" up="0 1 0"/>"#;
    close(first(lookat), vec3(1.0, -1.0, 5.0));
    close(first(&lookat.replace("lookat", "lookAt")), vec3(1.0, -1.0, 5.0));
    for (step, part) in [
        ("<rotate angle=\"3\"/>", "zero vector"),
        ("<rotate x=\"1\"/>", "`angle` is missing"),
        ("<scale w=\"1\"/>", "unknown attribute `w`"),
        ("<translate x=\"one\"/>", "expected a finite number"),
        ("<matrix value=\"1 2 3\"/>", "9 or 16 numbers, found 3"),
        ("<matrix value=\"1 0 0 0 0 1 0 0 0 0 1 0 1 0 0 1\"/>", "last row"),
        ("<shear x=\"1\"/>", "<shear>: expected translate"),
        ("<lookat origin=\"0 0 0\" target=\"0 0 0\"/>", "same point"),
    ] {
        let body = format!(
            "<shape type=\"cube\">\n<transform name=\"to_world\">{step}</transform></shape>"
        );
        refused(&body, &[":3", part]);
    }
}

#[test]
fn mesh_files_get_mitsubas_normals() {
    let folder = Folder::new();
    folder.file("plain.obj", TETRAHEDRON);
    folder.file("own.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 1 1\nf 1//1 2//1 3//1\n");
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
               property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
               end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    folder.file("t.ply", ply);
    let mesh = |kind: &str, file: &str, more: &str| {
        let body = format!(
            "<shape type=\"{kind}\"><string name=\"filename\" value=\"{file}\"/>{more}</shape>"
        );
        from_folder(&folder, &body).shapes.remove(0).mesh
    };
    let facets = r#"<boolean name="face_normals" value="true"/>"#;
    let flip = r#"<boolean name="flip_normals" value="true"/>"#;
    let mirror = r#"<transform name="to_world"><scale x="-1"/></transform>"#;
    let diagonal = vec3(1.0, 1.0, 1.0).normalize();

    let smooth = mesh("obj", "plain.obj", "");
    assert!((smooth.normals.as_ref().unwrap()[0] + diagonal).max_abs() < 1e-12);
    assert!(smooth.volume() > 0.0);
    assert_eq!(mesh("obj", "plain.obj", facets).normals, None);
    let flipped = mesh("obj", "plain.obj", flip);
    assert!((flipped.normals.as_ref().unwrap()[0] - diagonal).max_abs() < 1e-12);
    assert!(flipped.volume() < 0.0);
    // Without normals of its own a mirrored mesh turns inside out; with them it does not.
    assert!(mesh("obj", "plain.obj", mirror).volume() < 0.0);
    assert!(mesh("obj", "plain.obj", &format!("{mirror}{flip}")).volume() > 0.0);
    let own = mesh("obj", "own.obj", mirror);
    assert!((own.normals.as_ref().unwrap()[0] - vec3(0.0, 1.0, 1.0).normalize()).max_abs() < 1e-12);
    assert_eq!(own.normal(0), Vec3::Z);
    assert_eq!(mesh("obj", "own.obj", &format!("{facets}{mirror}")).normal(0), -Vec3::Z);
    assert_eq!(mesh("ply", "t.ply", facets).normal(0), Vec3::Z);
}

#[test]
fn vertices_repeated_in_a_file_keep_their_crease() {
    let folder = Folder::new();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nv 0 0 1\nv 1 0 0\nf 1 2 3\nf 4 6 5\n";
    folder.file("fold.obj", text);
    let body = r#"<shape type="obj"><string name="filename" value="fold.obj"/></shape>"#;
    let mesh = from_folder(&folder, body).shapes.remove(0).mesh;
    assert_eq!(mesh.normals.as_ref().unwrap()[0], Vec3::Z);
    assert_eq!(mesh.normals.as_ref().unwrap()[3], -Vec3::Y);
}

#[test]
fn unusable_files_name_scene_line_and_cause() {
    let folder = Folder::new();
    folder.file("cut.obj", "v 0 0 0\nv 1 0\n");
    let file = folder.file(
        "s.xml",
        "<scene version=\"3.0.0\">\n<shape type=\"obj\"><string name=\"filename\" \
         value=\"cut.obj\"/></shape></scene>",
    );
    let message = read_scene(&file, &Defaults::new()).unwrap_err().to_string();
    for part in ["s.xml:2: <shape type=\"obj\">", "cut.obj:2"] {
        assert!(message.contains(part), "{message}");
    }
    refused(
        r#"<shape type="ply"><string name="filename" value="no.ply"/></shape>"#,
        &[":2", "no file `no.ply`; searched dir"],
    );
    refused(r#"<shape type="obj"/>"#, &["`filename` is missing"]);
    refused(r#"<shape type="cone"/>"#, &["`cone` is not supported", "rectangle"]);
}

#[test]
fn shapes_hold_materials_lights_and_media() {
    let s = scene(
        r#"<medium type="homogeneous" id="fog"/>
           <shape type="cube"><ref name="interior" id="fog"/><bsdf type="null"/></shape>
           <shape type="cube"><medium name="exterior" type="homogeneous"/><ref name="interior" id="fog"/>
             <emitter type="area" id="glow"/></shape>
           <shape type="cube"/>"#,
    );
    assert_eq!(s.shapes[0].boundary, Some(MediumBoundary { interior: Some(0), exterior: None }));
    assert_eq!(s.shapes[1].boundary, Some(MediumBoundary { interior: Some(0), exterior: Some(1) }));
    assert_eq!(s.shapes[2].boundary, None);
    assert_eq!(s.shapes[1].emitter, Some(0));
    assert_eq!(s.emitters[0].id.as_deref(), Some("glow"));
    // Mitsuba's defaults: a light is black, anything else gray.
    assert_ne!(s.shapes[1].bsdf, s.shapes[2].bsdf);
    refused(
        "<medium type=\"homogeneous\" id=\"fog\"/><shape type=\"cube\">\n<ref id=\"fog\"/></shape>",
        &[":3", "`interior` or `exterior`"],
    );
    refused(
        "<shape type=\"cube\"><bsdf type=\"null\"/>\n<bsdf type=\"null\"/></shape>",
        &[":3", "only one bsdf"],
    );
    refused("<shape type=\"cube\"><emitter type=\"point\"/></shape>", &["type `area`"]);
    refused("<emitter type=\"area\"/>", &["belongs inside a <shape>"]);
}

const GROUP: &str = r#"<shape type="shapegroup" id="group">
    <shape type="cube" id="box"/><shape type="sphere"><integer name="resolution" value="8"/></shape>
    <ref id="extra"/></shape><shape type="disk" id="extra"/>"#;

#[test]
fn instances_share_the_meshes_of_their_group() {
    let s = scene(&format!(
        r#"<shape type="instance" id="a"><ref id="group"/></shape>{GROUP}
           <shape type="instance"><ref id="group"/><transform name="to_world"><scale value="2"/>
             <translate x="1"/></transform></shape>
           <shape type="shapegroup" id="single"><shape type="cube"/></shape>
           <shape type="instance" id="b"><ref id="single"/></shape>"#
    ));
    let ids: Vec<_> = s.shapes.iter().map(|s| s.id.as_deref()).collect();
    let a = [Some("a/box"), Some("a/1"), Some("a/extra")];
    assert_eq!(ids[..3], a);
    // A shape that a group refers to is there, too; one in it is not.
    assert_eq!(ids[3..], [Some("extra"), None, None, None, Some("b")]);
    assert_eq!(s.instances.iter().map(|i| i.shape).collect::<Vec<_>>(), [0, 1, 2, 4, 5, 6, 7]);
    for (i, j) in [(0, 4), (1, 5), (2, 6)] {
        assert!(std::sync::Arc::ptr_eq(&s.shapes[i].mesh, &s.shapes[j].mesh));
    }
    let map = &s.instances[3].to_world;
    assert_eq!(map.point(Vec3::splat(1.0)), vec3(3.0, 2.0, 2.0));
    s.check().unwrap();
}

#[test]
fn groups_hold_shapes_and_instances_refer_to_groups() {
    for (body, parts) in [
        (
            r#"<shape type="shapegroup"><shape type="instance"><ref id="group"/></shape></shape>"#,
            &["shapegroup", "instances of instances"][..],
        ),
        (
            r#"<shape type="shapegroup"><ref id="group"/></shape>"#,
            &["<ref id=\"group\"", "instances of instances"],
        ),
        (
            r#"<shape type="instance"><ref id="extra"/></shape>"#,
            &["of a shapegroup, not of", "extra"],
        ),
        (r#"<shape type="instance"/>"#, &["refers to a shapegroup"]),
        (
            r#"<shape type="instance" id="i"><ref id="j"/></shape>
               <shape type="instance" id="j"><ref id="i"/></shape>"#,
            &["which it is part of"],
        ),
        (
            r#"<shape type="instance"><ref id="group"/><transform name="to_world">
               <scale x="0"/></transform></shape>"#,
            &["flattens"],
        ),
        (
            r#"<shape type="instance"><ref id="group"/><bsdf type="diffuse"/></shape>"#,
            &["not supported inside"],
        ),
        (r#"<shape type="shapegroup"/>"#, &["there is no shape"]),
        (
            r#"<shape type="shapegroup"><shape type="cube"><emitter type="area"/></shape></shape>"#,
            &["cannot carry an emitter"],
        ),
    ] {
        refused(&format!("{GROUP}{body}"), parts);
    }
}

#[test]
fn merged_shapes_are_shapes() {
    let merged = scene(
        r#"<bsdf type="diffuse" id="grey"/><shape type="merge" id="all"><shape type="cube" id="box"><ref id="grey"/></shape>
           <shape type="rectangle"><ref id="grey"/></shape></shape>"#,
    );
    let ids: Vec<_> = merged.shapes.iter().map(|s| s.id.as_deref()).collect();
    assert_eq!(ids, [Some("box"), None]);
    refused(r#"<shape type="merge"/>"#, &["no shape in this merge"]);
    let elsewhere = r#"<shape type="cube" id="box"/><shape type="merge"><ref id="box"/></shape>"#;
    refused(elsewhere, &["stand in it"]);
    let moved =
        r#"<shape type="merge"><shape type="cube"/><float name="scale" value="2"/></shape>"#;
    refused(moved, &["scale", "merge"]);
    refused(
        r#"<shape type="shapegroup"><shape type="merge"><shape type="cube"/></shape></shape>"#,
        &["merge"],
    );
}
