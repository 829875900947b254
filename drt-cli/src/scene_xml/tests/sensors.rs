use drt_estimators::filter::FilterKind;
use drt_estimators::sensor::FovAxis;
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
    wrong(r#"<film type="hdrfilm"><integer name="crop_width" value="3"/></film>"#, "crop_width");
    wrong(r#"<film type="hdrfilm"><rfilter type="lanczos"/></film>"#, "lanczos");
    wrong(r#"<transform name="to_world"><scale value="2"/></transform>"#, "scales or shears");
    wrong(r#"<sampler type="independent"><integer name="sample_count" value="0"/></sampler>"#, "0");
    refused("<sensor type=\"thinlens\"/>", &["perspective or orthographic"]);
    for (inside, part) in [
        (r#"<float name="fov" value="30"/>"#, "fov"),
        (r#"<transform name="to_world"><scale x="2"/></transform>"#, "stretched along one axis"),
        (r#"<float name="near_clip" value="0"/>"#, "clip planes"),
    ] {
        refused(&format!("<sensor type=\"orthographic\">\n{inside}</sensor>"), &[part]);
    }
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
        assert!((ray.direction + Vec3::Z).max_abs() < 1e-12);
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
    assert_eq!(scene("").integrator, Integrator { max_depth: None, rr_depth: 5 });
    assert_eq!(read("").max_depth, None);
    assert_eq!(read(r#"<integer name="max_depth" value="-1"/>"#).max_depth, None);
    let both = r#"<integer name="max_depth" value="7"/><integer name="rr_depth" value="3"/>"#;
    assert_eq!(read(both), Integrator { max_depth: Some(7), rr_depth: 3 });
    let old = old_scene(
        r#"<integrator type="volpathAD"><integer name="rrDepth" value="9"/></integrator>"#,
    );
    assert_eq!(old.integrator.rr_depth, 9);
    for (body, part) in [
        (r#"<integrator type="aov"/>"#, "one integrator inside"),
        (r#"<integrator type="path"><integer name="max_depth" value="-2"/></integrator>"#, "-2"),
        (
            r#"<integrator type="path"><boolean name="hide_emitters" value="true"/></integrator>"#,
            "hide_emitters",
        ),
        (r#"<integrator type="path"/><integrator type="path"/>"#, "only one integrator"),
    ] {
        refused(body, &[part]);
    }
}
