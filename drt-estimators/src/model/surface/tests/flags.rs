use drt_math::Mat3;

use crate::model::surface::model::Flags;
use crate::model::surface::tests::*;

/// What the values of a BSDF say against flags; `None` where they agree.
fn contradiction(bsdf: &Bsdf, flags: Flags) -> Option<&'static str> {
    let (mut rng, n) = (Rng::new(47, 0, 0), normal());
    let turn = Mat3::rotation(n, 1.1);
    for _ in 0..400 {
        let wo = random_direction(&mut rng);
        let drawn = bsdf.sample(wo, n, random_3d(&mut rng), Given::Wo).map(|s| s.w);
        let single = bsdf.sample_specular(wo, n, rng.next_f64(), Given::Wo);
        if let Some(single) = single {
            match (flags.smooth, flags.straight, single.straight) {
                (_, false, true) => return Some("light goes straight on"),
                (false, _, false) => return Some("light goes into single directions"),
                _ => {}
            }
        }
        for wi in [Some(random_direction(&mut rng)), drawn, single.map(|s| s.w)] {
            let Some(wi) = wi else { continue };
            let value = bsdf.eval(wo, wi, n);
            let dark = value.is_zero();
            let [o, i] = [n.dot(wo), n.dot(wi)];
            if flags.black && !dark {
                return Some("light is scattered");
            }
            if flags.black_from_behind && o < 0.0 && i < 0.0 && !dark {
                return Some("light is scattered from behind");
            }
            if !flags.transmissive && o * i < 0.0 && !dark {
                return Some("light is scattered through the surface");
            }
            let turned = bsdf.eval(turn * wo, turn * wi, n);
            let scale = value.max_abs().max(turned.max_abs());
            if !flags.oriented && (turned - value).max_abs() > 1e-7 * scale {
                return Some("directions along the surface are told apart");
            }
        }
    }
    None
}

#[test]
fn flags_are_those_of_values() {
    for bsdf in every_kind() {
        assert_eq!(contradiction(&bsdf, bsdf.flags()), None, "{bsdf:?}");
    }
}

/// What a model would answer that states one thing less.
#[test]
fn missing_flags_are_rejected() {
    let glass = Bsdf::RoughDielectric(glass(Distribution::Ggx, 0.3, 1.5));
    let pane = Bsdf::ThinDielectric(ThinDielectric::default());
    let ward = Bsdf::Ward(Ward { alpha: [0.2, 0.5], ..Ward::default() });
    let varnish = Bsdf::Plastic(smooth_plastic(1.5));
    let grey = Bsdf::Diffuse(Diffuse::default());
    let wrong = [
        (&grey, Flags { black: true, ..grey.flags() }),
        (&glass, Flags { black_from_behind: true, ..glass.flags() }),
        (&glass, Flags { transmissive: false, ..glass.flags() }),
        (&varnish, Flags { smooth: false, ..varnish.flags() }),
        (&pane, Flags { straight: false, ..pane.flags() }),
        (&ward, Flags { oriented: false, ..ward.flags() }),
    ];
    for (bsdf, flags) in wrong {
        assert!(contradiction(bsdf, flags).is_some(), "{bsdf:?}: {flags:?}");
    }
}
