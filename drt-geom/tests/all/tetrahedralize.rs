//! Boxes of tetrahedra around surfaces: full, without overlap, and with every triangle among the
//! faces.

use std::collections::HashMap;

use drt_geom::{
    Aabb, Mesh, TetVertexOrigin, Tetrahedralization, TetrahedralizeError, TetrahedralizeInput,
    procedural, tetrahedralize,
};
use drt_math::{Affine, CompensatedSum, Frame, Mat3, Rng, Vec3, vec3};

use crate::common::{direction, point};

fn fill(surfaces: &[&Mesh]) -> Result<Tetrahedralization, TetrahedralizeError> {
    tetrahedralize(&TetrahedralizeInput { surfaces, points: &[], margin: 0.2 })
}

/// Fills and checks all that is promised.
fn checked(surfaces: &[&Mesh], points: &[Vec3]) -> Tetrahedralization {
    let input = TetrahedralizeInput { surfaces, points, margin: 0.2 };
    let made = tetrahedralize(&input).unwrap_or_else(|e| panic!("{e}"));
    let largest = made.mesh.positions.iter().fold(0.0, |m, p| f64::max(m, p.max_abs()));
    volumes(&made);
    neighbours(&made);
    origins(&made, &input, 1e-13 * largest);
    for (s, mesh) in surfaces.iter().enumerate() {
        let on = faces_of(&made, mesh, 1e-13 * largest);
        for (t, [above, below]) in on.iter().enumerate() {
            let area = mesh.area(t as u32);
            let tolerance = 1e-9 * area + 1e-12 * largest * area.sqrt();
            assert!((above - area).abs() < tolerance, "{s} {t}: {above} of {area} above");
            assert!((below - area).abs() < tolerance, "{s} {t}: {below} of {area} below");
        }
    }
    made
}

fn corners(made: &Tetrahedralization, tet: [u32; 4]) -> [Vec3; 4] {
    tet.map(|v| made.mesh.positions[v as usize])
}

/// Six times the volume, exact in sign.
fn orient([a, b, c, d]: [Vec3; 4]) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|p| robust::Coord3D { x: p.x, y: p.y, z: p.z });
    -robust::orient3d(a, b, c, d)
}

fn volumes(made: &Tetrahedralization) {
    let mut sum = CompensatedSum::default();
    for &tet in &made.mesh.tets {
        let volume = orient(corners(made, tet));
        assert!(volume > 0.0, "{tet:?} {volume}");
        sum += volume / 6.0;
    }
    let extent = Aabb::around(made.mesh.positions.iter().copied()).extent();
    let whole = extent.x * extent.y * extent.z;
    assert!((sum.value() / whole - 1.0).abs() < 1e-12, "{} of {whole}", sum.value());
}

/// Each face has tetrahedra on both sides, or one where it is on the box.
fn neighbours(made: &Tetrahedralization) {
    let mut sides: HashMap<[u32; 3], Vec<bool>> = HashMap::new();
    let mut used = vec![false; made.mesh.positions.len()];
    for &[a, b, c, d] in &made.mesh.tets {
        for v in [a, b, c, d] {
            used[v as usize] = true;
        }
        for face in [[b, c, d], [a, d, c], [a, b, d], [a, c, b]] {
            let mut key = face;
            key.sort_unstable();
            let even = [face, [face[1], face[2], face[0]], [face[2], face[0], face[1]]];
            sides.entry(key).or_default().push(even.contains(&key));
        }
    }
    assert!(used.iter().all(|&u| u));
    for (face, sides) in sides {
        match sides[..] {
            [one, other] => assert_ne!(one, other, "{face:?}"),
            [_] => assert!(face.iter().all(|&v| v < 8), "{face:?}"),
            _ => panic!("{face:?} {}", sides.len()),
        }
    }
    assert_eq!(made.origins.len(), made.mesh.positions.len());
}

