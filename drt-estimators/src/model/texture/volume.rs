//! Textures that surfaces take from the space they are in.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::{Mesh, MeshAttribute, MeshError};
use drt_math::{Rgb, Vec3};
use drt_medium::{Filter, Volume};

use crate::model::texture::{luminance, widened};

/// The value that a volume has where a point of the surface is when nothing has moved yet.
///
/// The value belongs to the material point, as with all textures: when the surface moves or deforms, it takes
/// the value along. For this, meshes hold where they were as the attribute [`VolumeTexture::POSITIONS`].
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct VolumeTexture {
    /// The values; shared by the copies of a scene.
    pub volume: Arc<Volume>,
    /// Their luminance counts, in every channel.
    pub grey: bool,
}

impl VolumeTexture {
    /// The attribute of a mesh that says where its points are when nothing has moved, in the world.
    pub const POSITIONS: &str = "position_at_rest";

    /// A mesh whose points remember where they are now.
    ///
    /// # Errors
    /// None for a mesh that is valid.
    pub fn remember_positions(mesh: Mesh) -> Result<Mesh, MeshError> {
        let place = |v: u32| mesh.positions[v as usize].to_array().map(|x| x as f32);
        let values: Vec<_> = mesh.triangles.iter().map(|t| t.map(place)).collect();
        let mut attributes = mesh.attributes.clone();
        attributes.retain(|a| a.name != Self::POSITIONS);
        attributes.push(MeshAttribute { name: Self::POSITIONS.into(), values });
        mesh.with_attributes(attributes)
    }

    pub(super) fn value(&self, x: Vec3) -> Rgb {
        self.toned(self.volume.value(x))
    }

    fn toned(&self, value: Rgb) -> Rgb {
        if self.grey { luminance(value) } else { value }
    }

    /// The derivatives of the value by the weights of a triangle's second and third corner.
    pub(super) fn slopes(&self, mesh: &Mesh, triangle: u32, bary: [f64; 2]) -> [Rgb; 2] {
        let Some(attribute) = mesh.attribute(Self::POSITIONS) else { return [Rgb::ZERO; 2] };
        let corners = &attribute.values[triangle as usize];
        let [p, q, r] = corners.map(|c| Vec3::from(c.map(f64::from)));
        let gradient = self.volume.gradient(attribute.at(triangle, bary).into());
        [q - p, r - p].map(|edge| self.toned(gradient.dot(edge)))
    }

    pub(super) fn is_continuous(&self) -> bool {
        self.volume.grid().is_none_or(|grid| grid.filter() == Filter::Trilinear)
    }

    /// The voxels, in three channels.
    fn voxels(&self) -> impl Iterator<Item = Rgb> + '_ {
        let constant = match &*self.volume {
            Volume::Constant(value) => Some(*value),
            Volume::Grid(_) => None,
        };
        let voxels = self.volume.grid().into_iter().flat_map(|grid| {
            grid.values().chunks_exact(grid.channels()).map(|voxel| match *voxel {
                [r, g, b] => Rgb::new(r, g, b),
                _ => Rgb::splat(voxel[0]),
            })
        });
        constant.into_iter().chain(voxels).map(|value| self.toned(value))
    }

    /// Values, per channel, between which all others are.
    pub(super) fn bounds(&self) -> [Rgb; 2] {
        self.voxels().fold([f64::INFINITY, f64::NEG_INFINITY].map(Rgb::splat), widened)
    }

    /// The mean of the voxels.
    pub(super) fn mean(&self) -> Rgb {
        let sum = |(n, sum): (f64, Rgb), value| (n + 1.0, sum + value);
        let (count, sum) = self.voxels().fold((0.0, Rgb::ZERO), sum);
        sum / count
    }
}
