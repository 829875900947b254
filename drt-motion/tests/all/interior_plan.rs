//! Which field moves the inside of a medium, and that it meets what is around: rooms of open sheets above
//! all.

use std::sync::Arc;

use crate::common::*;
use drt_geom::{Mesh, TetrahedralizeError, procedural};
use drt_math::{Affine, Mat3, Rng, Vec3, vec3};
use drt_motion::interior::{
    BasisValues, InteriorError, InteriorMotion, InteriorPlan, InteriorPoint, SurroundingSurface,
    Surroundings, TetrahedraCache,
};
use drt_motion::{SurfaceMotion, SurfacePoint};

type Motions = Vec<(usize, SurfaceMotion)>;

fn placed(mesh: &Mesh, size: f64, at: Vec3) -> Mesh {
    mesh.transform(&Affine { linear: Mat3::IDENTITY * size, translation: at })
}

/// Six sheets, `part` of a cube's faces, each with the errors that turning it into its place leaves.
fn sheets(part: f64) -> Vec<Mesh> {
    use std::f64::consts::{FRAC_PI_2, PI};
    let turn = |mesh: &Mesh, axis: Vec3, angle: f64| {
        let linear = Mat3::rotation(axis, angle);
        mesh.transform(&Affine { linear, translation: Vec3::ZERO })
    };
    let side = placed(&procedural::rectangle(), part, -Vec3::Z);
    let [x, y] = [Vec3::X, Vec3::Y];
    let turns =
        [(x, 0.0), (x, PI), (x, FRAC_PI_2), (x, -FRAC_PI_2), (y, FRAC_PI_2), (y, -FRAC_PI_2)];
    let askew = vec3(0.3, 1.0, 0.2).normalize();
    turns.map(|(axis, a)| turn(&turn(&turn(&side, axis, a), askew, 0.7), askew, -0.7)).into()
}

/// Sheets and what may move in front of them.
struct Room {
    meshes: Vec<Arc<Mesh>>,
    motions: Vec<Motions>,
    points: Vec<InteriorPoint>,
}

impl Room {
    /// A ball turns, a lamp slides, the camera rests.
    fn new(mut meshes: Vec<Mesh>) -> Self {
        let mut motions: Vec<Motions> = meshes.iter().map(|_| Vec::new()).collect();
        meshes.push(placed(&procedural::icosphere(1), 0.3, vec3(-0.2, -0.1, 0.2)));
        let linear = Mat3::skew(vec3(0.3, 1.0, -0.5));
        motions.push(vec![(0, SurfaceMotion::Affine(Affine { linear, translation: Vec3::X }))]);
        meshes.push(placed(&procedural::rectangle(), 0.2, vec3(0.5, 0.4, -0.5)));
        let slides = Affine { translation: vec3(0.0, 0.7, 0.2), ..Affine::ZERO };
        motions.push(vec![(0, SurfaceMotion::Affine(slides))]);
        let eye = InteriorPoint { position: vec3(0.6, -0.5, 0.6), velocities: Vec::new() };
        let meshes = meshes.into_iter().map(Arc::new).collect();
        Self { meshes, motions, points: vec![eye] }
    }

    fn surroundings(&self) -> Surroundings<'_> {
        let surfaces = self.meshes.iter().zip(&self.motions);
        let surfaces =
            surfaces.map(|(mesh, motions)| SurroundingSurface { mesh, motions, scatters: true });
        Surroundings {
            parameters: 1,
            surfaces: surfaces.collect(),
            points: self.points.clone(),
            unbounded: false,
            multiple_scattering: true,
        }
    }

    fn plan(&self, asked: Option<&InteriorMotion>) -> Result<InteriorPlan, InteriorError> {
        self.surroundings().plan(asked, &mut TetrahedraCache::default())
    }

    /// The largest difference between the field and what is around, next to it.
    fn worst_miss(&self, plan: &InteriorPlan) -> f64 {
        let basis = plan.basis.as_ref().expect("several motions");
        let (_, velocity) = &plan.velocities[0];
        let mut values = BasisValues::default();
        let mut rng = Rng::new(95, 0, 0);
        let mut worst: f64 = 0.0;
        let mut miss = |x: Vec3, expected: Vec3| {
            basis.evaluate(x, &mut values);
            worst = worst.max((velocity.jet(x, &values).u - expected).max_abs());
        };
        for (mesh, motions) in self.meshes.iter().zip(&self.motions) {
            for triangle in 0..mesh.triangles.len() as u32 {
                for _ in 0..20 {
                    let [r, q] = rng.next_2d();
                    let (a, b) = (r.sqrt() * (1.0 - q), r.sqrt() * q);
                    let point = SurfacePoint { triangle, bary: [a, b] };
                    let [p0, p1, p2] = mesh.triangle(triangle);
                    let x = p0 * (1.0 - a - b) + p1 * a + p2 * b;
                    let motion = motions.first().map_or(&SurfaceMotion::Rest, |(_, m)| m);
                    miss(x + random_vec(&mut rng) * 1e-7, motion.velocity(mesh, &point));
                }
            }
        }
        for point in &self.points {
            miss(point.position, Vec3::ZERO);
        }
        worst
    }
}

