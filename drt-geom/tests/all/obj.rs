//! OBJ files, right and wrong.

use drt_geom::{Mesh, MeshError, ObjErrorKind, PolygonError, Topology, decode_obj, read_obj};
use drt_math::{Rng, Vec3, vec3};

fn load(text: &str) -> Result<Mesh, drt_geom::ObjError> {
    decode_obj(text.as_bytes(), "test.obj")
}

const CUBE: &str = "# a cube
mtllib none.mtl
o cube
v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1
v -1 -1 1\r\nv 1 -1 1\r\nv 1 1 1\t\r\nv -1 1 1
vt 0 0
g sides
usemtl red
f 4/1 3/1 2/1 1/1
f 5/1 6/1 7/1 8/1
s off
f -8 -7 -3 -4
f 2 3 7 6   # a comment
f 3 4 \\
  8 7
f 4 1 5 8
l 1 2
p 1
";

#[test]
fn a_cube_of_quads() {
    let m = load(CUBE).unwrap();
    assert_eq!((m.positions.len(), m.triangles.len()), (8, 12));
    assert_eq!(m.volume(), 8.0);
    assert!(Topology::of(&m).is_closed());
    assert_eq!((m.source_vertices, m.source_vertex_count), (None, 8));
    assert_eq!(m.normals, None);
    assert_eq!(m.triangles[..2], [[3, 2, 1], [3, 1, 0]]);
    assert_eq!(m.positions[6], vec3(1.0, 1.0, 1.0));
}

#[test]
fn vertices_split_by_normals_remember_their_source() {
    let m = load(
        "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 2\nvn 0 -1 0\n\
         f 2//1 3//1 4//1\nf 2//2 5//2 3//2\n",
    )
    .unwrap();
    assert_eq!(m.source_vertices, Some(vec![1, 1, 2, 2, 3, 4]));
    assert_eq!(m.source_vertex_count, 5);
    let normals = m.normals.as_ref().unwrap();
    for (t, n) in m.triangles.iter().zip([Vec3::Z, -Vec3::Y]) {
        assert!(t.iter().all(|&v| normals[v as usize] == n));
    }
    assert_eq!(m.triangle(0), [Vec3::ZERO, Vec3::X, Vec3::Y]);
}

#[test]
fn corners_without_normals_take_their_faces() {
    let m = load(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 1 0 0\nvn 0 0 0\nf 1//1 2//1 3//1\nf 1 3 4\nf 1//2 4//2 3//2\n",
    )
    .unwrap();
    let normals = m.normals.as_ref().unwrap();
    for (t, n) in m.triangles.iter().zip([Vec3::X, Vec3::Z, -Vec3::Z]) {
        assert!(t.iter().all(|&v| normals[v as usize] == n));
    }
}

#[test]
fn concave_polygons_are_cut_right() {
    let m = load("v 2 0 0\nv 0 1 0\nv 0.5 0 0\nv 0 -1 0\nf 4 1 2 3\n").unwrap();
    assert_eq!(m.surface_area(), 1.5);
}

#[test]
fn what_is_not_read_is_passed_over() {
    let m = load(
        "# \u{e9}\nv 0 0 0 0\nv 1 0 0 2\nl 7 8\nv 0 1 0 0.5 0.5 0.5\nv 5 5 5 red\n\
         g x\nf 1 2 \\\n 3\no y\nf -4 -3 -2 # 9\nusemtl z\nf 3 2 5\nv 0 0 1\n",
    )
    .unwrap();
    assert_eq!(m.positions, [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z]);
    assert_eq!(m.triangles, [[0, 1, 2], [0, 1, 2], [2, 1, 3]]);
    assert_eq!((m.source_vertices, m.source_vertex_count), (Some(vec![0, 1, 2, 4]), 5));
    let bytes = b"o \xff\xfe\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 # \xff\n";
    assert_eq!(decode_obj(bytes, "latin").unwrap().triangles, [[0, 1, 2]]);
}

type Expected = fn(&ObjErrorKind) -> bool;

