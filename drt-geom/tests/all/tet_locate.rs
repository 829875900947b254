//! Point location in tetrahedral meshes, where it is hard.

use crate::common::tets::{at, jittered, placed, slivers, weights};
use crate::common::{direction, point};
use drt_geom::{TetLocator, TetMesh, TetMeshError, tet_barycentric};
use drt_math::{Dual, Rng, Vec3, vec3};

/// Rounding of weights, and of the points made of them, per unit of a tetrahedron's condition.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// By how much the weights of a point may be off: rounding, of the point too, over the height.
fn condition(locator: &TetLocator, mesh: &TetMesh, tet: u32, x: Vec3) -> f64 {
    let [a, b, c, d] = mesh.tet(tet);
    let size = [b, c, d].iter().fold(0.0, |s, v| f64::max(s, (*v - a).max_abs()));
    let steepest = locator.gradients(tet).iter().fold(0.0, |s, g| f64::max(s, g.length()));
    1.0 + steepest * (size + x.max_abs())
}

/// Locates a point from scratch and from hints, and checks all that is promised.
fn check(locator: &TetLocator, mesh: &TetMesh, x: Vec3, hints: [u32; 2]) -> Result<f64, String> {
    let found = locator.locate(x, None).ok_or("lost")?;
    for hint in hints.map(Some) {
        if locator.locate(x, hint) != Some(found) {
            return Err(format!("another answer by hint {hint:?}"));
        }
    }
    let condition = condition(locator, mesh, found.tet, x);
    let tolerance = ROUNDING * condition;
    let sum: f64 = found.bary.iter().sum();
    if !found.bary.iter().all(|w| w.is_finite() && *w >= -tolerance) {
        return Err(format!("weights {:?}", found.bary));
    }
    if (sum - 1.0).abs() > 4.0 * f64::EPSILON * condition {
        return Err(format!("weights that sum to {sum}"));
    }
    let corners = mesh.tet(found.tet);
    let size = corners.iter().fold(0.0, |s, v| f64::max(s, (*v - corners[0]).max_abs()));
    let error = (at(corners, found.bary) - x).max_abs();
    let allowed = tolerance * size + ROUNDING * x.max_abs();
    if error > allowed {
        Err(format!("off by {error}, {allowed} allowed"))
    } else {
        Ok(error / allowed)
    }
}

#[test]
fn no_point_of_the_domain_is_lost() {
    let shapes = [jittered(4, 1), slivers(4, 1e8, 2), slivers(3, 1e4, 3)];
    let places = [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6), (1e-6, 1.0), (1e6, 1e6)];
    let mut total = 0;
    let mut worst = 0.0;
    for (i, shape) in shapes.iter().enumerate() {
        for (j, (scale, offset)) in places.into_iter().enumerate() {
            let mesh = placed(shape.clone(), scale, offset);
            // What rounding leaves of slivers is a mesh only where they are thicker than that.
            let thin = i == 1 && offset > scale;
            if !thin {
                mesh.validate().unwrap_or_else(|e| panic!("{i} {j}: {e}"));
            }
            let locator = TetLocator::new(&mesh).unwrap();
            let mut rng = Rng::new(4, i as u64, j as u32);
            for n in 0..7_000 {
                let count = mesh.tets.len() as u32;
                let tet = rng.next_u32() % count;
                let on = n % 4;
                let mut x = at(mesh.tet(tet), weights(on, &mut rng));
                if on == 3 {
                    x = mesh.positions[mesh.tets[tet as usize][n / 4 % 4] as usize];
                }
                if n % 8 >= 4 {
                    // Just off it, but not out of the domain.
                    let inward = (placed_center(scale, offset) - x) / scale;
                    let off = if n % 16 >= 8 { direction(&mut rng) } else { inward };
                    let moved = x + off * (1e-12 * scale);
                    let bounds = mesh.bounds();
                    x = if bounds.contains(moved) { moved } else { x };
                }
                let hints = [tet, rng.next_u32() % (count + 1)];
                total += 1;
                match check(&locator, &mesh, x, if thin { [u32::MAX; 2] } else { hints }) {
                    Ok(error) => worst = f64::max(worst, error),
                    Err(e) => panic!("{i} {j} {n}: {x:?} {e}"),
                }
            }
        }
    }
    println!("{total} points, largest error {worst} of that allowed");
    assert!(total >= 100_000 && worst > 1e-3);
}