/// Every vertex is where its place on the input says.
fn origins(made: &Tetrahedralization, input: &TetrahedralizeInput<'_>, tolerance: f64) {
    let firsts = (0..).zip(made.origins.iter().copied());
    for (v, origin) in firsts.chain(made.shared.iter().copied()) {
        let at = made.mesh.positions[v as usize];
        let expected = match origin {
            TetVertexOrigin::Surface { surface, triangle, bary: [u, w] } => {
                assert!(u >= 0.0 && w >= 0.0 && u + w <= 1.0 + 1e-15, "{u} {w}");
                let [a, b, c] = input.surfaces[surface as usize].triangle(triangle);
                a * (1.0 - u - w) + b * u + c * w
            }
            TetVertexOrigin::Point(i) => input.points[i as usize],
            TetVertexOrigin::Box => {
                assert!(v < 8);
                at
            }
            TetVertexOrigin::Inside => panic!("no vertex is added off the surfaces"),
        };
        assert!((at - expected).max_abs() <= tolerance, "{v}: {at:?} {origin:?} {expected:?}");
    }
}

/// For each triangle, the area of the faces on it that have a tetrahedron above, and below; those
/// of tetrahedra that lie on it as a whole do not count.
fn faces_of(made: &Tetrahedralization, mesh: &Mesh, tolerance: f64) -> Vec<[f64; 2]> {
    let mut tets_of = vec![Vec::new(); made.mesh.positions.len()];
    for (t, tet) in made.mesh.tets.iter().enumerate() {
        for &v in tet {
            tets_of[v as usize].push(t);
        }
    }
    let on_triangle = |i: u32| {
        let [a, b, c] = mesh.triangle(i);
        // The normal of a needle is less sure.
        let length = f64::max((b - a).length(), (c - a).length());
        let tolerance = tolerance + 1e-15 * length.powi(3) / mesh.area(i);
        let inward = {
            let n = mesh.normal(i);
            [(a, b), (b, c), (c, a)].map(|(p, q)| (p, n.cross((q - p).normalize())))
        };
        let vertices: Vec<usize> = (0..made.mesh.positions.len())
            .filter(|&v| {
                let p = made.mesh.positions[v];
                (p - a).dot(mesh.normal(i)).abs() <= tolerance
                    && inward.iter().all(|(o, n)| (p - *o).dot(*n) >= -tolerance)
            })
            .collect();
        let mut tets: Vec<usize> = vertices.iter().flat_map(|&v| tets_of[v].clone()).collect();
        tets.sort_unstable();
        tets.dedup();
        let mut area = [0.0; 2];
        for t in tets {
            let tet = made.mesh.tets[t];
            let is_on = tet.map(|v| vertices.binary_search(&(v as usize)).is_ok());
            for (off, face) in [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]].iter().enumerate() {
                if !is_on[off] && face.iter().all(|&k| is_on[k]) {
                    let [p, q, r] = face.map(|k| made.mesh.positions[tet[k] as usize]);
                    let outward = (q - p).cross(r - p);
                    let below = outward.dot(mesh.normal(i)) > 0.0;
                    area[usize::from(below)] += 0.5 * outward.length();
                }
            }
        }
        area
    };
    (0..mesh.triangles.len() as u32).map(on_triangle).collect()
}

fn count_added(made: &Tetrahedralization) -> usize {
    let is_corner = |o: &TetVertexOrigin| match o {
        TetVertexOrigin::Surface { bary, .. } => bary.iter().all(|w| [0.0, 1.0].contains(w)),
        _ => true,
    };
    made.origins.iter().filter(|o| !is_corner(o)).count()
}

fn moved(mesh: &Mesh, scale: f64, offset: Vec3) -> Mesh {
    let linear = Mat3 { cols: [Vec3::X * scale, Vec3::Y * scale, Vec3::Z * scale] };
    mesh.transform(&Affine { linear, translation: offset })
}

/// A shape turned by no angle in particular.
fn turned(mesh: &Mesh) -> Mesh {
    let f = Frame::from_normal(vec3(0.36, 0.48, 0.8));
    let linear = Mat3 { cols: [f.s, f.t, f.n] };
    mesh.transform(&Affine { linear, translation: vec3(0.1, 0.2, 0.3) })
}

