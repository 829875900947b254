use alloc::vec;
use alloc::vec::Vec;

use drt_math::Vec3;

use super::MeanValueField;
use super::field::MeanValueWeights;
use super::moments::Moments;
use crate::volume::VolumeAdjoint;

/// A gradient with respect to the velocities of all surfaces of a [`MeanValueField`]: the transpose
/// of every [`jet`](MeanValueField::jet) scattered so far.
///
/// What far clusters get is kept with them until [`finish`](MeanValueField::finish).
#[derive(Clone, Debug)]
pub struct MeanValueGradient {
    corners: Vec<[Vec3; 3]>,
    moments: Vec<[Moments; 3]>,
}

impl MeanValueGradient {
    /// No gradient yet.
    #[must_use]
    pub fn zeros(field: &MeanValueField) -> Self {
        Self {
            corners: vec![[Vec3::ZERO; 3]; field.triangles.len()],
            moments: vec![[Moments::ZERO; 3]; field.clusters.len()],
        }
    }

    /// Adds another gradient of the same field: for buffers filled in parallel.
    pub fn add(&mut self, other: &Self) {
        for (a, b) in self.corners.iter_mut().flatten().zip(other.corners.iter().flatten()) {
            *a += *b;
        }
        for (a, b) in self.moments.iter_mut().flatten().zip(other.moments.iter().flatten()) {
            a.add_part(b, Vec3::ZERO);
        }
    }
}

impl MeanValueField {
    /// Adds the transpose of the jet at the point that `weights` is of, applied to `adjoint`.
    ///
    /// # Panics
    /// When the weights or the gradient belong to another field.
    pub fn scatter(
        &self,
        weights: &MeanValueWeights,
        adjoint: &VolumeAdjoint,
        gradient: &mut MeanValueGradient,
    ) {
        let inverse = 1.0 / weights.whole.value;
        if !inverse.is_finite() {
            return;
        }
        let on_divergence = adjoint.j * inverse * self.unit;
        let on_velocity = (adjoint.u - weights.whole.gradient * on_divergence) * inverse;
        for near in &weights.near {
            let corners = &mut gradient.corners[near.triangle as usize];
            for (g, w) in corners.iter_mut().zip(&near.weights) {
                *g += on_velocity * w.value + w.gradient * on_divergence;
            }
        }
        for d in &weights.distant {
            let on_value = on_velocity * d.share.value + d.share.gradient * on_divergence;
            let moments = &mut gradient.moments[d.cluster as usize];
            for (axis, m) in moments.iter_mut().enumerate() {
                m.add_value_transposed(&d.derivatives, on_value[axis]);
                m.add_slope_transposed(&d.derivatives, axis, d.share.value * on_divergence);
            }
        }
    }

    /// The gradient with respect to the velocities of each triangle's corners, in the order in which
    /// triangles were given.
    ///
    /// # Panics
    /// When the gradient belongs to another field.
    #[must_use]
    pub fn finish(&self, gradient: &MeanValueGradient) -> Vec<[Vec3; 3]> {
        let MeanValueGradient { mut corners, mut moments } = gradient.clone();
        // Clusters come before their parts.
        for (i, cluster) in self.clusters.iter().enumerate() {
            let whole = moments[i];
            if let Some(first) = cluster.parts {
                for part in [first as usize, first as usize + 1] {
                    let t = self.clusters[part].middle - cluster.middle;
                    for (m, whole) in moments[part].iter_mut().zip(&whole) {
                        m.add_part_transposed(whole, t);
                    }
                }
                continue;
            }
            for t in cluster.triangles.clone() {
                for (l, g) in corners[t as usize].iter_mut().enumerate() {
                    let mut unit = [0.0; 3];
                    unit[l] = 1.0;
                    let mut piece = Moments::ZERO;
                    self.triangles[t as usize].triangle.add_moments(
                        unit,
                        cluster.middle,
                        self.kernel,
                        &mut piece,
                    );
                    *g += Vec3::from([0, 1, 2].map(|axis| whole[axis].dot(&piece)));
                }
            }
        }
        let mut given = vec![[Vec3::ZERO; 3]; self.given];
        for (placed, [a, b, c]) in self.triangles.iter().zip(corners) {
            given[placed.source as usize] = if placed.swapped { [a, c, b] } else { [a, b, c] };
        }
        given
    }
}
