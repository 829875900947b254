//! A slice through the velocity fields of a medium between a body that moves and one that rests, in
//! the manner of Figure 9c of the 2021 paper: speed as colour, velocity in the slice as arrows.
//!
//! `cargo run --release -p drt-motion --example field_slice > docs/images/field-slice.svg`

use std::error::Error;
use std::fmt::Write;

use drt_geom::procedural::{bumpy_sphere, cube, icosphere};
use drt_geom::{Mesh, TetrahedralizeInput, TriangleBvh, tetrahedralize};
use drt_math::{Affine, Mat3, Vec3, vec3};
use drt_motion::SurfaceMotion;
use drt_motion::interior::{Blend, Carrier, Site, TetrahedralField, blend_jet};
use drt_motion::mean_value::{MeanValueField, MeanValueWeights};

/// Cells along a side of a panel, and pixels along a side of a cell.
const CELLS: usize = 84;
const CELL: usize = 4;
/// Cells from arrow to arrow.
const APART: usize = 6;
/// Pixels around panels, and for their titles.
const MARGIN: usize = 12;
const TITLE: usize = 26;
/// Steps of colour.
const LEVELS: usize = 24;
/// Half the side of the box that holds the medium.
const HALF: f64 = 1.0;
/// Where the slice crosses the z axis: off the planes of symmetry.
const SLICE: f64 = 0.03;

/// The border of the medium, and two bodies in it.
struct Stage {
    meshes: [Mesh; 3],
    motions: [Affine; 3],
}

type Field = Box<dyn Fn(Vec3) -> Vec3>;

fn stage() -> Stage {
    let put = |mesh: Mesh, size: f64, place: Vec3| {
        mesh.transform(&Affine { linear: Mat3::diagonal(Vec3::splat(size)), translation: place })
    };
    let place = vec3(-0.35, -0.1, 0.0);
    let turns = Affine { linear: Mat3::skew(vec3(0.0, 0.0, 1.2)), ..Affine::ZERO };
    let moves = Affine { translation: vec3(0.5, 0.7, 0.0) - turns.point(place), ..turns };
    Stage {
        meshes: [
            put(cube(), HALF, Vec3::ZERO),
            put(bumpy_sphere(2, 0.4, 3.0), 0.36, place),
            put(icosphere(2), 0.24, vec3(0.45, 0.35, 0.0)),
        ],
        motions: [Affine::ZERO, moves, Affine::ZERO],
    }
}

fn blend(stage: &Stage) -> Result<Field, Box<dyn Error>> {
    let sites = stage.meshes.iter().map(|m| Ok(Site::Surface(TriangleBvh::of(m)?)));
    let blend = Blend::new(sites.collect::<Result<_, Box<dyn Error>>>()?);
    let moving = vec![(1, stage.motions[1])];
    Ok(Box::new(move |x| {
        let mut weights = Vec::new();
        blend.weights(x, &mut weights);
        blend_jet(&weights, &moving, x).u
    }))
}

fn tetrahedra(stage: &Stage) -> Result<Field, Box<dyn Error>> {
    let meshes: Vec<&Mesh> = stage.meshes.iter().collect();
    let input = TetrahedralizeInput { surfaces: &meshes, points: &[], margin: 0.2 };
    let field = TetrahedralField::new(tetrahedralize(&input)?)?;
    let motions = stage.motions.map(SurfaceMotion::Affine);
    let pairs = stage.meshes.iter().zip(&motions);
    let carriers: Vec<_> = pairs.map(|(mesh, motion)| Carrier { mesh, motion }).collect();
    let velocities = field.velocities(&carriers, &[]);
    Ok(Box::new(move |x| field.place(x).jet(&velocities).u))
}

fn mean_values(stage: &Stage) -> Result<Field, Box<dyn Error>> {
    let (mut triangles, mut corners) = (Vec::new(), Vec::new());
    for (mesh, motion) in stage.meshes.iter().zip(&stage.motions) {
        for t in 0..mesh.triangles.len() as u32 {
            triangles.push(mesh.triangle(t));
            corners.push(mesh.triangle(t).map(|x| motion.point(x)));
        }
    }
    let field = MeanValueField::new(&triangles)?;
    let velocities = field.velocities(&corners)?;
    Ok(Box::new(move |x| {
        let mut weights = MeanValueWeights::default();
        field.weights(x, &mut weights);
        field.jet(&weights, &velocities).u
    }))
}

/// The point in the middle of a cell, counted from the top left.
fn middle(column: usize, row: usize) -> Vec3 {
    let at = |k: usize| (2.0 * (k as f64 + 0.5) / CELLS as f64 - 1.0) * HALF;
    vec3(at(column), -at(row), SLICE)
}

/// Pixels of a point in a panel.
fn pixels(x: Vec3) -> [f64; 2] {
    let scale = (CELLS * CELL) as f64 / (2.0 * HALF);
    [(x.x + HALF) * scale, (HALF - x.y) * scale]
}

