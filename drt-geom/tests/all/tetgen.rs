//! Tetrahedra by TetGen: they fill the box, keep every face, and bad input is an error that says
//! which faces are bad.

use std::collections::HashMap;
use std::time::Duration;

use drt_geom::{
    Mesh, MeshError, TetVertexOrigin, TetgenError, Tetrahedralization, TetrahedralizeInput,
    TriangleBvh, crossing_pairs, procedural, tetrahedralize_tetgen,
};
use drt_math::{Affine, Mat3, Vec3, vec3};

const LIMIT: Duration = Duration::from_secs(60);

fn make(surfaces: &[&Mesh], points: &[Vec3]) -> Result<Tetrahedralization, TetgenError> {
    tetrahedralize_tetgen(&TetrahedralizeInput { surfaces, points, margin: 0.1 }, LIMIT)
}

fn placed(mesh: &Mesh, scale: f64, shift: Vec3) -> Mesh {
    mesh.transform(&Affine { linear: Mat3::IDENTITY * scale, translation: shift })
}

fn origin_position(surfaces: &[&Mesh], points: &[Vec3], origin: TetVertexOrigin) -> Option<Vec3> {
    match origin {
        TetVertexOrigin::Surface { surface, triangle, bary: [u, v] } => {
            let [a, b, c] = surfaces[surface as usize].triangle(triangle);
            Some(a * (1.0 - u - v) + b * u + c * v)
        }
        TetVertexOrigin::Point(i) => Some(points[i as usize]),
        TetVertexOrigin::Box | TetVertexOrigin::Inside => None,
    }
}

/// What holds for every result. Returns the volume of the tetrahedra whose middle `inside` holds.
fn check(
    surfaces: &[&Mesh],
    points: &[Vec3],
    made: &Tetrahedralization,
    inside: impl Fn(Vec3) -> bool,
) -> f64 {
    let positions = &made.mesh.positions;
    assert_eq!(made.origins.len(), positions.len());
    let with_origin = (0..).zip(made.origins.iter().copied()).chain(made.shared.iter().copied());
    for (vertex, origin) in with_origin {
        let expected = origin_position(surfaces, points, origin);
        assert!(expected.is_none_or(|p| p == positions[vertex as usize]));
    }
    let count = |is: fn(&TetVertexOrigin) -> bool| made.origins.iter().filter(|o| is(o)).count();
    assert_eq!(count(|o| *o == TetVertexOrigin::Box), 8);

    assert!(made.shared.is_sorted_by_key(|(vertex, _)| *vertex));

    // Each face is that of two tetrahedra, or on the box.
    let mut faces: HashMap<[Vec3Bits; 3], usize> = HashMap::new();
    let (mut volume, mut held) = (0.0, 0.0);
    for tet in &made.mesh.tets {
        let [a, b, c, d] = tet.map(|v| positions[v as usize]);
        let part = (b - a).cross(c - a).dot(d - a) / 6.0;
        assert!(part > 0.0);
        volume += part;
        held += if inside((a + b + c + d) * 0.25) { part } else { 0.0 };
        for face in [[a, b, c], [a, b, d], [a, c, d], [b, c, d]] {
            *faces.entry(face_key(face)).or_default() += 1;
        }
    }
    assert_eq!(faces.values().filter(|n| **n == 1).count(), 12);
    assert!(faces.values().all(|n| *n <= 2));
    for surface in surfaces {
        assert!(surface.soup().iter().all(|t| faces.get(&face_key(*t)) == Some(&2)));
    }
    let everything = surfaces.iter().flat_map(|s| s.positions.iter()).chain(points);
    let bounds = drt_geom::Aabb::around(everything.copied());
    let size = bounds.extent() + Vec3::splat(0.2 * bounds.extent().length());
    assert!((volume / (size.x * size.y * size.z) - 1.0).abs() < 1e-12, "{volume}");
    held
}

type Vec3Bits = [u64; 3];

fn face_key(corners: [Vec3; 3]) -> [Vec3Bits; 3] {
    let mut key = corners.map(|p| p.to_array().map(|x| (x + 0.0).to_bits()));
    key.sort_unstable();
    key
}

