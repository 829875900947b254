//! How much edges matter to the shadows of areas that emit.
//!
//! A point on an edge and one of a light make a boundary segment where the edge is a silhouette between them. By
//! the probability p of an edge per length, a sample has the value g / p there, g being light times the sine of edge and segment, and none
//! elsewhere. So its second moment is least for p ∝ √(mean of g² over points of lights from which the edge is a silhouette). The
//! mean is that of a few points, the same for all edges; an edge that is no silhouette from these may be one from others, with about
//! the probability that it is one from anywhere, its silhouette angle over π. It counts as if it were seen so by one point more.

use alloc::vec::Vec;
use core::f64::consts::FRAC_1_PI;

use drt_math::{Real, Rng};

use crate::discontinuities::edge::Edge;
use crate::world::World;
use crate::world::lights::AreaPoint;

/// Points of lights.
const POINTS: u32 = 8;

/// Edges of which the mean is taken.
const SOME: usize = 256;

/// The part of the mean of all edges that each has.
const EVEN: f64 = 0.1;

/// Names the random numbers of the points.
const SEED: u64 = 0x6172_6561_7321;

/// Weights of edges for segments that start on areas.
pub(super) struct AreaWeights<'a> {
    world: &'a World,
    /// Points of lights, the same for all edges.
    points: Vec<AreaPoint>,
    /// The mean of g² over some edges and all points.
    mean: f64,
}

impl<'a> AreaWeights<'a> {
    pub(super) fn new(world: &'a World, edges: &[Edge]) -> Self {
        let lights = &world.lights;
        let point = |point| {
            let mut rng = Rng::new(SEED, 0, point);
            let light = lights.choose(&mut rng)?;
            lights.area_point(world, &light, &mut rng)
        };
        let mut weights =
            Self { world, points: (0..POINTS).filter_map(point).collect(), mean: 0.0 };
        let step = edges.len().div_ceil(SOME).max(1);
        let some = edges.iter().step_by(step).map(|e| weights.squares(e)[1]);
        let (sum, count) = some.fold((0.0, 0.0), |(sum, n), square| (sum + square, n + 1.0));
        weights.mean = if count > 0.0 { sum / count } else { 0.0 };
        weights
    }

    /// Of one edge.
    pub(super) fn of(&self, e: &Edge) -> f64 {
        let [seen, all] = self.squares(e);
        let anywhere = e.wedge.silhouette_angle() * FRAC_1_PI;
        let unseen = anywhere * (all + EVEN * self.mean) / f64::from(POINTS);
        if self.mean > 0.0 { e.wedge.length * Real::sqrt(seen + unseen) } else { anywhere }
    }

    /// The means of g², for points from which the edge is a silhouette and for all.
    fn squares(&self, e: &Edge) -> [f64; 2] {
        let x = e.wedge.at(0.5);
        let mut sums = [0.0; 2];
        for point in &self.points {
            let light = self.world.lights.area_seen_from(self.world, point, x);
            let Some(light) = light else { continue };
            let g = light.value.mean() * light.inv_pdf * e.wedge.sine(light.w);
            let square = g * g / f64::from(POINTS);
            sums[1] += square;
            sums[0] += if e.wedge.is_silhouette(light.w) { square } else { 0.0 };
        }
        sums
    }
}
