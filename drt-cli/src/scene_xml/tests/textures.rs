//! Textures, and texture coordinates of shapes.

use drt_estimators::Scene;
use drt_estimators::emitter::Emitter;
use drt_estimators::surface::{Bsdf, Property};
use drt_estimators::texture::{Texture, VolumeTexture};
use drt_geom::Mesh;
use drt_math::{Rgb, Vec3, vec3};
use drt_medium::Grid;
use drt_medium::vol::{VolFile, encode};

use super::{refused, scene};
use crate::testing::Folder;
use crate::{CliError, Defaults, read_scene};

fn load(folder: &Folder, body: &str) -> Result<Scene, CliError> {
    let file = folder.file("s.xml", format!("<scene version=\"3.0.0\">\n{body}</scene>"));
    read_scene(&file, &Defaults::new())
}

fn textures(bsdf: &Bsdf) -> &[(Property, Texture)] {
    let Bsdf::Textured(textured) = bsdf else { panic!("{bsdf:?}") };
    &textured.textures
}

/// Black, red, white and a grey of half the code value.
fn picture(folder: &Folder) {
    let pixels = [[0, 0, 0], [255, 0, 0], [255, 255, 255], [128, 128, 128]];
    let image = image::RgbImage::from_fn(2, 2, |x, y| image::Rgb(pixels[(2 * y + x) as usize]));
    image.save(folder.path().join("four.png")).unwrap();
}

fn bitmap(inside: &str) -> String {
    format!(
        "<texture name=\"reflectance\" type=\"bitmap\"><string name=\"filename\" \
         value=\"four.png\"/>{inside}</texture>"
    )
}

#[test]
fn checkerboards_and_what_they_stand_for() {
    // For a number the two change places, as in Mitsuba.
    let s = scene(
        r#"<bsdf type="diffuse"/>
           <bsdf type="twosided"><bsdf type="roughconductor">
             <texture name="alpha" type="checkerboard"><float name="color0" value="0.1"/>
               <float name="color1" value="0.3"/>
               <transform name="to_uv"><scale x="10" y="5"/></transform></texture>
           </bsdf></bsdf>"#,
    );
    let Bsdf::TwoSided(two) = &s.bsdfs[1].item else { panic!() };
    let [(Property::Alpha, texture)] = textures(&two.front) else { panic!() };
    for (uv, value) in [([0.01, 0.01], 0.3), ([0.07, 0.01], 0.1), ([0.07, 0.15], 0.3)] {
        assert!((texture.at(uv).r - value).abs() < 1e-12, "{uv:?}");
    }
}

