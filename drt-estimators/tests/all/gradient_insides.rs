//! The inside does not matter: gradients are the same whether insides stay, the flux being added, or
//! move with tetrahedra; also where bodies touch, so that no field follows them.

use crate::common::*;
use drt_estimators::{InteriorMotion, Scene, Session, Settings, Target, Unattended, gradient};
use drt_math::{Rgb, Rng, Vec3, vec3};
use drt_motion::GeometryChange;

const SEEDS: u64 = 48;

/// Means over seeds, and their standard errors, of the gradient's products with velocities of a
/// shape's vertices.
struct Measured(Vec<[f64; 2]>);

impl Measured {
    fn new(scene: &Scene, kind: InteriorMotion, velocities: &[Vec<Vec3>]) -> Self {
        let target = scene.find("block").expect("a shape");
        let Target::Shape(shape) = target else { panic!("no shape") };
        let mut rng = Rng::new(5, 0, 0);
        let adjoint: Vec<Rgb> =
            (0..FILM[0] * FILM[1]).map(|_| Rgb::splat(0.5 + rng.next_f64())).collect();
        let insides = vec![(0, kind)];
        let products = (0..SEEDS).map(|seed| -> Vec<f64> {
            let settings = Settings { seed, insides: insides.clone(), ..Settings::default() };
            let g = gradient(scene, &[target], &settings, 256, &adjoint, &Unattended);
            let g = g.expect("a valid scene").vertices(scene, shape).expect("wanted");
            velocities.iter().map(|v| g.iter().zip(v).map(|(g, v)| g.dot(*v)).sum()).collect()
        });
        let products: Vec<Vec<f64>> = products.collect();
        let n = SEEDS as f64;
        let moments = (0..velocities.len()).map(|i| {
            let mean = products.iter().map(|p| p[i]).sum::<f64>() / n;
            let squares = products.iter().map(|p| (p[i] - mean) * (p[i] - mean)).sum::<f64>();
            [mean, (squares / (n * (n - 1.0))).sqrt()]
        });
        Self(moments.collect())
    }

    /// The largest difference to another, in standard errors.
    fn off(&self, other: &Self) -> f64 {
        let pairs = self.0.iter().zip(&other.0);
        pairs.map(|([a, e], [b, f])| (a - b).abs() / (e * e + f * f).sqrt()).fold(0.0, f64::max)
    }
}

/// Shifts along the axes, a turn, a stretch, and one corner by itself.
fn velocities(scene: &Scene) -> Vec<Vec<Vec3>> {
    let shape = scene.shapes.iter().find(|s| s.id.as_deref() == Some("block"));
    let positions = &shape.expect("a shape").mesh.positions;
    let of = |f: &dyn Fn(Vec3) -> Vec3| positions.iter().map(|p| f(*p)).collect::<Vec<_>>();
    let lowest = positions.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    vec![
        of(&|_| Vec3::X),
        of(&|_| Vec3::Y),
        of(&|_| Vec3::Z),
        of(&|p| vec3(p.z, 0.0, -p.x)),
        of(&|p| p * 0.5),
        of(&|p| if p.y == lowest && p.x > 0.1 && p.z > 0.0 { Vec3::Y } else { Vec3::ZERO }),
    ]
}

/// Where nothing scatters but fog, both kinds have finite variances.
fn agree_where(bottom: f64) {
    let scene = fog_with_a_block(bottom, 0.0);
    let velocities = velocities(&scene);
    let stays = Measured::new(&scene, InteriorMotion::Static, &velocities);
    let moves = Measured::new(&scene, InteriorMotion::Tetrahedral(None), &velocities);
    assert!(stays.off(&moves) < 4.0, "{}", stays.off(&moves));
    let larger = Measured(moves.0.iter().map(|[m, e]| [1.2 * m, *e]).collect());
    assert!(larger.off(&moves) > 4.0);
}

#[test]
fn a_block_in_the_air() {
    agree_where(-0.7);
}

#[test]
fn a_block_on_the_floor() {
    agree_where(-1.0);
}

/// A body that leaves what it stands on: no field follows both, and forward mode, too, adds the flux
/// through what is left behind.
#[test]
fn a_block_lifts_off() {
    let scene = fog_with_a_block(-1.0, 0.0);
    let up = moves("block", GeometryChange::Translate(Vec3::Y));
    let lift = parameter("lift", 0.0, vec![up]);
    let total = |kind: InteriorMotion| {
        let insides = vec![(0, kind)];
        let settings = Settings { seed: 3, insides, ..Settings::default() };
        let mut session = Session::new(&scene, core::slice::from_ref(&lift), &settings);
        let session = session.as_mut().expect("a valid scene");
        session.run(16384, &Unattended);
        let total = session.rendering().derivatives[0].total.total;
        (total.mean.g, total.stderr.g)
    };
    let (a, e) = total(InteriorMotion::Static);
    let (b, f) = total(InteriorMotion::Tetrahedral(None));
    let (off, error) = ((a - b).abs(), e.hypot(f));
    assert!(off < 4.0 * error, "{a} ± {e}, {b} ± {f}");
    assert!(error < 0.04 * a.abs(), "{e} and {f} of {a} is too much noise");
}
