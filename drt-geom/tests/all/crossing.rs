//! Where surfaces run through each other: what counts as crossing, exactly, and that none is missed.

use drt_geom::{Mesh, crossing_pairs, crossing_segments, procedural};
use drt_math::{Affine, Mat3, Rng, Vec3, vec3};

fn triangle(corners: [[f64; 3]; 3]) -> Mesh {
    Mesh::new(corners.map(Vec3::from).to_vec(), vec![[0, 1, 2]]).unwrap()
}

const FLOOR: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

fn crosses_floor(corners: [[f64; 3]; 3]) -> bool {
    let (a, b) = (triangle(FLOOR), triangle(corners));
    let found = crossing_pairs(&[&a, &b], 9);
    assert_eq!(found, crossing_pairs(&[&a, &b, &triangle([[9.0; 3]; 3])], 9));
    // In whatever order the corners and the triangles come.
    for turn in 0..6 {
        let mut turned = corners;
        turned.rotate_left(turn % 3);
        if turn > 2 {
            turned.swap(0, 1);
        }
        let again = crossing_pairs(&[&triangle(turned), &a], 9);
        assert_eq!(found.is_empty(), again.is_empty(), "{corners:?} as {turned:?}");
    }
    assert!(found.is_empty() || found == [[(0, 0), (1, 0)]]);
    !found.is_empty()
}

#[test]
fn common_corners_and_edges_are_no_crossing() {
    // A corner; an edge, from above and in the plane; beside it; above it.
    assert!(!crosses_floor([[0.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 1.0]]));
    assert!(!crosses_floor([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]]));
    assert!(!crosses_floor([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 1e-300]]));
    assert!(!crosses_floor([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, -4.0, 0.0]]));
    assert!(!crosses_floor([[0.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]));
    assert!(!crosses_floor([[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.0, 4.0, 0.0]]));
    assert!(!crosses_floor([[1.0, 1.0, 1e-30], [2.0, 1.0, 1.0], [1.0, 2.0, 1.0]]));
    // The planes cross, the triangles do not.
    assert!(!crosses_floor([[3.0, 3.0, -1.0], [3.0, 3.0, 1.0], [4.0, 4.0, 0.0]]));
}

#[test]
fn what_runs_through_is_a_crossing() {
    assert!(crosses_floor([[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [9.0, 9.0, 0.0]]));
    assert!(crosses_floor([[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [1.5, 1.0, 1.0]]));
    // From a common corner on, through the inside and through the opposite edge.
    assert!(crosses_floor([[0.0, 0.0, 0.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0]]));
    assert!(crosses_floor([[0.0, 0.0, 0.0], [9.0, 9.0, -1.0], [9.0, 9.0, 1.0]]));
}

#[test]
fn overlap_in_a_plane_is_a_crossing() {
    assert!(crosses_floor(FLOOR));
    assert!(crosses_floor([[1.0, 1.0, 0.0], [1.5, 1.0, 0.0], [1.0, 1.5, 0.0]]));
    assert!(crosses_floor([[-1.0, 1.0, 0.0], [9.0, 1.0, 0.0], [9.0, 1.5, 0.0]]));
    assert!(crosses_floor([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [1.0, 1.0, 0.0]]));
    assert!(crosses_floor([[0.0, 0.0, 0.0], [9.0, 1.0, 0.0], [1.0, 9.0, 0.0]]));
    assert!(crosses_floor([[0.0, 0.0, 0.0], [1.0, 0.2, 0.0], [0.2, 1.0, 0.0]]));
}

#[test]
fn a_corner_where_the_other_has_none_is_a_crossing() {
    // On the inside, on an edge, and an edge along a part of an edge.
    assert!(crosses_floor([[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]]));
    assert!(crosses_floor([[2.0, 0.0, 0.0], [2.0, -1.0, 1.0], [3.0, -1.0, 1.0]]));
    assert!(crosses_floor([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, -4.0, 0.0]]));
    assert!(crosses_floor([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, -4.0, 3.0]]));
    assert!(crosses_floor([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, -4.0, 3.0]]));
}

