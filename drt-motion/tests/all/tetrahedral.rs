//! Velocities carried by tetrahedra, against the transpose.

use crate::common::*;
use drt_geom::{Mesh, TetrahedralizeInput, procedural, tetrahedralize};
use drt_math::{Affine, Mat3, Rng, Vec3, vec3};
use drt_motion::SurfaceMotion;
use drt_motion::interior::{Carrier, TetrahedralField};
use drt_motion::surface::VertexGradient;
use drt_motion::volume::{VolumeAdjoint, VolumeJet};

fn sized(mesh: &Mesh, size: f64, at: Vec3) -> Mesh {
    mesh.transform(&Affine { linear: Mat3::IDENTITY * size, translation: at })
}

/// A plate whose vertices are a little rounded, a block over it whose bottom is at a height, and a ball
/// that touches nothing.
fn bodies(height: f64) -> [Mesh; 3] {
    let upright = Mat3::rotation(Vec3::X, -core::f64::consts::FRAC_PI_2) * 2.0;
    let place = Affine { linear: upright, translation: vec3(0.0, -1.0, 0.0) };
    [
        procedural::grid(2, 2).transform(&place),
        sized(&procedural::cube(), 0.4, vec3(0.1, height - 0.6, 0.0)),
        sized(&procedural::icosphere(1), 0.5, vec3(-0.5, 1.0, 0.3)),
    ]
}

const LIGHT: Vec3 = Vec3 { x: 1.2, y: 0.4, z: -0.3 };

fn field(bodies: &[Mesh]) -> TetrahedralField {
    let surfaces: Vec<&Mesh> = bodies.iter().collect();
    let input = TetrahedralizeInput { surfaces: &surfaces, points: &[LIGHT], margin: 0.5 };
    let mut made = tetrahedralize(&input).unwrap();
    made.remove_flat(&surfaces);
    TetrahedralField::new(made).unwrap()
}

fn wobble(rng: &mut Rng, mesh: &Mesh) -> SurfaceMotion {
    let positions = random_vecs(rng, mesh.positions.len()).into();
    SurfaceMotion::Vertices { positions, normals: None }
}

/// The pairing of random adjoints with the jets of a motion, and of their gradient with the motion.
fn sides(
    rng: &mut Rng,
    bodies: &[Mesh],
    field: &TetrahedralField,
    motions: &[SurfaceMotion],
    light: Vec3,
) -> [f64; 2] {
    let carriers: Vec<Carrier<'_>> =
        bodies.iter().zip(motions).map(|(mesh, motion)| Carrier { mesh, motion }).collect();
    let velocities = field.velocities(&carriers, &[light]);
    let mut gradient = vec![Vec3::ZERO; field.mesh().positions.len()];
    let mut forward = 0.0;
    for _ in 0..500 {
        let place = field.place(random_vec(rng) * 2.0);
        let adjoint = VolumeAdjoint { u: random_vec(rng), j: random_vec(rng).x };
        let VolumeJet { u, j_dot } = place.jet(&velocities);
        forward += u.dot(adjoint.u) + j_dot * adjoint.j;
        place.scatter(&adjoint, &mut gradient);
    }
    let mut to: Vec<Option<VertexGradient>> = bodies
        .iter()
        .zip(motions)
        .map(|(mesh, motion)| (!motion.is_rest()).then(|| VertexGradient::zeros(mesh)))
        .collect();
    let mut surfaces: Vec<_> = bodies.iter().zip(to.iter_mut().map(Option::as_mut)).collect();
    let mut points = [(light != Vec3::ZERO).then_some(Vec3::ZERO)];
    field.gather(gradient, &mut surfaces, &mut points);
    let of_surfaces = to
        .iter()
        .zip(bodies)
        .zip(motions)
        .filter_map(|((g, mesh), motion)| Some(g.as_ref()?.dot(mesh, motion)));
    [forward, of_surfaces.sum::<f64>() + points[0].map_or(0.0, |g| g.dot(light))]
}

#[track_caller]
fn assert_equal([forward, reverse]: [f64; 2]) {
    assert!((forward - reverse).abs() <= 1e-12 * forward.abs().max(1.0), "{forward} {reverse}");
}

