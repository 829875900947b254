use alloc::vec;
use alloc::vec::Vec;

use drt_geom::{Mesh, NONE};
use drt_math::{Vec3, vec3};

use super::hierarchy::{self, Cluster};
use super::moments::{Derivatives, Moments};
use super::triangle::Triangle;
use super::view::View;
use super::{BEYOND, Kernel, MeanValueWeight, orientation, unit_of};
use crate::error::Cause;
use crate::volume::VolumeJet;

/// Distance over radius up to which a cluster counts by its parts alone.
const NEAR: f64 = 2.5;
/// Distance over radius from which it counts by its moments alone.
const FAR: f64 = 4.0;

/// A velocity field inside a medium that has given velocities, linear on triangles, on all of the
/// surfaces around it: mean value interpolation.
#[derive(Clone, Debug)]
pub struct MeanValueField {
    pub(super) clusters: Vec<Cluster>,
    /// Moments of the clusters for the constant 1.
    ones: Vec<Moments>,
    /// In the order of the hierarchy.
    pub(super) triangles: Vec<Placed>,
    /// How many triangles there were, those that cancel included.
    pub(super) given: usize,
    pub(super) unit: f64,
    pub(super) kernel: Kernel,
    exact: bool,
}

#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub(super) triangle: Triangle,
    /// Its number in the list that was given.
    pub(super) source: u32,
    /// Whether its second and third corner changed places.
    pub(super) swapped: bool,
}

/// What a point sees of the surfaces: common to all parameters, and reused from point to point.
#[derive(Clone, Debug, Default)]
pub struct MeanValueWeights {
    pub(super) near: Vec<Near>,
    pub(super) distant: Vec<Distant>,
    pub(super) whole: MeanValueWeight,
}

/// A triangle that counts by itself.
#[derive(Clone, Debug)]
pub(super) struct Near {
    pub(super) triangle: u32,
    pub(super) weights: [MeanValueWeight; 3],
}

/// A cluster that counts by its moments.
#[derive(Clone, Debug)]
pub(super) struct Distant {
    pub(super) cluster: u32,
    /// The part of it that does.
    pub(super) share: MeanValueWeight,
    pub(super) derivatives: Derivatives,
}

/// The velocities of all surfaces for one parameter.
#[derive(Clone, Debug)]
pub struct MeanValueVelocities {
    /// In the order of the hierarchy.
    corners: Vec<[Vec3; 3]>,
    /// Where each cluster's moments are; [`NONE`] for one at rest.
    slots: Vec<u32>,
    moments: Vec<[Moments; 3]>,
}

impl MeanValueWeights {
    /// How many triangles count by themselves, and how many clusters by their moments: what a
    /// query costs.
    #[must_use]
    pub fn counts(&self) -> [usize; 2] {
        [self.near.len(), self.distant.len()]
    }
}

impl MeanValueField {
    /// A field between closed surfaces, given as triangles in any order and winding.
    ///
    /// Surfaces are turned so that those inside one another alternate: the denominator of the
    /// interpolation is then positive on one side of each and negative on the other, and vanishes
    /// nowhere off them. Bodies may touch; triangles of the same three corners cancel in pairs, and
    /// their velocities count for nothing. Where surfaces intersect, no winding alternates, and the
    /// field may grow without bound near places inside.
    ///
    /// # Errors
    /// When they are not closed or have one side only, or a connected part encloses no volume.
    pub fn new(triangles: &[[Vec3; 3]]) -> Result<Self, Cause> {
        let mesh = mesh_of(triangles)?;
        Ok(Self::of(&mesh, &orientation::alternating(&mesh)?, Kernel::MeanValue))
    }

    /// A field around any surfaces, open ones and such that pass through one another too, given as
    /// triangles in any order and winding: with the kernel [`Kernel::InverseDistance`].
    ///
    /// Linear velocities do not come back as they do from closed surfaces, constant ones do. At a rim the field is as
    /// continuous as elsewhere.
    ///
    /// # Errors
    /// When a corner is not finite.
    pub fn two_sided(triangles: &[[Vec3; 3]]) -> Result<Self, Cause> {
        let mesh = mesh_of(triangles)?;
        let all: Vec<orientation::Turned> = (0..).zip(mesh.triangles.iter().copied()).collect();
        Ok(Self::of(&mesh, &all, Kernel::InverseDistance))
    }

