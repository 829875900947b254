//! Files of tetrahedra, right and wrong.

use std::path::PathBuf;

use drt_geom::{
    Aabb, TetFileError, TetFileErrorKind as Kind, TetMesh, decode_medit, decode_tetgen, procedural,
    read_tet_mesh,
};
use drt_math::{Rng, Vec3, vec3};

const NODES: &str = "# a tetrahedron and its mirror image
5 3 1 1  # points, dimension, attributes, markers

1  0 0 0   0.5 1
2  1 0 0   0.5 1 # a comment
3  0 1.0 0 0.5 1
4  0 0 1e0 0.5 1\r
   5  0 0 -1 0.5 -1
";
const TETS: &str = "2 4 1\n1 1 2 3 4 7\n2 1 2 3 5 8\n# end";

const MEDIT: &str = "MeshVersionFormatted 2

Dimension
3
# a comment
Vertices
5
0 0 0 1
1 0 0 1
0 1 0 2
0 0 1 2
0 0 -1 0
Triangles
1
1 2 3 9
RequiredTriangles 1
1
Tetrahedra 2
1 2 3 4 0
1 2 3 5 0
Corners
1
4
End
Vertices
";

fn two_tets() -> TetMesh {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, -Vec3::Z];
    TetMesh { positions, tets: vec![[0, 1, 2, 3], [0, 1, 4, 2]] }
}

fn tetgen(nodes: &str, tets: &str) -> Result<TetMesh, TetFileError> {
    decode_tetgen([(nodes.as_bytes(), "t.node"), (tets.as_bytes(), "t.ele")])
}

fn medit(text: &str) -> Result<TetMesh, TetFileError> {
    decode_medit(text.as_bytes(), "t.mesh")
}

#[test]
fn both_formats_give_the_same_mesh() {
    let mesh = tetgen(NODES, TETS).unwrap();
    assert_eq!(mesh, two_tets());
    assert_eq!(medit(MEDIT).unwrap(), mesh);
    mesh.validate().unwrap();
    let from_zero = NODES.replace("\n1 ", "\n0 ").replace("\n2 ", "\n1 ");
    let from_zero =
        from_zero.replace("\n3 ", "\n2 ").replace("\n4 ", "\n3 ").replace("   5 ", "4 ");
    assert_eq!(tetgen(&from_zero, "2 4\n0 0 1 2 3\n1 0 1 2 4\n").unwrap(), mesh);
}

