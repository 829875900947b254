//! What two speeds count for.

use drt_math::{Vec3, vec3};
use drt_motion::SurfacePoint;

use crate::terms::flux::reservoir::{MediumSide, Speed};
use crate::world::vertex::MaterialPoint;

fn side(alongs: [Vec3; 2]) -> MediumSide {
    let at = SurfacePoint { triangle: 0, bary: [0.3; 2] };
    let point = MaterialPoint { shape: 0, at };
    let speeds = alongs.map(|along| Some(Speed { point, t: 1.0, along }));
    MediumSide { medium: 0, front: true, fullness: 1.0, speeds }
}

/// The sides of a parallel layer cancel for a ray that is carried, not where they move by themselves.
#[test]
fn parallel_sides_cancel_for_rays_alone() {
    let n = vec3(0.3, -0.5, 0.7);
    let parallel = side([n, -n * (1.0 + 1e-15)]);
    assert_eq!(parallel.most(true), 0.0);
    assert!((parallel.most(false) - 2.0 * n.length()).abs() < 1e-12);
    let wedge = side([n, vec3(-0.3, 0.5, 0.0)]);
    assert!((wedge.most(true) - 0.7).abs() < 1e-12);
    assert!(wedge.most(false) > 1.0);
}