#[test]
fn signs_are_exact() {
    // One unit in the last place decides whether the tip reaches the plane x + y + z = 1.
    let plane = triangle([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    let tip = |z: f64| triangle([[0.25, 0.25, z], [3.0, 2.0, 2.0], [2.0, 3.0, 2.0]]);
    let at = |z| crossing_pairs(&[&plane, &tip(z)], 1).len();
    assert_eq!([at(0.5_f64.next_down()), at(0.5), at(0.5_f64.next_up())], [1, 1, 0]);
}

#[test]
fn good_meshes_do_not_cross_and_copies_of_them_do() {
    let knot = procedural::torus_knot(&procedural::TorusKnot::default());
    let sphere = procedural::icosphere(3);
    let grid = procedural::grid(9, 7);
    let cube = procedural::cube();
    for mesh in [&knot, &sphere, &grid, &cube] {
        assert!(crossing_pairs(&[mesh], 9).is_empty());
        let n = mesh.triangles.len();
        assert!(crossing_pairs(&[mesh, mesh], usize::MAX).len() >= n);
    }
    let inner = sphere.transform(&Affine::about(Mat3::IDENTITY * 0.5, Vec3::ZERO));
    assert!(crossing_pairs(&[&sphere, &inner], 9).is_empty());
}

#[test]
fn the_tree_misses_nothing() {
    // A cloud of triangles over common corners, with degenerate ones and repetitions among them.
    let mut rng = Rng::new(5, 0, 0);
    let mut coordinate = || (rng.next_f64() * 16.0).floor() / 4.0;
    let positions: Vec<_> =
        (0..150).map(|_| vec3(coordinate(), coordinate(), coordinate())).collect();
    let triangles = (0..300_u32).map(|i| [i % 150, (i * 7 + i / 150) % 150, (i * 31 + 5) % 150]);
    let cloud = Mesh::new(positions, triangles.collect()).unwrap();
    let found = crossing_pairs(&[&cloud], usize::MAX);
    let mut expected = Vec::new();
    for i in 0..300_u32 {
        for j in i + 1..300 {
            let of =
                |k: u32| Mesh { triangles: vec![cloud.triangles[k as usize]], ..cloud.clone() };
            if !crossing_pairs(&[&of(i), &of(j)], 1).is_empty() {
                expected.push([(0, i), (0, j)]);
            }
        }
    }
    assert!(expected.len() > 1000);
    assert_eq!(found, expected);
    // A few of them, when a few are asked for.
    let few = crossing_pairs(&[&cloud], 7);
    assert!(few.len() == 7 && few.iter().all(|pair| expected.contains(pair)));
    assert!(crossing_pairs(&[&cloud], 0).is_empty());
}

/// Whether no plane separates two triangles strictly: of those along a face, along an edge of each,
/// or upright on a face along its edge, one does when any does. Exact for small integers.
fn inseparable(t: [Vec3; 3], u: [Vec3; 3]) -> bool {
    let edges = |[a, b, c]: [Vec3; 3]| [b - a, c - b, a - c];
    let (e, f) = (edges(t), edges(u));
    let normals = [e[0].cross(e[1]), f[0].cross(f[1])];
    let mut axes = normals.to_vec();
    axes.extend(e.iter().flat_map(|e| f.iter().map(|f| e.cross(*f))));
    axes.extend(e.iter().map(|e| e.cross(normals[0])));
    axes.extend(f.iter().map(|f| f.cross(normals[1])));
    axes.iter().all(|axis| {
        let reach = |t: [Vec3; 3]| {
            let heights = t.map(|p| axis.dot(p));
            (
                heights.iter().copied().fold(f64::INFINITY, f64::min),
                heights.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            )
        };
        let ((low, high), (lower, higher)) = (reach(t), reach(u));
        low <= higher && lower <= high
    })
}

#[test]
fn separating_planes_agree() {
    let mut rng = Rng::new(6, 0, 0);
    let mut random = |flat: bool| {
        let mut c = || (rng.next_f64() * 6.0).floor();
        [(); 3].map(|()| if flat { vec3(c(), c(), 1.0) } else { vec3(c(), c(), c()) })
    };
    let (mut crossing, mut clear) = (0, 0);
    for trial in 0..40_000 {
        let (t, u) = (random(trial % 2 == 0), random(trial % 4 == 0));
        let has_area = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a) != Vec3::ZERO;
        if !has_area(t) || !has_area(u) || t.iter().any(|p| u.contains(p)) {
            continue;
        }
        let [a, b] = [t, u].map(|t| Mesh::new(t.to_vec(), vec![[0, 1, 2]]).unwrap());
        let found = !crossing_pairs(&[&a, &b], 1).is_empty();
        assert_eq!(found, inseparable(t, u), "{t:?} {u:?}");
        *if found { &mut crossing } else { &mut clear } += 1;
    }
    assert!(crossing > 5000 && clear > 5000, "{crossing} {clear}");
}

#[test]
fn nonsense_meets_nothing() {
    let mut bad = triangle(FLOOR);
    bad.positions[1].x = f64::NAN;
    assert!(crossing_pairs(&[&bad, &triangle(FLOOR)], 9).is_empty());
    assert!(crossing_segments(&[&bad, &triangle(FLOOR)]).is_empty());
    bad.triangles[0] = [0, 2, 7];
    assert!(crossing_pairs(&[&bad, &triangle(FLOOR)], 9).is_empty());
    assert!(crossing_segments(&[&bad, &triangle(FLOOR)]).is_empty());
    assert!(crossing_pairs(&[], 9).is_empty());
}

/// How long the segments are along which surfaces pass through each other.
fn length_of_crossings(surfaces: &[&Mesh]) -> f64 {
    let found = crossing_segments(surfaces);
    let mut inside = 0;
    for s in &found {
        let tangent = (s.ends[1] - s.ends[0]).normalize();
        for ((surface, triangles), across) in s.surfaces.iter().zip(s.triangles).zip(s.across) {
            for (triangle, across) in triangles.into_iter().zip(across) {
                // The ends are on the triangle, and it goes on from them.
                let mesh = surfaces[*surface as usize];
                let [g1, g2] = mesh.barycentric_gradients(triangle);
                let [a, b, c] = mesh.triangle(triangle);
                let normal = (b - a).cross(c - a).normalize();
                // Corners count as on a plane within a millionth.
                assert!(across.dot(tangent).abs() < 1e-9 && across.dot(normal).abs() < 1e-5);
                assert!((across.length() - 1.0).abs() < 1e-12);
                let on = |x: Vec3, near: f64| {
                    let (u, v) = (g1.dot(x - a), g2.dot(x - a));
                    u > -near && v > -near && u + v < 1.0 + near
                };
                assert!(s.ends.iter().all(|x| on(*x, 1e-5) && normal.dot(*x - a).abs() < 1e-6));
                let middle = (s.ends[0] + s.ends[1]) * 0.5;
                let beside = middle + across * (1e-4 * (s.ends[1] - s.ends[0]).length());
                // A line may be nearer to an edge than that.
                assert!(on(beside, 1e-3));
                inside += u32::from(on(beside, 0.0));
            }
        }
    }
    assert!(inside >= 3 * found.len() as u32);
    found.iter().map(|s| (s.ends[1] - s.ends[0]).length()).sum()
}

fn placed(mesh: &Mesh, size: Vec3, translation: Vec3) -> Mesh {
    mesh.transform(&Affine { linear: Mat3::diagonal(size), translation })
}

fn floor(cells: u32) -> Mesh {
    placed(&procedural::grid(cells, cells), vec3(2.0, 2.0, 1.0), Vec3::ZERO)
}

/// A ball in a floor is cut along a circle, however edges of the two lie to each other.
#[test]
fn a_ball_in_a_floor_is_cut_along_a_circle() {
    for cells in [1, 2, 7, 32] {
        for by in [-0.3, -3e-8, 0.0, 1e-7, 4e-7, 0.01, 0.6] {
            let circle = core::f64::consts::TAU * f64::sqrt(1.0 - by * by);
            for ball in [procedural::icosphere(4), procedural::uv_sphere(48)] {
                let ball = placed(&ball, vec3(1.0, 1.0, 1.0), vec3(0.0, 0.0, by));
                let length = length_of_crossings(&[&floor(cells), &ball]);
                assert!((length / circle - 1.0).abs() < 0.01, "{cells} {by}: {length} {circle}");
                let again = length_of_crossings(&[&ball, &floor(cells)]);
                assert!((length - again).abs() < 1e-9, "{cells} {by}: {length} {again}");
            }
        }
    }
}

/// What only touches has no such segments: a block on a floor, the walls of a room, a body beside itself.
#[test]
fn what_rests_does_not_pass_through() {
    let block = |bottom: f64| {
        placed(&procedural::cube(), vec3(0.4, 0.3, 0.5), vec3(0.1, 0.2, 0.5 + bottom))
    };
    for cells in [1, 2, 10] {
        let floor = floor(cells);
        assert_eq!(length_of_crossings(&[&floor, &block(0.0)]), 0.0);
        assert_eq!(length_of_crossings(&[&floor, &block(1e-8)]), 0.0);
        assert_eq!(length_of_crossings(&[&floor, &block(-1e-8)]), 0.0);
        assert_eq!(length_of_crossings(&[&floor, &block(1e-3)]), 0.0);
        // Sunk, it meets the floor all around.
        let perimeter = 2.0 * (0.8 + 0.6);
        let sunk = length_of_crossings(&[&floor, &block(-1e-3)]);
        assert!((sunk - perimeter).abs() < 1e-9, "{sunk}");
    }
    let [cube, ball] = [procedural::cube(), procedural::icosphere(3)];
    assert_eq!(length_of_crossings(&[&cube]), 0.0);
    assert_eq!(length_of_crossings(&[&ball, &ball.clone()]), 0.0);
    // A wall that stands on an edge of the floor, and one that goes through along it.
    let wall = |low: f64| triangle([[0.0, -1.0, low], [0.0, 1.0, low], [0.0, 0.0, 1.0]]);
    assert_eq!(length_of_crossings(&[&floor(2), &wall(0.0)]), 0.0);
    let through = length_of_crossings(&[&floor(2), &wall(-1.0)]);
    assert!((through - 1.0).abs() < 1e-9, "{through}");
}

/// Where two triangles cross, exactly, there is a segment, unless it is very short.
#[test]
fn segments_are_where_triangles_cross() {
    let mut rng = Rng::new(3, 0, 0);
    let mut point = || vec3(rng.next_f64(), rng.next_f64(), rng.next_f64());
    let mut crossed = 0;
    for _ in 0..2000 {
        let [t, u] = [0; 2].map(|_| {
            let corners = [point(), point(), point()];
            Mesh::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap()
        });
        let exact = !crossing_pairs(&[&t, &u], 1).is_empty();
        let length = length_of_crossings(&[&t, &u]);
        assert!(exact || length == 0.0);
        crossed += usize::from(exact);
        assert!(!exact || length > 1e-6, "{t:?} {u:?}");
    }
    assert!(crossed > 200, "{crossed}");
}