    fn of(mesh: &Mesh, turned: &[orientation::Turned], kernel: Kernel) -> Self {
        let unit = unit_of(mesh.bounds().extent().max_abs());
        let scaled: Vec<[Vec3; 3]> =
            turned.iter().map(|(_, t)| t.map(|i| mesh.positions[i as usize] * unit)).collect();
        let (clusters, order) = hierarchy::build(&scaled, kernel);
        let placed = |&i: &u32| {
            let (source, corners) = turned[i as usize];
            let swapped = corners != mesh.triangles[source as usize];
            Placed { triangle: Triangle::new(scaled[i as usize]), source, swapped }
        };
        let triangles = order.iter().map(placed).collect();
        let given = mesh.triangles.len();
        let ones = Vec::new();
        let mut field = Self { clusters, ones, triangles, given, unit, kernel, exact: false };
        field.ones = field.moments(|_| [1.0; 3]);
        field
    }

    /// How many triangles the surfaces have.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// The mean value interpolation itself, every triangle by itself: slow.
    #[must_use]
    pub fn exact(self) -> Self {
        Self { exact: true, ..self }
    }

    /// Moments of all clusters for a function given by its values at the corners of each triangle.
    fn moments(&self, values: impl Fn(usize) -> [f64; 3]) -> Vec<Moments> {
        let mut all = vec![Moments::ZERO; self.clusters.len()];
        for (i, c) in self.clusters.iter().enumerate().rev() {
            let mut moments = Moments::ZERO;
            match c.parts {
                Some(first) => {
                    for part in [first as usize, first as usize + 1] {
                        let t = self.clusters[part].middle - c.middle;
                        moments.add_part(&all[part], t);
                    }
                }
                None => {
                    for i in c.triangles.start as usize..c.triangles.end as usize {
                        let triangle = &self.triangles[i].triangle;
                        triangle.add_moments(values(i), c.middle, self.kernel, &mut moments);
                    }
                }
            }
            all[i] = moments;
        }
        all
    }

    /// The velocities of one parameter: for each triangle, in the order given, those of its corners.
    ///
    /// # Errors
    /// When there is not one entry per triangle, or one is not finite.
    pub fn velocities(&self, corners: &[[Vec3; 3]]) -> Result<MeanValueVelocities, Cause> {
        if corners.len() != self.given {
            let (expected, found) = (self.given, corners.len());
            return Err(Cause::TriangleCount { expected, found });
        }
        crate::error::finite(corners.iter().flatten().all(|v| v.is_finite()), "a vertex velocity")?;
        let turned = |p: &Placed| {
            let [a, b, c] = corners[p.source as usize];
            if p.swapped { [a, c, b] } else { [a, b, c] }
        };
        let corners: Vec<[Vec3; 3]> = self.triangles.iter().map(turned).collect();
        let along = [0, 1, 2].map(|axis| self.moments(|i| corners[i].map(|v| v[axis])));
        let mut slots = vec![NONE; self.clusters.len()];
        let mut moments = Vec::new();
        for (i, slot) in slots.iter_mut().enumerate() {
            let here = [0, 1, 2].map(|axis| along[axis][i]);
            if here.iter().any(|m| *m != Moments::ZERO) {
                *slot = moments.len() as u32;
                moments.push(here);
            }
        }
        Ok(MeanValueVelocities { corners, slots, moments })
    }

    /// Replaces `out` by what all surfaces weigh at `x`.
    pub fn weights(&self, x: Vec3, out: &mut MeanValueWeights) {
        out.near.clear();
        out.distant.clear();
        out.whole = MeanValueWeight::default();
        let x = x * self.unit;
        let Some(root) = self.clusters.first() else { return };
        if (x - root.middle).max_abs() < BEYOND {
            let all = MeanValueWeight { value: 1.0, gradient: Vec3::ZERO };
            self.visit(0, x, &all, out);
        }
    }