#[test]
fn images_are_linear_unless_raw() {
    let folder = Folder::new();
    picture(&folder);
    let texture = |inside: &str| {
        let body = format!("<bsdf type=\"diffuse\">{}</bsdf>", bitmap(inside));
        textures(&load(&folder, &body).unwrap().bsdfs[0].item)[0].1.clone()
    };
    let plain = texture("");
    assert_eq!(plain.at([0.75, 0.25]), Rgb::new(1.0, 0.0, 0.0));
    assert!((plain.at([0.75, 0.75]).g - 0.215_860_5).abs() < 1e-6);
    let raw = texture(r#"<boolean name="raw" value="true"/>"#);
    assert!((raw.at([0.75, 0.75]).g - 128.0 / 255.0).abs() < 1e-6);
    assert_eq!(plain.at([0.5, 0.25]).r, 0.5);
    let nearest = texture(
        r#"<string name="filter_type" value="nearest"/><string name="wrap_mode" value="clamp"/>
           <transform name="to_uv"><scale value="2"/><translate x="-0.5"/></transform>"#,
    );
    // u = 2 · 0.6 - 0.5
    assert_eq!(nearest.at([0.6, 0.1]), Rgb::new(1.0, 0.0, 0.0));
    assert_eq!(nearest.at([9.0, 0.1]), Rgb::new(1.0, 0.0, 0.0));
    // By a name, for a number: luminance.
    let body = "<texture id=\"t\" type=\"bitmap\"><string name=\"filename\" value=\"four.png\"/>\
                <boolean name=\"raw\" value=\"true\"/></texture><bsdf type=\"roughconductor\">\
                <ref name=\"specular_reflectance\" id=\"t\"/><ref name=\"alpha\" id=\"t\"/></bsdf>";
    let s = load(&folder, body).unwrap();
    let own = textures(&s.bsdfs[0].item);
    assert_eq!(own.len(), 2);
    let (_, alpha) = own.iter().find(|t| t.0 == Property::Alpha).unwrap();
    assert!((alpha.at([0.75, 0.25]).r - 0.212_671).abs() < 1e-6);
}

#[test]
fn stored_images_are_counted() {
    let folder = Folder::new();
    picture(&folder);
    let body = format!("<bsdf type=\"diffuse\">{}</bsdf>", bitmap(""));
    let texture = textures(&load(&folder, &body).unwrap().bsdfs[0].item)[0].1.clone();
    let json = serde_json::to_string(&texture).unwrap();
    assert_eq!(serde_json::from_str::<Texture>(&json).unwrap(), texture);
    let broken = json.replace("[2,2]", "[3,2]");
    let error = serde_json::from_str::<Texture>(&broken).unwrap_err().to_string();
    assert!(error.contains("3x2 texels were expected, found 4"), "{error}");
}

#[test]
fn unusable_textures_are_told() {
    let folder = Folder::new();
    picture(&folder);
    folder.file("text.png", "no image");
    let refused_there = |body: &str, parts: &[&str]| {
        let message = load(&folder, body).map(|_| ()).unwrap_err().to_string();
        for part in parts {
            assert!(message.contains(part), "expected `{part}` in: {message}");
        }
    };
    let diffuse = |t: &str| format!("<bsdf type=\"diffuse\">{t}</bsdf>");
    refused_there(&diffuse(&bitmap("").replace("four", "text")), &[":2", "text.png"]);
    refused_there(&diffuse(&bitmap("").replace("four", "none")), &["no file `none.png`"]);
    refused_there(
        &diffuse(&bitmap("<string name=\"wrap_mode\" value=\"twist\"/>")),
        &["expected repeat, mirror, clamp"],
    );
    let light = bitmap("").replace("reflectance", "radiance");
    let lamp = |light: &str| {
        format!("<shape type=\"cube\"><emitter type=\"area\">{light}</emitter></shape>")
    };
    let scene = load(&folder, &lamp(&light)).unwrap();
    let Emitter::TexturedArea { radiance, texture } = &scene.emitters[0].item.emitter else {
        panic!()
    };
    assert_eq!((*radiance, texture.size()), (Rgb::ONE, [2, 2]));
    refused_there(
        &format!("<emitter type=\"point\">{}</emitter>", light.replace("radiance", "intensity")),
        &["cannot stand for `intensity` here"],
    );
    let dark = "<texture name=\"radiance\" type=\"checkerboard\"><float name=\"color0\" value=\"-1\"/></texture>";
    refused_there(&lamp(dark), &[":2", "radiance has a channel of -1"]);
    // All at once.
    let none = |name: &str| diffuse(&bitmap("").replace("four", name));
    let both = format!("{}\n{}", none("none"), none("lost"));
    refused_there(&both, &["2 files are missing", "none.png", ":3", "lost.png"]);
    let board = |name: &str| format!("<texture name=\"{name}\" type=\"checkerboard\"/>");
    refused(
        &format!("<bsdf type=\"roughplastic\">{}</bsdf>", board("alpha")),
        &["has no \"alpha\""],
    );
    let negative = "<bsdf type=\"phong\"><texture name=\"exponent\" type=\"checkerboard\">\
                    <float name=\"color0\" value=\"-1\"/>\
                    <float name=\"color1\" value=\"5\"/></texture></bsdf>";
    refused(negative, &[":2", "texture of \"exponent\"", "above 0"]);
    let pixel = |x, y| (0.5_f32, if (x, y) == (0, 1) { f32::NAN } else { 0.5 }, 0.5_f32);
    exr::prelude::write_rgb_file(folder.path().join("nan.exr"), 2, 2, pixel).unwrap();
    refused_there(
        &diffuse(&bitmap("").replace("four.png", "nan.exr")),
        &[":2", "nan.exr", "column 0, row 1 is not finite"],
    );
}

/// The coordinates of the surface's point nearest to `p`, flat triangles standing for curved ones.
fn value(folder: &Folder, name: &str) -> Rgb {
    let body = format!("<bsdf type=\"diffuse\">{}</bsdf>", bitmap("").replace("four.png", name));
    let scene = load(folder, &body).unwrap();
    let [(_, texture)] = textures(&scene.bsdfs[0].item) else { panic!() };
    texture.at([0.3, 0.8])
}

fn exr_file(folder: &Folder, name: &str, size: usize, channels: &[(&str, f32)]) {
    use exr::prelude::*;
    let channel = |(name, v): &(&str, f32)| {
        AnyChannel::new(Text::from(*name), FlatSamples::F32(vec![*v; size * size]))
    };
    let channels = AnyChannels::sort(channels.iter().map(channel).collect());
    let image = Image::from_channels((size, size), channels);
    image.write().to_file(folder.path().join(name)).unwrap();
}

#[test]
fn images_of_one_texel_and_of_few_channels_are_right() {
    let folder = Folder::new();
    let at = |name: &str| folder.path().join(name);
    image::GrayImage::from_pixel(1, 1, image::Luma([255])).save(at("one.png")).unwrap();
    assert_eq!(value(&folder, "one.png"), Rgb::ONE);
    let grey = image::ImageBuffer::from_pixel(3, 2, image::LumaA([65_535_u16, 7]));
    grey.save(at("grey.png")).unwrap();
    assert_eq!(value(&folder, "grey.png"), Rgb::ONE);
    let see_through = image::RgbaImage::from_pixel(2, 2, image::Rgba([255, 0, 255, 3]));
    see_through.save(at("rgba.png")).unwrap();
    assert_eq!(value(&folder, "rgba.png"), Rgb::new(1.0, 0.0, 1.0));
    exr_file(&folder, "one.exr", 1, &[("R", 0.25), ("G", 0.5), ("B", 0.75), ("A", 0.1)]);
    assert_eq!(value(&folder, "one.exr"), Rgb::new(0.25, 0.5, 0.75));
    exr_file(&folder, "grey.exr", 2, &[("Y", 0.5)]);
    assert_eq!(value(&folder, "grey.exr"), Rgb::splat(0.5));
}

/// Bytes of a PNG or EXR that say that it is 16384 texels wide and high.
#[test]
fn broken_and_huge_images_are_told_at_once() {
    let folder = Folder::new();
    let body = |name: &str| {
        format!("<bsdf type=\"diffuse\">{}</bsdf>", bitmap("").replace("four.png", name))
    };
    let refused = |name: &str, bytes: &[u8], part: &str| {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        let message = load(&folder, &body(name)).map(|_| ()).unwrap_err().to_string();
        assert!([":2", name, part].iter().all(|p| message.contains(p)), "{message}");
    };
    picture(&folder);
    let png = std::fs::read(folder.path().join("four.png")).unwrap();
    refused("cut.png", &png[..png.len() / 2], "");
    refused("empty.png", &[], "");
    let mut huge = png.clone();
    for at in [16, 20] {
        huge[at..at + 4].copy_from_slice(&16_384_u32.to_be_bytes());
    }
    // The checksum of what was changed.
    let crc = huge[12..29].iter().fold(!0_u32, |c, b| {
        (0..8).fold(c ^ u32::from(*b), |c, _| (c >> 1) ^ (0xedb8_8320 * (c & 1)))
    });
    huge[29..33].copy_from_slice(&(!crc).to_be_bytes());
    refused("huge.png", &huge, "16384x16384 pixels are too many; at most 67108864 fit");
    exr_file(&folder, "two.exr", 2, &[("R", 0.25), ("G", 0.5), ("B", 0.75)]);
    let exr = std::fs::read(folder.path().join("two.exr")).unwrap();
    refused("cut.exr", &exr[..exr.len() - 9], "");
    refused("no.exr", b"v/1\x01 not one", "");
    let mut huge = exr;
    for name in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let at = huge.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4 + 8;
        for at in [at, at + 4] {
            huge[at..at + 4].copy_from_slice(&16_383_u32.to_le_bytes());
        }
    }
    refused("huge.exr", &huge, "16384x16384 pixels are too many");
    exr_file(&folder, "few.exr", 2, &[("R", 0.25), ("G", 0.5)]);
    let few = std::fs::read(folder.path().join("few.exr")).unwrap();
    refused("few.exr", &few, "its channels are G, R; expected R, G and B, or Y");
}