#[test]
fn wrong_lines_are_named() {
    let four = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let cases: [(&str, usize, Expected); 24] = [
        ("f 1 2 3 9", 5, |k| matches!(k, ObjErrorKind::MissingItem { index: 9, count: 4, .. })),
        ("f 1 2 -5", 5, |k| matches!(k, ObjErrorKind::MissingItem { index: -5, .. })),
        ("f 1 2 0", 5, |k| matches!(k, ObjErrorKind::BadCorner(_))),
        ("f 1 2 3//1", 5, |k| matches!(k, ObjErrorKind::MissingItem { what: "normal", .. })),
        ("f 1", 5, |k| *k == PolygonError::TooFewCorners(1).into()),
        ("f", 5, |k| *k == PolygonError::TooFewCorners(0).into()),
        ("f 1 2 3/x/1", 5, |k| matches!(k, ObjErrorKind::BadCorner(_))),
        ("vn 0 0 1\nf 1 2 3//2", 6, |k| matches!(k, ObjErrorKind::MissingItem { index: 2, .. })),
        ("vn 0 0 1\nf 1 2 3//-2", 6, |k| matches!(k, ObjErrorKind::MissingItem { count: 1, .. })),
        ("vn 0 0 1\nf 1 2 3//0", 6, |k| matches!(k, ObjErrorKind::BadCorner(_))),
        ("f 1 2 3//6148914691236517206\nvn 0 0 1", 5, |k| {
            matches!(k, ObjErrorKind::MissingItem { what: "normal", .. })
        }),
        ("f 1 2 -4\nf 1 2 -5\nv 1 1 1", 6, |k| {
            matches!(k, ObjErrorKind::MissingItem { index: -5, count: 4, .. })
        }),
        ("f 1 2 x", 5, |k| matches!(k, ObjErrorKind::BadCorner(_))),
        ("f 1 2 3/1/1/1", 5, |k| matches!(k, ObjErrorKind::BadCorner(_))),
        ("f 1 2 //1", 5, |k| matches!(k, ObjErrorKind::BadCorner(_))),
        ("f 1 2 99999999999999999999", 5, |k| matches!(k, ObjErrorKind::BadCorner(_))),
        ("f 1 2 4294967295", 5, |k| matches!(k, ObjErrorKind::MissingItem { .. })),
        ("v 1 2", 5, |k| matches!(k, ObjErrorKind::BadNumbers { statement: "v", .. })),
        ("v 1 nan 2", 5, |k| matches!(k, ObjErrorKind::BadNumbers { .. })),
        ("v 1 1e999 2", 5, |k| matches!(k, ObjErrorKind::BadNumbers { .. })),
        ("vn 1 inf 2", 5, |k| matches!(k, ObjErrorKind::BadNumbers { statement: "vn", .. })),
        ("v 1 two 3", 5, |k| matches!(k, ObjErrorKind::BadNumbers { .. })),
        ("v -1 0.5 0\n# five\nf 1 3 2 4 5", 7, |k| *k == PolygonError::Crossing.into()),
        ("# nothing\n", 5, |k| *k == ObjErrorKind::NoFaces),
    ];
    for (text, line, expected) in cases {
        let error = load(&format!("{four}{text}")).unwrap_err();
        assert!(expected(&error.kind), "{text}: {error}");
        assert_eq!(error.line, line, "{text}: {error}");
        assert!(error.to_string().starts_with(&format!("test.obj:{line}: ")), "{error}");
    }
    assert_eq!(load("").unwrap_err().kind, ObjErrorKind::NoFaces);
    assert!(!matches!(
        load("v 0 0").unwrap_err().kind,
        ObjErrorKind::Mesh(MeshError::TooLarge { .. })
    ));
}

#[test]
fn damaged_files_never_panic() {
    let mut rng = Rng::new(1, 0, 0);
    for end in 0..CUBE.len() {
        let _ = decode_obj(&CUBE.as_bytes()[..end], "cut");
    }
    for _ in 0..20_000 {
        let mut bytes = CUBE.as_bytes().to_vec();
        for _ in 0..1 + rng.next_u32() % 4 {
            let at = rng.next_u32() as usize % bytes.len();
            bytes[at] = (rng.next_u32() >> 24) as u8;
        }
        if let Ok(m) = decode_obj(&bytes, "damaged") {
            assert!(Mesh::new(m.positions, m.triangles).is_ok());
        }
    }
}

#[test]
fn a_path_is_read_as_its_bytes_are() {
    let path = std::env::temp_dir().join(format!("drt-geom-{}.obj", std::process::id()));
    std::fs::write(&path, CUBE).unwrap();
    let read = read_obj(&path);
    std::fs::remove_file(&path).unwrap();
    assert_eq!(read.unwrap(), decode_obj(CUBE.as_bytes(), "test").unwrap());
    let error = read_obj(&path).unwrap_err();
    assert!(
        error.to_string().starts_with(&error.file) && error.to_string().contains("cannot be read")
    );
}
