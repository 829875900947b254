//! PLY files in all encodings, right and wrong.

use drt_geom::{Mesh, PlyErrorKind, PolygonError, decode_ply, decode_vertex_vectors, read_ply};
use drt_math::{Rng, Vec3, vec3};

const ASCII: &str = "ply
format ascii 1.0
comment a pyramid
element vertex 5
property float x
property float y
property double z
property uchar red
element face 5
property uchar flags
property list uchar int vertex_indices
element edge 1
property list uint float ends
end_header
-1 -1 0 255
1 -1 0 255
1 1 0 255
-1 1 0 255
0 0 1.5 0
7 4 3 2 1 0
7 3 0 1 4
7 3 1 2 4
7 3 2 3 4
7 3 3 0 4
2 0.5 1
";

fn binary(big: bool, with_normals: bool) -> Vec<u8> {
    let name = if big { "binary_big_endian" } else { "binary_little_endian" };
    let normals = "property double nx\nproperty double ny\nproperty double nz\n";
    let mut out = format!(
        "ply\nformat {name} 1.0\nelement vertex 4\nproperty double x\nproperty float y\n\
         property short z\n{}element face 2\nproperty list ushort uint vertex_index\nend_header\n",
        if with_normals { normals } else { "" }
    )
    .into_bytes();
    let mut push = |bytes: &[u8]| {
        let mut bytes = bytes.to_vec();
        if big {
            bytes.reverse();
        }
        out.extend(bytes);
    };
    for p in [[0, 0], [1, 0], [1, 1], [0, 1]] {
        push(&(f64::from(p[0]) + 0.1).to_le_bytes());
        push(&(p[1] as f32).to_le_bytes());
        push(&(-3_i16).to_le_bytes());
        if with_normals {
            for n in [0.0, 0.6, 0.8_f64] {
                push(&n.to_le_bytes());
            }
        }
    }
    for face in [[0_u32, 1, 2], [0, 2, 3]] {
        push(&3_u16.to_le_bytes());
        for v in face {
            push(&v.to_le_bytes());
        }
    }
    out
}

#[test]
fn text_with_other_properties_and_elements() {
    let m = decode_ply(ASCII.as_bytes(), "test.ply").unwrap();
    assert_eq!((m.positions.len(), m.triangles.len()), (5, 6));
    assert!((m.volume() - 2.0).abs() < 1e-15);
    assert_eq!(m.source_vertices, None);
    let v = decode_vertex_vectors(ASCII.as_bytes(), "test.ply").unwrap();
    assert_eq!(v, m.positions);
    assert_eq!(v[4], vec3(0.0, 0.0, 1.5));
    let windows = ASCII.replace('\n', "\r\n");
    assert_eq!(decode_ply(windows.as_bytes(), "test.ply").unwrap(), m);
}

#[test]
fn binary_of_either_order() {
    for big in [false, true] {
        let plain = decode_ply(&binary(big, false), "test.ply").unwrap();
        assert_eq!(plain.positions[2], vec3(1.1, 1.0, -3.0));
        assert_eq!(plain.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(plain.normals, None);
        let smooth = decode_ply(&binary(big, true), "test.ply").unwrap();
        assert_eq!(smooth.positions, plain.positions);
        assert_eq!(smooth.normals, Some(vec![vec3(0.0, 0.6, 0.8); 4]));
    }
}

#[test]
fn vectors_alone_need_no_faces() {
    let text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n\
                property float z\nend_header\n1 2 3\n-4 5e-1 6\n";
    let v = decode_vertex_vectors(text.as_bytes(), "v.ply").unwrap();
    assert_eq!(v, [vec3(1.0, 2.0, 3.0), vec3(-4.0, 0.5, 6.0)]);
    let error = decode_ply(text.as_bytes(), "v.ply").unwrap_err();
    assert_eq!(error.kind, PlyErrorKind::Missing("faces"));
}

#[test]
fn unused_vertices_are_left_out() {
    let text = ASCII
        .replace("7 4 3 2 1 0", "7 3 3 2 1")
        .replace("3 0 4", "3 3 4 2")
        .replace("3 0 1 4", "3 1 2 4");
    let m = decode_ply(text.as_bytes(), "test.ply").unwrap();
    assert_eq!(m.source_vertices, Some(vec![1, 2, 3, 4]));
    assert_eq!(m.source_vertex_count, 5);
}

#[test]
fn other_columns_become_attributes() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
                property float quality\nproperty float two_a\nproperty float two_b\n\
                element face 1\nproperty list uchar int vertex_indices\nproperty float heat_0\n\
                end_header\n0 0 0 1 2 3 9 0 0\n1 0 0 4 5 6 9 0 0\n1 1 0 7 8 9 9 0 0\n\
                0 1 0 0 1 0 9 0 0\n4 0 1 2 3 0.5\n";
    let mut m = decode_ply(text.as_bytes(), "a.ply").unwrap();
    let names: Vec<_> = m.attributes.iter().map(|a| a.name.as_str()).collect();
    // Neither lone columns nor pairs.
    assert_eq!(names, ["vertex_color", "face_heat"]);
    let red = |m: &drt_geom::Mesh, i: u32| {
        let corners = m.triangles[i as usize].map(|v| m.positions[v as usize]);
        let at = |bary| m.attribute("vertex_color").unwrap().at(i, bary)[0];
        (corners, [at([0.0, 0.0]), at([1.0, 0.0]), at([0.0, 1.0])])
    };
    let check = |m: &drt_geom::Mesh| {
        for i in 0..2 {
            let (corners, values) = red(m, i);
            for (p, value) in corners.into_iter().zip(values) {
                assert_eq!(value, [[1.0, 4.0], [0.0, 7.0]][p.y as usize][p.x as usize]);
            }
            assert_eq!(m.attribute("face_heat").unwrap().at(i, [0.3, 0.3])[2], 0.5);
        }
    };
    check(&m);
    m.flip();
    check(&m);
    check(&m.drop_degenerate().0);
    m.attributes[0].values.pop();
    assert!(m.validate().unwrap_err().to_string().contains("`vertex_color`"));
}