#[test]
fn files_are_found_by_their_extension() {
    let folder = std::env::temp_dir().join(format!("drt-tet-files-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = |name: &str| -> PathBuf { folder.join(name) };
    for (name, text) in [("a.node", NODES), ("a.ele", TETS), ("b.mesh", MEDIT)] {
        std::fs::write(path(name), text).unwrap();
    }
    for name in ["a.node", "a.ele", "b.mesh"] {
        assert_eq!(read_tet_mesh(path(name)).unwrap(), two_tets());
    }
    std::fs::remove_file(path("a.node")).unwrap();
    let error = read_tet_mesh(path("a.ele")).unwrap_err();
    assert!(error.file.ends_with("a.node") && matches!(error.kind, Kind::Unreadable(_)), "{error}");
    let error = read_tet_mesh(path("b.msh")).unwrap_err();
    assert_eq!(error.kind, Kind::UnknownFormat);
    std::fs::remove_dir_all(&folder).unwrap();
}

type Expected = fn(&Kind) -> bool;

fn assert_error(error: TetFileError, line: usize, expected: Expected) {
    assert!(error.line == line && expected(&error.kind), "{error:?}");
    assert!(error.to_string().starts_with(&format!("{}:{line}: ", error.file)));
}

#[test]
fn wrong_lines_of_tetgen_files_are_named() {
    let one = |line: &str| format!("4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n{line}\n");
    let nodes: [(String, usize, Expected); 10] = [
        (String::new(), 1, |k| matches!(k, Kind::Cut(_))),
        ("\n# nothing\n\n".into(), 3, |k| matches!(k, Kind::Cut(_))),
        ("four".into(), 1, |k| matches!(k, Kind::Unexpected { .. })),
        ("4 2 0 0\n".into(), 1, |k| *k == Kind::NotSpatial(2)),
        (one(""), 5, |k| matches!(k, Kind::Cut("the number of a point"))),
        (one("3 0 0"), 5, |k| matches!(k, Kind::Cut(_))),
        (one("3 0 0 NaN"), 5, |k| matches!(k, Kind::Unexpected { found, .. } if found == "NaN")),
        (one("3 0 0 1e999"), 5, |k| matches!(k, Kind::Unexpected { .. })),
        (one("7 0 0 1"), 5, |k| *k == Kind::OutOfSequence { expected: 3, found: 7 }),
        ("18446744073709551615 3\n1 0 0 0\n".into(), 2, |k| matches!(k, Kind::Cut(_))),
    ];
    for (text, line, expected) in nodes {
        let error = tetgen(&text, "0 4 0").unwrap_err();
        assert_eq!(error.file, "t.node");
        assert_error(error, line, expected);
    }
    let tets: [(&str, usize, Expected); 6] = [
        ("1 10 0\n0 0 1 2 3", 1, |k| *k == Kind::NotLinear(10)),
        ("1 4 0\n1 0 1 2 3", 2, |k| *k == Kind::OutOfSequence { expected: 0, found: 1 }),
        ("1 4 0\n0 0 1 2 4", 2, |k| *k == Kind::MissingVertex { index: 4, first: 0, count: 4 }),
        ("1 4 0\n0 0 1 2 -1", 2, |k| matches!(k, Kind::Unexpected { .. })),
        ("1 4 0\n0 0 1 \n2", 3, |k| matches!(k, Kind::Cut(_))),
        ("99999999999 4\n0 0 1 2 3\n", 2, |k| matches!(k, Kind::Cut(_))),
    ];
    for (text, line, expected) in tets {
        let error = tetgen(&one("3 0 0 1"), text).unwrap_err();
        assert_eq!(error.file, "t.ele");
        assert_error(error, line, expected);
    }
}

#[test]
fn wrong_lines_of_medit_files_are_named() {
    let head = "MeshVersionFormatted 1\nDimension 3\n";
    let four = "Vertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n";
    let cases: [(String, usize, Expected); 11] = [
        (String::new(), 1, |k| matches!(k, Kind::Cut(_))),
        ("ply".into(), 1, |k| matches!(k, Kind::Unexpected { .. })),
        ("MeshVersionFormatted 2\nDimension 2\n".into(), 2, |k| *k == Kind::NotSpatial(2)),
        (head.into(), 2, |k| *k == Kind::Missing("Vertices")),
        (format!("{head}{four}"), 7, |k| *k == Kind::Missing("Tetrahedra")),
        (format!("{head}Tetrahedra 0\n"), 3, |k| matches!(k, Kind::Missing(_))),
        (format!("{head}{four}{four}"), 8, |k| *k == Kind::Repeated("Vertices")),
        (format!("{head}{four}Tetrahedra 0\nTetrahedra 0\n"), 9, |k| {
            *k == Kind::Repeated("Tetrahedra")
        }),
        (format!("{head}{four}Tetrahedra 1\n0 1 2 3 0\n"), 9, |k| {
            *k == Kind::MissingVertex { index: 0, first: 1, count: 4 }
        }),
        (format!("{head}Vertices 1\n0 inf 0 0\n"), 4, |k| matches!(k, Kind::Unexpected { .. })),
        (format!("{head}Vertices 18446744073709551615\n0 0 0 0\n"), 4, |k| {
            matches!(k, Kind::Cut(_))
        }),
    ];
    for (text, line, expected) in cases {
        assert_error(medit(&text).unwrap_err(), line, expected);
    }
}

/// Numbers in their shortest form that is read back as the same.
fn write(mesh: &TetMesh) -> [String; 3] {
    let mut nodes = format!("{} 3 0 0\n", mesh.positions.len());
    let mut tets = format!("{} 4 0\n", mesh.tets.len());
    let mut medit =
        format!("MeshVersionFormatted 2\nDimension 3\nVertices {}\n", mesh.positions.len());
    for (i, p) in mesh.positions.iter().enumerate() {
        nodes += &format!("{i} {} {} {}\n", p.x, p.y, p.z);
        medit += &format!("{} {} {} 0\n", p.x, p.y, p.z);
    }
    medit += &format!("Tetrahedra {}\n", mesh.tets.len());
    for (i, t) in mesh.tets.iter().enumerate() {
        tets += &format!("{i} {} {} {} {}\n", t[0], t[1], t[2], t[3]);
        let [a, b, c, d] = t.map(|v| v + 1);
        medit += &format!("{a} {b} {c} {d} 0\n");
    }
    [nodes, tets, medit + "End\n"]
}

#[test]
fn what_is_written_is_read_and_bytes_do_not_panic() {
    let bounds = Aabb { min: vec3(-1.0, 0.1, 1e-7), max: vec3(1.0 / 3.0, 0.7, 1e6) };
    let mesh = procedural::tet_grid([2, 3, 1], &bounds);
    let [nodes, tets, text] = write(&mesh);
    assert_eq!(tetgen(&nodes, &tets).unwrap(), mesh);
    assert_eq!(medit(&text).unwrap(), mesh);
    let mut rng = Rng::new(1, 0, 0);
    let (mut accepted, mut refused) = (0, 0);
    for _ in 0..3_000 {
        let [nodes, tets, text] = [&nodes, &tets, &text].map(|t| damaged(t.as_bytes(), &mut rng));
        let files = [(&nodes[..], "n"), (&tets[..], "t")];
        for result in [decode_tetgen(files), decode_medit(&text, "m")] {
            match result {
                Ok(mesh) => {
                    accepted += 1;
                    let _ = mesh.validate();
                }
                Err(e) => {
                    refused += 1;
                    assert!(e.line >= 1 && !e.to_string().is_empty());
                }
            }
        }
    }
    assert!(accepted > 500 && refused > 500, "{accepted} {refused}");
}

/// The text with a byte changed, or cut short.
fn damaged(text: &[u8], rng: &mut Rng) -> Vec<u8> {
    let mut bytes = text.to_vec();
    let place = rng.next_u32() as usize % bytes.len();
    match rng.next_u32() % 4 {
        0 => bytes.truncate(place),
        1 => bytes[place] = rng.next_u32() as u8,
        _ => bytes[place] = b"0123456789 -.e#\nN"[rng.next_u32() as usize % 17],
    }
    bytes
}
