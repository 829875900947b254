mod slide;

use alloc::vec::Vec;
use core::f64::consts::PI;

use drt_math::testing::{SIGNIFICANCE, sphere_chi_square, z_score};
use drt_math::{Affine, Dual, Mat3, Moments, Real, Rgb, Rng, Vec3, vec3};

use crate::model::emitter::{Emitter, EmitterError, EmitterGradient, EmitterTangent};

const STRENGTH: Rgb = Rgb::new(1.0, 2.0, 3.0);

fn degrees(cutoff_angle: f64, beam_width: f64) -> Emitter {
    Emitter::Spot {
        position: vec3(1.0, 2.0, 3.0),
        direction: vec3(3.0, -2.0, -4.0),
        intensity: STRENGTH,
        cutoff_angle: cutoff_angle.to_radians(),
        beam_width: beam_width.to_radians(),
    }
    .checked()
    .unwrap()
}

fn random_vec(rng: &mut Rng) -> Vec3 {
    vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) * 2.0 - Vec3::splat(1.0)
}

fn random_colour(rng: &mut Rng) -> Rgb {
    Rgb::from(random_vec(rng).to_array()).abs()
}

/// A spot whose falloff covers most directions, a point, or a directional light.
fn random_delta(rng: &mut Rng) -> Emitter {
    let [position, direction] = [random_vec(rng), random_vec(rng)];
    let strength = random_colour(rng);
    let emitter = match (rng.next_f64() * 4.0) as u32 {
        0 => Emitter::Point { position, intensity: strength },
        1 => Emitter::Directional { direction, irradiance: strength },
        _ => Emitter::Spot {
            position,
            direction,
            intensity: strength,
            cutoff_angle: 0.999 * PI,
            beam_width: 0.3 * rng.next_f64(),
        },
    };
    emitter.checked().unwrap()
}

fn random_tangent(rng: &mut Rng) -> EmitterTangent {
    EmitterTangent {
        strength: random_colour(rng),
        position: random_vec(rng),
        direction: random_vec(rng),
        cutoff_angle: rng.next_f64(),
        beam_width: rng.next_f64(),
        rotation: Vec3::ZERO,
    }
}

/// Direction, distance and value that `sample_direction` gives in Mitsuba 3.9.1, single precision.
#[test]
fn light_is_that_of_mitsuba() {
    let position = vec3(1.0, 2.0, 3.0);
    let default = degrees(
        Emitter::DEFAULT_CUTOFF_ANGLE.to_degrees(),
        Emitter::DEFAULT_CUTOFF_ANGLE.to_degrees() * Emitter::DEFAULT_BEAM_FRACTION,
    );
    let wide = degrees(35.0, 5.0);
    let point = Emitter::Point { position, intensity: STRENGTH };
    for (emitter, y, w, distance, red) in [
        (&default, 0.0, [-0.557086, 0.37139067, 0.74278134], 5.385164737701416, 0.03448276),
        (&default, 0.8, [-0.58343244, 0.23337297, 0.7779099], 5.141983985900879, 0.03782149),
        (&default, 1.2, [-0.59246445, 0.1579905, 0.7899526], 5.063595294952393, 0.03900157),
        (&default, 1.6, [-0.59808916, 0.07974522, 0.7974522], 5.015974521636963, 0.02203919),
        (&default, 2.5, [-0.59702235, -0.09950373, 0.7960298], 5.024937629699707, 0.0),
        (&wide, 1.2, [-0.59246445, 0.1579905, 0.7899526], 5.063595294952393, 0.02897672),
        (&point, 1.2, [-0.59246445, 0.1579905, 0.7899526], 5.063595294952393, 0.03900157),
    ] {
        let incident = emitter.incident(vec3(4.0, y, -1.0)).unwrap();
        assert!((incident.w - Vec3::from(w)).max_abs() < 1e-6);
        assert!((incident.distance - distance).abs() < 1e-6);
        let error = incident.value - STRENGTH * red;
        assert!(error.max_abs() < 1e-6, "{emitter:?} {incident:?}");
    }
    let sun = Emitter::Directional { direction: vec3(1.0, 2.0, -3.0), irradiance: STRENGTH };
    let incident = sun.checked().unwrap().incident(vec3(4.0, 1.2, -1.0)).unwrap();
    assert!((incident.w - vec3(-0.26726127, -0.53452253, 0.8017838)).max_abs() < 1e-7);
    assert_eq!((incident.value, incident.distance), (STRENGTH, f64::INFINITY));
}

