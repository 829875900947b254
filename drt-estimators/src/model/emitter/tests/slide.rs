//! Lights that throw pictures.

use alloc::sync::Arc;

use super::*;
use crate::model::emitter::Slide;
use crate::model::texture::{Bitmap, Texture};

/// Six columns and five rows of random colours, black at the border or not.
fn picture(border: f32) -> Texture {
    let mut rng = Rng::new(3, 0, 0);
    let texels = (0..30).map(|i| {
        let (x, y) = (i % 6, i / 6);
        let dim = if x == 0 || y == 0 || x == 5 || y == 4 { border } else { 1.0 };
        random_colour(&mut rng).to_array().map(|c| dim * (c as f32 + 0.1))
    });
    Texture::Bitmap(Bitmap::new([6, 5], texels.collect()).unwrap())
}

fn throwing(slide: Slide) -> Emitter {
    let frame = Mat3::rotation(vec3(0.48, 0.64, 0.6), 0.8);
    let position = vec3(0.3, -0.2, 0.5);
    let slide = Arc::new(slide);
    Emitter::Projector { position, frame, strength: STRENGTH, slide }.checked().unwrap()
}

fn all() -> [Emitter; 3] {
    [
        Slide::projector(Some(picture(0.0)), [0.7, 0.5]),
        Slide::projector(None, [0.7, 0.5]),
        Slide::spot(picture(1.0), 0.9, 0.2),
    ]
    .map(|slide| throwing(slide.unwrap()))
}

/// Points in the light, and not at the borders of texels.
fn lit(emitter: &Emitter, rng: &mut Rng) -> (Vec3, Vec3) {
    loop {
        let flow = emitter.sample_flow(rng.next_2d()).unwrap().flow;
        let x = emitter.position().unwrap() + flow * (0.5 + rng.next_f64());
        if emitter.incident(x).unwrap().value.mean() > 0.2 {
            return (x, flow);
        }
    }
}

#[test]
fn rates_and_gradients_are_differences() {
    let mut rng = Rng::new(7, 0, 0);
    let h = 1e-6;
    let mut checked = 0;
    for emitter in all() {
        for _ in 0..60 {
            let (x, _) = lit(&emitter, &mut rng);
            let (axis, shift, x_rate) =
                (random_vec(&mut rng), random_vec(&mut rng), random_vec(&mut rng));
            let field = Affine { linear: Mat3::skew(axis), translation: shift };
            let strength = random_colour(&mut rng);
            let tangent = EmitterTangent { strength, ..emitter.velocity(&field) };
            let at = |s: f64| {
                let linear = Mat3::rotation(axis.normalize(), axis.length() * s);
                let moved = emitter.moved(&Affine { linear, translation: shift * s }).unwrap();
                let name = moved.strength_name();
                let moved = moved.with_property(name, STRENGTH + strength * s).unwrap();
                moved.incident(x + x_rate * s).unwrap().value
            };
            let differences = [h, 2.0 * h].map(|h| (at(h) - at(-h)) * (0.5 / h));
            // Not across a kink.
            if (differences[0] - differences[1]).max_abs() > 1e-4 {
                continue;
            }
            checked += 1;
            let incident = emitter.incident(x).unwrap();
            let rate = incident.rate(x_rate, &tangent);
            let scale = 1.0 + rate.max_abs();
            assert!((rate - differences[0]).max_abs() < 1e-5 * scale, "{rate:?} {differences:?}");
            let adjoint = random_colour(&mut rng);
            let (point, gradient) = incident.gradient(adjoint);
            let found = point.dot(x_rate) + gradient.dot(&tangent);
            assert!((found - rate.dot(adjoint)).abs() < 1e-9 * scale);
        }
    }
    assert!(checked > 120, "{checked}");
}

#[test]
fn flow_follows_its_density_and_carries_the_power() {
    for emitter in all() {
        let mut rng = Rng::new(9, 0, 0);
        let mut power = Moments::default();
        for _ in 0..20_000 {
            let sample = emitter.sample_flow(rng.next_2d()).unwrap();
            assert!((emitter.flow_pdf(sample.flow) - sample.pdf).abs() < 1e-9 * sample.pdf);
            let value = emitter.emission(sample.flow).value;
            power.push(value.mean() / sample.pdf);
        }
        // Channels and texels correlate, and spots have round cones: it is about that.
        let ratio = power.mean() / emitter.power(1.0);
        assert!(ratio > 0.8 && ratio < 1.3, "{ratio}");
    }
    let [projector, white, _] = all();
    for e in [projector, white] {
        assert_eq!(e.flow_pdf(-e.sample_flow([0.3, 0.4]).unwrap().flow), 0.0);
    }
}

#[test]
fn light_that_jumps_is_known() {
    let [faded, white, spot] = all();
    assert!(faded.is_continuous() && !white.is_continuous() && spot.is_continuous());
    assert!(!throwing(Slide::projector(Some(picture(1.0)), [0.7, 0.5]).unwrap()).is_continuous());
    assert!(!throwing(Slide::spot(picture(0.0), 0.5, 0.5).unwrap()).is_continuous());
    let board = Texture::Checkerboard {
        colours: [Rgb::ONE, Rgb::ZERO],
        to_uv: crate::model::texture::UvMap::IDENTITY,
    };
    assert!(!throwing(Slide::spot(board, 0.5, 0.2).unwrap()).is_continuous());
}

#[test]
fn unusable_pictures_are_named() {
    for (slide, part) in [
        (Slide::projector(None, [0.0, 1.0]), "no size"),
        (Slide::projector(None, [f64::NAN, 1.0]), "no size"),
        (Slide::spot(picture(1.0), 1.6, 0.2), "< 90"),
        (Slide::spot(picture(1.0), 0.3, 0.4), "beam_width"),
        (Slide::spot(picture(-1.0), 0.3, 0.2), "negative"),
    ] {
        let message = slide.unwrap_err();
        assert!(message.contains(part), "{message}");
    }
    let flat = Emitter::Projector {
        position: Vec3::ZERO,
        frame: Mat3::ZERO,
        strength: Rgb::ONE,
        slide: Arc::new(Slide::projector(None, [1.0, 1.0]).unwrap()),
    };
    assert_eq!(flat.checked(), Err(EmitterError::ZeroDirection("projector")));
    let message = all()[1].property("intensity").unwrap_err();
    assert!(alloc::format!("{message}").contains("it has irradiance"));
}
