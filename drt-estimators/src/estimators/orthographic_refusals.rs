//! What an [orthographic](crate::model::sensor) camera's derivatives cannot have in or through its film.
//!
//! Paths start on the film's plane. In material form vertices in a medium around the film may cross it, and where a surface
//! goes through it visibility jumps without an edge; both have terms that are not derived here, so they are refused. A
//! vertex of the spatial form keeps its distance from the film. The warp turns rays with edges beside them, which parallel
//! rays cannot do.

use drt_math::Vec3;

use crate::derivative::sensitivity::ActiveInputs;
use crate::estimators::Changes;
use crate::model::error::{ElementError, Error};
use crate::model::scene::Target;
use crate::model::sensor::Sensor;
use crate::world::{SurroundingMedium, Tracking, World};

/// What an estimator cannot do with a film that rays leave in parallel.
pub(super) enum Film {
    /// Let its rays turn.
    Turning,
    /// Let a medium around it move.
    InMedium,
}

/// Refuses what an estimator cannot do as something moves.
pub(super) fn refuse(world: &World, changes: &Changes<'_>, film: Film) -> Result<(), Error> {
    if !world.camera.is_orthographic() || !changes.active.moves_geometry() {
        return Ok(());
    }
    match film {
        Film::Turning => fail(world, changes, ElementError::ParallelRays),
        Film::InMedium if sweeps_medium(world, changes.active) => {
            fail(world, changes, ElementError::FilmInMedium)
        }
        Film::InMedium => Ok(()),
    }
}

/// Refuses surfaces that go through the film as something moves.
pub(super) fn refuse_cuts(world: &World, changes: &Changes<'_>) -> Result<(), Error> {
    let camera = &world.camera;
    if !camera.is_orthographic() || !changes.active.moves_geometry() {
        return Ok(());
    }
    let cut = (0..world.scene.shapes.len()).find(|s| {
        let mesh = &world.scene.shapes[*s].mesh;
        let mut triangles = (0..mesh.triangles.len() as u32).map(|t| mesh.triangle(t));
        !world.is_null(*s as u32) && triangles.any(|t| cuts(camera, t))
    });
    cut.map_or(Ok(()), |s| fail(world, changes, ElementError::FilmCut(world.shape_name(s))))
}

fn fail(world: &World, changes: &Changes<'_>, reason: ElementError) -> Result<(), Error> {
    let element = world.scene.name_of(Target::Sensor(changes.settings.sensor));
    Err(Error::Element { element, reason })
}

/// True when vertices of the material form move through the film.
fn sweeps_medium(world: &World, active: &ActiveInputs) -> bool {
    let moves =
        |m: usize| world.tracking[m] == Tracking::Vertices && (active.sensor || active.volumes[m]);
    match world.film_medium {
        SurroundingMedium::Uniform(medium) => medium.is_some_and(moves),
        SurroundingMedium::Varies => (0..world.scene.media.len()).any(moves),
    }
}

/// True when a triangle goes through the film.
fn cuts(camera: &Sensor, triangle: [Vec3; 3]) -> bool {
    let seen = triangle.map(|x| camera.view(x));
    let mut ends = [[0.0; 2]; 2];
    let mut found = 0;
    for k in 0..3 {
        let (a, b) = (&seen[k], &seen[(k + 1) % 3]);
        if (a.depth < 0.0) != (b.depth < 0.0) && found < 2 {
            let t = a.depth / (a.depth - b.depth);
            ends[found] = [0, 1].map(|i| a.pixel[i] + t * (b.pixel[i] - a.pixel[i]));
            found += 1;
        }
    }
    if found < 2 {
        return false;
    }
    // The part of the cut between two lines of the film's border, and then two more.
    let radius = camera.filter().radius();
    let [mut from, mut to] = [0.0, 1.0];
    let [first, second] = ends;
    for ((start, end), size) in first.into_iter().zip(second).zip(camera.film()) {
        let along = end - start;
        let border = [-radius, f64::from(size) + radius];
        if along == 0.0 {
            if start < border[0] || start > border[1] {
                return false;
            }
            continue;
        }
        let [s, t] = border.map(|b| (b - start) / along);
        from = f64::max(from, f64::min(s, t));
        to = f64::min(to, f64::max(s, t));
    }
    from <= to
}
