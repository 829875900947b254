//! The motion inside a medium chosen from that of its boundary.

mod common;

use common::*;
use drt_math::{Affine, Rng, Vec3};
use drt_motion::{SurfaceMotion, VolumeMotion, inside_motion};

#[test]
fn the_inside_follows_a_boundary_that_moves_as_one() {
    let mut rng = Rng::new(50, 0, 0);
    let field = random_affine(&mut rng);
    let (affine, other) = (SurfaceMotion::Affine(field), random_affine(&mut rng));
    let other = SurfaceMotion::Affine(other);
    let rest = SurfaceMotion::Rest;
    let still = SurfaceMotion::Affine(Affine::ZERO);
    let vertices =
        SurfaceMotion::Vertices { positions: random_vecs(&mut rng, 3).into(), normals: None };

    let choice = |boundary: &[&SurfaceMotion]| {
        let inside = inside_motion(boundary);
        (inside.motion, inside.flux)
    };
    assert_eq!(choice(&[]), (VolumeMotion::Static, false));
    assert_eq!(choice(&[&rest, &still]), (VolumeMotion::Static, false));
    assert_eq!(choice(&[&affine, &affine]), (VolumeMotion::Affine(field), false));
    for mixed in [[&affine, &rest], [&rest, &affine], [&affine, &other], [&vertices, &vertices]] {
        assert_eq!(choice(&mixed), (VolumeMotion::Static, true));
    }
    assert!(VolumeMotion::Static.is_rest() && VolumeMotion::Affine(Affine::ZERO).is_rest());
    let jet = VolumeMotion::Static.jet(Vec3::X);
    assert_eq!((jet.u, jet.j_dot), (Vec3::ZERO, 0.0));
}