fn uv(mesh: &Mesh, p: Vec3) -> [f64; 2] {
    let nearest = (0..mesh.triangles.len() as u32).map(|i| {
        let [a, b, c] = mesh.triangle(i);
        let (n, q) = ((b - a).cross(c - a), p - a);
        let weights = [q.cross(c - a).dot(n), (b - a).cross(q).dot(n)].map(|w| w / n.dot(n));
        let outside = weights.iter().map(|w| (-w).max(0.0)).sum::<f64>()
            + (weights[0] + weights[1] - 1.0).max(0.0);
        let off = q.dot(n.normalize()).abs() + outside;
        (off, mesh.texcoord(i, weights))
    });
    nearest.min_by(|a, b| a.0.total_cmp(&b.0)).expect("a triangle").1
}

/// What Mitsuba 3.9.1 says of the same points.
#[test]
fn primitives_have_mitsubas_coordinates() {
    let mesh = |kind: &str| scene(&format!("<shape type=\"{kind}\"/>")).shapes.remove(0).mesh;
    let cases = [
        ("rectangle", vec3(-0.5, -0.5, 0.0), [0.25, 0.25]),
        ("rectangle", vec3(0.5, 0.25, 0.0), [0.75, 0.625]),
        ("disk", vec3(0.0, 0.5, 0.0), [0.5, 0.25]),
        ("disk", vec3(-0.3, -0.3, 0.0), [0.4243, 0.625]),
        ("sphere", vec3(0.5, 0.1, 0.8602), [0.0314, 0.1703]),
        ("sphere", vec3(-0.3, 0.3, 0.9055), [0.375, 0.1395]),
        ("cylinder", vec3(0.866, 0.5, 0.25), [0.0833, 0.25]),
        ("cylinder", vec3(0.866, -0.5, 0.75), [0.9167, 0.75]),
        ("cube", vec3(0.5, 0.25, 1.0), [0.625, 0.75]),
        ("cube", vec3(0.5, 0.25, -1.0), [0.375, 0.75]),
        ("cube", vec3(1.0, 0.5, 0.25), [0.75, 0.375]),
        ("cube", vec3(-1.0, 0.5, 0.25), [0.75, 0.625]),
        ("cube", vec3(0.5, 1.0, 0.25), [0.25, 0.375]),
        ("cube", vec3(0.5, -1.0, 0.25), [0.625, 0.75]),
    ];
    for (kind, p, expected) in cases {
        let found = uv(&mesh(kind), p);
        let off = (found[0] - expected[0]).abs().max((found[1] - expected[1]).abs());
        assert!(off < 3e-3, "{kind} {p:?}: {found:?}, not {expected:?}");
    }
}