#[test]
fn fields_meet_what_moves_in_rooms_of_sheets() {
    let without_a_wall: Vec<Mesh> = sheets(1.0).into_iter().skip(1).collect();
    for (name, walls) in
        [("rims meet", sheets(1.0)), ("gaps", sheets(0.8)), ("a wall missing", without_a_wall)]
    {
        let room = Room::new(walls);
        for asked in [
            None,
            Some(InteriorMotion::Blend),
            Some(InteriorMotion::Tetrahedral(None)),
            Some(InteriorMotion::MeanValue),
        ] {
            let plan = room.plan(asked.as_ref()).expect("any kind works");
            let worst = room.worst_miss(&plan);
            assert!(worst < 1e-4, "{name} {asked:?} {worst:e}");
            assert!(plan.flux_surfaces.is_empty() && plan.instead_of.is_none());
        }
        let plan = room.plan(Some(&InteriorMotion::Static)).expect("always right");
        let moving = room.meshes.len() - 2;
        assert!(plan.velocities.is_empty() && plan.basis.is_none());
        assert_eq!((plan.flux, plan.flux_surfaces), (vec![0], vec![moving, moving + 1]));
    }
}

/// Tetrahedra by TetGen carry the velocities of the surfaces as our own do; a program without TetGen says so.
#[test]
fn tetgen_fills_a_room_where_it_is_built_in() {
    let room = Room::new(vec![placed(&procedural::cube(), 1.0, Vec3::ZERO)]);
    let plan = room.plan(Some(&InteriorMotion::Tetgen));
    if cfg!(not(feature = "tetgen")) {
        assert_eq!(plan.err(), Some(InteriorError::NoTetgen));
        return;
    }
    let plan = plan.expect("TetGen fills it");
    let worst = room.worst_miss(&plan);
    assert!(worst < 1e-4 && plan.flux_surfaces.is_empty(), "{worst:e}");
    // What crosses is refused by name.
    let crossing = [Vec3::ZERO, vec3(0.3, 0.2, 0.1)].map(|at| placed(&procedural::cube(), 1.0, at));
    let error =
        Room::new(crossing.into()).plan(Some(&InteriorMotion::Tetgen)).expect_err("crosses");
    assert!(error.to_string().contains("faces cross"), "{error}");
}

#[test]
fn rims_may_end_on_edges_and_faces_up_to_rounding() {
    let sheet = |size: Vec3, at: Vec3| {
        let linear = Mat3::diagonal(size);
        procedural::rectangle().transform(&Affine { linear, translation: at })
    };
    let panels = [
        sheet(vec3(0.3, 1.0, 1.0), vec3(-0.7, 0.0, -1.0)),
        sheet(vec3(0.7, 1.0, 1.0), vec3(0.3, 0.0, -1.0)),
    ];
    let cases = [
        ("two panels for a wall", panels.to_vec(), 1),
        ("a partition", vec![sheet(vec3(1.0, 1.0, 1.0), vec3(0.0, 0.0, -0.6))], 0),
        ("a partition with doors", vec![sheet(vec3(0.4, 1.0, 1.0), vec3(0.1, 0.0, -0.6))], 0),
        ("a picture on a wall", vec![sheet(vec3(0.3, 0.2, 1.0), vec3(0.1, 0.05, -1.0))], 0),
        ("a block on a wall", vec![placed(&procedural::cube(), 0.15, vec3(0.1, 0.1, -0.85))], 0),
    ];
    for (name, more, replaced) in cases {
        let mut walls: Vec<Mesh> = sheets(1.0).into_iter().skip(replaced).collect();
        // With roundings of their own.
        let turn = |mesh: &Mesh, angle: f64| {
            let linear = Mat3::rotation(vec3(0.3, 1.0, 0.2).normalize(), angle);
            mesh.transform(&Affine { linear, translation: Vec3::ZERO })
        };
        walls.extend(more.iter().map(|mesh| turn(&turn(mesh, 1.1), -1.1)));
        let room = Room::new(walls);
        for asked in [InteriorMotion::Tetrahedral(None), InteriorMotion::MeanValue] {
            let plan = room.plan(Some(&asked)).expect("any kind works");
            let worst = room.worst_miss(&plan);
            assert!(worst < 1e-4 && plan.flux_surfaces.is_empty(), "{name} {asked:?} {worst:e}");
        }
    }
}