fn placed_center(scale: f64, offset: f64) -> Vec3 {
    let one = TetMesh { positions: vec![Vec3::ZERO], tets: vec![] };
    placed(one, scale, offset).positions[0]
}
/// Velocities at a mesh's vertices, different everywhere.
fn velocities(mesh: &TetMesh) -> Vec<Vec3> {
    let mut rng = Rng::new(9, 0, 0);
    mesh.positions.iter().map(|_| point(&mut rng)).collect()
}

/// The interpolated velocity.
fn velocity(mesh: &TetMesh, u: &[Vec3], tet: u32, weights: [f64; 4]) -> Vec3 {
    at(mesh.tets[tet as usize].map(|v| u[v as usize]), weights)
}

#[test]
fn velocities_are_continuous_across_faces() {
    for (scale, offset) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e3)] {
        let mesh = placed(slivers(4, 1e8, 5), scale, offset);
        let locator = TetLocator::new(&mesh).unwrap();
        let neighbours = mesh.neighbours().unwrap();
        let u = velocities(&mesh);
        let mut torn = u.clone();
        torn[150] += Vec3::splat(1e-3);
        let mut rng = Rng::new(6, 0, 0);
        let mut faults = 0;
        for tet in 0..mesh.tets.len() as u32 {
            for (k, &across) in neighbours[tet as usize].iter().enumerate() {
                if across == drt_geom::NONE {
                    continue;
                }
                let corners = mesh.face(tet, k).map(|v| v as usize);
                let w = weights(0, &mut rng);
                let w = [w[0], w[1], w[2] + w[3]];
                let on_face = |f: &dyn Fn(usize) -> Vec3| {
                    (0..3).fold(Vec3::ZERO, |sum, i| sum + f(corners[i]) * w[i])
                };
                let x = on_face(&|v| mesh.positions[v]);
                let expected = on_face(&|v| u[v]);
                let found = locator.locate(x, Some(tet)).unwrap();
                let condition = condition(&locator, &mesh, found.tet, x);
                let jump = velocity(&mesh, &u, found.tet, found.bary) - expected;
                assert!(jump.max_abs() < ROUNDING * condition, "{tet} {across} {jump:?}");
                let jump = velocity(&mesh, &torn, found.tet, found.bary) - expected;
                faults += usize::from(jump.max_abs() > ROUNDING * condition);
            }
        }
        assert!(faults > 0, "a vertex that moves on its own goes unnoticed");
    }
}

#[test]
fn outside_of_the_domain_is_nowhere() {
    for (scale, offset) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e3)] {
        // A cube with a cavity.
        let mut mesh = slivers(4, 1e6, 7);
        let middle =
            |t: &[u32; 4]| t.iter().fold(Vec3::ZERO, |s, v| s + mesh.positions[*v as usize] * 0.25);
        let solid = mesh.tets.iter().copied().filter(|t| middle(t).max_abs() > 0.4).collect();
        mesh.tets = solid;
        let mesh = placed(mesh, scale, offset);
        let locator = TetLocator::new(&mesh).unwrap();
        let boundary: Vec<_> = TetMesh::boundary_faces(&mesh.neighbours().unwrap()).collect();
        let mut rng = Rng::new(8, 0, 0);
        for _ in 0..3_000 {
            let (tet, k) = boundary[rng.next_u32() as usize % boundary.len()];
            let [a, b, c] = mesh.face(tet, k).map(|v| mesh.positions[v as usize]);
            let out = (b - a).cross(c - a).normalize();
            let x = a * 0.3 + b * 0.3 + c * 0.4;
            let reach = 1e-9 * (scale + 1e-3 * offset);
            assert!(locator.locate(x, None).is_some());
            assert!(locator.locate(x - out * reach, Some(tet)).is_some());
            // Slivers at the cavity are thinner than that, and then it is the cavity's other side.
            let hint = Some(tet);
            assert_eq!(
                locator.locate(x + out * reach, hint),
                locator.locate(x + out * reach, None)
            );
            if (0..3).any(|i| out[i].abs() > 0.999) {
                let outside = x + out * reach;
                if !mesh.bounds().contains(outside) {
                    assert_eq!(locator.locate(outside, hint), None);
                }
            }
        }
        for x in [Vec3::splat(f64::NAN), vec3(f64::INFINITY, 0.0, 0.0), Vec3::splat(-1e300)] {
            assert_eq!((locator.locate(x, None), locator.locate(x, Some(0))), (None, None));
        }
        let cavity = placed_center(scale, offset);
        assert_eq!((locator.locate(cavity, None), locator.locate(cavity, Some(3))), (None, None));
    }
    let nothing = TetLocator::new(&TetMesh::default()).unwrap();
    assert_eq!(nothing.locate(Vec3::ZERO, Some(0)), None);
}

