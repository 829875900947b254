//! Jumps of a box filter: what leaves one pixel enters its neighbour.
//!
//! In material form the filter moves over the image with the material seen. A filter that jumps at
//! the border of its support then adds, for each pixel (theory sheet §1),
//!
//! ```text
//! - ∫_border P_in L q_dot·n dl,
//! ```
//!
//! n outward in the image and q_dot the image velocity of the material point seen. One sample serves
//! both pixels of a shared border, so that sums over pixels stay exact.
//!
//! In symmetric scenes edges lie along borders, and radiance differs on both sides of these. As parameters grow one side moves
//! through the border, as they fall the other one does. Samples are taken on either side of the border as often, so that the
//! estimate is the mean of both derivatives, as that of central differences is.

use drt_math::{Ray, Rgb, Vec3};

use crate::derivative::sensitivity::VelocityTerm;
use crate::model::filter::ON_BORDER;
use crate::sampling::record::Radiance;
use crate::sampling::trace::Tracer;
use crate::terms::boundary_segments::{BoundarySink, Buffers};
use crate::world::vertex::{Kind, Vertex};

/// Takes one sample of all pixel borders.
pub(crate) fn sample<R: BoundarySink>(
    tracer: &mut Tracer<'_>,
    b: &mut Buffers,
    receiver: &mut R,
) -> Option<()> {
    tracer.counters.border_samples += 1;
    let world = tracer.world;
    let lens = world.camera.draw_lens(&mut tracer.rng);
    let camera = &*world.camera.at_lens(lens);
    let film = camera.film();
    let radius = camera.filter().radius();
    // A side of a pixel's support, and a point on it.
    let pixel = [0, 1].map(|k| index(tracer.rng.next_f64(), film[k]));
    let axis = usize::from(tracer.rng.next_f64() < 0.5);
    // Each side of the pixel, and on either side of its border.
    let quarter = 4.0 * tracer.rng.next_f64();
    let outward = if quarter < 2.0 { 1.0 } else { -1.0 };
    let beside = if (quarter as u32).is_multiple_of(2) { ON_BORDER } else { -ON_BORDER };
    let mut q = pixel.map(|p| f64::from(p) + 0.5);
    q[axis] += outward * radius + beside;
    q[1 - axis] += radius * (2.0 * tracer.rng.next_f64() - 1.0);
    let mut neighbour = None;
    if radius == 0.5 {
        let mut other = pixel;
        let next = f64::from(pixel[axis]) + outward;
        if next >= 0.0 && next < f64::from(film[axis]) {
            other[axis] = next as u32;
            neighbour = Some(other);
        }
    }
    let sides = 4.0 * f64::from(film[0]) * f64::from(film[1]);
    let chosen_by = if neighbour.is_some() { 2.0 } else { 1.0 };
    let inv_pdf = 2.0 * radius * sides / chosen_by;

    let Ray { origin, dir, .. } = camera.ray(q);
    let mut ray = core::mem::take(&mut b.ray);
    world.cast(&world.eye_at(origin), dir, &mut ray, &mut tracer.counters);
    let travel = tracer.travel(origin, dir, &ray, Rgb::ONE);
    b.ray = ray;
    let (vertex, weight) = travel.end()?;
    let mut along = [0.0; 2];
    along[axis] = 1.0;
    let x = vertex.map_or(origin + dir, |v| v.x);
    let (point, mut sensor) = camera.view_gradient(&camera.view(x), along, 0.0);
    let items = &mut b.functional.items;
    items.clear();
    match vertex {
        Some(Vertex { kind: Kind::Surface(s), .. }) => {
            items.push(VelocityTerm::Surface(s.material(), point))
        }
        Some(Vertex { medium: Some(m), x, .. }) => items.push(VelocityTerm::Volume(m, x, point)),
        // What has no place keeps its image point, or its direction.
        _ if camera.viewpoint().is_at_infinity() => return None,
        _ => sensor.position = Vec3::ZERO,
    }
    items.push(VelocityTerm::Sensor(world.camera.lens_gradient(lens, sensor)));
    if !receiver.moves(&b.functional) {
        return None;
    }
    let light = match vertex {
        Some(vertex) => {
            let mut light = Radiance::default();
            let longest = tracer.max_segments.checked_sub(1)?;
            tracer.radiance_within(longest, vertex, -dir, &mut light);
            light.0
        }
        None => world.lights.environment().map_or(Rgb::ZERO, |sky| sky.radiance(dir)),
    };
    let inside = 1.0 / (4.0 * radius * radius);
    let value = light * weight * (inside * inv_pdf);
    if value.is_zero() {
        return None;
    }
    receiver.receive(pixel[1] * film[0] + pixel[0], value * -outward);
    if let Some([x, y]) = neighbour {
        receiver.receive(y * film[0] + x, value * outward);
    }
    Some(())
}

fn index(u: f64, n: u32) -> u32 {
    u32::min((u * f64::from(n)) as u32, n - 1)
}