/// The definition for any scalar, for flows inside the falloff; the number is `adjoint · value`.
struct Definition<T> {
    strength: Rgb<T>,
    position: Vec3<T>,
    direction: Vec3<T>,
    cutoff_angle: T,
    beam_width: T,
}

impl<T: Real> Definition<T> {
    fn at(&self, kind: &Emitter, x: Vec3<T>, adjoint: Rgb) -> T {
        let weight = |c: Rgb<T>| c.r * adjoint.r + c.g * adjoint.g + c.b * adjoint.b;
        if matches!(kind, Emitter::Directional { .. }) {
            return weight(self.strength);
        }
        let d = x - self.position;
        let value = weight(self.strength) / d.length_squared();
        if matches!(kind, Emitter::Point { .. }) {
            return value;
        }
        let theta = d.normalize().dot(self.direction.normalize()).acos();
        if theta.re() < self.beam_width.re() {
            return value;
        }
        value * (self.cutoff_angle - theta) / (self.cutoff_angle - self.beam_width)
    }
}

#[test]
fn gradients_are_those_of_duals() {
    type D = Dual<f64, 14>;
    let mut rng = Rng::new(1, 0, 0);
    for _ in 0..500 {
        let emitter = random_delta(&mut rng);
        let x = random_vec(&mut rng) * 2.0;
        let incident = emitter.incident(x).unwrap();
        let adjoint = random_colour(&mut rng);
        let (point, gradient) = incident.gradient(adjoint);

        let v = |v: Vec3, i| {
            vec3(D::variable(v.x, i), D::variable(v.y, i + 1), D::variable(v.z, i + 2))
        };
        let (direction, cutoff, beam) = match emitter {
            Emitter::Spot { direction, cutoff_angle, beam_width, .. } => {
                (direction, cutoff_angle, beam_width)
            }
            _ => (Vec3::Z, 1.0, 0.0),
        };
        let strength = v(Vec3::from(emitter.strength().to_array()), 3);
        let dual = Definition {
            strength: Rgb::new(strength.x, strength.y, strength.z),
            position: v(emitter.position().unwrap_or_default(), 6),
            direction: v(direction, 9),
            cutoff_angle: D::variable(cutoff, 12),
            beam_width: D::variable(beam, 13),
        }
        .at(&emitter, v(x, 0), adjoint);
        let e = dual.eps;
        let value = incident.value.dot(adjoint);
        assert!((value - dual.re).abs() < 1e-10 * value.abs());

        let d = |i: usize| vec3(e[i], e[i + 1], e[i + 2]);
        let expected = EmitterGradient {
            strength: Rgb::new(e[3], e[4], e[5]),
            position: d(6),
            direction: d(9),
            cutoff_angle: e[12],
            beam_width: e[13],
            rotation: Vec3::ZERO,
        };
        let scale = 1e-10 * e.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
        assert!((point - d(0)).max_abs() < scale, "{point:?} {expected:?}");
        assert!((gradient.position - expected.position).max_abs() < scale);
        assert!((gradient.direction - expected.direction).max_abs() < scale);
        assert!((gradient.strength - expected.strength).max_abs() < scale);
        assert!((gradient.cutoff_angle - expected.cutoff_angle).abs() < scale);
        assert!((gradient.beam_width - expected.beam_width).abs() < scale);
    }
}

#[test]
fn rates_and_gradients_are_transposes() {
    let mut rng = Rng::new(2, 0, 0);
    let close = |a: f64, b: f64| (a - b).abs() < 1e-12 * (1.0 + a.abs());
    for _ in 0..500 {
        let emitter = random_delta(&mut rng);
        let x_rate = random_vec(&mut rng);
        let tangent = random_tangent(&mut rng);
        let adjoint = random_colour(&mut rng);
        let incident = emitter.incident(random_vec(&mut rng) * 2.0).unwrap();
        let (point, gradient) = incident.gradient(adjoint);
        let rate = incident.rate(x_rate, &tangent).dot(adjoint);
        assert!(close(rate, point.dot(x_rate) + gradient.dot(&tangent)));

        let flow_rate = x_rate.reject(incident.w);
        let (flow, gradient) = incident.emission.gradient(adjoint);
        let rate = incident.emission.rate(flow_rate, &tangent).dot(adjoint);
        assert!(close(rate, flow.dot(flow_rate) + gradient.dot(&tangent)));
    }
}

