use drt_estimators::emitter::Emitter;
use drt_estimators::{SceneEmitter, Surrounding};
use drt_math::{Rgb, Vec3, vec3};

use super::{old_scene, refused, scene};
use crate::testing::Folder;
use crate::{Defaults, read_scene};

fn emitter(kind: &str, inside: &str) -> Emitter {
    scene(&format!("<emitter type=\"{kind}\">{inside}</emitter>")).emitters.remove(0).item.emitter
}

#[test]
fn defaults_are_mitsubas() {
    let one = Rgb::ONE;
    assert_eq!(emitter("point", ""), Emitter::Point { position: Vec3::ZERO, intensity: one });
    assert_eq!(emitter("constant", ""), Emitter::Constant { radiance: one });
    let directional = Emitter::Directional { direction: Vec3::Z, irradiance: one };
    assert_eq!(emitter("directional", ""), directional);
    let Emitter::Spot { direction, cutoff_angle, beam_width, .. } = emitter("spot", "") else {
        panic!()
    };
    assert_eq!(direction, Vec3::Z);
    assert!((cutoff_angle.to_degrees() - 20.0).abs() < 1e-12);
    assert!((beam_width.to_degrees() - 15.0).abs() < 1e-12);
}

#[test]
fn placed_by_position_direction_or_transform() {
    let at = |inside: &str| match emitter("point", inside) {
        Emitter::Point { position, .. } => position,
        _ => panic!(),
    };
    let three = vec3(1.0, 2.0, 3.0);
    assert_eq!(at(r#"<point name="position" x="1" y="2" z="3"/>"#), three);
    assert_eq!(at(r#"<point name="position" value="1, 2, 3"/>"#), three);
    let placed = r#"<transform name="to_world"><translate value="1 2 3"/></transform>"#;
    assert_eq!(at(placed), three);
    let flows = |inside: &str| match emitter("directional", inside) {
        Emitter::Directional { direction, .. } => direction,
        _ => panic!(),
    };
    assert_eq!(flows(r#"<vector name="direction" x="0" y="-2" z="0"/>"#), -Vec3::Y);
    let turned = r#"<transform name="to_world"><rotate x="1" angle="90"/></transform>"#;
    assert!((flows(turned) + Vec3::Y).max_abs() < 1e-12);
    let inside = r#"<float name="cutoff_angle" value="30"/><float name="beam_width" value="10"/>
        <transform name="to_world"><lookat origin="0 5 0" target="0 0 0" up="0 0 1"/></transform>"#;
    let Emitter::Spot { position, direction, cutoff_angle, beam_width, .. } =
        emitter("spot", inside)
    else {
        panic!()
    };
    assert_eq!((position, direction), (vec3(0.0, 5.0, 0.0), -Vec3::Y));
    assert!((cutoff_angle - 30f64.to_radians()).abs() < 1e-12);
    assert!((beam_width - 10f64.to_radians()).abs() < 1e-12);
}

/// Mitsuba 3 sees a `<spectrum>` of one number as light of equal energy, which is not white in sRGB.
#[test]
fn light_of_equal_energy() {
    let strength = |e: &Emitter| match e {
        Emitter::Constant { radiance } => *radiance,
        _ => panic!(),
    };
    let spectrum = r#"<spectrum name="radiance" value="8"/>"#;
    let seen = strength(&emitter("constant", spectrum));
    // As Mitsuba 3.9.1 prints it.
    for (ours, theirs) in seen.to_array().into_iter().zip([9.63835, 7.58633, 7.27133]) {
        assert!((ours - theirs).abs() < 1e-5);
    }
    assert_eq!(strength(&emitter("constant", r#"<rgb name="radiance" value="8"/>"#)).r, 8.0);
    assert_eq!(strength(&emitter("constant", r#"<float name="radiance" value="8"/>"#)).r, 8.0);
    let old = old_scene(&format!("<emitter type=\"constant\">{spectrum}</emitter>"));
    assert_eq!(strength(&old.emitters[0].item.emitter), Rgb::splat(8.0));
}

#[test]
fn media_around_lights() {
    let around = |body: &str| -> SceneEmitter {
        scene(&format!("<medium type=\"homogeneous\" id=\"m\"/>{body}")).emitters.remove(0).item
    };
    assert_eq!(around("<emitter type=\"point\"/>").medium, Surrounding::Counted);
    let named = "<emitter type=\"point\"><ref name=\"medium\" id=\"m\"/></emitter>";
    assert_eq!(around(named).medium, Surrounding::Stated(Some(0)));
    let far = "<medium type=\"homogeneous\" id=\"m\"/>\n\
               <emitter type=\"directional\"><ref id=\"m\"/></emitter>";
    refused(far, &[":3", "not supported inside"]);
}

#[test]
fn unusable_lights() {
    refused("<emitter type=\"sunsky\"/>", &["`sunsky` is not supported", "as an envmap"]);
    let scaled = "<transform name=\"to_world\"><scale value=\"2\"/></transform>";
    for (inside, part) in [
        (scaled, "not scale or shear"),
        (r#"<float name="fov" value="180"/>"#, "field of view"),
        (r#"<rgb name="intensity" value="1"/>"#, "which takes"),
        (r#"<rgb name="irradiance" value="-1"/>"#, "negative"),
    ] {
        refused(&format!("<emitter type=\"projector\">{inside}</emitter>"), &[":2", part]);
    }
    let board = r#"<texture type="checkerboard" name="texture"/>"#;
    let wide = format!(r#"{board}<float name="cutoff_angle" value="90"/>"#);
    refused(&format!("<emitter type=\"spot\">{wide}</emitter>"), &[":2", "< 90"]);
    refused("<emitter type=\"envmap\"/>", &["`filename` is missing"]);
    for (kind, inside, part) in [
        ("point", r#"<rgb name="intensity" value="-1"/>"#, "negative"),
        ("point", r#"<rgb name="radiance" value="1"/>"#, "which takes intensity"),
        ("directional", r#"<vector name="direction" value="0 0 0"/>"#, "zero vector"),
        ("spot", r#"<float name="beam_width" value="30"/>"#, "beam_width"),
        (
            "point",
            r#"<point name="position" value="0 0 0"/><transform name="to_world"/>"#,
            "not both",
        ),
    ] {
        refused(&format!("<emitter type=\"{kind}\">{inside}</emitter>"), &[":2", part]);
    }
}

#[test]
fn environments_are_images() {
    let folder = crate::testing::Folder::new();
    let pixel = |x, y| (f32::from(x as u8 + 2 * y as u8), 0.5_f32, if y == 2 { -1.0 } else { 0.0 });
    let write = |name: &str, height| {
        exr::prelude::write_rgb_file(folder.path().join(name), 2, height, pixel).unwrap();
    };
    write("sky.exr", 2);
    write("dark.exr", 3);
    write("flat.exr", 1);
    let load = |name: &str, inside: &str| {
        let body = format!(
            "<scene version=\"3.0.0\"><emitter type=\"envmap\" id=\"sky\">\
             <string name=\"filename\" value=\"{name}\"/>{inside}</emitter></scene>"
        );
        crate::read_scene(&folder.file("s.xml", body), &crate::Defaults::new())
    };
    let turned = "<float name=\"scale\" value=\"2\"/><transform name=\"to_world\">\
                  <rotate x=\"1\" angle=\"180\"/></transform>";
    let scene = load("sky.exr", turned).unwrap();
    let Emitter::Envmap { radiance, map } = &scene.emitters[0].item.emitter else { panic!() };
    assert_eq!(*radiance, Rgb::splat(2.0));
    // Upside down: the last row is above, half of both columns straight up.
    assert!((map.at(Vec3::Y).r - 2.5).abs() < 1e-5);
    let refused = |name: &str, inside: &str, part: &str| {
        let message = load(name, inside).map(|_| ()).unwrap_err().to_string();
        assert!(
            message.contains(":1: <emitter type=\"envmap\"") && message.contains(part),
            "{message}"
        );
    };
    refused("dark.exr", "", "column 0, row 2 is negative or not finite");
    refused("flat.exr", "", "one row");
    refused("none.exr", "", "no file `none.exr`");
    let scaled = "<transform name=\"to_world\"><scale x=\"2\"/></transform>";
    refused("sky.exr", scaled, "not scaled or sheared");
}

/// Intensities over π along directions of Mitsuba's camera: columns go to the local -x, rows to -y.
#[test]
fn pictures_are_upright() {
    let folder = crate::testing::Folder::new();
    let image = image::RgbImage::from_fn(4, 2, |x, y| image::Rgb([60 * x as u8, 200 * y as u8, 9]));
    image.save(folder.path().join("p.png")).unwrap();
    let load = |kind: &str, name: &str, inside: &str| {
        let body = format!(
            "<scene version=\"3.0.0\"><emitter type=\"{kind}\">\
             <texture type=\"bitmap\" name=\"{name}\"><string name=\"filename\" value=\"p.png\"/>\
             <boolean name=\"raw\" value=\"true\"/><string name=\"filter_type\" value=\"nearest\"/>\
             </texture>{inside}</emitter></scene>"
        );
        let scene = crate::read_scene(&folder.file("s.xml", body), &crate::Defaults::new());
        scene.unwrap().emitters.remove(0).item.emitter
    };
    let towards = |e: &Emitter, x: f64, y: f64| {
        let d = vec3(x, y, 1.0).normalize();
        e.emission(d).value * (d.z.powi(3) / std::f64::consts::PI)
    };
    // 90 degrees along columns: half as high as wide.
    let e = load("projector", "irradiance", "<float name=\"fov\" value=\"90\"/>");
    for (x, y, column, row) in [(0.9, 0.4, 0, 0), (-0.9, 0.4, 3, 0), (0.4, -0.4, 1, 1)] {
        let expected = [60 * column, 200 * row, 9].map(|v| f64::from(v) / 255.0);
        let found = towards(&e, x, y);
        assert!((found - Rgb::from(expected)).max_abs() < 1e-6, "{x} {y} {found:?}");
    }
    assert_eq!(towards(&e, 0.9, 0.6), Rgb::ZERO);
    let e = load("spot", "texture", "<float name=\"cutoff_angle\" value=\"45\"/>");
    let d = vec3(0.3, 0.3, 1.0).normalize();
    assert!((e.emission(d).value.r - 120.0 / 255.0).abs() < 1e-6, "{:?}", e.emission(d));
    assert!((e.emission(d).value.g - 200.0 / 255.0).abs() < 1e-6);
}

/// A ray through a medium sees (1 - exp(-sigma_a t)) j / sigma_a of the light j per length.
#[test]
fn volume_lights() {
    let body = |medium: &str, inside: &str| {
        format!(
            r#"<medium type="homogeneous" id="m"><rgb name="sigma_t" value="2"/>{medium}</medium>
               <emitter type="point"/>
               <shape type="sphere"><bsdf type="null"/>{inside}</shape>
               <shape type="rectangle" id="lamp"><emitter type="area"/></shape>"#
        )
    };
    let light = r#"<emitter type="volumelight"><rgb name="radiance" value="2 0 5"/></emitter>"#;
    let within = format!(r#"<ref name="interior" id="m"/>{light}"#);
    let albedo = r#"<rgb name="albedo" value="0.75 1 0.5"/>"#;
    let s = scene(&body(albedo, &within));
    let drt_medium::MediumKind::Homogeneous(m) = &s.media[0].item.kind else { panic!() };
    assert_eq!(m.coefficients().source(), Rgb::new(2.0, 0.0, 5.0));
    let of = |shape: usize| s.shapes[shape].emitter.map(|i| &s.emitters[i].item.emitter);
    assert_eq!((s.emitters.len(), of(0)), (2, None));
    assert!(matches!(of(1), Some(Emitter::Area { .. })));
    let clear = r#"<float name="albedo" value="1"/>"#;
    refused(&body(clear, &within), &["does not absorb"]);
    refused(&body("", light), &["no medium called `interior`"]);
    refused(light, &["belongs inside a <shape>"]);
    let folder = Folder::new();
    let values = drt_medium::Grid::new([2, 1, 1], 1, vec![1.0, 3.0]).unwrap();
    let file = drt_medium::vol::VolFile { grid: values, bounds: [Vec3::ZERO, Vec3::splat(1.0)] };
    folder.file("glow.vol", drt_medium::vol::encode(&file).unwrap());
    let grid = r#"<emitter type="volumelight"><volume name="radiance" type="gridvolume">
        <string name="filename" value="glow.vol"/></volume></emitter>"#;
    let glow = |albedo: &str| {
        let inside = body(albedo, &within.replace(light, grid));
        let file = folder.file("s.xml", format!("<scene version=\"3.0.0\">{inside}</scene>"));
        read_scene(&file, &Defaults::new()).map(|mut s| s.media.remove(0).item)
    };
    let m = glow(r#"<rgb name="albedo" value="0.75 0.9 0.5"/>"#).unwrap();
    let source = m.coefficients(vec3(0.5, 0.5, 0.5)).source();
    assert!((source - Rgb::splat(2.0)).max_abs() < 1e-12, "{source:?}");
    let message = glow(albedo).unwrap_err().to_string();
    assert!(message.contains("does not absorb"), "{message}");
    let heterogeneous = body(albedo, &within).replace("homogeneous", "heterogeneous");
    refused(&heterogeneous, &["medium with grids"]);
}

#[test]
fn what_moves_is_refused() {
    let keys = r#"<transform time="0"/><transform time="1"><translate x="1"/></transform>"#;
    refused(
        &format!(
            r#"<emitter type="point"><animation name="to_world">{keys}</animation></emitter>"#
        ),
        &[":2", "<animation name=\"to_world\">", "motion blur is not supported"],
    );
}