#[test]
fn one_affine_field_takes_everything() {
    let mut room = Room::new(sheets(1.0));
    let asked = Some(InteriorMotion::Affine);
    assert_eq!(room.plan(asked.as_ref()).err(), Some(InteriorError::NotAffine { parameter: 0 }));
    let field = Affine { linear: Mat3::diagonal(vec3(0.3, 0.1, -0.4)), translation: Vec3::Y };
    for motions in &mut room.motions {
        *motions = vec![(0, SurfaceMotion::Affine(field))];
    }
    // The camera stays behind.
    assert!(room.plan(asked.as_ref()).is_err() && room.surroundings().affine_fields().is_none());
    let eye = &mut room.points[0];
    eye.velocities = vec![(0, field.point(eye.position))];
    let plan = room.plan(asked.as_ref()).expect("one field");
    assert_eq!((plan.velocities[0].1.name(), plan.basis.is_some()), ("affine", false));
    assert_eq!(room.surroundings().affine_fields(), Some(vec![(0, field)]));
}

#[test]
fn surfaces_that_pass_through_each_other_have_no_tetrahedra() {
    // The floor is larger than the room, and passes through its walls.
    let mut walls = sheets(1.0);
    walls.push(placed(&procedural::rectangle(), 1.5, vec3(0.0, 0.0, 0.1)));
    let mut room = Room::new(walls);
    let asked = InteriorMotion::Tetrahedral(None);
    let error = room.plan(Some(&asked)).expect_err("no tetrahedra");
    let named = error.with_names(|s| format!("wall {s}"), |p| format!("p{p}"));
    assert!(
        matches!(error, InteriorError::Unfilled(TetrahedralizeError::Intersection { .. })),
        "{error}"
    );
    assert!(named.contains("of wall") && named.contains("intersect"), "{named}");
    // From both sides it is all one.
    assert!(room.plan(Some(&InteriorMotion::MeanValue)).is_ok());

    // Chosen: tetrahedra for what deforms, if there were any. Of few triangles, each counts by itself.
    let wobbles = |mesh: &Mesh| {
        let positions: Vec<Vec3> = mesh.positions.iter().map(|p| p.cross(Vec3::X) * p.z).collect();
        vec![(0, SurfaceMotion::Vertices { positions: positions.into(), normals: None })]
    };
    let [ball, lamp] = [room.meshes.len() - 2, room.meshes.len() - 1];
    room.motions[ball] = wobbles(&room.meshes[ball]);
    let plan = room.plan(None).expect("a choice");
    assert_eq!((plan.instead_of, plan.velocities[0].1.name()), (Some(error), "blend"));
    assert!(plan.flux.is_empty());
    // Of many, it is left to its flux; if nothing else moves, the inside rests.
    let fine = placed(&procedural::icosphere(4), 0.3, vec3(-0.2, -0.1, 0.2));
    room.meshes[ball] = Arc::new(fine);
    room.motions[ball] = wobbles(&room.meshes[ball]);
    room.motions[lamp].clear();
    let plan = room.plan(None).expect("a choice");
    assert!(plan.instead_of.is_some() && plan.velocities.is_empty());
    assert_eq!((plan.flux, plan.flux_surfaces), (vec![0], vec![ball]));
}
