use drt_estimators::surface::{Bsdf, Distribution};
use drt_math::Rgb;

use super::{old_scene, refused, scene};

fn bsdf(kind: &str, inside: &str) -> Bsdf {
    scene(&format!("<bsdf type=\"{kind}\">{inside}</bsdf>")).bsdfs.remove(0).item
}

#[test]
fn diffuse_and_its_colours() {
    let color = |inside: &str| match bsdf("diffuse", inside) {
        Bsdf::Diffuse(d) => d.reflectance,
        _ => panic!(),
    };
    assert_eq!(color(""), Rgb::splat(0.5));
    let three = Rgb::new(0.1, 0.2, 0.3);
    assert_eq!(color(r#"<rgb name="reflectance" value="0.1, 0.2, 0.3"/>"#), three);
    assert_eq!(color(r#"<rgb name="reflectance" value="0.1 0.2 0.3"/>"#), three);
    assert_eq!(color(r#"<rgb name="reflectance" value="0.4"/>"#), Rgb::splat(0.4));
    assert_eq!(color(r#"<spectrum name="reflectance" value="0.4"/>"#), Rgb::splat(0.4));
    assert_eq!(color(r#"<float name="reflectance" value="0.4"/>"#), Rgb::splat(0.4));
    let property = |inside: &str| format!("<bsdf type=\"diffuse\">\n{inside}</bsdf>");
    for (inside, part) in [
        (r#"<rgb name="reflectance" value="0.1 0.2"/>"#, "one number or three"),
        (r#"<rgb name="reflectance" value="nan"/>"#, "finite number"),
        (r#"<rgb name="reflectance" value="-1"/>"#, "reflectance"),
        (r##"<rgb name="reflectance" value="#ffffff"/>"##, "finite number"),
        (r#"<spectrum name="reflectance" value="400:1, 700:2"/>"#, "sampled spectra"),
        (r#"<spectrum name="reflectance" value="1, 1, 1"/>"#, "need an <rgb>"),
        (r#"<texture name="reflectance" type="bitmap"/>"#, "must be a <rgb>"),
        (r#"<rgb name="diffuse_reflectance" value="1"/>"#, "which takes reflectance"),
    ] {
        refused(&property(inside), &[part]);
    }
}

#[test]
fn colours_of_old_files() {
    let color = |inside: &str| match old_scene(&format!("<bsdf type=\"diffuse\">{inside}</bsdf>"))
        .bsdfs
        .remove(0)
        .item
    {
        Bsdf::Diffuse(d) => d.reflectance,
        _ => panic!(),
    };
    let three = Rgb::new(0.1, 0.2, 0.3);
    assert_eq!(color(r#"<spectrum name="reflectance" value="0.1, 0.2, 0.3"/>"#), three);
    assert_eq!(color(r#"<rgb name="diffuseReflectance" value="0.1 0.2 0.3"/>"#), three);
    assert_eq!(color(r##"<rgb name="reflectance" value="#ff0033"/>"##), Rgb::new(1.0, 0.0, 0.2));
    let gray = color(r##"<srgb name="reflectance" value="#808080"/>"##);
    assert!((gray.r - 0.215_860_5).abs() < 1e-6 && gray.r == gray.b);
}

#[test]
fn phong() {
    let Bsdf::Phong(p) = bsdf("phong", "") else { panic!() };
    assert_eq!((p.reflectance, p.specular_reflectance), (Rgb::splat(0.5), Rgb::splat(0.2)));
    assert_eq!(p.exponent, 30.0);
    let inside = r#"<rgb name="diffuse_reflectance" value="0.1"/><float name="exponent" value="5"/>
                    <rgb name="specular_reflectance" value="0.3"/>"#;
    let Bsdf::Phong(p) = bsdf("phong", inside) else { panic!() };
    assert_eq!((p.reflectance.r, p.specular_reflectance.g, p.exponent), (0.1, 0.3, 5.0));
}

#[test]
fn rough_conductor() {
    let Bsdf::RoughConductor(c) = bsdf("roughconductor", "") else { panic!() };
    assert_eq!((c.alpha, c.eta, c.k), (0.1, Rgb::ZERO, Rgb::ONE));
    assert_eq!(c.distribution, Distribution::Beckmann);
    let inside = r#"<rgb name="eta" value="0.2 0.9 1.1"/><rgb name="k" value="3.9 2.4 2.1"/>
                    <string name="distribution" value="ggx"/><float name="alpha_u" value="0.3"/>
                    <float name="alpha_v" value="0.3"/><boolean name="sample_visible" value="true"/>"#;
    let Bsdf::RoughConductor(c) = bsdf("roughconductor", inside) else { panic!() };
    assert_eq!((c.alpha, c.eta.g, c.k.b), (0.3, 0.9, 2.1));
    assert_eq!(c.distribution, Distribution::Ggx);
    for (inside, part) in [
        (r#"<string name="material" value="Cu"/>"#, "material `Cu`"),
        (r#"<string name="distribution" value="phong"/>"#, "expected beckmann, ggx"),
        (r#"<float name="alpha_u" value="0.3"/>"#, "`alpha_u` and `alpha_v`"),
        (
            r#"<float name="alpha_u" value="0.3"/><float name="alpha_v" value="0.2"/>"#,
            "anisotropic",
        ),
    ] {
        refused(&format!("<bsdf type=\"roughconductor\">{inside}</bsdf>"), &[part]);
    }
}

#[test]
fn rough_dielectric() {
    let eta = |inside: &str| match bsdf("roughdielectric", inside) {
        Bsdf::RoughDielectric(d) => d.eta,
        _ => panic!(),
    };
    assert!((eta("") - 1.504_183_3).abs() < 1e-6);
    let water = r#"<string name="int_ior" value="water"/>"#;
    assert!((eta(water) - 1.332_630_8).abs() < 1e-6);
    let both = r#"<float name="int_ior" value="1"/><float name="ext_ior" value="1.5"/>"#;
    assert_eq!(eta(both), 1.0 / 1.5);
    let old =
        old_scene(r#"<bsdf type="roughdielectric"><float name="intIOR" value="1.5"/></bsdf>"#);
    assert!(matches!(&old.bsdfs[0].item, Bsdf::RoughDielectric(d) if d.eta == 1.5 / 1.000_277));
    let same = r#"<bsdf type="roughdielectric"><float name="int_ior" value="1.000277"/></bsdf>"#;
    refused(same, &["eta"]);
    let cheese = r#"<bsdf type="roughdielectric"><string name="int_ior" value="cheese"/></bsdf>"#;
    refused(cheese, &["`int_ior` is `cheese`", "bk7"]);
}

#[test]
fn two_sided() {
    let one = bsdf("twosided", "<bsdf type=\"diffuse\"/>");
    assert!(matches!(one, Bsdf::TwoSided(t) if t.back.is_none()));
    let s = scene(
        r#"<bsdf type="phong" id="p"/>
           <bsdf type="twosided"><bsdf type="diffuse"/><ref id="p"/></bsdf>"#,
    );
    let Bsdf::TwoSided(t) = &s.bsdfs[1].item else { panic!() };
    assert!(matches!((&t.front, &t.back), (Bsdf::Diffuse(_), Some(Bsdf::Phong(_)))));
    refused("<bsdf type=\"twosided\"/>", &["one or two bsdfs inside, found 0"]);
    refused("<bsdf type=\"twosided\"><bsdf type=\"null\"/></bsdf>", &["null"]);
    refused("<bsdf type=\"plastic\"/>", &["`plastic` is not supported", "diffuse"]);
}
