use std::sync::Arc;

use drt_estimators::surface::{
    Bsdf, Distribution, Measured, MeasuredTables, Perturbation, Principled, RoughConductor,
};
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
    assert_eq!(color(r##"<rgb name="reflectance" value="#ff0033"/>"##), Rgb::new(1.0, 0.0, 0.2));
    let gray = color(r##"<srgb name="reflectance" value="#808080"/>"##);
    assert!((gray.r - 0.215_860_5).abs() < 1e-6 && gray.r == gray.b);
    // As a diffuse BSDF of Mitsuba 3.9.1 (scalar_rgb) holds it.
    let pairs =
        color(r#"<spectrum name="reflectance" value="400:0.1, 500:0.3, 600:0.9, 700:0.2"/>"#);
    assert!((pairs - Rgb::new(0.887_608_5, 0.562_839_4, 0.155_488_1)).max_abs() < 1e-6);
    let irregular = r#"<spectrum name="reflectance" type="irregular">
        <string name="wavelengths" value="400, 500, 600, 700"/>
        <string name="values" value="0.1, 0.3, 0.9, 0.2"/></spectrum>"#;
    assert_eq!(color(irregular), pairs);
    let uniform = "<texture name=\"reflectance\" type=\"uniform\"><float name=\"value\" value=\"0.3\"/></texture>";
    assert_eq!(color(uniform), Rgb::splat(0.3));
    let property = |inside: &str| format!("<bsdf type=\"diffuse\">\n{inside}</bsdf>");
    for (inside, part) in [
        (r#"<rgb name="reflectance" value="0.1 0.2"/>"#, "one number or three"),
        (r#"<rgb name="reflectance" value="nan"/>"#, "finite number"),
        (r#"<rgb name="reflectance" value="-1"/>"#, "reflectance"),
        (r##"<rgb name="reflectance" value="#fffff"/>"##, "#rrggbb"),
        (r#"<spectrum name="reflectance" value="400:1, 300:2"/>"#, "increasing wavelengths"),
        (r#"<spectrum name="reflectance" value="400:1, 2"/>"#, "pair of wavelength"),
        (r#"<spectrum name="reflectance" filename="no.spd"/>"#, "no file `no.spd`"),
        (r#"<spectrum name="reflectance" type="blackbody"/>"#, "`temperature` is missing"),
        (r#"<spectrum name="reflectance" type="laser"/>"#, "`laser` is not supported"),
        (r#"<spectrum name="reflectance" value="1, 1, 1"/>"#, "need an <rgb>"),
        (r#"<texture name="reflectance" type="bitmap"/>"#, "`filename` is missing"),
        (r#"<texture name="reflectance" type="marble"/>"#, "`marble` is not supported"),
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
    let copper = bsdf("roughconductor", r#"<string name="material" value="Cu"/>"#);
    assert!(matches!(copper, Bsdf::RoughConductor(c) if c.eta.g == 0.92375 && c.k.g == 2.45305));
    let old = old_scene(r#"<bsdf type="roughconductor"/>"#).bsdfs.remove(0).item;
    assert!(matches!(old, Bsdf::RoughConductor(c) if c.eta.g == 0.92375 * 1.000_277_f64.recip()));
    for (inside, part) in [
        (
            r#"<string name="material" value="cheese"/>"#,
            "`material` is `cheese`; expected none, a-C",
        ),
        (
            r#"<string name="material" value="Cu"/><rgb name="k" value="1"/>"#,
            "give `material`, or `eta` and `k`",
        ),
        (r#"<string name="distribution" value="phong"/>"#, "expected beckmann, ggx"),
        (r#"<float name="alpha_u" value="0.3"/>"#, "`alpha_u` and `alpha_v`"),
    ] {
        refused(&format!("<bsdf type=\"roughconductor\">{inside}</bsdf>"), &[part]);
    }
}

#[test]
fn anisotropic() {
    let uneven = r#"<float name="alpha_u" value="0.3"/><float name="alpha_v" value="0.2"/>"#;
    for kind in ["roughconductor", "roughdielectric"] {
        let Bsdf::Anisotropic(a) = bsdf(kind, uneven) else { panic!("{kind}") };
        assert_eq!((a.alpha, a.base.name()), ([0.3, 0.2], kind));
    }
    let squares = |name: &str| {
        format!(
            "<texture name=\"{name}\" type=\"checkerboard\"><float name=\"color0\" value=\"0.1\"/>\
             </texture>"
        )
    };
    let both = squares("alpha_u") + &squares("alpha_v");
    let Bsdf::Textured(t) = bsdf("roughconductor", &both) else { panic!() };
    assert!(matches!(t.bsdf, Bsdf::Anisotropic(_)) && t.textures.len() == 2);
    refused(&format!("<bsdf type=\"roughplastic\">{uneven}</bsdf>"), &["must be equal"]);
}

#[test]
fn principled() {
    let Bsdf::Principled(p) = bsdf("principled", "") else { panic!() };
    assert_eq!(*p, Principled::default());
    assert!((p.eta - 1.5).abs() < 1e-12);
    let inside = r#"<rgb name="base_color" value="0.2 0.8 0.1"/><float name="eta" value="1"/>
                    <float name="spec_trans" value="0.5"/><float name="metallic" value="0.25"/>
                    <float name="main_specular_sampling_rate" value="2"/>"#;
    let Bsdf::Principled(p) = bsdf("principled", inside) else { panic!() };
    assert_eq!((p.base_color.g, p.spec_trans, p.metallic, p.eta), (0.8, 0.5, 0.25, 1.001));
    let Bsdf::PrincipledThin(p) =
        bsdf("principledthin", r#"<float name="diff_trans" value="1.5"/>"#)
    else {
        panic!()
    };
    assert_eq!((p.diff_trans, p.eta), (1.5, 1.5));
    for (inside, part) in [
        (r#"<float name="eta" value="1.4"/><float name="specular" value="0.4"/>"#, "not both"),
        (r#"<float name="roughness" value="1.5"/>"#, "\"roughness\" is 1.5"),
        (r#"<float name="subsurface" value="1"/>"#, "not supported by"),
    ] {
        refused(&format!("<bsdf type=\"principled\">{inside}</bsdf>"), &[part]);
    }
}

#[test]
fn bsdfs_made_of_others() {
    let Bsdf::Mask(m) = bsdf("mask", r#"<bsdf type="diffuse"/>"#) else { panic!() };
    assert_eq!(m.opacity, 0.5);
    let colour = r#"<rgb name="opacity" value="1 0 0"/><bsdf type="diffuse"/>"#;
    assert!(matches!(bsdf("mask", colour), Bsdf::Mask(m) if (m.opacity - 0.212_671).abs() < 1e-12));
    let two = r#"<float name="weight" value="0.25"/><bsdf type="diffuse"/><bsdf type="phong"/>"#;
    let Bsdf::Blend(b) = bsdf("blendbsdf", two) else { panic!() };
    assert_eq!((b.weight, b.bsdfs[0].name(), b.bsdfs[1].name()), (0.25, "diffuse", "phong"));
    let map = r#"<texture name="any" type="checkerboard"/><bsdf type="diffuse"/>
                 <float name="scale" value="0.1"/>"#;
    let Bsdf::Perturbed(b) = bsdf("bumpmap", map) else { panic!() };
    assert!(b.perturbation == Perturbation::Heights(0.1) && b.use_shadowing_function);
    let map = r#"<texture name="normalmap" type="rawconstant"><vector name="value" value="0.5 0.5 1"/>
                 </texture><bsdf type="diffuse"/><boolean name="flip_invalid_normals" value="false"/>"#;
    let Bsdf::Perturbed(b) = bsdf("normalmap", map) else { panic!() };
    assert!(b.perturbation == Perturbation::Normals && !b.flip_invalid_normals);
    assert_eq!(b.map.at([0.3, 0.3]), Rgb::new(0.5, 0.5, 1.0));
    refused("<bsdf type=\"mask\"/>", &["expected a bsdf inside"]);
    refused("<bsdf type=\"mask\"><bsdf type=\"null\"/></bsdf>", &["cannot hold a null"]);
    refused("<bsdf type=\"blendbsdf\"><bsdf type=\"diffuse\"/></bsdf>", &["two bsdfs", "found 1"]);
    refused("<bsdf type=\"bumpmap\"><bsdf type=\"diffuse\"/></bsdf>", &["one texture", "found 0"]);
    refused(
        "<bsdf type=\"normalmap\"><bsdf type=\"diffuse\"/></bsdf>",
        &["`normalmap` is missing"],
    );
    // Doubled at each step, this would not end.
    let mut tree = String::from("<bsdf type=\"diffuse\" id=\"b0\"/>");
    for i in 1..40 {
        let inner = format!("<ref id=\"b{}\"/>", i - 1);
        tree += &format!("<bsdf type=\"blendbsdf\" id=\"b{i}\">{inner}{inner}</bsdf>");
    }
    tree += "<shape type=\"cube\"><ref id=\"b39\"/></shape>";
    refused(&tree, &["more than 64 bsdfs in one"]);
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
fn smooth_surfaces() {
    let Bsdf::Conductor(c) = bsdf("conductor", r#"<string name="material" value="Au"/>"#) else {
        panic!()
    };
    assert!(c.eta.r < c.eta.b && c.k.r > c.k.b);
    let diamond = r#"<string name="int_ior" value="diamond"/><string name="ext_ior" value="air"/>"#;
    assert!(
        matches!(bsdf("dielectric", diamond), Bsdf::Dielectric(d) if d.eta == 2.419 / 1.000_277)
    );
    let pane = bsdf("thindielectric", r#"<rgb name="specular_reflectance" value="0.5"/>"#);
    assert!(matches!(pane, Bsdf::ThinDielectric(d) if d.specular_reflectance.g == 0.5));
    refused("<bsdf type=\"dielectric\"><float name=\"alpha\" value=\"0.1\"/></bsdf>", &["alpha"]);
}

#[test]
fn plastics() {
    let Bsdf::Plastic(smooth) = bsdf("plastic", "") else { panic!() };
    assert_eq!((smooth.reflectance, smooth.nonlinear), (Rgb::splat(0.5), false));
    assert!((smooth.coating.eta() - 1.489_587_3).abs() < 1e-6 && smooth.coating.facets().is_none());
    let inside = r#"<float name="alpha" value="0.2"/><boolean name="nonlinear" value="true"/>
                    <string name="distribution" value="ggx"/><float name="int_ior" value="1.9"/>"#;
    let Bsdf::Plastic(rough) = bsdf("roughplastic", inside) else { panic!() };
    assert!(rough.nonlinear && rough.coating.facets() == Some((Distribution::Ggx, 0.2)));
    let thin = "<bsdf type=\"plastic\"><float name=\"int_ior\" value=\"1\"/></bsdf>";
    refused(thin, &["\"eta\" is 0.99", "above 1"]);
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
    refused("<bsdf type=\"hair\"/>", &["`hair` is not supported", "diffuse"]);
}

/// Mitsuba's `path` takes going through nothing for a scattering.
#[test]
fn null_interfaces_count_in_path() {
    let body = |integrator: &str, inside: &str| {
        let text = format!(
            r#"<integrator type="{integrator}"/><medium type="homogeneous" id="m"/>
               <shape type="cube"><bsdf type="null"/>{inside}</shape>"#
        );
        let s = scene(&text);
        s.bsdfs[s.shapes[0].bsdf].item.clone()
    };
    let Bsdf::Mask(mask) = body("path", "") else { panic!() };
    assert_eq!(mask.opacity, 0.0);
    assert!(body("volpath", "").is_null());
    assert!(body("path", r#"<ref name="interior" id="m"/>"#).is_null());
}

#[test]
fn measured_materials() {
    let folder = crate::testing::Folder::new();
    let tables =
        MeasuredTables::of_metal(&RoughConductor::default(), [0.3; 2], &[0.0], [4, 5, 4]).unwrap();
    let good = crate::encode_measured(&tables);
    let body = r#"<scene version="3.0.0">
        <bsdf type="measured" id="a"><string name="filename" value="m.bsdf"/></bsdf>
        <bsdf type="twosided"><bsdf type="measured"><string name="filename" value="m.bsdf"/></bsdf></bsdf>
        </scene>"#;
    let read = |bytes: &[u8]| {
        folder.file("m.bsdf", bytes);
        crate::read_scene(&folder.file("scene.xml", body), &crate::Defaults::new())
    };
    let scene = read(&good).unwrap();
    let Bsdf::Measured(a) = &scene.bsdfs[0].item else { panic!() };
    let Bsdf::TwoSided(sides) = &scene.bsdfs[1].item else { panic!() };
    let Bsdf::Measured(b) = &sides.front else { panic!() };
    // One file is read once.
    assert!(Arc::ptr_eq(a, b));
    assert!(**a == Measured::new(tables.clone()).unwrap());
    let refused = |bytes: &[u8], part: &str| {
        let message = read(bytes).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains(part) && message.contains("m.bsdf"), "{part}: {message}");
    };
    // A number is missing, whatever it belongs to.
    for end in (0..good.len()).step_by(7) {
        refused(&good[..end], "");
    }
    refused(b"tensor", "not a tensor file");
    let changed = |change: fn(&mut MeasuredTables)| {
        let mut tables = tables.clone();
        change(&mut tables);
        crate::encode_measured(&tables)
    };
    refused(&changed(|t| t.rgb.values[3] = f32::NAN), "`rgb` is NaN at index 3");
    refused(&changed(|t| t.ndf.values[3] = -1.0), "`ndf` is -1 at index 3");
    let two = |t: &mut MeasuredTables| t.vndf.shape = vec![4, 1, 5, 5];
    refused(&changed(two), "`vndf` has the shape [4, 1, 5, 5]");
    let at = good.windows(3).position(|name| name == b"rgb").unwrap();
    let mut spectral = good.clone();
    spectral[at..at + 3].copy_from_slice(b"pgb");
    refused(&spectral, "there is no `rgb`");
}