#[test]
fn nested_spheres() {
    let sphere = procedural::icosphere(2);
    let spheres = [0.3, 0.6, 1.0].map(|r| placed(&sphere, r, vec3(3.0, -2.0, 0.5)));
    let surfaces: Vec<&Mesh> = spheres.iter().collect();
    let made = make(&surfaces, &[]).unwrap();
    for s in &surfaces {
        let bvh = TriangleBvh::of(s).unwrap();
        let inside = check(&surfaces, &[], &made, |p| bvh.inside(p));
        assert!((inside / s.volume() - 1.0).abs() < 1e-10);
    }
    assert!(made.shared.is_empty());
}

#[test]
fn a_cube_and_points_around_it() {
    let cube = procedural::cube();
    let points =
        [vec3(0.25, 0.5, 0.0), vec3(2.0, 3.0, -1.5), vec3(1.0, 1.0, -1.0), vec3(2.0, 3.0, -1.5)];
    let made = make(&[&cube], &points).unwrap();
    check(&[&cube], &points, &made, |_| false);
    // The third is a corner of the cube, the fourth the second again.
    let named = |i| made.shared.iter().filter(|s| s.1 == TetVertexOrigin::Point(i)).count();
    assert_eq!([0, 1, 2, 3].map(named), [0, 0, 1, 1]);
    let distinct = |i| made.origins.iter().filter(|o| **o == TetVertexOrigin::Point(i)).count();
    assert_eq!([0, 1, 2, 3].map(distinct), [1, 1, 0, 0]);
}

#[test]
fn a_knot() {
    let shape = procedural::TorusKnot { segments: 96, sides: 8, ..Default::default() };
    let knot = procedural::torus_knot(&shape);
    let made = make(&[&knot], &[]).unwrap();
    let bvh = TriangleBvh::of(&knot).unwrap();
    let inside = check(&[&knot], &[], &made, |p| bvh.inside(p));
    assert!((inside / knot.volume() - 1.0).abs() < 1e-9);
}

#[test]
fn open_sheets_and_points_alone() {
    let sheet = procedural::grid(6, 5);
    let made = make(&[&sheet], &[]).unwrap();
    check(&[&sheet], &[], &made, |_| false);
    let points = [vec3(0.0, 0.0, 0.0), vec3(1.0, 2.0, 3.0)];
    let made = make(&[], &points).unwrap();
    check(&[], &points, &made, |_| false);
}

#[test]
fn bodies_that_touch_share_the_face() {
    let cube = procedural::cube();
    let above = placed(&cube, 1.0, vec3(0.0, 0.0, 2.0));
    let touching = crossing_pairs(&[&cube, &above], 99);
    assert_eq!(touching.len(), 2);
    let made = make(&[&cube, &above], &[]).unwrap();
    check(&[&cube, &above], &[], &made, |_| false);
    assert_eq!(made.shared.len(), 4);
}

#[test]
fn vertices_that_only_their_normals_tell_apart_are_one() {
    let cube = procedural::cube();
    let soup: Vec<Vec3> = cube.soup().into_iter().flatten().collect();
    let split = Mesh::new(soup, (0..12).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect()).unwrap();
    let made = make(&[&split], &[]).unwrap();
    check(&[&split], &[], &made, |_| false);
    assert_eq!(made.mesh.positions.len(), 16);
    assert_eq!(made.shared.len(), 36 - 8);
}

#[test]
fn triangles_without_area_are_left_out() {
    let cube = procedural::cube();
    let mut more = cube.clone();
    more.triangles.extend([[3, 3, 7], [0, 0, 0]]);
    assert_eq!(make(&[&more], &[]).unwrap(), make(&[&cube], &[]).unwrap());
}

#[test]
fn any_scale_and_place() {
    let sphere = procedural::icosphere(2);
    for (scale, shift) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e6), (1e-3, -1e3)] {
        let mesh = placed(&sphere, scale, Vec3::splat(shift));
        let made = make(&[&mesh], &[]).unwrap();
        assert!(made.mesh.tets.len() > 600, "{}", made.mesh.tets.len());
    }
}

