//! Levels: a radiance for each pixel that the motion of its rays is taken relative to.
//!
//! Where the image points x of a pixel's rays move by a rate V(x), the derivative of its value I = ∫ h L dx, h being the filter, is
//!
//! ```text
//! dI/dθ = ∫ [h ∂L + L div(h V)] dx.
//! ```
//!
//! If V is continuous, but for places where it has the rate of a jump of L on both sides, and h V is zero at the ends of the filter, the
//! integral of div(h V) is zero by Gauss's theorem: an image of the same radiance everywhere does not change, however its rays move. So for
//! any number c
//!
//! ```text
//! dI/dθ = ∫ [h ∂L + (L - c) div(h V)] dx.
//! ```
//!
//! The divergence is large where V changes from the rate of one edge to that of another, or to zero at a pixel's border, and near such places
//! its second moment diverges like a logarithm. With the *level* c near the radiance that the pixel sees, what it multiplies is small there: on a
//! surface between two borders it is the noise of L alone, and at a silhouette half of the jump.
//!
//! In the sweep, div(h V) stands in three places: in the geometric term and the Jacobian of points that move with matter, in
//! the divergence of the rate of rays that turn with edges, and in the filter and the importance of the camera. All of them are
//! factors of the camera's [segment](crate::derivative::adjoint), whose value takes L - c for L. Rays that see nothing count with L = 0, and are recorded.
//!
//! V must follow from x alone. So levels are for the [rates of rays that turn](crate::derivative::velocity::VelocityField::is_continuous_in_view)
//! where neither a medium nor a smooth surface chooses at random what a ray sees next.
//!
//! c may be anything that does not depend on the samples which it is subtracted from. It is the lower median of a few radiances
//! that a pilot sees in the pixel, channel by channel: a rare bright path must not set it.

use alloc::vec::Vec;

use drt_math::{Rgb, Rng};

use crate::model::rendering::Account;
use crate::sampling::parallel::Pool;
use crate::sampling::record::Radiance;
use crate::sampling::streams::LEVEL_STREAM;
use crate::sampling::trace::Tracer;
use crate::terms::selected::Terms;
use crate::world::World;

/// Most paths of a pixel's pilot, and samples of the pixel to each of them.
const PATHS: usize = 4;
const SAMPLES: u32 = 8;

/// Pixels of a piece of work.
const TILE: u32 = 256;

/// The levels of all pixels, row by row from the top left; or of none, where there are none to be had.
#[derive(Clone, Debug, Default)]
pub(crate) struct Levels(Vec<Rgb>);

impl Levels {
    pub(crate) fn of(&self, pixel: u32) -> Rgb {
        self.0.get(pixel as usize).copied().unwrap_or(Rgb::ZERO)
    }

    /// The same of every pixel.
    #[cfg(all(test, feature = "std"))]
    pub(crate) fn even(level: Rgb, world: &World) -> Self {
        let [w, h] = world.camera.film();
        Self(alloc::vec![level; (w * h) as usize])
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Those of a world in a run that takes `spp` samples of each pixel; none where rays do not move as they must.
    pub(crate) fn learn(
        world: &World,
        terms: &Terms,
        seed: u64,
        spp: u32,
        pool: &Pool,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> (Account, Self) {
        let mut account = Account::default();
        let rates = terms.velocity.may_move() && terms.velocity.is_continuous_in_view();
        if !(rates && sees_what_follows(world)) {
            return (account, Self::default());
        }
        let [w, h] = world.camera.film();
        let paths = (spp / SAMPLES).clamp(1, PATHS as u32);
        let work = |tile: u32| {
            let mut tracer = Tracer::new(world);
            let pixels = tile * TILE..u32::min((tile + 1) * TILE, w * h);
            let level = |pixel| {
                if cancelled() { Rgb::ZERO } else { level(&mut tracer, seed, pixel, paths) }
            };
            let levels: Vec<Rgb> = pixels.map(level).collect();
            (levels, tracer.counters.rays)
        };
        let mut levels = Vec::new();
        let all = pool.ordered(0..(w * h).div_ceil(TILE), 4, work, |_, (tile, rays)| {
            levels.extend(tile);
            account.counters.rays += rays;
            !cancelled()
        });
        (account, Self(if all { levels } else { Vec::new() }))
    }
}

/// Whether what a camera's ray sees follows from the ray.
fn sees_what_follows(world: &World) -> bool {
    let null = || world.scene.bsdfs.iter().any(|b| b.item.is_null());
    !world.has_media() && world.scene.first_smooth().is_none() && !null()
}

fn level(tracer: &mut Tracer<'_>, seed: u64, pixel: u32, paths: u32) -> Rgb {
    let world = tracer.world;
    let mut seen = [[0.0; PATHS]; 3];
    for path in 0..paths {
        let mut rng = Rng::new(seed, LEVEL_STREAM | u64::from(pixel), path);
        let u = rng.next_2d();
        let lens = world.camera.draw_lens(&mut rng);
        let view = world.camera.at_lens(lens).sample_view(pixel, u, false);
        tracer.rng = rng;
        let mut radiance = Radiance::default();
        tracer.trace_camera(&view, Rgb::ONE, &mut radiance);
        for (seen, value) in seen.iter_mut().zip(radiance.0.to_array()) {
            seen[path as usize] = if value.is_finite() { value } else { 0.0 };
        }
    }
    let [r, g, b] = seen.map(|mut seen| {
        let seen = &mut seen[..paths as usize];
        seen.sort_unstable_by(f64::total_cmp);
        seen[(seen.len() - 1) / 2]
    });
    Rgb { r, g, b }
}