    /// Adds a share of a cluster; `None` as soon as the point turns out to be on the surface.
    fn visit(
        &self,
        index: u32,
        x: Vec3,
        share: &MeanValueWeight,
        out: &mut MeanValueWeights,
    ) -> Option<()> {
        let cluster = &self.clusters[index as usize];
        let z = cluster.middle - x;
        let far = self.farness(cluster, z);
        if far.value > 0.0 {
            let share = far.times(share);
            let derivatives = Derivatives::at(z);
            let ones = &self.ones[index as usize];
            let whole = MeanValueWeight {
                value: ones.value(&derivatives),
                gradient: ones.gradient(&derivatives),
            };
            out.whole.add(&whole.times(&share));
            out.distant.push(Distant { cluster: index, share, derivatives });
        }
        if far.value == 1.0 {
            return Some(());
        }
        let near = MeanValueWeight { value: 1.0 - far.value, gradient: -far.gradient };
        let share = near.times(share);
        if let Some(first) = cluster.parts {
            self.visit(first, x, &share, out)?;
            return self.visit(first + 1, x, &share, out);
        }
        for triangle in cluster.triangles.clone() {
            match self.triangles[triangle as usize].triangle.view(x, self.kernel) {
                View::Apart(weights) => {
                    let weights = weights.map(|w| w.times(&share));
                    weights.iter().for_each(|w| out.whole.add(w));
                    out.near.push(Near { triangle, weights });
                }
                View::On(weights) => {
                    out.distant.clear();
                    out.near.clear();
                    out.near.push(Near { triangle, weights });
                    out.whole = MeanValueWeight { value: 1.0, gradient: Vec3::ZERO };
                    return None;
                }
            }
        }
        Some(())
    }

    /// How far away a cluster is: 0 to count by its parts, 1 to count by its moments; twice
    /// differentiable in between.
    fn farness(&self, cluster: &Cluster, z: Vec3) -> MeanValueWeight {
        let distance = z.length();
        let t = (distance - NEAR * cluster.radius) / ((FAR - NEAR) * cluster.radius);
        if self.exact || t <= 0.0 || t.is_nan() {
            return MeanValueWeight::default();
        }
        if t >= 1.0 {
            return MeanValueWeight { value: 1.0, gradient: Vec3::ZERO };
        }
        let value = t * t * t * (10.0 + t * (6.0 * t - 15.0));
        let slope = 30.0 * t * t * (1.0 - t) * (1.0 - t);
        let per_length = slope / ((FAR - NEAR) * cluster.radius);
        MeanValueWeight { value, gradient: z * (-per_length / distance) }
    }

    /// Velocity and divergence for one parameter, at the point that `weights` is of.
    #[must_use]
    pub fn jet(&self, weights: &MeanValueWeights, velocities: &MeanValueVelocities) -> VolumeJet {
        let mut u = Vec3::ZERO;
        let mut divergence = 0.0;
        for near in &weights.near {
            for (v, w) in velocities.corners[near.triangle as usize].iter().zip(&near.weights) {
                u += *v * w.value;
                divergence += v.dot(w.gradient);
            }
        }
        for d in &weights.distant {
            let slot = velocities.slots[d.cluster as usize];
            let Some(moments) = velocities.moments.get(slot as usize) else { continue };
            let [x, y, z] = moments;
            let p = &d.derivatives;
            let here = vec3(x.value(p), y.value(p), z.value(p));
            let spread = x.slope(p, 0) + y.slope(p, 1) + z.slope(p, 2);
            u += here * d.share.value;
            divergence += d.share.value * spread + here.dot(d.share.gradient);
        }
        let inverse = 1.0 / weights.whole.value;
        if !inverse.is_finite() {
            return VolumeJet::default();
        }
        let u = u * inverse;
        let j_dot = (divergence - u.dot(weights.whole.gradient)) * (inverse * self.unit);
        VolumeJet { u, j_dot }
    }
}

/// Triangles as a mesh whose corner k of triangle i is vertex 3 i + k.
fn mesh_of(triangles: &[[Vec3; 3]]) -> Result<Mesh, Cause> {
    let positions: Vec<Vec3> = triangles.iter().flatten().copied().collect();
    let corners = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh::new(positions, corners).map_err(|_| Cause::NotFinite { what: "a corner of the surface" })
}
