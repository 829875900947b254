//! What is prepared once has the bits of what is prepared for one call.

use drt_estimators::{Control, Unattended};
use drt_math::Rgb;

use super::{PreparedJob, Samples, Unknown};
use crate::testing::{Folder, TETRAHEDRON};
use crate::{Overrides, read_job};

const SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="3"/></integrator>
    <sensor type="perspective">
      <transform name="to_world"><lookat origin="1, 1, 4" target="0.3, 0.3, 0" up="0, 1, 0"/></transform>
      <film type="hdrfilm"><integer name="width" value="6"/><integer name="height" value="5"/></film>
    </sensor>
    <shape type="obj" id="body"><string name="filename" value="body.obj"/></shape>
    <emitter type="constant" id="sky"/>
  </scene>"#;

const JOB: &str = r#"
    scene = "scene.xml"
    [estimator]
    kind = "path-space"
    boundary_spp = 6
    [[parameter]]
    name = "x"
    effect = [{ target = "body", translate = [1, 0, 0] }]
    [[parameter]]
    name = "light"
    effect = [{ target = "sky", property = "radiance", multiply = 1.0 }]
    [[parameter_group]]
    target = "body"
    vertices = "all"
"#;

const SAMPLES: Samples = Samples { spp: 4, seed: 3, sensor: 0 };

struct Prepared {
    job: PreparedJob,
    _folder: Folder,
}

fn prepared() -> Prepared {
    let folder = Folder::new();
    folder.file("body.obj", TETRAHEDRON);
    folder.file("scene.xml", SCENE);
    let path = folder.file("job.toml", JOB);
    let job = read_job(&path, &Overrides::default()).expect("a job");
    Prepared { job: PreparedJob::new(job).expect("no name twice"), _folder: folder }
}

/// The bits of everything that is computed.
fn all(job: &mut PreparedJob, samples: Samples) -> Vec<u64> {
    let adjoint: Vec<Rgb> = (0..30).map(|i| Rgb::splat(f64::from(i) - 12.0)).collect();
    let image = job.render(samples, &Unattended).expect("a scene").expect("all of it");
    let seen = job.derivatives(samples, &Unattended).expect("a scene").expect("all of it");
    let layers = seen.derivatives.iter().map(|d| &d.total).chain([&image.image]);
    let pixels = layers.flat_map(|layer| &layer.pixels).flat_map(|p| p.mean.to_array());
    let wanted = [Unknown::Group(0), Unknown::Parameter(1)];
    let gradient = job.gradient(&wanted, &adjoint, samples, &Unattended);
    let gradient = gradient.expect("a gradient").expect("all of it");
    assert_eq!(gradient.iter().map(Vec::len).collect::<Vec<_>>(), [12, 1]);
    pixels.chain(gradient.into_iter().flatten()).map(f64::to_bits).collect()
}

#[test]
fn what_was_done_before_does_not_matter() {
    let mut used = prepared();
    let (_, start) = used.job.values(Unknown::Group(0)).expect("vertices");
    let moved: Vec<f64> = start.iter().map(|v| 1.1 * v).collect();
    let changes: [(Unknown, &[f64]); 2] =
        [(Unknown::Group(0), &moved), (Unknown::Parameter(0), &[0.2])];
    let first = all(&mut used.job, SAMPLES);
    assert_ne!(all(&mut used.job, Samples { seed: 4, ..SAMPLES }), first);
    assert_ne!(all(&mut used.job, Samples { spp: 8, ..SAMPLES }), first);
    used.job.set(&changes).expect("vertices");
    let at_changes = all(&mut used.job, SAMPLES);
    assert_ne!(at_changes, first);
    let mut fresh = prepared();
    fresh.job.set(&changes).expect("vertices");
    assert_eq!(all(&mut fresh.job, SAMPLES), at_changes);
    used.job
        .set(&[(Unknown::Group(0), &start), (Unknown::Parameter(0), &[0.0])])
        .expect("as before");
    assert_eq!(all(&mut used.job, SAMPLES), first);
}

#[test]
fn what_cannot_be_set_changes_nothing() {
    let Prepared { mut job, _folder } = prepared();
    let first = all(&mut job, SAMPLES);
    let vertices = [0.5; 12];
    for wrong in [
        (Unknown::Group(0), &[0.5; 11][..]),
        (Unknown::Group(1), &[0.5]),
        (Unknown::Parameter(2), &[0.5]),
        (Unknown::Parameter(0), &[f64::NAN]),
        (Unknown::Parameter(0), &[0.1, 0.2]),
        // Light below nothing.
        (Unknown::Parameter(1), &[-2.0]),
    ] {
        let before = (Unknown::Group(0), &vertices[..]);
        assert!(job.set(&[before, (Unknown::Parameter(0), &[0.3]), wrong]).is_err(), "{wrong:?}");
        assert_eq!(all(&mut job, SAMPLES), first, "{wrong:?}");
    }
}

#[test]
fn what_is_cancelled_is_nothing_and_the_next_call_is_whole() {
    struct Never;
    impl Control for Never {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let Prepared { mut job, _folder } = prepared();
    let first = all(&mut job, SAMPLES);
    let adjoint = [Rgb::ONE; 30];
    assert!(job.render(SAMPLES, &Never).expect("a scene").is_none());
    assert!(job.derivatives(SAMPLES, &Never).expect("a scene").is_none());
    let wanted = [Unknown::Group(0)];
    assert!(job.gradient(&wanted, &adjoint, SAMPLES, &Never).expect("a scene").is_none());
    assert_eq!(all(&mut job, SAMPLES), first);
    assert!(job.gradient(&wanted, &adjoint[1..], SAMPLES, &Unattended).is_err());
    job.resize(0, [3, 2]).expect("a film");
    let image = job.render(SAMPLES, &Unattended).expect("a scene").expect("all of it");
    assert_eq!(image.image.size, [3, 2]);
}