#[test]
fn files_bring_their_coordinates() {
    let folder = Folder::new();
    folder.file("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0.25\nvt 0.5 1\nf 1/1 2/2 3/3\n");
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
               property float z\nproperty float s\nproperty float t\nelement face 1\n\
               property list uchar int vertex_indices\nend_header\n\
               0 0 0 0 0\n1 0 0 1 0.25\n0 1 0 0.5 1\n3 0 1 2\n";
    folder.file("a.ply", ply);
    let corners = |kind: &str, inside: &str| {
        let body = format!(
            "<shape type=\"{kind}\"><string name=\"filename\" value=\"a.{kind}\"/>{inside}</shape>"
        );
        load(&folder, &body).unwrap().shapes[0].mesh.texcoords.clone().unwrap()[0]
    };
    let upright = [[0.0, 0.0], [1.0, 0.25], [0.5, 1.0]];
    let flipped = [[0.0, 1.0], [1.0, 0.75], [0.5, 0.0]];
    let no = r#"<boolean name="flip_tex_coords" value="false"/>"#;
    assert_eq!(corners("obj", ""), flipped);
    assert_eq!(corners("obj", no), upright);
    assert_eq!(corners("ply", ""), upright);
    // What turns triangles over takes their corners along.
    let mirrored = "<transform name=\"to_world\"><scale x=\"-1\"/></transform>\
                    <boolean name=\"face_normals\" value=\"true\"/>";
    let [a, b, c] = corners("ply", mirrored);
    assert_eq!(a, upright[0]);
    assert!([b, c] == [upright[1], upright[2]] || [c, b] == [upright[1], upright[2]]);
}