#[test]
fn falloff_is_flat_inside_and_outside_and_continuous_between() {
    let spot = degrees(40.0, 25.0);
    let Emitter::Spot { direction, .. } = spot else { unreachable!() };
    let side = direction.cross(Vec3::X).normalize();
    let red = |angle: f64| {
        let (s, c) = angle.to_radians().sin_cos();
        spot.emission(direction * c + side * s)
    };
    for (angle, value) in
        [(0.0, 1.0), (24.9, 1.0), (25.0 + 1e-7, 1.0), (32.5, 0.5), (40.0 - 1e-7, 0.0), (90.0, 0.0)]
    {
        assert!((red(angle).value.r - value).abs() < 1e-7);
    }
    for angle in [0.0, 10.0, 41.0, 180.0] {
        let (flow, gradient) = red(angle).gradient(Rgb::ONE);
        assert_eq!((flow, gradient.direction), (Vec3::ZERO, Vec3::ZERO));
    }
    // The hard cone jumps, the cone with a tip at its axis does not.
    assert!(spot.is_continuous() && degrees(20.0, 0.0).is_continuous());
    assert!(!degrees(20.0, 20.0).is_continuous());
    let (flow, _) = degrees(20.0, 0.0).emission(direction).gradient(Rgb::ONE);
    assert_eq!(flow, Vec3::ZERO);
}

#[test]
fn velocities_and_property_rates_are_finite_differences() {
    let mut rng = Rng::new(3, 0, 0);
    let h = 1e-5;
    let numbers = |e: &Emitter| -> Vec<f64> {
        let direction = match *e {
            Emitter::Spot { direction, .. } | Emitter::Directional { direction, .. } => direction,
            _ => Vec3::ZERO,
        };
        let angles = match *e {
            Emitter::Spot { cutoff_angle, beam_width, .. } => [cutoff_angle, beam_width],
            _ => [0.0; 2],
        };
        let position = e.position().unwrap_or_default();
        let strength = e.strength().to_array();
        [strength, position.to_array(), direction.to_array()]
            .concat()
            .into_iter()
            .chain(angles)
            .collect()
    };
    let flat = |t: &EmitterTangent| -> Vec<f64> {
        let strength = t.strength.to_array();
        [strength, t.position.to_array(), t.direction.to_array()]
            .concat()
            .into_iter()
            .chain([t.cutoff_angle, t.beam_width])
            .collect()
    };
    let compare = |at: &dyn Fn(f64) -> Emitter, tangent: &EmitterTangent| {
        let (plus, minus) = (numbers(&at(h)), numbers(&at(-h)));
        for ((p, m), rate) in plus.iter().zip(minus).zip(flat(tangent)) {
            let difference = (p - m) / (2.0 * h);
            assert!((difference - rate).abs() < 1e-8 * (1.0 + rate.abs()), "{difference} {rate}");
        }
    };
    for _ in 0..100 {
        let emitter = random_delta(&mut rng);
        let field = Affine {
            linear: Mat3 { cols: [0; 3].map(|_| random_vec(&mut rng)) },
            translation: random_vec(&mut rng),
        };
        let moved = |theta| emitter.moved(&Affine::IDENTITY.plus(&field.times(theta))).unwrap();
        compare(&moved, &emitter.velocity(&field));

        let colour = random_colour(&mut rng);
        for (name, rate) in [
            (emitter.strength_name(), colour),
            ("cutoff_angle", Rgb::splat(2.0)),
            ("beam_width", Rgb::splat(-3.0)),
        ] {
            let Ok(value) = emitter.property(name) else { continue };
            let changed = |theta| emitter.with_property(name, value + rate * theta).unwrap();
            compare(&changed, &emitter.property_tangent(name, rate).unwrap());
        }
    }
}

#[test]
fn distant_and_area_light_stays_where_it_is() {
    let field = Affine { linear: Mat3::skew(Vec3::X), translation: Vec3::Y };
    for emitter in [Emitter::Area { radiance: STRENGTH }, Emitter::Constant { radiance: STRENGTH }]
    {
        assert!(emitter.velocity(&field).is_zero());
        assert_eq!(emitter.moved(&Affine::translation(Vec3::X)), Ok(emitter.clone()));
        assert_eq!(emitter.emission(Vec3::Z).value, STRENGTH);
        assert!(!emitter.is_delta() && emitter.incident(Vec3::ZERO).is_none());
        assert!(emitter.sample_flow([0.5; 2]).is_none() && emitter.flow_pdf(Vec3::Z) == 0.0);
    }
    let point = Emitter::Point { position: Vec3::X, intensity: STRENGTH };
    assert!(point.incident(Vec3::X).is_none());
}