/// From white by blue to nearly black.
fn colour(level: usize) -> String {
    const STOPS: [[f64; 3]; 4] =
        [[252.0, 252.0, 248.0], [150.0, 200.0, 226.0], [44.0, 110.0, 180.0], [12.0, 28.0, 84.0]];
    let t = 3.0 * level as f64 / (LEVELS - 1) as f64;
    let i = (t as usize).min(2);
    let mix = |c: usize| STOPS[i][c] + (STOPS[i + 1][c] - STOPS[i][c]) * (t - i as f64);
    format!("#{:02x}{:02x}{:02x}", mix(0) as u8, mix(1) as u8, mix(2) as u8)
}

/// Speeds as areas of one colour each, runs of cells merged.
fn speeds(out: &mut String, field: &Field, fastest: f64) -> std::fmt::Result {
    let level = |column: usize, row: usize| {
        let part = field(middle(column, row)).length() / fastest;
        ((part * LEVELS as f64) as usize).min(LEVELS - 1)
    };
    let mut areas = vec![String::new(); LEVELS];
    for row in 0..CELLS {
        let levels: Vec<usize> = (0..CELLS).map(|column| level(column, row)).collect();
        let mut column = 0;
        for run in levels.chunk_by(|a, b| a == b) {
            let (x, y, w) = (column * CELL, row * CELL, run.len() * CELL);
            write!(areas[run[0]], "M{x} {y}h{w}v{CELL}h-{w}z")?;
            column += run.len();
        }
    }
    for (level, area) in areas.iter().enumerate().filter(|(_, area)| !area.is_empty()) {
        writeln!(out, "<path fill='{}' d='{area}'/>", colour(level))?;
    }
    Ok(())
}

/// Velocities in the slice, with the head at the end that is gone to.
fn arrows(out: &mut String, field: &Field, fastest: f64) -> std::fmt::Result {
    let longest = 1.2 * (APART * CELL) as f64 / fastest;
    write!(out, "<path class='arrow' d='")?;
    for row in (APART / 2..CELLS).step_by(APART) {
        for column in (APART / 2..CELLS).step_by(APART) {
            let x = middle(column, row);
            let u = field(x);
            let (dx, dy) = (u.x * longest, -u.y * longest);
            if dx.hypot(dy) < 1.5 {
                continue;
            }
            let [px, py] = pixels(x);
            let (tx, ty) = (px + 0.5 * dx, py + 0.5 * dy);
            write!(out, "M{:.1} {:.1}L{tx:.1} {ty:.1}", px - 0.5 * dx, py - 0.5 * dy)?;
            let (bx, by) = (tx - 0.3 * dx, ty - 0.3 * dy);
            for side in [0.15, -0.15] {
                write!(out, "M{tx:.1} {ty:.1}L{:.1} {:.1}", bx - side * dy, by + side * dx)?;
            }
        }
    }
    writeln!(out, "'/>")
}

/// The line in which a surface meets the slice.
fn section(out: &mut String, mesh: &Mesh) -> std::fmt::Result {
    write!(out, "<path class='body' d='")?;
    for t in 0..mesh.triangles.len() as u32 {
        let corners = mesh.triangle(t);
        let crossing = (0..3).filter_map(|k| {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            let (above, below) = (a.z - SLICE, b.z - SLICE);
            (above * below < 0.0).then(|| pixels(a + (b - a) * (above / (above - below))))
        });
        if let [p, q] = crossing.collect::<Vec<_>>()[..] {
            write!(out, "M{:.1} {:.1}L{:.1} {:.1}", p[0], p[1], q[0], q[1])?;
        }
    }
    writeln!(out, "'/>")
}

fn main() -> Result<(), Box<dyn Error>> {
    let stage = stage();
    let panels = [
        ("blend", blend(&stage)?),
        ("tetrahedral", tetrahedra(&stage)?),
        ("mean value", mean_values(&stage)?),
    ];
    // That of the moving body's fastest vertex.
    let speed = |x: &Vec3| stage.motions[1].point(*x).length();
    let fastest = stage.meshes[1].positions.iter().map(speed).fold(0.0, f64::max);
    let side = CELLS * CELL;
    let width = panels.len() * (side + MARGIN) + MARGIN;
    let height = side + TITLE + MARGIN;
    let mut out = String::new();
    writeln!(out, "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {height}'>")?;
    writeln!(
        out,
        "<style>text{{font:15px sans-serif;text-anchor:middle}}\
         path{{shape-rendering:crispEdges}}\
         .arrow,.body{{fill:none;shape-rendering:auto;stroke-linecap:round}}\
         .arrow{{stroke:#c2410c;stroke-width:1.2}}.body{{stroke:#000;stroke-width:2}}</style>"
    )?;
    writeln!(out, "<rect width='{width}' height='{height}' fill='#fff'/>")?;
    for (i, (name, field)) in panels.iter().enumerate() {
        let left = MARGIN + i * (side + MARGIN);
        writeln!(out, "<text x='{}' y='18'>{name}</text>", left + side / 2)?;
        writeln!(out, "<g transform='translate({left} {TITLE})'>")?;
        speeds(&mut out, field, fastest)?;
        arrows(&mut out, field, fastest)?;
        for mesh in &stage.meshes {
            section(&mut out, mesh)?;
        }
        writeln!(out, "</g>")?;
    }
    writeln!(out, "</svg>")?;
    print!("{out}");
    Ok(())
}
