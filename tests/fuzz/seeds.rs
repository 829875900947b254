//! Writes a corpus for every target to start from: the examples' files, and small files made here.

use std::f32::consts::{FRAC_PI_2, PI};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use drt_estimators::surface::{MeasuredTables, RoughConductor};
use drt_fuzz::{SCENE, write};
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Mat3, Vec3};
use drt_medium::nanovdb::{self, NanoVdb};
use drt_medium::{Grid, vol};

const OLD_SCENE: &str = r#"<scene version="0.5.0">
    <sensor type="perspective">
        <transform name="toWorld"><lookAt origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
    </sensor>
    <shape type="sphere" id="ball">
        <point name="center" x="0" y="0" z="0"/><float name="radius" value="0.5"/>
        <bsdf type="phong"><float name="exponent" value="20"/><float name="kd" value="0.4"/></bsdf>
    </shape>
    <emitter type="spot"><float name="cutoffAngle" value="30"/></emitter>
    <emitter type="directional"><vector name="direction" x="0" y="-1" z="0"/></emitter>
    <emitter type="constant"/>
</scene>"#;

const EFFECTS: [&str; 10] = [
    r#"target = "box"
translate = [1, 0, 0]"#,
    r#"target = "lamp"
rotate = { axis = [0, 1, 0], pivot = [1, 0, 0] }"#,
    r#"target = "camera"
translate = [0.0, 1e-1, 0]"#,
    r#"target = "box"
scale = { factor = [1, 0.5, 0], pivot = [0, 0.6, 0] }"#,
    r#"target = "shape[0]"
matrix = [[0, 1, 0, 0], [0, 0, 0, 1], [0, 0, 0, 0.5]]"#,
    r#"target = "floor"
vertex_velocity = "velocity.txt""#,
    r#"target = "box"
vertex = { index = 3, direction = [0, 1, 0] }"#,
    r#"target = "fog"
property = "sigma_t"
add = [1, 1, 1]"#,
    r#"target = "metal"
property = "alpha"
multiply = 0.5
log = true"#,
    r#"target = "haze"
follow = "box""#,
];

const MEDIT: &str = "MeshVersionFormatted 2\nDimension 3\nVertices 5\n0 0 0 1\n1 0 0 1\n0 1 0 2\n\
0 0 1 2\n0 0 -1 0\nTriangles 1\n1 2 3 9\nTetrahedra 2\n1 2 3 4 0\n1 3 2 5 0\nEnd\n";

const TETGEN: &str = "5 3 1 1\n1 0 0 0 .5 1\n2 1 0 0 .5 1\n3 0 1 0 .5 1\n4 0 0 1 .5 1\n5 0 0 -1 .5 1\n\
---\n2 4 1\n1 1 2 3 4 7\n2 1 2 3 5 8\n";

fn main() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    for target in [
        "obj",
        "ply",
        "tet",
        "vol",
        "nvdb",
        "xml",
        "toml",
        "serialized",
        "bitmap",
        "spectrum",
        "measured",
    ] {
        std::fs::create_dir_all(corpus.join(target)).expect("the corpus folder can be written");
    }
    meshes(&corpus);
    write(&corpus.join("tet/two.mesh"), MEDIT.as_bytes());
    write(&corpus.join("tet/two.node"), TETGEN.as_bytes());
    volumes(&corpus.join("vol"));
    trees(&corpus.join("nvdb"));
    write(&corpus.join("xml/new.xml"), SCENE.as_bytes());
    write(&corpus.join("xml/old.xml"), OLD_SCENE.as_bytes());
    for (i, effect) in EFFECTS.iter().enumerate() {
        let job = format!(
            "scene = \"scene.xml\"\nsensor = \"camera\"\n[estimator]\nspp = 4\nmax_depth = 3\n\
             [[parameter]]\nname = \"p{i}\"\nvalue = 0.1\n[[parameter.effect]]\n{effect}\n"
        );
        write(&corpus.join(format!("toml/{i}.toml")), job.as_bytes());
    }
    write(&corpus.join("spectrum/pairs.txt"), b"# wavelength value\n400 0.1\n550, 0.8\n700 0.3\n");
    write(&corpus.join("spectrum/value.txt"), b"400:0.1, 500:0.7, 700:0.2");
    images(&corpus.join("bitmap"));
    for version in [3, 4] {
        write(&corpus.join(format!("serialized/{version}.serialized")), &serialized(version));
    }
    measured(&corpus.join("measured"));
    examples(&corpus);
}

