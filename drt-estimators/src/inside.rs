//! How the inside of each medium moves with each parameter (theory sheet §4.1, §14.1).
//!
//! Any field is right as long as it matches the normal velocity of the surfaces around the medium,
//! or the flux through those it does not match is added. A camera or point light inside a medium
//! is one more boundary: near it the field must have its velocity, or rates grow like 1/r.

use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_math::{Affine, Vec3};
use drt_motion::{SurfaceMotion, VolumeMotion, inside_motion};

use crate::tangents::Tangents;
use crate::transport::World;

/// The motions of all insides, and the shapes whose flux must be added.
#[derive(Clone, Debug, Default)]
pub(crate) struct Insides {
    /// Per medium: the parameters that move it, and how.
    pub(crate) volumes: Vec<Vec<(usize, VolumeMotion)>>,
    /// Shapes through which some medium has a flux for some parameter.
    pub(crate) flux_shapes: Vec<usize>,
    /// Per medium and parameter that concerns it: true when flux is needed.
    pub(crate) flux: Vec<Vec<(usize, bool)>>,
}

/// Points of each medium that must move with their own velocity.
struct Anchor {
    medium: usize,
    x: Vec3,
    velocities: Vec<Vec3>,
}

pub(crate) fn plan(world: &World, tangents: &Tangents) -> Insides {
    let media = world.scene.media.len();
    let n = tangents.names.len();
    let adjacent = adjacency(world);
    let anchors = anchors(world, tangents);
    let mut insides = Insides {
        volumes: alloc::vec![Vec::new(); media],
        flux: alloc::vec![Vec::new(); media],
        flux_shapes: Vec::new(),
    };
    let rest = SurfaceMotion::Rest;
    let of = |shape: usize, p: usize| {
        tangents.shapes[shape].iter().find(|(q, _)| *q == p).map_or(&rest, |(_, m)| m)
    };
    for m in 0..media {
        let shapes: Vec<usize> =
            (0..world.scene.shapes.len()).filter(|s| adjacent[*s].contains(&m)).collect();
        let inside: Vec<&Anchor> = anchors.iter().filter(|a| a.medium == m).collect();
        for p in 0..n {
            let motions: Vec<&SurfaceMotion> = shapes.iter().map(|s| of(*s, p)).collect();
            let mut chosen = inside_motion(&motions);
            let off =
                |a: &&&Anchor| (chosen.motion.velocity(a.x) - a.velocities[p]).max_abs() > 0.0;
            if let Some(a) = inside.iter().find(off) {
                let v = a.velocities[p];
                chosen.motion = if v == Vec3::ZERO {
                    VolumeMotion::Static
                } else {
                    VolumeMotion::Affine(Affine { translation: v, ..Affine::ZERO })
                };
                chosen.flux = true;
            }
            let moves = !chosen.motion.is_rest();
            if moves {
                insides.volumes[m].push((p, chosen.motion.clone()));
            }
            if chosen.flux {
                for (s, motion) in shapes.iter().zip(&motions) {
                    let mesh = &world.scene.shapes[*s].mesh;
                    if mismatch(mesh, motion, &chosen.motion) && !insides.flux_shapes.contains(s) {
                        insides.flux_shapes.push(*s);
                    }
                }
            }
            if moves || motions.iter().any(|m| !m.is_rest()) {
                insides.flux[m].push((p, chosen.flux));
            }
        }
    }
    insides.flux_shapes.sort_unstable();
    insides
}

fn mismatch(mesh: &Mesh, surface: &SurfaceMotion, volume: &VolumeMotion) -> bool {
    match (surface, volume) {
        (SurfaceMotion::Affine(a), VolumeMotion::Affine(b)) if a == b => false,
        (s, v) if s.is_rest() && v.is_rest() => false,
        _ => (0..mesh.triangles.len() as u32).any(|t| {
            let n = mesh.normal(t);
            let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
            corners.into_iter().any(|bary| {
                let point = drt_motion::SurfacePoint { triangle: t, bary };
                let [a, b, c] = mesh.triangle(t);
                let x = a * (1.0 - bary[0] - bary[1]) + b * bary[0] + c * bary[1];
                let (u, v) = (surface.velocity(mesh, &point), volume.velocity(x));
                let relative = n.dot(u - v);
                relative * relative > 1e-24 * (u.length_squared() + v.length_squared())
            })
        }),
    }
}

/// The scattering or emitting media that each shape touches.
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

fn anchors(world: &World, tangents: &Tangents) -> Vec<Anchor> {
    let n = tangents.names.len();
    let mut anchors = Vec::new();
    if let Some(medium) = world.camera_medium {
        let mut velocities = alloc::vec![Vec3::ZERO; n];
        for (p, t) in &tangents.sensor {
            velocities[*p] = t.position;
        }
        anchors.push(Anchor { medium, x: world.camera.position(), velocities });
    }
    for (e, named) in world.scene.emitters.iter().enumerate() {
        let Some(x) = named.item.emitter.position() else { continue };
        let Some(medium) = world.medium_of_emitter(e, x) else { continue };
        let mut velocities = alloc::vec![Vec3::ZERO; n];
        for (p, t) in &tangents.emitters[e] {
            velocities[*p] = t.position;
        }
        anchors.push(Anchor { medium, x, velocities });
    }
    anchors
}
