use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};
use drt_medium::nanovdb::NanoVdb;
use drt_medium::vol::{VolFile, encode};
use drt_medium::{Coefficients, Grid, LocalPhase, Medium, MediumKind, Phase, Property, Volume};

use super::{old_scene, refused, scene};
use crate::testing::Folder;
use crate::{Defaults, read_scene};

fn medium(kind: &str, inside: &str) -> Medium {
    scene(&format!("<medium type=\"{kind}\">{inside}</medium>")).media.remove(0).item
}

fn homogeneous(inside: &str) -> Coefficients {
    medium("homogeneous", inside).homogeneous().unwrap().coefficients()
}

/// The value of a phase function where light turns by the angle of a cosine.
fn at_cosine(phase: &LocalPhase<'_>, cosine: f64) -> f64 {
    phase.eval(-Vec3::Z, vec3((1.0 - cosine * cosine).sqrt(), 0.0, cosine))
}

#[test]
fn homogeneous_by_either_pair_of_coefficients() {
    let c = homogeneous("");
    assert_eq!((c.sigma_t, c.albedo, c.emission), (Rgb::ONE, Rgb::splat(0.75), Rgb::ZERO));
    let c = homogeneous(
        r#"<rgb name="sigma_t" value="1 2 3"/><spectrum name="albedo" value="0.5"/>
           <float name="scale" value="10"/><rgb name="emission" value="4"/>"#,
    );
    assert_eq!(c.sigma_t, Rgb::new(10.0, 20.0, 30.0));
    assert_eq!((c.albedo, c.emission), (Rgb::splat(0.5), Rgb::splat(4.0)));
    let c =
        homogeneous(r#"<rgb name="sigma_a" value="1 0 3"/><rgb name="sigma_s" value="1 0 1"/>"#);
    assert_eq!((c.sigma_t, c.albedo), (Rgb::new(2.0, 0.0, 4.0), Rgb::new(0.5, 0.0, 0.25)));
    let c = homogeneous(
        r#"<volume name="sigma_t" type="constvolume"><rgb name="value" value="1 2 3"/></volume>"#,
    );
    assert_eq!(c.sigma_t.b, 3.0);
    for (inside, part) in [
        (r#"<float name="sigma_a" value="1"/>"#, "give `sigma_t` and `albedo`"),
        (r#"<float name="albedo" value="2"/>"#, "albedo"),
        (r#"<float name="sigma_t" value="-1"/>"#, "sigma_t"),
        (r#"<float name="density" value="1"/>"#, "density"),
        (r#"<phase type="hg"><float name="g" value="1"/></phase>"#, "g"),
        (r#"<phase type="sggx"/>"#, "the volume `S` is missing"),
    ] {
        refused(&format!("<medium type=\"homogeneous\">\n{inside}</medium>"), &[part]);
    }
    refused("<medium type=\"foggy\"/>", &["`foggy` is not supported"]);
}

#[test]
fn phase_functions() {
    let phase = |inside: &str| medium("homogeneous", inside).phase;
    assert_eq!(phase(""), Phase::Isotropic);
    assert_eq!(phase("<phase type=\"rayleigh\"/>"), Phase::Rayleigh);
    let inside =
        r#"<phase type="hg"><float name="g" value="0.5"/></phase><phase type="isotropic"/>"#;
    let blend = |inside: &str| format!(r#"<phase type="blendphase">{inside}</phase>"#);
    let weight = r#"<float name="weight" value="0.3"/>"#;
    let value = at_cosine(&phase(&blend(&format!("{weight}{inside}"))).at(Vec3::ZERO), -0.5);
    assert!((value - 0.0419197).abs() < 1e-6, "{value}");
    let table = |values: &str| {
        format!(r#"<phase type="tabphase"><string name="values" value="{values}"/></phase>"#)
    };
    assert!(
        (at_cosine(&phase(&table("0.5, 1.0, 1.5, 4")).at(Vec3::ZERO), 0.3) - 0.0741327).abs()
            < 1e-6
    );
    let wrong = |inside: &str, part| {
        refused(&format!("<medium type=\"homogeneous\">{inside}</medium>"), &[part])
    };
    wrong(&blend(inside), "`weight` is missing");
    wrong(&blend(weight), "two phase functions inside, found 0");
    wrong(&blend(&format!("{}{inside}", weight.replace("0.3", "2"))), "weight is 2");
    wrong(&table("1"), "number of values is 1");
    wrong(&table("1, x"), "`x`");
    assert_eq!(phase("<phase type=\"hg\"/>"), Phase::HenyeyGreenstein { g: 0.8 });
    let s = scene(
        r#"<phase type="hg" id="p"><float name="g" value="-0.3"/></phase>
           <medium type="homogeneous"><ref id="p"/></medium>"#,
    );
    assert_eq!(s.media[0].item.phase, Phase::HenyeyGreenstein { g: -0.3 });
}

#[test]
fn old_media_have_no_defaults() {
    let s = old_scene(
        r#"<medium type="homogeneous" id="m"><spectrum name="sigmaT" value="0.1"/>
           <spectrum name="albedo" value="0.9, 0.5, 0.5"/></medium>"#,
    );
    let c = s.media[0].item.homogeneous().unwrap().coefficients();
    assert_eq!((c.sigma_t, c.albedo), (Rgb::splat(0.1), Rgb::new(0.9, 0.5, 0.5)));
    assert!(super::read_version("0.5.0", "<medium type=\"homogeneous\"/>").is_err());
}

/// NanoVDB files are read as `.vol` files are, one grid of them.
#[test]
fn grids_of_nanovdb() {
    let folder = Folder::new();
    let grid = Grid::new([4, 1, 1], 1, vec![0.0, 1.0, 2.0, 3.0]).unwrap();
    let linear = Mat3::diagonal(vec3(2.0, 1.0, 1.0));
    let placement = Affine { linear, translation: Vec3::ZERO };
    let file = NanoVdb { name: "smoke".into(), grid, placement };
    folder.file("ramp.nvdb", drt_medium::nanovdb::encode(&file).unwrap());
    let density = |more: &str| {
        format!(
            "<volume name=\"sigma_t\" type=\"gridvolume\"><string name=\"filename\" value=\"ramp.nvdb\"/>{more}</volume>\
             <float name=\"albedo\" value=\"0.5\"/>"
        )
    };
    let at = |more: &str, x: f64| {
        grid_medium(&folder, "3.0.0", &density(more)).sigma_t(vec3(x, 0.5, 0.5)).r
    };
    let name = r#"<string name="grid_name" value="smoke"/>"#;
    assert!((at("", 0.375) - 1.0).abs() < 1e-12);
    let stored = r#"<boolean name="use_grid_bbox" value="true"/>"#;
    assert!((at(&format!("{name}{stored}"), 0.75) - 1.0).abs() < 1e-12);
    let other = format!(
        "<scene version=\"3.0.0\"><medium type=\"heterogeneous\">{}</medium></scene>",
        density(&name.replace("smoke", "heat"))
    );
    let path = folder.file("s.xml", other);
    let error = read_scene(&path, &Defaults::new()).unwrap_err().to_string();
    assert!(
        error.contains("ramp.nvdb") && error.contains("the list of grids is `smoke`"),
        "{error}"
    );
}

/// A ramp from 0 to 3 along x, stored in the box (0, 0, 0)-(2, 1, 1).
fn ramp(folder: &Folder) {
    let grid = Grid::new([4, 1, 1], 1, vec![0.0, 1.0, 2.0, 3.0]).unwrap();
    let bounds = [Vec3::ZERO, vec3(2.0, 1.0, 1.0)];
    folder.file("ramp.vol", encode(&VolFile { grid, bounds }).unwrap());
}

fn grid_medium(folder: &Folder, version: &str, inside: &str) -> Medium {
    let text = format!(
        "<scene version=\"{version}\"><medium type=\"heterogeneous\">{inside}</medium></scene>"
    );
    let file = folder.file("s.xml", text);
    read_scene(&file, &Defaults::new()).unwrap().media.remove(0).item
}

#[test]
fn grids_of_version_3_fill_the_unit_cube() {
    let folder = Folder::new();
    ramp(&folder);
    let density = |more: &str| {
        format!(
            "<volume name=\"sigma_t\" type=\"gridvolume\"><string name=\"filename\" \
             value=\"ramp.vol\"/>{more}</volume><float name=\"scale\" value=\"2\"/>\
             <float name=\"albedo\" value=\"0.5\"/>"
        )
    };
    let at = |more: &str, x: f64| {
        grid_medium(&folder, "3.0.0", &density(more)).sigma_t(vec3(x, 0.5, 0.5)).r
    };
    // Value i of 4 sits at (i + 1/2) / 4.
    assert!((at("", 0.375) - 2.0).abs() < 1e-12);
    assert_eq!(at("", 1.5), 0.0);
    let stored = r#"<boolean name="use_grid_bbox" value="true"/>"#;
    assert!((at(stored, 0.75) - 2.0).abs() < 1e-12);
    let moved = r#"<transform name="to_world"><translate x="10"/></transform>"#;
    assert!((at(moved, 10.375) - 2.0).abs() < 1e-12);
    assert!((at(&format!("{moved}{stored}"), 10.75) - 2.0).abs() < 1e-12);
    let nearest = r#"<string name="filter_type" value="nearest"/><string name="wrap_mode"
                     value="mirror"/><boolean name="raw" value="true"/>"#;
    assert_eq!(at(nearest, 0.49), 2.0);
}

#[test]
fn grids_of_old_files_fill_their_own_box_with_values_at_its_faces() {
    let folder = Folder::new();
    ramp(&folder);
    let inside = r#"<volume name="density" type="gridvolume"><string name="filename"
        value="ramp.vol"/></volume><volume name="albedo" type="constvolume"><spectrum name="value"
        value="0.1, 0.2, 0.3"/></volume><float name="scale" value="5"/>"#;
    let m = grid_medium(&folder, "0.5.0", inside);
    assert!((m.sigma_t(vec3(2.0, 0.5, 0.5)).r - 15.0).abs() < 1e-12);
    assert!((m.sigma_t(vec3(1.0, 0.5, 0.5)).g - 7.5).abs() < 1e-12);
    assert_eq!(m.coefficients(vec3(1.0, 0.5, 0.5)).albedo, Rgb::new(0.1, 0.2, 0.3));
}

#[test]
fn heterogeneous_of_constants_is_a_box() {
    let m = medium(
        "heterogeneous",
        r#"<volume name="sigma_t" type="constvolume"><float name="value" value="2"/>
           <transform name="to_world"><scale value="3"/></transform></volume>"#,
    );
    assert_eq!(m.sigma_t(vec3(2.9, 2.9, 0.1)).r, 2.0);
    assert_eq!(m.sigma_t(vec3(3.1, 0.5, 0.5)).r, 0.0);
    let MediumKind::Grid(g) = &m.kind else { panic!() };
    let placement = Affine::about(Mat3::diagonal(vec3(3.0, 3.0, 3.0)), Vec3::ZERO);
    assert_eq!(*g.density().to_world(), placement);
    assert_eq!(*g.albedo(), Volume::Constant(Rgb::splat(0.75)));
}

#[test]
fn homogeneous_media_take_their_albedo_from_a_grid() {
    let folder = Folder::new();
    ramp(&folder);
    let grid = |name: &str| {
        format!(
            "<volume name=\"{name}\" type=\"gridvolume\"><string name=\"filename\" \
             value=\"ramp.vol\"/></volume>"
        )
    };
    let inside = format!("<float name=\"sigma_t\" value=\"2\"/>{}", grid("emission"));
    let text = |inside: &str| {
        format!("<scene version=\"3.0.0\"><medium type=\"homogeneous\">{inside}</medium></scene>")
    };
    let load = |inside: &str| {
        let file = folder.file("s.xml", text(inside));
        read_scene(&file, &Defaults::new()).map(|mut s| s.media.remove(0).item)
    };
    let m = load(&inside).unwrap();
    let (near, far) = (vec3(0.375, 0.5, 0.5), vec3(9.0, 0.5, 0.5));
    assert_eq!(m.coefficients(near).emission, Rgb::ONE);
    // The outermost value goes on, and the extinction does.
    assert_eq!((m.sigma_t(far), m.coefficients(far).emission), (Rgb::splat(2.0), Rgb::splat(3.0)));
    assert_eq!(m.coefficients(far).albedo, Rgb::splat(0.75));
    assert!(m.extinction().is_some() && m.homogeneous().is_none());
    let message = load(&grid("albedo")).unwrap_err().to_string();
    assert!(message.contains("albedo is 2"), "{message}");
    let message = load(&grid("sigma_t")).unwrap_err().to_string();
    assert!(message.contains("`sigma_t` of a homogeneous medium must be one number"), "{message}");
}

/// Mean cosines and weights of phase functions are read from volumes; negative cosines stay what they are.
#[test]
fn phase_functions_take_their_numbers_from_grids() {
    let folder = Folder::new();
    ramp(&folder);
    let signed = Grid::new([4, 1, 1], 1, vec![-0.001, 0.2, 0.4, 0.6]).unwrap();
    let bounds = [Vec3::ZERO, Vec3::splat(1.0)];
    folder.file("signed.vol", encode(&VolFile { grid: signed, bounds }).unwrap());
    let grid = |name: &str, file: &str| {
        format!(
            "<volume name=\"{name}\" type=\"gridvolume\"><string name=\"filename\" \
             value=\"{file}.vol\"/></volume>"
        )
    };
    let load = |phase: &str| {
        let text = format!(
            "<scene version=\"3.0.0\"><medium type=\"homogeneous\">{phase}</medium></scene>"
        );
        let file = folder.file("s.xml", text);
        read_scene(&file, &Defaults::new()).map(|mut s| s.media.remove(0).item)
    };
    let at = |x: f64| vec3(x, 0.5, 0.5);
    let hg = |file: &str| format!("<phase type=\"hg\">{}</phase>", grid("g", file));
    let m = load(&hg("signed")).unwrap();
    for (x, g) in [(0.125, -0.001), (0.5, 0.3), (9.0, 0.6)] {
        let found = m.phase_at(at(x)).mean_cosine_parameter().unwrap();
        assert!((found - g).abs() < 1e-7, "{found} at {x}");
    }
    assert!(m.homogeneous().is_none() && m.extinction().is_some() && m.is_carried());
    assert_eq!(m.voxels(Property::G).unwrap().size(), [4, 1, 1]);
    let message = load(&hg("ramp")).unwrap_err().to_string();
    assert!(message.contains("g is 1; it must be between -1 and 1"), "{message}");
    let parts = r#"<phase type="isotropic"/><phase type="rayleigh"/>"#;
    let blend =
        |file: &str| format!("<phase type=\"blendphase\">{}{parts}</phase>", grid("weight", file));
    let message = load(&blend("ramp")).unwrap_err().to_string();
    assert!(message.contains("weight is 2; it must be between 0 and 1"), "{message}");
    let m = load(&blend("signed")).unwrap();
    assert!(m.voxels(Property::Weight).is_some() && m.voxels(Property::G).is_none());
    let even = 0.25 / core::f64::consts::PI;
    let value = at_cosine(&m.phase_at(at(0.5)), 0.0);
    assert!((value - even * (0.7 + 0.3 * 0.75)).abs() < 1e-7, "{value}");
}

#[test]
fn absorbing_and_scattering_grids() {
    let folder = Folder::new();
    ramp(&folder);
    let grid = |name: &str| {
        format!(
            "<volume name=\"{name}\" type=\"gridvolume\"><string name=\"filename\" \
             value=\"ramp.vol\"/></volume>"
        )
    };
    let zero = "<float name=\"sigma_a\" value=\"0\"/>";
    let m = grid_medium(&folder, "3.0.0", &format!("{}{zero}", grid("sigma_s")));
    let c = m.coefficients(vec3(0.375, 0.5, 0.5));
    assert_eq!((c.sigma_t, c.albedo), (Rgb::ONE, Rgb::ONE));
    let both = format!("{}{}", grid("sigma_s"), grid("sigma_a"));
    let text =
        format!("<scene version=\"3.0.0\"><medium type=\"heterogeneous\">{both}</medium></scene>");
    let file = folder.file("s.xml", text);
    let message = read_scene(&file, &Defaults::new()).unwrap_err().to_string();
    assert!(message.contains("give `sigma_t` and `albedo`"), "{message}");
}

#[test]
fn unusable_grids() {
    let volume = |more: &str| {
        format!(
            "<medium type=\"heterogeneous\">\n<volume name=\"sigma_t\" type=\"gridvolume\">{more}\
             </volume></medium>"
        )
    };
    refused(&volume(""), &[":3", "`filename` is missing"]);
    refused(&volume(r#"<string name="filename" value="no.vol"/>"#), &[":3", "no.vol"]);
    let vdb = "<medium type=\"heterogeneous\"><volume name=\"sigma_t\" type=\"vdb\"/></medium>";
    refused(vdb, &["`vdb` is not supported"]);
}

/// Bytes of a volume of six channels.
fn six_channels(size: [i32; 3], values: &[f32]) -> Vec<u8> {
    let head = [1, size[0], size[1], size[2], 6].map(i32::to_le_bytes);
    let corners = [0.0_f32, 0.0, 0.0, 1.0, 1.0, 1.0].map(f32::to_le_bytes);
    let values = values.iter().map(|v| v.to_le_bytes());
    let numbers = head.into_iter().chain(corners).chain(values).flatten();
    b"VOL\x03".iter().copied().chain(numbers).collect()
}

#[test]
fn microflakes_are_read_from_six_channels() {
    let folder = Folder::new();
    let [a, b] = [[1.0, 0.5, 0.25, 0.1, -0.1, 0.05], [0.5, 0.5, 0.5, 0.0, 0.0, 0.1_f32]];
    let bad = [0.5, 0.5, 0.5, 0.6, 0.0, 0.0];
    for (name, size, values) in [
        ("one", [1, 1, 1], a.to_vec()),
        ("two", [2, 1, 1], [a, b].concat()),
        ("bad", [2, 1, 1], [a, bad].concat()),
    ] {
        folder.file(&format!("{name}.vol"), six_channels(size, &values));
    }
    folder.file("seven.vol", {
        let mut bytes = six_channels([1, 1, 1], &a);
        bytes[20] = 3;
        bytes
    });
    let load = |inside: &str| {
        let text = format!(
            "<scene version=\"3.0.0\"><medium type=\"homogeneous\"><phase type=\"sggx\">{inside}\
             </phase></medium></scene>"
        );
        let file = folder.file("s.xml", text);
        read_scene(&file, &Defaults::new()).map(|mut s| s.media.remove(0).item)
    };
    let of = |file: &str| {
        format!(
            "<volume name=\"S\" type=\"gridvolume\"><string name=\"filename\" \
             value=\"{file}.vol\"/><transform name=\"to_world\"><rotate z=\"1\" angle=\"30\"/>\
             </transform></volume>"
        )
    };
    let m = load(&of("one")).unwrap();
    assert!(m.homogeneous().is_some() && m.extinction().is_none() && m.is_carried());
    let area = m.projected_area(Vec3::ZERO, vec3(0.6, 0.8, 0.0));
    assert!((area * area - (0.36 + 0.32 + 0.96 * 0.1)).abs() < 1e-7, "{area}");
    let m = load(&of("two")).unwrap();
    assert_eq!(m.voxels(Property::SggxOffDiagonal).unwrap().size(), [2, 1, 1]);
    // The volume is turned, and S is not.
    let inside = m.voxels(Property::SggxDiagonal).unwrap().to_world().point(vec3(0.1, 0.5, 0.5));
    assert!((m.projected_area(inside, Vec3::Y) - 0.5_f64.sqrt()).abs() < 1e-7);
    for (inside, part) in [
        (of("bad"), "at voxel [1, 0, 0]"),
        (of("seven"), "the number of channels is 3, expected 6"),
        (String::new(), "the volume `S` is missing"),
    ] {
        let message = load(&inside).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
}
