//! How the inside of each medium moves with each parameter (theory sheet §4.1, §14.1).
//!
//! Any continuous field is right that matches the normal velocity of the surfaces around the medium,
//! or misses it where the flux is added. The variance is finite only if the field also matches
//! surfaces on which paths have vertices, and cameras and point lights inside the medium: else rates
//! near them grow like 1/r. So, per medium and parameter:
//!
//! * nothing around it moves: static;
//! * everything around it moves by one affine field: that field;
//! * paths scatter once, and only surfaces without path vertices move (null or black): static, with
//!   the flux added, which single scattering finds exactly;
//! * else: a blend of the fields around it (drt-motion's `Blend`). A surface that deforms by its
//!   vertices counts triangle by triangle, if it has few; if it has many it counts as resting, and
//!   its flux is added.

use alloc::vec::Vec;

use drt_geom::TriangleBvh;
use drt_math::{Affine, Vec3};
use drt_motion::{Blend, Site, SurfaceMotion, triangle_field};

use crate::Error;
use crate::settings::InsideKind;
use crate::tangents::Tangents;
use crate::transport::World;

/// The motion of an inside under one parameter.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Inside {
    /// One affine field.
    Affine(Affine),
    /// The fields of the medium's sites that move, blended.
    Blend(Vec<(usize, Affine)>),
}

/// The motions of all insides, and the shapes whose flux must be added.
#[derive(Clone, Debug, Default)]
pub(crate) struct Insides {
    /// Per medium: the parameters that move its inside, and how.
    pub(crate) volumes: Vec<Vec<(usize, Inside)>>,
    /// Per medium: its surroundings, where some parameter blends.
    pub(crate) blends: Vec<Option<Blend>>,
    /// Shapes through which some medium has a flux for some parameter.
    pub(crate) flux_shapes: Vec<usize>,
    /// Per medium: parameters that need a flux.
    pub(crate) flux: Vec<Vec<usize>>,
}

/// Triangles of a deforming surface that are blended one by one: each costs every volume vertex.
const MOST_TRIANGLES: usize = 1024;

/// Something around a medium that moves as one.
struct Part {
    shapes: Vec<usize>,
    /// One triangle of the shape alone.
    triangle: Option<u32>,
    point: Option<Vec3>,
    /// Paths have vertices on it.
    scatters: bool,
    /// Per parameter.
    velocities: Vec<Affine>,
}

pub(crate) fn plan(
    world: &World,
    tangents: &Tangents,
    asked: &[(usize, InsideKind)],
) -> Result<Insides, Error> {
    let media = world.scene.media.len();
    let adjacent = adjacency(world);
    let mut insides = Insides {
        volumes: alloc::vec![Vec::new(); media],
        blends: alloc::vec![None; media],
        flux: alloc::vec![Vec::new(); media],
        flux_shapes: Vec::new(),
    };
    for m in 0..media {
        let shapes: Vec<usize> =
            (0..world.scene.shapes.len()).filter(|s| adjacent[*s].contains(&m)).collect();
        for &s in
            shapes.iter().filter(|s| is_deformed(tangents, **s) && !is_split(world, tangents, **s))
        {
            insides.flux_shapes.push(s);
            let deforming = |m: &SurfaceMotion| matches!(m, SurfaceMotion::Vertices { .. });
            let moving = tangents.shapes[s].iter().filter(|(_, m)| deforming(m));
            insides.flux[m].extend(moving.map(|(p, _)| *p));
        }
        let parts = parts(world, tangents, m, &shapes);
        let kind = asked.iter().rev().find(|(medium, _)| *medium == m).map(|(_, kind)| *kind);
        let mut blended = false;
        for p in 0..tangents.names.len() {
            let Some(first) = parts.first().map(|part| part.velocities[p]) else { continue };
            if parts.iter().all(|part| part.velocities[p].is_zero()) {
                continue;
            }
            // A point has one velocity, whatever the field is elsewhere.
            let agrees = |part: &Part| match part.point {
                Some(x) => part.velocities[p].point(x) == first.point(x),
                None => part.velocities[p] == first,
            };
            let moving = || parts.iter().filter(|part| !part.velocities[p].is_zero());
            let one = parts[0].point.is_none() && parts.iter().all(agrees);
            let kind = kind.unwrap_or(if one {
                InsideKind::Affine
            } else if world.max_depth > 2 || moving().any(|part| part.scatters) {
                InsideKind::Blend
            } else {
                InsideKind::Static
            });
            let inside = match kind {
                InsideKind::Affine if one => Inside::Affine(first),
                InsideKind::Affine => return Err(not_affine(world, tangents, m, p)),
                InsideKind::Static => {
                    insides.flux[m].push(p);
                    insides.flux_shapes.extend(moving().flat_map(|part| &part.shapes));
                    continue;
                }
                InsideKind::Blend => {
                    blended = true;
                    let fields = parts.iter().map(|part| part.velocities[p]).enumerate();
                    Inside::Blend(fields.filter(|(_, v)| !v.is_zero()).collect())
                }
            };
            insides.volumes[m].push((p, inside));
        }
        insides.flux[m].sort_unstable();
        insides.flux[m].dedup();
        if blended {
            let sites = parts.iter().map(|part| site(world, part)).collect::<Result<_, _>>()?;
            insides.blends[m] = Some(Blend::new(sites));
        }
    }
    insides.flux_shapes.sort_unstable();
    insides.flux_shapes.dedup();
    Ok(insides)
}

