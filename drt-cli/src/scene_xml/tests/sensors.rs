use drt_estimators::filter::FilterKind;
use drt_estimators::sensor::{Aperture, FovAxis};
use drt_estimators::{Integrator, SceneSensor, Surrounding};
use drt_math::{Vec3, vec3};

use super::{old_scene, refused, scene};

fn sensor(inside: &str) -> SceneSensor {
    scene(&format!("<sensor type=\"perspective\">{inside}</sensor>")).sensors.remove(0).item
}

fn wrong(inside: &str, part: &str) {
    refused(&format!("<sensor type=\"perspective\">\n{inside}</sensor>"), &[part]);
}

#[test]
fn defaults_are_mitsubas() {
    let s = sensor("");
    assert_eq!(s.sensor.film(), [768, 576]);
    assert_eq!(s.sensor.filter().kind(), FilterKind::GAUSSIAN);
    assert_eq!((s.sensor.lens().near, s.sensor.lens().far), (1e-2, 1e4));
    assert_eq!(s.sensor.lens().fov_axis, FovAxis::Diagonal);
    assert_eq!((s.medium, s.sample_count), (Surrounding::Counted, None));
}

#[test]
fn lens_film_filter_and_sampler() {
    let s = sensor(
        r#"<float name="fov" value="30"/><string name="fov_axis" value="smaller"/>
           <float name="principal_point_offset_x" value="0.1"/><float name="near_clip" value="0.5"/>
           <float name="far_clip" value="20"/><float name="focus_distance" value="3"/>
           <transform name="to_world"><lookat origin="1 2 3" target="1 2 0" up="0 1 0"/></transform>
           <film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="30"/>
             <string name="pixel_format" value="rgb"/><string name="component_format" value="float32"/>
             <rfilter type="tent"><float name="radius" value="2"/></rfilter></film>
           <sampler type="multijitter"><integer name="sample_count" value="9"/>
             <integer name="seed" value="3"/></sampler>"#,
    );
    let lens = s.sensor.lens();
    assert_eq!((lens.fov, lens.fov_axis, lens.near, lens.far), (30.0, FovAxis::Smaller, 0.5, 20.0));
    assert_eq!(lens.principal_point_offset, [0.1, 0.0]);
    assert_eq!(s.sensor.film(), [40, 30]);
    assert_eq!(s.sensor.filter().kind(), FilterKind::Tent { radius: 2.0 });
    assert_eq!(s.sample_count, Some(9));
    assert_eq!(s.sensor.pinhole().position, vec3(1.0, 2.0, 3.0));
    assert!((s.sensor.pinhole().forward + Vec3::Z).max_abs() < 1e-12);
    assert_eq!(
        sensor(r#"<film type="hdrfilm"><rfilter type="box"/></film>"#).sensor.filter().kind(),
        FilterKind::BOX
    );
    let b = r#"<float name="B" value="0.2"/>"#;
    for (kind, inside, read) in [
        ("mitchell", "", FilterKind::MITCHELL),
        ("mitchell", b, FilterKind::Mitchell { b: 0.2, c: 1.0 / 3.0 }),
        ("catmullrom", "", FilterKind::CATMULL_ROM),
        ("lanczos", "", FilterKind::LANCZOS),
    ] {
        let film =
            format!(r#"<film type="hdrfilm"><rfilter type="{kind}">{inside}</rfilter></film>"#);
        assert_eq!(sensor(&film).sensor.filter().kind(), read);
    }
}

#[test]
fn unusable_sensors() {
    wrong(r#"<float name="fov" value="180"/>"#, "field of view");
    wrong(r#"<string name="fov_axis" value="x"/>"#, "fov_axis");
    wrong(
        r#"<float name="fov" value="20"/><string name="focal_length" value="50mm"/>"#,
        "not both",
    );
    wrong(r#"<string name="focal_length" value="far"/>"#, "50mm");
    wrong(r#"<film type="ldrfilm"/>"#, "hdrfilm");
    wrong(r#"<film type="hdrfilm"><integer name="width" value="0"/></film>"#, "`width` is 0");
    for (name, value, part) in [
        ("crop_width", 0, "`crop_width` is 0"),
        ("crop_width", 769, "769x576 pixels at (0, 0), which is not inside the film of 768x576"),
        ("crop_offset_y", 576, "at (0, 576), which is not inside"),
        ("crop_offset_x", -1, "`crop_offset_x` is -1"),
    ] {
        let crop = format!(r#"<integer name="{name}" value="{value}"/>"#);
        wrong(&format!(r#"<film type="hdrfilm">{crop}</film>"#), part);
    }
    wrong(r#"<film type="hdrfilm"><rfilter type="sinc"/></film>"#, "catmullrom or lanczos");
    let lobes = r#"<rfilter type="lanczos"><integer name="lobes" value="0"/></rfilter>"#;
    wrong(&format!(r#"<film type="hdrfilm">{lobes}</film>"#), "`lobes` is 0");
    wrong(r#"<transform name="to_world"><scale value="2"/></transform>"#, "scales or shears");
    wrong(r#"<sampler type="independent"><integer name="sample_count" value="0"/></sampler>"#, "0");
    refused("<sensor type=\"distant\"/>", &["perspective, thinlens or orthographic"]);
    for (inside, part) in [
        ("", "`aperture_radius` is missing"),
        (r#"<float name="aperture_radius" value="-1"/>"#, "`aperture_radius` is -1"),
        (
            r#"<float name="aperture_radius" value="1"/><float name="focus_distance" value="0"/>"#,
            "`focus_distance` is 0",
        ),
        (
            r#"<float name="aperture_radius" value="1"/>
               <float name="principal_point_offset_x" value="0"/>"#,
            "principal_point_offset_x",
        ),
    ] {
        refused(&format!("<sensor type=\"thinlens\">\n{inside}</sensor>"), &[part]);
    }
    for (inside, part) in [
        (r#"<float name="fov" value="30"/>"#, "fov"),
        (r#"<transform name="to_world"><scale x="2"/></transform>"#, "stretched along one axis"),
        (r#"<float name="near_clip" value="0"/>"#, "clip planes"),
    ] {
        refused(&format!("<sensor type=\"orthographic\">\n{inside}</sensor>"), &[part]);
    }
}

#[test]
fn crop_windows_and_lenses() {
    let film = |crop: &str| {
        format!(
            r#"<film type="hdrfilm"><integer name="width" value="40"/>
               <integer name="height" value="30"/>{crop}</film>"#
        )
    };
    let crop = r#"<integer name="crop_offset_x" value="10"/><integer name="crop_offset_y" value="3"/>
                  <integer name="crop_width" value="8"/><integer name="crop_height" value="9"/>"#;
    let (whole, part) = (sensor(&film("")).sensor, sensor(&film(crop)).sensor);
    assert_eq!(part.film(), [8, 9]);
    assert_eq!(part.ray([2.5, 4.0]), whole.ray([12.5, 7.0]));
    let rest = sensor(&film(r#"<integer name="crop_offset_x" value="10"/>"#)).sensor;
    assert_eq!(rest.film(), [30, 30]);
    let lens = |inside: &str| {
        let text = format!("<sensor type=\"thinlens\">{inside}</sensor>");
        scene(&text).sensors.remove(0).item.sensor.aperture()
    };
    let radius = r#"<float name="aperture_radius" value="0.5"/>"#;
    assert_eq!(lens(radius), Some(Aperture { radius: 0.5, focus_distance: 1e4 }));
    let near = format!(r#"{radius}<float name="focus_distance" value="3"/>"#);
    assert_eq!(lens(&near), Some(Aperture { radius: 0.5, focus_distance: 3.0 }));
    assert_eq!(lens(r#"<float name="aperture_radius" value="0"/>"#), None);
}

#[test]
fn orthographic_films_scale_with_to_world() {
    let s = scene(
        r#"<sensor type="orthographic"><float name="near_clip" value="0.5"/>
           <transform name="to_world"><scale x="3" y="3"/>
             <lookat origin="1 2 3" target="1 2 0" up="0 1 0"/></transform>
           <film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="30"/>
           </film></sensor>"#,
    );
    let sensor = &s.sensors[0].item.sensor;
    assert!(sensor.is_orthographic());
    for (pixel, x, y) in [([0.0, 0.0], -2.0, 4.25), ([40.0, 30.0], 4.0, -0.25)] {
        let ray = sensor.ray(pixel);
        assert!((ray.origin - vec3(x, y, 2.5)).max_abs() < 1e-12, "{ray:?}");
        assert!((ray.dir + Vec3::Z).max_abs() < 1e-12);
    }
}

#[test]
fn media_around_cameras() {
    let s = scene(
        r#"<medium type="homogeneous" id="m"/>
           <sensor type="perspective"><ref name="medium" id="m"/></sensor>"#,
    );
    assert_eq!(s.sensors[0].item.medium, Surrounding::Stated(Some(0)));
}

#[test]
fn integrators() {
    let read = |inside: &str| {
        scene(&format!("<integrator type=\"volpathmis\">{inside}</integrator>")).integrator
    };
    assert_eq!(scene("").integrator, Integrator::default());
    assert_eq!(read("").max_depth, None);
    let straight =
        |kind| scene(&format!("<integrator type=\"{kind}\"/>")).integrator.straight_depth;
    assert!(straight("path") && straight("direct") && !straight("volpath"));
    assert_eq!(read(r#"<integer name="max_depth" value="-1"/>"#).max_depth, None);
    let both = r#"<integer name="max_depth" value="7"/><integer name="rr_depth" value="3"/>"#;
    let read_both = Integrator { max_depth: Some(7), rr_depth: 3, ..Integrator::default() };
    assert_eq!(read(both), read_both);
    assert!(read(r#"<boolean name="hide_emitters" value="true"/>"#).hide_emitters);
    let old = old_scene(
        r#"<integrator type="volpathAD"><integer name="rrDepth" value="9"/></integrator>"#,
    );
    assert_eq!(old.integrator.rr_depth, 9);
    for (body, part) in [
        (r#"<integrator type="aov"/>"#, "one integrator inside"),
        (r#"<integrator type="path"><integer name="max_depth" value="-2"/></integrator>"#, "-2"),
        (
            r#"<integrator type="path"><boolean name="strict_normals" value="true"/></integrator>"#,
            "strict_normals",
        ),
        (r#"<integrator type="path"/><integrator type="path"/>"#, "only one integrator"),
    ] {
        refused(body, &[part]);
    }
}