#[test]
fn flow_samples_follow_their_density_and_carry_the_power() {
    let mut rng = Rng::new(4, 0, 0);
    let point = Emitter::Point { position: Vec3::ZERO, intensity: STRENGTH };
    for emitter in [point, degrees(20.0, 15.0), degrees(120.0, 0.0), degrees(50.0, 50.0)] {
        let samples: Vec<_> =
            (0..50_000).map(|_| emitter.sample_flow(rng.next_2d()).unwrap()).collect();
        let flows = samples.iter().map(|s| s.flow);
        assert!(sphere_chi_square(flows, |w| emitter.flow_pdf(w)) > SIGNIFICANCE);
        let power: Moments =
            samples.iter().map(|s| emitter.emission(s.flow).value.mean() / s.pdf).collect();
        let expected = emitter.power(1.0);
        // The estimate of a light without falloff has no variance, only rounding.
        let exact = (power.mean() / expected - 1.0).abs() < 1e-12;
        assert!(exact || z_score(&power, expected).abs() < 4.0, "{power:?} {expected}");
        assert!(power.standard_error() < 0.01 * expected);
        if let Emitter::Spot { cutoff_angle, beam_width, .. } = emitter
            && beam_width < cutoff_angle
        {
            // A full cone, as if there were no falloff, is a fault.
            let full = 2.0 * PI * (1.0 - cutoff_angle.cos()) * STRENGTH.mean();
            assert!(z_score(&power, full).abs() > 4.0);
        }
    }
}

/// The solid angle of narrow cones, against (b² + bc + c²)/6, and across the series' limit.
#[test]
fn narrow_cones_keep_their_power() {
    let mean = |b, c| degrees(c, b).power(1.0) / (2.0 * PI * STRENGTH.mean());
    for scale in [1e-4, 1e-6] {
        let [b, c] = [2.0 * scale, 3.0 * scale].map(f64::to_radians);
        let expected = (b * b + b * c + c * c) / 6.0;
        assert!((mean(2.0 * scale, 3.0 * scale) / expected - 1.0).abs() < 1e-9);
    }
    for width in [0.0199_f64, 0.0201] {
        let [b, c] = [0.7, 0.7 + width];
        let expected = 1.0 - (c.sin() - b.sin()) / (c - b);
        assert!((mean(b.to_degrees(), c.to_degrees()) / expected - 1.0).abs() < 1e-12);
    }
}

#[test]
fn unusable_emitters_are_named() {
    let zero = Emitter::Directional { direction: Vec3::ZERO, irradiance: STRENGTH };
    assert_eq!(zero.checked(), Err(EmitterError::ZeroDirection("directional")));
    let nan = Emitter::Constant { radiance: Rgb::new(1.0, f64::NAN, 1.0) };
    assert_eq!(nan.checked(), Err(EmitterError::NotFinite { kind: "constant", what: "radiance" }));
    let far = Emitter::Point { position: Vec3::X * f64::INFINITY, intensity: STRENGTH };
    assert_eq!(far.checked(), Err(EmitterError::NotFinite { kind: "point", what: "position" }));
    for (cutoff_angle, beam_width) in
        [(0.0, 0.0), (1.0, 1.1), (1.0, -0.1), (3.2, 1.0), (f64::NAN, 0.5), (1.0, f64::NAN)]
    {
        let spot = Emitter::Spot {
            position: Vec3::ZERO,
            direction: Vec3::X,
            intensity: STRENGTH,
            cutoff_angle,
            beam_width,
        };
        assert!(matches!(spot.checked(), Err(EmitterError::Cone { .. })));
    }
    let spot = degrees(20.0, 15.0);
    assert_eq!(spot.moved(&Affine::ZERO), Err(EmitterError::Flattened("spot")));
    assert!(matches!(
        spot.property("fov"),
        Err(EmitterError::UnknownProperty { kind: "spot", .. })
    ));
    let uneven = spot.with_property("cutoff_angle", STRENGTH);
    assert_eq!(uneven, Err(EmitterError::NotScalar("cutoff_angle")));
    let message = alloc::format!("{}", zero.property("radiance").unwrap_err());
    assert_eq!(message, "a directional emitter has no property `radiance`; it has irradiance");
}
