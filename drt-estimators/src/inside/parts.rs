//! What surrounds a medium: its surfaces grouped by motion, and the cameras and point lights in it.

use alloc::vec::Vec;

use drt_geom::TriangleBvh;
use drt_math::{Affine, Vec3};
use drt_motion::SurfaceMotion;
use drt_motion::interior::{Site, triangle_field};

use super::unusable;
use crate::Error;
use crate::tangents::Tangents;
use crate::transport::World;

/// Triangles of a deforming surface that are blended one by one: each costs every volume vertex.
const MOST_TRIANGLES: usize = 1024;

/// Something around a medium that moves as one.
pub(super) struct Part {
    pub(super) shapes: Vec<usize>,
    /// One triangle of the shape alone.
    triangle: Option<u32>,
    pub(super) point: Option<Vec3>,
    /// Paths have vertices on it.
    pub(super) scatters: bool,
    /// Per parameter; zero where a surface deforms as a whole.
    pub(super) velocities: Vec<Affine>,
}

/// A point inside a medium whose velocity is its own.
#[derive(Clone, Copy, Debug)]
pub(super) enum Anchor {
    Camera,
    Emitter(usize),
}

/// What surrounds a medium, grouped by motion; the surfaces come first.
pub(super) fn parts(
    world: &World,
    tangents: &Tangents,
    medium: usize,
    shapes: &[usize],
) -> Vec<Part> {
    let n = tangents.names.len();
    let mut parts: Vec<Part> = Vec::new();
    for &s in shapes {
        let scatters = world.scatters(s);
        if is_split(world, tangents, s) {
            parts.extend(triangles(world, tangents, s, scatters));
            continue;
        }
        let mut velocities = alloc::vec![Affine::ZERO; n];
        for (p, motion) in &tangents.shapes[s] {
            if let SurfaceMotion::Affine(field) = motion {
                velocities[*p] = *field;
            }
        }
        let same = |part: &&mut Part| {
            part.triangle.is_none() && part.scatters == scatters && part.velocities == velocities
        };
        match parts.iter_mut().find(same) {
            Some(part) => part.shapes.push(s),
            None => {
                let shapes = alloc::vec![s];
                parts.push(Part { shapes, triangle: None, point: None, scatters, velocities });
            }
        }
    }
    for (anchor, x) in anchors(world, medium) {
        let mut velocities = alloc::vec![Affine::ZERO; n];
        let mut moves = |p: usize, v: Vec3| {
            velocities[p] = Affine { translation: v, ..Affine::ZERO };
        };
        match anchor {
            Anchor::Camera => tangents.sensor.iter().for_each(|(p, t)| moves(*p, t.position)),
            Anchor::Emitter(e) => {
                tangents.emitters[e].iter().for_each(|(p, t)| moves(*p, t.position));
            }
        }
        let (shapes, point) = (Vec::new(), Some(x));
        parts.push(Part { shapes, triangle: None, point, scatters: true, velocities });
    }
    parts
}

/// The cameras and point lights in a medium, and where they are.
pub(super) fn anchors(world: &World, medium: usize) -> Vec<(Anchor, Vec3)> {
    let mut anchors = Vec::new();
    if world.camera_medium == Some(medium) {
        anchors.push((Anchor::Camera, world.camera.position()));
    }
    for (e, named) in world.scene.emitters.iter().enumerate() {
        if let Some(x) = named.item.emitter.position()
            && world.medium_of_emitter(e, x) == Some(medium)
        {
            anchors.push((Anchor::Emitter(e), x));
        }
    }
    anchors
}

/// True when some parameter moves a shape's vertices one by one.
fn is_deformed(tangents: &Tangents, shape: usize) -> bool {
    tangents.shapes[shape].iter().any(|(_, m)| matches!(m, SurfaceMotion::Vertices { .. }))
}

/// True when a parameter moves a shape's vertices one by one.
pub(super) fn is_deformed_by(tangents: &Tangents, shape: usize, parameter: usize) -> bool {
    let deforms = |m: &SurfaceMotion| matches!(m, SurfaceMotion::Vertices { .. });
    tangents.shapes[shape].iter().any(|(p, m)| *p == parameter && deforms(m))
}

/// True when a shape counts triangle by triangle.
pub(super) fn is_split(world: &World, tangents: &Tangents, shape: usize) -> bool {
    is_deformed(tangents, shape) && world.scene.shapes[shape].mesh.triangles.len() <= MOST_TRIANGLES
}

/// The triangles of a deforming shape, each with its own linear field.
fn triangles<'a>(
    world: &'a World,
    tangents: &'a Tangents,
    shape: usize,
    scatters: bool,
) -> impl Iterator<Item = Part> + 'a {
    let mesh = &world.scene.shapes[shape].mesh;
    (0..mesh.triangles.len() as u32).map(move |t| {
        let mut velocities = alloc::vec![Affine::ZERO; tangents.names.len()];
        for (p, motion) in &tangents.shapes[shape] {
            velocities[*p] = match motion {
                SurfaceMotion::Rest => Affine::ZERO,
                SurfaceMotion::Affine(field) => *field,
                SurfaceMotion::Vertices { positions, .. } => {
                    let corners = mesh.triangles[t as usize].map(|v| positions[v as usize]);
                    triangle_field(mesh.triangle(t), corners)
                }
            };
        }
        let shapes = alloc::vec![shape];
        Part { shapes, triangle: Some(t), point: None, scatters, velocities }
    })
}

/// A part as something to blend.
pub(super) fn site(world: &World, medium: usize, part: &Part) -> Result<Site, Error> {
    if let Some(x) = part.point {
        return Ok(Site::Point(x));
    }
    if let Some(t) = part.triangle {
        return Ok(Site::Triangle(world.scene.shapes[part.shapes[0]].mesh.triangle(t)));
    }
    let mut soup = Vec::new();
    for s in &part.shapes {
        soup.extend(world.scene.shapes[*s].mesh.soup());
    }
    let bvh = TriangleBvh::build(&soup).map_err(|e| unusable(world, medium, e))?;
    Ok(Site::Surface(bvh))
}