type Expected = fn(&PlyErrorKind) -> bool;

#[test]
fn wrong_files_are_named() {
    let cases: [(&str, &str, Expected); 17] = [
        ("ply\n", "plx\n", |k| matches!(k, PlyErrorKind::Header { .. })),
        ("ascii 1.0", "ascii 2.0", |k| matches!(k, PlyErrorKind::Header { .. })),
        ("ascii", "binary_middle_endian", |k| matches!(k, PlyErrorKind::Header { .. })),
        ("element vertex 5", "element vertex -5", |k| matches!(k, PlyErrorKind::Header { .. })),
        ("property float x", "property quad x", |k| matches!(k, PlyErrorKind::Header { .. })),
        ("element face", "element vertex", |k| matches!(k, PlyErrorKind::Header { .. })),
        ("property float x", "property float a", |k| matches!(k, PlyErrorKind::Missing(_))),
        ("list uchar int", "list float int", |k| matches!(k, PlyErrorKind::Header { .. })),
        ("comment", "commend", |k| matches!(k, PlyErrorKind::Header { .. })),
        ("vertex_indices", "corners", |k| matches!(k, PlyErrorKind::Missing(_))),
        ("0 0 1.5", "0 nan 1.5", |k| *k == PlyErrorKind::NotFinite),
        ("0 0 1.5", "0 0 1e999", |k| *k == PlyErrorKind::NotFinite),
        ("0 0 1.5", "0 zero 1.5", |k| matches!(k, PlyErrorKind::BadNumber(_))),
        ("7 3 3 0 4", "7 3 3 0 5", |k| matches!(k, PlyErrorKind::MissingVertex { index: 5, .. })),
        ("7 3 3 0 4", "7 3 3 -1 4", |k| matches!(k, PlyErrorKind::MissingVertex { index: -1, .. })),
        ("7 3 3 0 4", "7 2 3 0", |k| *k == PolygonError::TooFewCorners(2).into()),
        ("2 0.5 1\n", "2 0.5\n", |k| *k == PlyErrorKind::Cut),
    ];
    for (from, to, expected) in cases {
        let text = ASCII.replacen(from, to, 1);
        assert_ne!(text, ASCII);
        let error = decode_ply(text.as_bytes(), "test.ply").unwrap_err();
        assert!(expected(&error.kind), "{to}: {error}");
        assert!(error.to_string().starts_with("test.ply: "), "{error}");
    }
    let error = decode_ply(ASCII.replace("0 0 1.5", "0 x 1.5").as_bytes(), "a").unwrap_err();
    assert_eq!(error.place, "line 19, vertex 4 (from 0)");
}

/// Headers that promise more than any memory holds, with next to nothing behind them.
#[test]
fn absurd_counts_cost_nothing() {
    let small = "ply\nformat binary_little_endian 1.0\n";
    for header in [
        "element vertex 1000000000000\nproperty double x\nproperty double y\nproperty double z\n",
        "element vertex 18446744073709551615\nproperty list uint double x\n",
        "element nothing 1000000000000\nelement vertex 1\nproperty float x\n",
        "element vertex 0\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1000000000000\nproperty list uint uint vertex_indices\n",
    ] {
        let mut bytes = format!("{small}{header}end_header\n").into_bytes();
        bytes.extend([255; 40]);
        assert!(decode_ply(&bytes, "absurd").is_err());
        assert!(decode_vertex_vectors(&bytes, "absurd").is_err() || header.contains("vertex 0"));
    }
}

#[test]
fn damaged_files_never_panic() {
    let mut rng = Rng::new(2, 0, 0);
    for whole in [ASCII.as_bytes().to_vec(), binary(false, true), binary(true, false)] {
        for end in 0..whole.len() - 1 {
            let cut = decode_ply(&whole[..end], "cut");
            assert!(cut.is_err() || end > whole.len() - 4, "{end}");
        }
        for _ in 0..10_000 {
            let mut bytes = whole.clone();
            for _ in 0..1 + rng.next_u32() % 4 {
                let at = rng.next_u32() as usize % bytes.len();
                bytes[at] = (rng.next_u32() >> 24) as u8;
            }
            if let Ok(m) = decode_ply(&bytes, "damaged") {
                assert!(m.positions.iter().all(|p: &Vec3| p.is_finite()));
                assert!(Mesh::new(m.positions, m.triangles).is_ok());
            }
        }
    }
}

#[test]
fn a_path_is_read_as_its_bytes_are() {
    let path = std::env::temp_dir().join(format!("drt-geom-{}.ply", std::process::id()));
    std::fs::write(&path, ASCII).unwrap();
    let read = read_ply(&path);
    std::fs::remove_file(&path).unwrap();
    assert_eq!(read.unwrap(), decode_ply(ASCII.as_bytes(), "test").unwrap());
    let error = read_ply(&path).unwrap_err();
    assert!(
        error.to_string().starts_with(&error.file) && error.to_string().contains("cannot be read")
    );
}
