//! Derivatives by all estimators beside each other, on scenes put together at random and on bodies across the borders of pixels.
//!
//! All of them, `DRT_COUNT` random scenes from number `DRT_FIRST` on (500 from 0), `DRT_SAMPLES` per pixel (512):
//! `cargo test --release -p drt-tests --test all -- --ignored random_scenes:: --nocapture`

use drt_estimators::EstimatorKind::{PathSpace, Radiative, Warped};
use drt_estimators::PathSampling::Bidirectional;
use drt_estimators::{Agreement, Tail};
use drt_tests::Result;
use drt_tests::matrix::Stage;
use drt_tests::matrix::estimators::{Effort, Method, Pair, Pairs, compare};
use drt_tests::matrix::filters::{BODIES, Body, FILTERS, LIGHTS, Light, bordered};
use drt_tests::matrix::random;

fn number(variable: &str, default: f64) -> f64 {
    std::env::var(variable).ok().and_then(|s| s.parse().ok()).unwrap_or(default)
}

/// At most `samples` per pixel, unless `DRT_SAMPLES` says otherwise.
fn effort(samples: u32) -> Effort {
    let samples = number("DRT_SAMPLES", f64::from(samples)) as u32;
    Effort { noise: 0.01, scale: 0.0, samples, seed: 0 }
}

/// What is in a scene, in a line.
fn contents(stage: &Stage) -> String {
    let scene = &stage.scene;
    let shapes = scene.shapes.iter().map(|s| {
        let id = s.id.as_deref().unwrap_or_default();
        let smooth = if s.mesh.normals.is_some() { " smooth" } else { "" };
        let bsdf = format!("{:?}", scene.bsdfs[s.bsdf].item);
        let bsdf = bsdf.split(['(', ' ']).next().unwrap_or_default();
        let b = s.mesh.bounds();
        let [low, high] = [b.min, b.max].map(|v| v.to_array().map(|c| (c * 100.0).round() / 100.0));
        format!("{id} ({}{smooth} {bsdf} {low:?} to {high:?})", s.mesh.triangles.len())
    });
    let lights = scene.emitters.iter().map(|e| format!("{:?}", e.item.emitter));
    let all: Vec<String> = shapes.chain(lights).collect();
    let sensor = &scene.sensors[0].item.sensor;
    format!(
        "{:?}, depth {:?}: {}",
        sensor.filter().kind(),
        scene.integrator.max_depth,
        all.join(", ")
    )
}

/// The comparisons of a stage, of each estimator that does not refuse it. Prints those that fail.
fn compared(name: &str, stage: Result<Stage>, methods: &[Method], effort: Effort) -> Vec<Pair> {
    let stage = stage.unwrap();
    let mut methods = methods.to_vec();
    methods.retain(|method| {
        let refusal = method.accepts(&stage).err();
        refusal.iter().for_each(|r| println!("{name}: {:?} refuses: {r}", method.0));
        refusal.is_none()
    });
    let pairs = compare(&stage, &methods, effort).unwrap();
    let failing: Vec<Pair> = pairs.iter().filter(|pair| !agrees(pair)).cloned().collect();
    if !failing.is_empty() {
        println!("{name}: {}{}", contents(&stage), Pairs(&failing));
    }
    pairs
}

/// Planted faults are judged where derivatives are known well enough to show them.
fn agrees(pair: &Pair) -> bool {
    pair.agreement.agrees && pair.scale.z() <= 4.0 && pair.non_finite == 0
}

/// Whether the program says of one of the two that single samples are much of its second moment, so that its errors are not to be trusted, and
/// the two disagree by no more than these may be off where such a sample is: in one block, and not as a whole.
fn is_told(pair: &Pair) -> bool {
    let Agreement { rms_z, max_z, .. } = pair.agreement;
    let as_a_whole = rms_z <= 1.3 && pair.scale.z() <= 4.0 && pair.non_finite == 0;
    pair.largest_share > Tail::HEAVY && as_a_whole && max_z < 6.0
}

/// The planted faults that the noise lets one see, and how many of them a comparison sees.
fn faults(pairs: &[Pair]) -> [usize; 2] {
    let clear = pairs.iter().flat_map(|pair| pair.faults.iter().filter(|f| f.must_be_seen));
    clear.fold([0; 2], |[all, seen], f| [all + 1, seen + usize::from(f.is_seen)])
}

fn assert_all_agree(pairs: &[Pair]) {
    let (told, failing): (Vec<&Pair>, Vec<&Pair>) =
        pairs.iter().filter(|pair| !agrees(pair)).partition(|pair| is_told(pair));
    let [planted, seen] = faults(pairs);
    let [all, told, failing] = [pairs.len(), told.len(), failing.len()];
    println!(
        "{all} derivatives, {failing} disagree, {told} with a heavy tail; {seen} of {planted} planted faults seen"
    );
    assert_eq!(failing, 0, "{failing} of {all} derivatives disagree");
    assert!(100 * told <= all, "{told} of {all} derivatives have a heavy tail");
    assert!(seen > 0 && seen == planted, "{seen} of {planted} planted faults seen");
}

fn at_borders(filters: &[usize], bodies: &[Body], lights: &[Light], effort: Effort) {
    let methods = [Radiative.into(), Warped.into()];
    let mut pairs = Vec::new();
    for filter in filters {
        for body in bodies {
            for light in lights {
                let name = format!("{:?}, {body:?}, {light:?}", FILTERS[*filter]);
                let stage = bordered(FILTERS[*filter], *body, *light);
                pairs.extend(compared(&name, stage, &methods, effort));
            }
        }
    }
    assert_all_agree(&pairs);
}

#[test]
fn what_is_seen_at_the_borders_of_box_filters() {
    at_borders(&[0], &[Body::Flat, Body::Smooth], &[Light::Point], effort(256));
}

#[test]
#[ignore = "minutes"]
fn every_filter_body_and_light() {
    at_borders(&[0, 1, 2, 3, 4], &BODIES, &LIGHTS, effort(2048));
}

fn at_random(numbers: std::ops::Range<u32>, effort: Effort) {
    let methods = [Radiative.into(), Warped.into(), Method(PathSpace, Bidirectional)];
    let mut pairs = Vec::new();
    for number in numbers {
        let name = format!("scene {number}");
        pairs.extend(compared(&name, random::scene(number), &methods, effort));
        if number % 50 == 49 {
            println!("{} scenes", number + 1);
        }
    }
    assert_all_agree(&pairs);
}

#[test]
fn four_random_scenes() {
    at_random(0..4, effort(128));
}

/// A sheet on a floor on which fog stands, too: its edge rests on the floor, and not on the fog's border.
#[test]
fn a_sheet_on_a_floor_where_fog_begins() {
    let stage = random::scene(148).map(|mut stage| {
        stage.cells.retain(|cell| cell.parameter.name == "first: moves");
        stage
    });
    assert_all_agree(&compared("scene 148", stage, &[Warped.into()], effort(2048)));
}

#[test]
#[ignore = "an hour"]
fn five_hundred_random_scenes() {
    let first = number("DRT_FIRST", 0.0) as u32;
    at_random(first..first + number("DRT_COUNT", 500.0) as u32, effort(512));
}