#[test]
fn nothing_and_single_points() {
    let made = checked(&[], &[]);
    assert_eq!((made.mesh.tets.len(), made.origins.len()), (6, 8));
    let made = checked(&[], &[Vec3::ZERO]);
    assert_eq!(made.origins[8], TetVertexOrigin::Point(0));
    let made = checked(&[], &[vec3(5.0, 6.0, 7.0), vec3(5.0, 6.0, 7.0)]);
    assert_eq!(made.shared, [(8, TetVertexOrigin::Point(1))]);
}

#[test]
fn a_cube_takes_nothing_but_its_corners() {
    for cube in [procedural::cube(), turned(&procedural::cube())] {
        let made = checked(&[&cube], &[]);
        assert_eq!(count_added(&made), 0);
        assert_eq!(made.origins.len(), 16);
    }
}

#[test]
fn nested_spheres_with_a_camera_between() {
    let outer = procedural::icosphere(3);
    let inner = moved(&procedural::icosphere(2), 0.5, Vec3::ZERO);
    let made = checked(&[&outer, &inner], &[vec3(0.75, 0.0, 0.0), outer.positions[7]]);
    assert_eq!(count_added(&made), 0);
    let points: Vec<_> =
        made.shared.iter().filter(|(_, o)| matches!(o, TetVertexOrigin::Point(_))).collect();
    assert_eq!(points.len(), 1, "the second point is a vertex of the sphere");
}

#[test]
fn open_sheets_and_knots() {
    checked(&[&procedural::grid(7, 5)], &[]);
    checked(&[&turned(&procedural::grid(9, 9))], &[]);
    checked(&[&procedural::star(7, 0.3, 1.0)], &[]);
    let knot = procedural::TorusKnot { segments: 96, sides: 8, ..Default::default() };
    checked(&[&procedural::torus_knot(&knot)], &[]);
    checked(&[&procedural::bumpy_sphere(3, 0.3, 5.0)], &[]);
}