/// Small images of every kind, after a byte that tells it.
fn images(folder: &Path) {
    use image::ImageFormat::{Bmp, Hdr, Jpeg, Png};
    for (kind, format) in (0_u8..).zip([Png, Jpeg, Bmp, Hdr]) {
        let colours =
            image::RgbImage::from_fn(4, 3, |x, y| image::Rgb([60 * x as u8, 80 * y as u8, 9]));
        let image = match format {
            Hdr => image::DynamicImage::ImageRgb8(colours).into_rgb32f().into(),
            _ => image::DynamicImage::ImageRgb8(colours),
        };
        let mut file = std::io::Cursor::new(vec![kind]);
        file.set_position(1);
        image.write_to(&mut file, format).expect("a small image");
        write(&folder.join(format!("{kind}")), &file.into_inner());
    }
    let path = folder.join("4");
    let pixel = |x, y| (x as f32, y as f32, 0.5_f32);
    exr::prelude::write_rgb_file(&path, 3, 2, pixel).expect("a small image");
    let bytes = std::fs::read(&path).expect("what was just written");
    write(&path, &[&[4], &bytes[..]].concat());
}

/// Metal, even and brushed.
fn measured(folder: &Path) {
    let metal = RoughConductor::default();
    let half = [-PI, -FRAC_PI_2, 0.0];
    for (name, alpha, phi_i) in [("even", [0.3; 2], &half[2..]), ("brushed", [0.5, 0.2], &half[..])]
    {
        let tables = MeasuredTables::of_metal(&metal, alpha, phi_i, [3, 5, 3]);
        let file = drt_cli::encode_measured(&tables.expect("a small material"));
        write(&folder.join(format!("{name}.bsdf")), &file);
    }
}

/// Two meshes of a triangle, with normals and texture coordinates.
fn serialized(version: u16) -> Vec<u8> {
    let mut part = vec![];
    part.extend(3_u32.to_le_bytes());
    if version == 4 {
        part.extend(b"name\0");
    }
    part.extend(3_u64.to_le_bytes());
    part.extend(1_u64.to_le_bytes());
    let corners = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let normals = [0.0_f32, 0.0, 1.0].repeat(3);
    let numbers = corners.into_iter().chain(normals).chain([0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    part.extend(numbers.flat_map(f32::to_le_bytes));
    part.extend([0_u32, 1, 2].into_iter().flat_map(u32::to_le_bytes));
    let deflated = || {
        let level = flate2::Compression::default();
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), level);
        std::io::Write::write_all(&mut encoder, &part).expect("memory");
        encoder.finish().expect("memory")
    };
    let mut file = Vec::new();
    let mut offsets = Vec::new();
    for _ in 0..2 {
        offsets.push(file.len() as u64);
        file.extend(0x041C_u16.to_le_bytes());
        file.extend(version.to_le_bytes());
        file.extend(deflated());
    }
    for offset in offsets {
        match version {
            3 => file.extend((offset as u32).to_le_bytes()),
            _ => file.extend(offset.to_le_bytes()),
        }
    }
    file.extend(2_u32.to_le_bytes());
    file
}

/// The files of the repository's examples that are small enough to mutate.
fn examples(corpus: &Path) {
    for path in files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples")) {
        let Ok(bytes) = std::fs::read(&path) else { continue };
        let target = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        let names = [path.parent().and_then(Path::file_name), path.file_name()];
        let [Some(folder), Some(file)] = names else { continue };
        if bytes.len() < 1 << 13 && corpus.join(target).is_dir() && !target.is_empty() {
            let name = format!("{}-{}", folder.display(), file.display());
            write(&corpus.join(target).join(name), &bytes);
        }
    }
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    entries
        .filter_map(|e| Some(e.ok()?.path()))
        .flat_map(|p| if p.is_dir() { files(&p) } else { vec![p] })
        .collect()
}

