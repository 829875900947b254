//! Edges seen from one vertex of each path, or from every vertex: the same derivatives.

use crate::common::*;
use drt_estimators::{EstimatorKind, Layer, Session, Settings, Term, Unattended, agreement};
use drt_math::{Vec3, vec3};
use drt_motion::GeometryChange;

fn grows() -> GeometryChange {
    GeometryChange::Scale { factor: Vec3::splat(1.0), pivot: vec3(0.5, -0.3, 0.1) }
}

/// Edges seen from first vertices, and from later ones.
fn edges(every_vertex: bool, seed: u64) -> [Layer; 2] {
    let mut scene = fog();
    // What lights the fog from outside is path space's, or has no edges.
    scene.emitters.retain(|e| e.id.as_deref() != Some("sun") && e.id.as_deref() != Some("bulb"));
    let settings = Settings {
        estimator: EstimatorKind::Radiative,
        every_vertex,
        terms: true,
        seed,
        ..Settings::default()
    };
    let parameters = [parameter("ball", 0.0, vec![moves("ball", grows())])];
    let mut session = Session::new(&scene, &parameters, &settings).expect("a valid scene");
    session.run(1 << 13, &Unattended);
    let derivative = session.rendering().derivatives.swap_remove(0);
    [Term::Direct, Term::Indirect].map(|term| {
        let found = derivative.terms.iter().find(|(t, _)| *t == term);
        found.expect("a term").1.clone()
    })
}

#[test]
fn one_vertex_stands_for_all() {
    let (one, all) = (edges(false, 1), edges(true, 2));
    for (one, all) in one.iter().zip(&all) {
        let found = agreement(one, all, None);
        assert!(found.agrees, "{found:?}");
        let [a, b] = [one, all].map(|l| [l.total.mean.r, l.total.stderr.r]);
        let error = a[1].hypot(b[1]);
        assert!((a[0] - b[0]).abs() < 4.0 * error, "{a:?} {b:?}");
        // A vertex left out, or its chance, would be seen.
        assert!(0.25 * b[0].abs() > 4.0 * error, "{a:?} {b:?}");
    }
}