#[test]
fn slivers_inverted_by_rounding_are_passed_over() {
    // Steiner points on faces, of which rounding decides on which side they are.
    let mut mesh = jittered(4, 10);
    let mut rng = Rng::new(11, 0, 0);
    for tet in 0..mesh.tets.len() {
        let k = rng.next_u32() as usize % 4;
        if !rng.next_u32().is_multiple_of(4) {
            continue;
        }
        let mut w = weights(0, &mut rng);
        w[k] = 0.0;
        let sum: f64 = w.iter().sum();
        let x = at(mesh.tet(tet as u32), w.map(|w| w / sum));
        let corners = mesh.tets[tet];
        mesh.positions.push(x);
        for j in 0..4 {
            let mut part = corners;
            part[j] = mesh.positions.len() as u32 - 1;
            if j == k { mesh.tets[tet] = part } else { mesh.tets.push(part) }
        }
    }
    for (scale, offset) in [(1.0, 0.0), (1e-6, 0.0), (1.0, 1e6)] {
        let mut mesh = placed(mesh.clone(), scale, offset);
        let inverted = (0..mesh.tets.len() as u32).filter(|t| mesh.volume(*t) < 0.0).count();
        assert!(inverted > 10, "{inverted}");
        assert!(mesh.validate().is_err());
        let before = mesh.clone();
        assert_eq!(mesh.orient(), 0);
        mesh.tets.iter_mut().for_each(|t| t.swap(0, 1));
        assert_eq!(mesh.orient(), mesh.tets.len());
        assert_eq!(TetLocator::new(&mesh).err(), None);
        let locator = TetLocator::new(&before).unwrap();
        let no_hints = [u32::MAX; 2];
        for n in 0..10_000 {
            let tet = rng.next_u32() % before.tets.len() as u32;
            let x = at(before.tet(tet), weights(n % 4, &mut rng));
            check(&locator, &before, x, no_hints).unwrap_or_else(|e| panic!("{scale} {n}: {e}"));
        }
    }
}

#[test]
fn derivatives_of_weights_are_the_gradients() {
    let mesh = jittered(3, 12);
    let locator = TetLocator::new(&mesh).unwrap();
    let mut rng = Rng::new(13, 0, 0);
    for tet in 0..mesh.tets.len() as u32 {
        let x = at(mesh.tet(tet), weights(0, &mut rng));
        let moving = |k: usize| Dual::<f64, 3>::variable(x[k], k);
        let corners = mesh.tet(tet).map(|v| v.lift());
        let dual = tet_barycentric(corners, vec3(moving(0), moving(1), moving(2)));
        let found = locator.locate(x, None).unwrap();
        assert_eq!(found.tet, tet);
        for (i, g) in locator.gradients(tet).iter().enumerate() {
            assert!((dual[i].re - found.bary[i]).abs() < 1e-13);
            for k in 0..3 {
                assert!((dual[i].eps[k] - g[k]).abs() < 1e-10 * g.length());
            }
        }
    }
}

#[test]
fn inverted_tetrahedra_are_refused() {
    let mut mesh = jittered(2, 14);
    mesh.tets[17].swap(0, 3);
    let found = TetLocator::new(&mesh).err();
    assert!(matches!(found, Some(TetMeshError::Overlap { tets: [_, 17] })), "{found:?}");
    let mut mesh = jittered(2, 14);
    mesh.positions[13] = vec3(1.5, 0.2, 0.1);
    assert!(matches!(TetLocator::new(&mesh).err(), Some(TetMeshError::Inverted { .. })));
}