#[test]
fn volumes_on_surfaces() {
    let folder = Folder::new();
    let grid = Grid::new([2, 1, 1], 1, vec![0.2, 0.6]).unwrap();
    let bounds = [Vec3::ZERO, Vec3::splat(1.0)];
    folder.file("v.vol", encode(&VolFile { grid, bounds }).unwrap());
    let volume = |rest: &str| {
        format!(
            "<volume {rest} type=\"gridvolume\"><string name=\"filename\" value=\"v.vol\"/>\
             <transform name=\"to_world\"><scale value=\"2\"/></transform></volume>"
        )
    };
    let paint = |inside: &str| {
        format!(
            "<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"volume\">{inside}</texture></bsdf>"
        )
    };
    let shape = |kind: &str, paint: &str| {
        format!(
            "<shape type=\"{kind}\">{paint}<transform name=\"to_world\"><translate x=\"1\" y=\"0.5\"/>\
             </transform></shape>"
        )
    };
    let inside = shape("rectangle", &paint(&volume("name=\"volume\"")));
    let referred = shape("rectangle", &paint("<ref id=\"v\" name=\"volume\"/>"));
    for body in [inside.clone(), format!("{}{referred}", volume("id=\"v\""))] {
        let s = load(&folder, &body).unwrap();
        assert!(s.check().is_ok());
        let positions = s.shapes[0].mesh.attribute(VolumeTexture::POSITIONS).unwrap();
        let [x, y, _] = positions.at(0, [0.0, 0.5]);
        let mesh = &s.shapes[0].mesh;
        let [i, _, k] = mesh.triangles[0].map(|v| mesh.positions[v as usize]);
        assert_eq!([x, y], [0.5 * (i.x + k.x), 0.5 * (i.y + k.y)]);
        s.bsdfs[0].item.for_each_texture(|_, texture| {
            let Texture::Volume(v) = texture else { panic!() };
            assert!((v.volume.value(vec3(1.25, 0.3, 9.0)).g - 0.5).abs() < 1e-6);
            let off = [0.2, 0.6].iter().zip(texture.bounds()).map(|(v, b)| (b.g - v).abs());
            assert!(off.fold(0.0, f64::max) < 1e-6);
        });
    }
    // Eight round shapes would be images of one mesh, which cannot know where all of them are.
    let spheres = shape("sphere", &paint(&volume("name=\"volume\""))).repeat(8);
    assert!(load(&folder, &spheres).unwrap().instances.is_empty());
    let fails = |body: &str, part: &str| {
        let message = load(&folder, body).map_err(|e| e.to_string()).unwrap_err();
        assert!(message.contains(part), "{message}");
    };
    fails(&shape("cube", &paint("")), "`volume` is missing");
    fails(&shape("cube", &paint("<float name=\"volume\" value=\"1\"/>")), "must be a <volume>");
    fails(
        &format!("<shape type=\"shapegroup\">{inside}</shape>"),
        "in a shapegroup is not supported",
    );
    let lamp =
        paint(&volume("name=\"volume\"")).replace("bsdf", "emitter").replace("diffuse", "area");
    fails(&shape("cube", &lamp.replace("reflectance", "radiance")), "volumes are for BSDFs");
}

#[test]
fn attributes_of_meshes() {
    let folder = Folder::new();
    folder.file(
        "t.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         property float tone_0\nproperty float tone_1\nproperty float tone_2\nelement face 1\n\
         property list uchar int vertex_indices\nproperty float gloss_0\nend_header\n\
         0 0 0 0.1 0.2 0.3\n1 0 0 0.5 0.2 0.3\n0 1 0 0.1 0.6 -1\n3 0 1 2 0.7\n",
    );
    let body = |name: &str| {
        format!(
            "<shape type=\"ply\"><string name=\"filename\" value=\"t.ply\"/><bsdf type=\"diffuse\">\
             <texture name=\"reflectance\" type=\"mesh_attribute\"><string name=\"name\" value=\"{name}\"/>\
             <float name=\"scale\" value=\"0.5\"/></texture></bsdf></shape>"
        )
    };
    let s = load(&folder, &body("face_gloss")).unwrap();
    let attribute = s.shapes[0].mesh.attribute("face_gloss").unwrap();
    assert!((attribute.at(0, [0.2, 0.2])[1] - 0.7).abs() < 1e-6);
    let tone = s.shapes[0].mesh.attribute("vertex_tone").unwrap().at(0, [0.5, 0.25]);
    assert!((tone[0] - 0.3).abs() < 1e-6 && (tone[1] - 0.3).abs() < 1e-6);
    assert!(s.check().is_ok());
    let fails = |name: &str, part: &str| {
        let loaded = load(&folder, &body(name)).map_err(|e| e.to_string());
        let message = loaded.and_then(|s| s.check().map_err(|e| e.to_string())).unwrap_err();
        assert!(message.contains(part), "{message}");
    };
    fails("vertex_tone", "\"reflectance\" is -0.5");
    fails("vertex_nothing", "the attribute `vertex_nothing`, which its mesh does not have");
    fails("tone", "begin with vertex_ or face_");
}