#[test]
fn touching_bodies() {
    let cube = procedural::cube();
    // The same face; half of it; a corner of it; an edge; a vertex.
    for offset in [[2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [2.0, 1.0, 0.5], [2.0, 2.0, 0.0], [2.0; 3]] {
        let other = moved(&cube, 1.0, offset.into());
        let made = checked(&[&cube, &other], &[]);
        assert!(!made.shared.is_empty(), "{offset:?}");
        // The same contact, up to rounding.
        checked(&[&turned(&cube), &turned(&other)], &[]);
    }
}

#[test]
fn piles_of_cubes_in_contact() {
    let mut rng = Rng::new(11, 0, 0);
    for pile in 0..40 {
        let mut at = vec![Vec3::ZERO];
        while at.len() < 2 + pile % 4 {
            let mut offset = [0; 3].map(|_| 0.25 * f64::from(rng.next_u32() % 17) - 2.0);
            offset[rng.next_u32() as usize % 3] = if rng.next_f64() < 0.5 { 2.0 } else { -2.0 };
            let next = at[rng.next_u32() as usize % at.len()] + offset.into();
            if at.iter().all(|p| (*p - next).max_abs() >= 2.0) {
                at.push(next);
            }
        }
        let f = Frame::from_normal(direction(&mut rng));
        let turn = Affine { linear: Mat3 { cols: [f.s, f.t, f.n] }, translation: point(&mut rng) };
        let cubes = at.iter().map(|&p| moved(&procedural::cube(), 1.0, p).transform(&turn));
        let cubes: Vec<Mesh> = cubes.collect();
        checked(&cubes.iter().collect::<Vec<_>>(), &[]);
    }
}

#[test]
fn the_checks_find_faults() {
    let cube = procedural::cube();
    let made = fill(&[&cube]).unwrap();
    let fails = |check: &dyn Fn(&mut Tetrahedralization)| {
        let mut made = made.clone();
        let check = std::panic::AssertUnwindSafe(|| check(&mut made));
        std::panic::catch_unwind(check).is_err()
    };
    let with_other_diagonals = {
        let quarter = |p: &Vec3| vec3(-p.y, p.x, p.z);
        let positions = cube.positions.iter().map(quarter).collect();
        Mesh::new(positions, cube.triangles.clone()).unwrap()
    };
    let covered = |made: &Tetrahedralization, mesh: &Mesh| {
        let on = faces_of(made, mesh, 1e-13);
        (0..).zip(on).all(|(t, areas)| areas.iter().all(|a| (a - mesh.area(t)).abs() < 1e-9))
    };
    assert!(covered(&made, &cube) && !covered(&made, &with_other_diagonals));
    assert!(!fails(&|made| neighbours(made)) && !fails(&|made| volumes(made)));
    assert!(fails(&|made| {
        made.mesh.tets.pop();
        neighbours(made);
    }));
    assert!(fails(&|made| {
        made.mesh.tets.pop();
        volumes(made);
    }));
    assert!(fails(&|made| {
        made.mesh.tets[0].swap(0, 1);
        volumes(made);
    }));
}

#[test]
fn a_cube_on_a_plate() {
    let plate = moved(&procedural::rectangle(), 3.0, vec3(0.1, 0.2, -1.0));
    let made = checked(&[&plate, &procedural::cube()], &[]);
    let on_both = made.shared.iter().filter(|(v, o)| {
        let surfaces = [*o, made.origins[*v as usize]].map(|o| match o {
            TetVertexOrigin::Surface { surface, .. } => Some(surface),
            _ => None,
        });
        surfaces[0] != surfaces[1]
    });
    assert!(on_both.count() >= 4);
    let plate = moved(&procedural::grid(5, 5), 3.0, vec3(0.1, 0.2, -1.0));
    checked(&[&plate, &procedural::cube()], &[]);
}

#[test]
fn coincident_triangles() {
    let sheet = procedural::grid(3, 3);
    let mut back = sheet.clone();
    back.flip();
    let made = checked(&[&sheet, &back, &sheet], &[]);
    assert_eq!(made.origins.len(), 8 + 16);
    assert_eq!(made.shared.len(), 2 * 16);
}

#[test]
fn crossing_bodies_are_named() {
    let cube = procedural::cube();
    let other = turned(&cube);
    let Err(TetrahedralizeError::Intersection { first, second }) = fill(&[&cube, &other]) else {
        panic!("they intersect")
    };
    assert_eq!((first.surface, second.surface), (0, 1));
    let [s, t] = [cube.triangle(first.triangle), other.triangle(second.triangle)];
    assert!(crosses(s, t), "{s:?} {t:?}");
    // A needle through a sheet, and a sheet through a sheet.
    let sheet = procedural::grid(4, 4);
    let needle = Mesh::new(
        vec![vec3(0.1, 0.2, -1.0), vec3(0.11, 0.2, 1.0), vec3(0.1, 0.21, 1.0)],
        vec![[0, 1, 2]],
    );
    assert!(matches!(
        fill(&[&sheet, &needle.unwrap()]),
        Err(TetrahedralizeError::Intersection { .. })
    ));
}

/// Whether an edge of either passes through the other.
fn crosses(s: [Vec3; 3], t: [Vec3; 3]) -> bool {
    let through = |[a, b, c]: [Vec3; 3], [x, y, z]: [Vec3; 3]| {
        [(a, b), (b, c), (c, a)].into_iter().any(|(p, q)| {
            orient([x, y, z, p]) * orient([x, y, z, q]) < 0.0 && {
                let s = [(x, y), (y, z), (z, x)].map(|(v, w)| orient([p, q, v, w]));
                s.iter().all(|&s| s > 0.0) || s.iter().all(|&s| s < 0.0)
            }
        })
    };
    through(s, t) || through(t, s)
}

/// Triangles of random shape, each in its own cell of a grid.
fn soup(cells: i32, rng: &mut Rng) -> Mesh {
    let mut positions = Vec::new();
    for i in 0..cells.pow(3) {
        let cell = vec3(i % cells, i / cells % cells, i / cells / cells);
        let centre = vec3(f64::from(cell.x), f64::from(cell.y), f64::from(cell.z));
        let (d, e) = (direction(rng), direction(rng));
        let thin = 1e-5 + rng.next_f64().powi(12);
        positions.extend([
            centre + d * 0.49,
            centre - d * 0.49,
            centre + d * 0.2 + e * (0.2 * thin),
        ]);
    }
    let triangles = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    let triangles = triangles.collect();
    Mesh::new(positions, triangles).unwrap()
}

#[test]
fn soups_of_random_triangles_and_needles() {
    let mut rng = Rng::new(5, 0, 0);
    for _ in 0..8 {
        let soup = soup(6, &mut rng);
        let points: Vec<Vec3> =
            (0..100).map(|_| point(&mut rng) * 3.0 + Vec3::splat(3.0)).collect();
        let made = checked(&[&soup], &points);
        println!("{} vertices added, {} tets", count_added(&made), made.mesh.tets.len());
    }
}

#[test]
fn long_triangles_in_a_cloud_of_points() {
    // Large triangles over one another, between which points are dense: much to recover.
    let mut rng = Rng::new(6, 0, 0);
    for sheets in [1, 3, 9] {
        let mut positions = Vec::new();
        for i in 0..sheets {
            let z = f64::from(i) * 0.1;
            let mut corner = |x: f64, y: f64| vec3(x, y, z + 0.04 * rng.next_f64());
            positions.extend([corner(-1.0, -1.0), corner(1.0, -0.9), corner(0.1, 1.0)]);
        }
        let triangles = (0..sheets as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = Mesh::new(positions, triangles).unwrap();
        let points: Vec<Vec3> = (0..1000).map(|_| point(&mut rng)).collect();
        let made = checked(&[&mesh], &points);
        println!("{} vertices added, {} tets", count_added(&made), made.mesh.tets.len());
    }
}

#[test]
fn any_scale_and_place() {
    let knot = procedural::TorusKnot { segments: 48, sides: 6, ..Default::default() };
    for shape in [procedural::cube(), procedural::icosphere(2), procedural::torus_knot(&knot)] {
        for scale in [1e-6, 1.0, 1e6] {
            for offset in [Vec3::ZERO, vec3(1e6, -2e6, 3e5) * scale] {
                checked(&[&moved(&shape, scale, offset)], &[]);
            }
        }
    }
    for scale in [1e-200, 1e100] {
        let made = fill(&[&moved(&procedural::icosphere(2), scale, Vec3::ZERO)]).unwrap();
        assert_eq!(count_added(&made), 0);
    }
}

#[test]
fn bad_input_is_refused() {
    let cube = procedural::cube();
    let mut broken = cube.clone();
    broken.positions[3].y = f64::NAN;
    assert_eq!(
        fill(&[&cube, &broken]),
        Err(TetrahedralizeError::NonFinitePosition { surface: 1, vertex: 3 })
    );
    let mut broken = cube.clone();
    broken.triangles[4][1] = 8;
    assert_eq!(
        fill(&[&broken]),
        Err(TetrahedralizeError::IndexOutOfRange { surface: 0, triangle: 4 })
    );
    let input = |points, margin| TetrahedralizeInput { surfaces: &[], points, margin };
    let far = [Vec3::ZERO, vec3(0.0, f64::INFINITY, 0.0)];
    assert_eq!(
        tetrahedralize(&input(&far, 0.1)),
        Err(TetrahedralizeError::NonFinitePoint { point: 1 })
    );
    for margin in [0.0, -1.0, f64::INFINITY] {
        let error = TetrahedralizeError::BadMargin { margin };
        assert_eq!(tetrahedralize(&input(&[], margin)), Err(error));
    }
}

#[test]
fn triangles_without_area_are_skipped() {
    let mut mesh = procedural::cube();
    mesh.positions.push(vec3(0.25, 0.25, 1.0));
    mesh.triangles.extend([[0, 0, 1], [0, 7, 7], [3, 3, 3], [8, 8, 8]]);
    let made = fill(&[&mesh]).unwrap();
    assert_eq!(made.origins.len(), 16);
}