/// Two spheres that run through each other, and the pairs of triangles that do.
fn crossing_spheres() -> (Mesh, Mesh, Vec<[(u32, u32); 2]>) {
    let (a, b) =
        (procedural::icosphere(2), placed(&procedural::icosphere(2), 1.0, Vec3::splat(0.6)));
    let pairs = crossing_pairs(&[&a, &b], usize::MAX);
    (a, b, pairs)
}

#[test]
fn crossing_faces_are_named_and_the_process_lives() {
    let (a, b, all) = crossing_spheres();
    let call = || {
        let error = make(&[&a, &b], &[]).unwrap_err();
        let text = error.to_string();
        let TetgenError::Crossing { pairs, .. } = error else { panic!("{text}") };
        assert!((1..=8).contains(&pairs.len()) && pairs.iter().all(|p| all.contains(p)));
        let [(_, first), (_, second)] = pairs[0];
        assert!(
            text.contains(&format!(
                "triangle {first} of surface 0 and triangle {second} of surface 1"
            )),
            "{text}"
        );
    };
    call();
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(call);
        }
    });
    assert!(make(&[&a], &[]).is_ok());
}

#[test]
fn what_repeats_or_touches_is_named() {
    let mut cube = procedural::cube();
    let [a, b, c] = cube.triangles[4];
    cube.triangles.push([c, b, a]);
    let error = make(&[&cube], &[]).unwrap_err();
    assert!(matches!(error, TetgenError::Repeated { surface: 0, triangles: [4, 12] }), "{error}");

    // A point on a face of the cube.
    let cube = procedural::cube();
    let error = make(&[&cube], &[vec3(3.0, 0.0, 0.0), vec3(1.0, 0.25, 0.5)]).unwrap_err();
    let TetgenError::OnFace { point: 1, face: (0, face), .. } = error else { panic!("{error}") };
    assert!(cube.triangle(face).iter().all(|p| p.x == 1.0));
}

#[test]
fn nonsense_is_refused() {
    let cube = procedural::cube();
    let mut bad = cube.clone();
    bad.positions[3].y = f64::NAN;
    let error = make(&[&cube, &bad], &[]).unwrap_err();
    let vertex = MeshError::BadPosition { vertex: 3 };
    assert!(matches!(&error, TetgenError::BadSurface { surface: 1, source } if *source == vertex));
    let mut bad = cube.clone();
    bad.triangles[2][1] = 8;
    assert!(matches!(make(&[&bad], &[]), Err(TetgenError::BadSurface { surface: 0, .. })));
    let infinite = vec3(f64::INFINITY, 0.0, 0.0);
    assert!(matches!(
        make(&[&cube], &[Vec3::ZERO, infinite]),
        Err(TetgenError::BadPoint { point: 1 })
    ));
    assert!(matches!(make(&[], &[]), Err(TetgenError::Empty)));
    let flat = Mesh::new(vec![Vec3::ZERO; 3], vec![[0, 1, 2]]).unwrap();
    assert!(matches!(make(&[&flat], &[]), Err(TetgenError::Empty)));
    assert!(matches!(make(&[], &[Vec3::X]), Err(TetgenError::BadMargin { .. })));
    for margin in [0.0, -1.0, 1e-30, f64::NAN, f64::INFINITY] {
        let input = TetrahedralizeInput { surfaces: &[&cube], points: &[], margin };
        let error = tetrahedralize_tetgen(&input, LIMIT).unwrap_err();
        assert!(matches!(error, TetgenError::BadMargin { .. }), "{margin}: {error}");
    }
}

#[test]
fn time_is_limited() {
    let sphere = procedural::icosphere(6);
    let input = TetrahedralizeInput { surfaces: &[&sphere], points: &[], margin: 0.1 };
    let error = tetrahedralize_tetgen(&input, Duration::from_millis(10)).unwrap_err();
    let timed_out = matches!(error, TetgenError::Library(tetgen_sys::Error::TimedOut { .. }));
    assert!(timed_out, "{error}");
}