fn meshes(corpus: &Path) {
    let meshes = [procedural::cube(), procedural::rectangle(), procedural::star(4, 0.4, 1.0)];
    for (i, mesh) in meshes.iter().enumerate() {
        let smooth = mesh.clone().with_smooth_normals();
        write(&corpus.join(format!("obj/{i}.obj")), obj(&smooth).as_bytes());
        write(&corpus.join(format!("ply/{i}-ascii.ply")), &ply(mesh, "ascii"));
        write(&corpus.join(format!("ply/{i}-le.ply")), &ply(mesh, "binary_little_endian"));
        write(&corpus.join(format!("ply/{i}-be.ply")), &ply(mesh, "binary_big_endian"));
    }
    let polygons =
        "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 .5 0\nv 0 2 0\ng a\nf 1 2 3 4 5\nf -5/1 -4/2 -2\n";
    write(&corpus.join("obj/polygons.obj"), polygons.as_bytes());
}

fn obj(mesh: &Mesh) -> String {
    let mut text = String::from("o mesh\n");
    let mut line = |kind: &str, v: &Vec3| {
        let _ = writeln!(text, "{kind} {} {} {}", v.x, v.y, v.z);
    };
    mesh.positions.iter().for_each(|p| line("v", p));
    mesh.normals.iter().flatten().for_each(|n| line("vn", n));
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| i + 1);
        let _ = writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}");
    }
    text
}

fn ply(mesh: &Mesh, format: &str) -> Vec<u8> {
    let (vertices, faces) = (mesh.positions.len(), mesh.triangles.len());
    let mut file = format!(
        "ply\nformat {format} 1.0\ncomment a seed\nelement vertex {vertices}\nproperty float x\n\
         property float y\nproperty double z\nelement face {faces}\n\
         property list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    let mut put = |text: String, little: &[u8]| match format {
        "ascii" => file.extend(text.bytes()),
        "binary_little_endian" => file.extend(little),
        _ => file.extend(little.iter().rev()),
    };
    for p in &mesh.positions {
        put(format!("{} ", p.x), &(p.x as f32).to_le_bytes());
        put(format!("{} ", p.y), &(p.y as f32).to_le_bytes());
        put(format!("{}\n", p.z), &p.z.to_le_bytes());
    }
    for t in &mesh.triangles {
        put("3".into(), &[3]);
        t.iter().for_each(|i| put(format!(" {i}"), &i.to_le_bytes()));
        put("\n".into(), &[]);
    }
    file
}

fn trees(folder: &Path) {
    for channels in [1, 3] {
        let values = (0..9 * 3 * 2 * channels).map(|i| f64::from(i as u32 / 6 % 3)).collect();
        let grid = Grid::new([9, 3, 2], channels, values).expect("a valid grid");
        let placement = Affine { linear: Mat3::IDENTITY, translation: Vec3::ZERO };
        let tree = NanoVdb { name: "density".into(), grid, placement };
        let bytes = nanovdb::encode(&tree).expect("a small grid");
        write(&folder.join(format!("{channels}.nvdb")), &bytes);
    }
}

fn volumes(folder: &Path) {
    for channels in [1, 3] {
        let values = (0..2 * 3 * 2 * channels).map(|i| f64::from(i as u32) / 8.0).collect();
        let grid = Grid::new([2, 3, 2], channels, values).expect("a valid grid");
        let bounds = [Vec3::ZERO, Vec3::splat(2.0)];
        let volume = vol::encode(&vol::VolFile { grid, bounds }).expect("a small grid");
        write(&folder.join(format!("{channels}-f32.vol")), &volume);
        // The same bytes taken for narrower values, of which fewer are needed.
        for (encoding, name) in [(2, "f16"), (3, "u8")] {
            let mut narrow = volume.clone();
            narrow[4] = encoding;
            write(&folder.join(format!("{channels}-{name}.vol")), &narrow);
        }
    }
    // Sizes whose product with three channels is the largest `usize`, 2⁶⁴ - 1.
    let sizes: [u32; 5] = [3, 14_002_645, 65_537, 6_700_417, 3];
    let largest = sizes.iter().flat_map(|n| n.to_le_bytes());
    let header: Vec<u8> = (*b"VOL\x03").into_iter().chain(largest).chain([0; 24]).collect();
    write(&folder.join("largest.vol"), &header);
}
