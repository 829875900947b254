//! Scene files that say nothing usable.

use std::fmt::Write as _;

use crate::hard_inputs::{Case, case, only_scene, refused, scene};

fn in_scene(name: &'static str, body: &str, parts: &'static [&'static str]) -> Case {
    only_scene(name, scene(body), parts)
}

#[test]
fn scenes_that_are_no_scenes() {
    let whole = scene(r#"<shape type="cube"/>"#);
    let deep = format!("<scene version=\"3.0.0\">{}", "<a>".repeat(300_000));
    let deep_closed = format!("{deep}{}</scene>", "</a>".repeat(300_000));
    refused([
        only_scene("empty", "", &["s.xml:1:1: not well-formed"]),
        only_scene("cut", &whole[..whole.len() - 20], &["s.xml:", "not well-formed"]),
        only_scene("bytes", [0xff, 0xfe, 0, 1], &["s.xml: cannot read this file"]),
        only_scene("zeros", [0; 64], &["s.xml:1:1: not well-formed"]),
        only_scene("deep", deep, &["s.xml:"]),
        only_scene("deep and closed", deep_closed, &["s.xml:1", "nest"]),
        only_scene(
            "entities",
            "<!DOCTYPE s [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;&a;\">]><scene>&b;</scene>",
            &["s.xml:1:1: not well-formed"],
        ),
        case("no file", [] as [(&str, &str); 0], &["s.xml: cannot read"]),
    ]);
}

#[test]
fn elements_that_do_not_fit() {
    let ring = r#"<bsdf type="twosided" id="a"><ref id="b"/></bsdf>
<bsdf type="twosided" id="b"><ref id="a"/></bsdf>"#;
    refused([
        in_scene(
            "unknown element",
            "<texture type=\"bitmap\"/>",
            &["s.xml:6: <texture", "<scene>"],
        ),
        in_scene(
            "unknown inside",
            "<shape type=\"cube\">\n<rotor/></shape>",
            &["s.xml:7: <rotor>"],
        ),
        in_scene("unknown type", "<shape type=\"torus\"/>", &["s.xml:6", "torus", "sphere"]),
        in_scene(
            "dangling",
            "<shape type=\"cube\">\n<ref id=\"x\"/></shape>",
            &["s.xml:7", "`x`", "cam"],
        ),
        in_scene(
            "wrong kind",
            "<shape type=\"cube\"><ref id=\"cam\"/></shape>",
            &["s.xml:6", "cam"],
        ),
        in_scene("taken", "<shape type=\"cube\" id=\"cam\"/>", &["s.xml:6", "`cam`", "line 2"]),
        in_scene(
            "itself",
            "<bsdf type=\"twosided\" id=\"a\"><ref id=\"a\"/></bsdf>",
            &["s.xml:6", "twosided"],
        ),
        in_scene("ring", ring, &["s.xml:7", "twosided"]),
        in_scene(
            "alias ring",
            "<alias id=\"a\" as=\"b\"/><alias id=\"b\" as=\"a\"/>",
            &["s.xml:6"],
        ),
        in_scene("no sensor twice", "<integrator type=\"path\"/>", &["s.xml:6", "one integrator"]),
    ]);
}

#[test]
fn includes_and_defaults_without_end() {
    let include =
        |name: &str| format!("<scene version=\"3.0.0\">\n<include filename=\"{name}\"/></scene>");
    // Each file includes the next one twice, and each default repeats the one before it.
    const NAMES: [&str; 31] = [
        "s.xml", "1.xml", "2.xml", "3.xml", "4.xml", "5.xml", "6.xml", "7.xml", "8.xml", "9.xml",
        "10.xml", "11.xml", "12.xml", "13.xml", "14.xml", "15.xml", "16.xml", "17.xml", "18.xml",
        "19.xml", "20.xml", "21.xml", "22.xml", "23.xml", "24.xml", "25.xml", "26.xml", "27.xml",
        "28.xml", "29.xml", "30.xml",
    ];
    let twice = |next: &str| {
        let include = format!("<include filename=\"{next}\"/>");
        format!("<scene version=\"3.0.0\"><bsdf type=\"null\"/>{include}\n{include}</scene>")
    };
    let mut tree: Vec<_> = NAMES.windows(2).map(|w| (w[0], twice(w[1]))).collect();
    tree.push((NAMES[30], "<scene version=\"3.0.0\"/>".into()));
    let mut doubling = String::from("<default name=\"d0\" value=\"1 2 3 4 5 6 7 8\"/>\n");
    for i in 1..=40 {
        let _ = writeln!(doubling, "<default name=\"d{i}\" value=\"$d{0} $d{0}\"/>", i - 1);
    }
    refused([
        only_scene("itself", include("s.xml"), &["s.xml:2", "includes itself"]),
        case(
            "ring",
            [("s.xml", include("b.xml")), ("b.xml", include("s.xml"))],
            &["b.xml:2", "s.xml includes itself"],
        ),
        only_scene("missing", include("b.xml"), &["s.xml:2", "b.xml"]),
        only_scene("folder", include("."), &["s.xml:2", "cannot read"]),
        case("tree", tree, &[".xml", "more than 4096 files"]),
        in_scene("doubling", &doubling, &["s.xml:", "longer than"]),
        in_scene("undefined", "<float name=\"$x\" value=\"1\"/>", &["s.xml:6", "$x has no value"]),
    ]);
}

#[test]
fn numbers_beyond_reason() {
    let placed = |step: &str| {
        format!("<shape type=\"cube\">\n<transform name=\"to_world\">{step}</transform></shape>")
    };
    let camera =
        |inside: &str| format!("<sensor type=\"perspective\" id=\"other\">\n{inside}</sensor>");
    let film = |w: &str| {
        camera(&format!(
            "<film type=\"hdrfilm\"><integer name=\"width\" value=\"{w}\"/>\
             <integer name=\"height\" value=\"65536\"/></film>"
        ))
    };
    let looking =
        |at: &str| camera(&format!("<transform name=\"to_world\"><lookat {at}/></transform>"));
    let wide_filter = scene("<shape type=\"cube\"/>").replace(
        "</film>",
        "<rfilter type=\"gaussian\"><float name=\"stddev\" value=\"1e300\"/></rfilter></film>",
    );
    refused([
        in_scene("nan", &placed("<translate x=\"nan\"/>"), &["s.xml:7", "`nan`", "finite"]),
        in_scene("infinite", &placed("<scale value=\"1e999\"/>"), &["s.xml:7", "`1e999`"]),
        in_scene(
            "overflow",
            &placed("<scale value=\"1e200\"/><scale value=\"1e200\"/>"),
            &["s.xml:7", "overflows"],
        ),
        in_scene("huge", &placed("<scale value=\"1e200\"/>"), &["s.xml:6", "cube", "1e100"]),
        in_scene("far", &placed("<translate x=\"1e150\"/>"), &["s.xml:6", "cube", "1e100"]),
        in_scene(
            "flat emitter",
            "<shape type=\"rectangle\">\n<transform name=\"to_world\"><scale x=\"0\"/></transform><emitter type=\"area\"/></shape>",
            &["s.xml:6", "area"],
        ),
        in_scene(
            "a point",
            "<shape type=\"sphere\"><transform name=\"to_world\"><scale value=\"0\"/></transform></shape>",
            &["s.xml:6"],
        ),
        in_scene(
            "no radius",
            "<shape type=\"sphere\"><float name=\"radius\" value=\"0\"/></shape>",
            &["s.xml:6", "radius"],
        ),
        in_scene(
            "resolution",
            "<shape type=\"sphere\"><integer name=\"resolution\" value=\"1000000000\"/></shape>",
            &["s.xml:6", "resolution"],
        ),
        in_scene("wide film", &film("99999999999"), &["s.xml:7", "width"]),
        in_scene("large film", &film("65536"), &["s.xml:7", "pixels"]),
        in_scene(
            "no view",
            &looking("origin=\"1 1 1\" target=\"1 1 1\" up=\"0 0 1\""),
            &["s.xml:7: <lookat>"],
        ),
        in_scene(
            "no up",
            &looking("origin=\"0 0 1\" target=\"0 0 0\" up=\"0 0 1\""),
            &["s.xml:7: <lookat>"],
        ),
        in_scene(
            "flat camera",
            &camera("<transform name=\"to_world\"><scale x=\"0\"/></transform>"),
            &["s.xml:6"],
        ),
        in_scene(
            "no angle",
            &camera("<float name=\"fov\" value=\"0\"/>"),
            &["s.xml:6", "field of view"],
        ),
        in_scene(
            "samples",
            &camera(
                "<sampler type=\"independent\"><integer name=\"sample_count\" value=\"1e9\"/></sampler>",
            ),
            &["s.xml:7", "1e9"],
        ),
        only_scene("filter", wide_filter, &["s.xml:4", "rfilter"]),
        in_scene(
            "fog",
            "<medium type=\"homogeneous\">\n<float name=\"sigma_t\" value=\"-1\"/></medium>",
            &["s.xml:6", "sigma_t"],
        ),
        in_scene(
            "albedo",
            "<medium type=\"homogeneous\">\n<float name=\"albedo\" value=\"1.5\"/></medium>",
            &["s.xml:6", "albedo"],
        ),
        in_scene(
            "asymmetry",
            "<medium type=\"homogeneous\"><phase type=\"hg\">\n<float name=\"g\" value=\"1\"/></phase></medium>",
            &["s.xml:6", "g"],
        ),
        in_scene(
            "roughness",
            "<bsdf type=\"roughconductor\"><float name=\"alpha\" value=\"0\"/></bsdf>",
            &["s.xml:6", "alpha"],
        ),
        in_scene(
            "radiance",
            "<emitter type=\"constant\"><rgb name=\"radiance\" value=\"1 -1 1\"/></emitter>",
            &["s.xml:6", "negative"],
        ),
        in_scene(
            "direction",
            "<emitter type=\"directional\"><vector name=\"direction\" value=\"0 0 0\"/></emitter>",
            &["s.xml:6", "direction"],
        ),
    ]);
}