fn not_affine(world: &World, tangents: &Tangents, medium: usize, parameter: usize) -> Error {
    let name = world.scene.media[medium].id.clone();
    Error::Element {
        element: name.unwrap_or_else(|| alloc::format!("medium[{medium}]")),
        reason: alloc::format!(
            "its inside cannot move affinely with parameter `{}`: not everything around it moves \
             by the same affine map",
            tangents.names[parameter]
        ),
    }
}

/// What surrounds a medium, grouped by motion; the surfaces come first.
fn parts(world: &World, tangents: &Tangents, medium: usize, shapes: &[usize]) -> Vec<Part> {
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
    let mut anchor = |x: Vec3, moves: &mut dyn Iterator<Item = (usize, Vec3)>| {
        let mut velocities = alloc::vec![Affine::ZERO; n];
        for (p, v) in moves {
            velocities[p] = Affine { translation: v, ..Affine::ZERO };
        }
        let point = Some(x);
        parts.push(Part { shapes: Vec::new(), triangle: None, point, scatters: true, velocities });
    };
    if world.camera_medium == Some(medium) {
        let moves = &mut tangents.sensor.iter().map(|(p, t)| (*p, t.position));
        anchor(world.camera.position(), moves);
    }
    for (e, named) in world.scene.emitters.iter().enumerate() {
        if let Some(x) = named.item.emitter.position()
            && world.medium_of_emitter(e, x) == Some(medium)
        {
            anchor(x, &mut tangents.emitters[e].iter().map(|(p, t)| (*p, t.position)));
        }
    }
    parts
}

/// True when some parameter moves a shape's vertices one by one.
fn is_deformed(tangents: &Tangents, shape: usize) -> bool {
    tangents.shapes[shape].iter().any(|(_, m)| matches!(m, SurfaceMotion::Vertices { .. }))
}

/// True when a shape counts triangle by triangle.
fn is_split(world: &World, tangents: &Tangents, shape: usize) -> bool {
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

fn site(world: &World, part: &Part) -> Result<Site, Error> {
    if let Some(x) = part.point {
        return Ok(Site::Point(x));
    }
    if let Some(t) = part.triangle {
        return Ok(Site::Triangle(world.scene.shapes[part.shapes[0]].mesh.triangle(t)));
    }
    let mut soup = Vec::new();
    for s in &part.shapes {
        let mesh = &world.scene.shapes[*s].mesh;
        soup.extend((0..mesh.triangles.len() as u32).map(|t| mesh.triangle(t)));
    }
    let bvh = TriangleBvh::build(&soup).map_err(|e| Error::Element {
        element: "surfaces around a medium".into(),
        reason: alloc::format!("{e}"),
    })?;
    Ok(Site::Surface(bvh))
}

/// The media that each shape touches.
pub(crate) fn adjacency(world: &World) -> Vec<Vec<usize>> {
    let scene = &world.scene;
    scene
        .shapes
        .iter()
        .enumerate()
        .map(|(i, shape)| match shape.boundary {
            Some(b) => b.interior.into_iter().chain(b.exterior).collect(),
            // A null sheet that separates nothing has no effect at all.
            None if world.is_null(i as u32) || !world.has_media() => Vec::new(),
            None => {
                let mut found: Vec<usize> = Vec::new();
                let step = 1 + shape.mesh.triangles.len() / 256;
                for t in (0..shape.mesh.triangles.len() as u32).step_by(step) {
                    let [a, b, c] = shape.mesh.triangle(t);
                    if let Some(m) = world.medium_at((a + b + c) * (1.0 / 3.0))
                        && !found.contains(&m)
                    {
                        found.push(m);
                    }
                }
                found
            }
        })
        .collect()
}