#[test]
fn gathering_is_the_transpose() {
    let mut rng = Rng::new(50, 0, 0);
    let bodies = bodies(0.2);
    let field = field(&bodies);
    assert!(field.contacts().is_empty());
    for round in 0..20 {
        // Some rest.
        let motions: Vec<SurfaceMotion> = (0..3)
            .map(|i| match round % 4 {
                r if r == i => SurfaceMotion::Rest,
                _ if round % 2 == 0 => SurfaceMotion::Affine(random_affine(&mut rng)),
                _ => wobble(&mut rng, &bodies[i]),
            })
            .collect();
        let light = if round % 3 == 0 { Vec3::ZERO } else { random_vec(&mut rng) };
        assert_equal(sides(&mut rng, &bodies, &field, &motions, light));
    }
}

/// What touches is carried by what moves; bodies that move alike count as one.
#[test]
fn gathering_where_surfaces_touch() {
    let mut rng = Rng::new(51, 0, 0);
    let bodies = bodies(0.0);
    let field = field(&bodies);
    assert_eq!(field.contacts(), [[0, 1]]);
    let affine = SurfaceMotion::Affine(random_affine(&mut rng));
    let alike = [affine.clone(), affine, wobble(&mut rng, &bodies[2])];
    assert_equal(sides(&mut rng, &bodies, &field, &alike, Vec3::X));
    let translation = vec3(0.3, 0.0, -0.2);
    let slides = SurfaceMotion::Affine(Affine { linear: Mat3::ZERO, translation });
    let one = [SurfaceMotion::Rest, slides.clone(), SurfaceMotion::Rest];
    assert_equal(sides(&mut rng, &bodies, &field, &one, Vec3::ZERO));
    // Each as it likes: no linear map does what suits both.
    let back = SurfaceMotion::Affine(Affine { linear: Mat3::ZERO, translation: -translation });
    let [forward, reverse] =
        sides(&mut rng, &bodies, &field, &[back, slides, SurfaceMotion::Rest], Vec3::ZERO);
    assert!((forward - reverse).abs() > 1e-3 * forward.abs());
}

/// A body that leaves its plate leaves it, or part of itself, behind; one that slides, or stands a
/// little above it, leaves nothing.
#[test]
fn who_is_left_behind() {
    let moves = |translation| SurfaceMotion::Affine(Affine { linear: Mat3::ZERO, translation });
    for (height, velocity, leaves) in [
        (0.0, Vec3::Y, true),
        (0.0, vec3(0.3, -0.5, 0.1), true),
        (0.0, vec3(0.3, 0.0, -0.2), false),
        (0.2, Vec3::Y, false),
    ] {
        let bodies = bodies(height);
        let field = field(&bodies);
        let motions = [SurfaceMotion::Rest, moves(velocity), SurfaceMotion::Rest];
        let carriers: Vec<Carrier<'_>> =
            bodies.iter().zip(&motions).map(|(mesh, motion)| Carrier { mesh, motion }).collect();
        let velocities = field.velocities(&carriers, &[Vec3::ZERO]);
        let left = field.left_behind(&velocities, &carriers);
        assert_eq!(!left.is_empty(), leaves, "{velocity:?}: {left:?}");
        assert!(left.iter().all(|s| *s < 2), "{left:?}");
    }
}

/// On a surface the field is that of the surface, whichever way its flat faces are cut into triangles.
#[test]
fn surfaces_are_followed_everywhere() {
    let mut rng = Rng::new(17, 0, 0);
    let body = |angle: f64| {
        let turned = Mat3::rotation(vec3(0.3, 1.0, 0.2).normalize(), angle);
        let place = Affine { linear: turned * 0.8, translation: Vec3::ZERO };
        procedural::cube().transform(&place)
    };
    let mut worst: f64 = 0.0;
    for angle in [0.0, 0.4, 1.0, 2.2] {
        let mesh = body(angle);
        let motion = wobble(&mut rng, &mesh);
        let field = field(core::slice::from_ref(&mesh));
        let carrier = Carrier { mesh: &mesh, motion: &motion };
        let velocities = field.velocities(&[carrier], &[Vec3::ZERO]);
        for triangle in 0..mesh.triangles.len() as u32 {
            for _ in 0..20 {
                let [b, c] = rng.next_2d();
                let bary = if b + c > 1.0 { [1.0 - b, 1.0 - c] } else { [b, c] };
                let at = drt_motion::SurfacePoint { triangle, bary };
                let [p, q, r] = mesh.triangle(triangle);
                let x = p * (1.0 - bary[0] - bary[1]) + q * bary[0] + r * bary[1];
                let off = field.place(x).jet(&velocities).u - motion.velocity(&mesh, &at);
                worst = worst.max(off.max_abs());
            }
        }
        assert!(worst < 1e-9, "{angle}: off by {worst}");
    }
}
