//! Files of meshes and grids that hold none.

use crate::hard_inputs::{case, from_file, from_grid, only_scene, refused, vol};

fn ply(vertices: &str, faces: &str) -> String {
    let header = "property float x\nproperty float y\nproperty float z\n";
    let list = "property list uchar int vertex_indices\n";
    format!(
        "ply\nformat ascii 1.0\nelement vertex 3\n{header}element face 1\n{list}end_header\n{vertices}{faces}"
    )
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
