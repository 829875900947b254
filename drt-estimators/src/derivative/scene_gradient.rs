//! The gradient of a loss with respect to a scene.

use alloc::vec::Vec;

use drt_math::{Rgb, Vec3};
use drt_medium::MediumGradient;
use drt_motion::surface::{SmoothNormals, VertexGradient};

use crate::derivative::sensitivity::ActiveInputs;
use crate::model::emitter::EmitterGradient;
use crate::model::rendering::Counters;
use crate::model::scene::Scene;
use crate::model::sensor::SensorGradient;
use crate::model::surface::{BsdfParams, Property, PropertySet};
use crate::model::texture::TexelGradient;
use crate::world::World;

/// The gradient of a loss with respect to a scene. Entries that were not asked for are `None`.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct SceneGradient {
    /// Per shape: with respect to its vertices (in mesh order), and to its vertex normals where it
    /// has any. [`SceneGradient::vertices`] folds the normals into positions.
    pub shapes: Vec<Option<VertexGradient>>,
    /// Per medium: with respect to coefficients and voxels.
    pub media: Vec<Option<MediumGradient>>,
    /// Per scattering model: with respect to its parameters (scalars: the sum over channels).
    pub bsdfs: Vec<Option<BsdfParams>>,
    /// Per scattering model: with respect to the texels of each texture, with the property that has the texture.
    pub texels: Vec<Vec<(Property, TexelGradient)>>,
    /// Per emitter: with respect to the texels of the image of its emission.
    pub emitter_texels: Vec<Option<TexelGradient>>,
    /// Per emitter: with respect to its emission, position, direction and angles.
    pub emitters: Vec<Option<EmitterGradient>>,
    /// With respect to the camera.
    pub sensor: Option<SensorGradient>,
    /// Work done.
    pub counters: Counters,
    /// Contributions that were not finite; they count as zero.
    pub non_finite: u64,
}

impl SceneGradient {
    pub(crate) fn zeros(world: &World, active: &ActiveInputs) -> Self {
        let scene = &world.scene;
        fn some<T>(wanted: &[bool], make: impl Fn(usize) -> T) -> Vec<Option<T>> {
            wanted.iter().enumerate().map(|(i, w)| w.then(|| make(i))).collect()
        }
        Self {
            shapes: some(&active.shapes, |i| VertexGradient::zeros(&scene.shapes[i].mesh)),
            media: some(&active.media, |i| {
                let zeros = MediumGradient::zeros(&scene.media[i].item);
                if active.grids[i] { zeros } else { zeros.at_rest() }
            }),
            bsdfs: some(&active.bsdfs, |i| {
                let bsdf = &scene.bsdfs[i].item;
                let index = PropertySet::new(&[Property::Eta]);
                let turning = if bsdf.bends() { index } else { PropertySet::NONE };
                BsdfParams::zeros(bsdf.differentiated().without(turning))
            }),
            texels: (active.bsdfs.iter().zip(&scene.bsdfs))
                .map(|(wanted, bsdf)| match bsdf.item.textured_part().filter(|_| *wanted) {
                    Some(t) => t
                        .textures
                        .iter()
                        .map(|(p, t)| (*p, TexelGradient::zeros(t.size())))
                        .collect(),
                    None => Vec::new(),
                })
                .collect(),
            emitter_texels: (active.emitters.iter().zip(&scene.emitters))
                .map(|(wanted, e)| e.item.emitter.texels().filter(|_| *wanted))
                .map(|size| size.map(TexelGradient::zeros))
                .collect(),
            emitters: some(&active.emitters, |_| EmitterGradient::default()),
            sensor: active.sensor.then(SensorGradient::default),
            counters: Counters::default(),
            non_finite: 0,
        }
    }

    /// Adds what other samples give for the same scene.
    pub(crate) fn add(&mut self, o: Self) {
        fn each<T>(a: &mut [Option<T>], b: Vec<Option<T>>, add: impl Fn(&mut T, T)) {
            for (a, b) in a.iter_mut().zip(b) {
                match (a, b) {
                    (Some(a), Some(b)) => add(a, b),
                    (a @ None, b) => *a = b,
                    (_, None) => {}
                }
            }
        }
        each(&mut self.shapes, o.shapes, |a, b| a.add(&b));
        each(&mut self.media, o.media, MediumGradient::add);
        each(&mut self.bsdfs, o.bsdfs, |a, b| a.scatter(&b, Rgb::ONE));
        for (a, b) in self.texels.iter_mut().zip(o.texels) {
            if a.is_empty() {
                *a = b;
            } else {
                a.iter_mut().zip(&b).for_each(|((_, a), (_, b))| a.add(b));
            }
        }
        each(&mut self.emitter_texels, o.emitter_texels, |a, b| a.add(&b));
        each(&mut self.emitters, o.emitters, |a, b| *a += b);
        if let (Some(a), Some(b)) = (&mut self.sensor, o.sensor) {
            *a += b;
        }
        self.counters.add(&o.counters);
        self.non_finite += o.non_finite;
    }

    /// The gradient by a shape's vertex positions, its vertex normals being recomputed from them as
    /// the vertices move; in mesh order. `None` when it was not asked for.
    #[must_use]
    pub fn vertices(&self, scene: &Scene, shape: usize) -> Option<Vec<Vec3>> {
        let mesh = &scene.shapes.get(shape)?.mesh;
        let gradient = self.shapes.get(shape)?.as_ref()?;
        Some(gradient.finish(mesh, &SmoothNormals::new(mesh)))
    }
}
