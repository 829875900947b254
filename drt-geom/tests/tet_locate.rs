//! Point location in tetrahedral meshes, where it is hard.

mod common;

use common::tets::{at, jittered, placed, slivers, weights};
use common::{direction, point};
use drt_geom::{Aabb, TetLocator, TetMesh, TetMeshError, procedural, tet_barycentric};
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
#[test]
fn debug() {
    let mesh = slivers(4, 1e8, 2);
    let locator = TetLocator::new(&mesh).unwrap();
    let x = vec3(0.429775403703239, -0.5100018074298166, -0.4830146515976043);
    let mut v: Vec<_> = (0..mesh.tets.len() as u32)
        .map(|t| {
            let w = tet_barycentric(mesh.tet(t), x);
            (w.iter().fold(1.0, |a: f64, b| a.min(*b)), t, w)
        })
        .filter(|v| v.0 > -1e-3)
        .collect();
    v.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (m, t, w) in v.iter().take(10) {
        println!(
            "{m:e} {t} {w:?} g {:?} vol {:e}",
            locator.gradients(*t).map(|g| g.length()),
            mesh.volume(*t)
        );
    }
    for t in (0..mesh.tets.len() as u32)
        .filter(|t| mesh.tet(*t).iter().any(|v| (*v - x).length() < 1e-9))
    {
        println!(
            "{t} {:?} {:?} {:?} g {:?} vol {:e}",
            mesh.tets[t as usize],
            mesh.tet(t),
            tet_barycentric(mesh.tet(t), x),
            locator.gradients(t).map(|g| g.length()),
            mesh.volume(t)
        );
    }
    println!("{:?}", locator.locate(x, None));
}
