//! All triangles of a scene under one tree.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::{Mesh, TriangleBvh};
use drt_math::Vec3;

use crate::model::error::Error;
use crate::model::scene::{Scene, Shape};

/// A triangle of the soup.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prim {
    pub(crate) shape: u32,
    pub(crate) triangle: u32,
}

/// The surfaces of a scene, prepared for ray queries. Materials have no part in it.
#[derive(Debug)]
pub(crate) struct Geometry {
    meshes: Vec<Arc<Mesh>>,
    pub(crate) bvh: TriangleBvh,
    pub(crate) prims: Vec<Prim>,
    /// Per shape, the number of its first triangle.
    pub(crate) first_prim: Vec<u32>,
    /// Of the bounding box: the middle, and half the diagonal. The origin and 1 where nothing is.
    pub(crate) center: Vec3,
    pub(crate) radius: f64,
}

impl Geometry {
    /// Prepares the surfaces of a scene, unless `known` has the same.
    pub(crate) fn new(scene: &Scene, known: Option<&Arc<Self>>) -> Result<Arc<Self>, Error> {
        if let Some(known) = known.filter(|k| k.is_of(scene)) {
            return Ok(known.clone());
        }
        let (mut soup, mut prims, mut first_prim) = (Vec::new(), Vec::new(), Vec::new());
        for (i, shape) in scene.shapes.iter().enumerate() {
            first_prim.push(prims.len() as u32);
            for t in 0..shape.mesh.triangles.len() as u32 {
                soup.push(shape.mesh.triangle(t));
                prims.push(Prim { shape: i as u32, triangle: t });
            }
        }
        let bvh = TriangleBvh::build(&soup)
            .map_err(|e| Error::Element { element: "scene geometry".into(), reason: e.into() })?;
        let (mut lo, mut hi) = (Vec3::splat(f64::INFINITY), Vec3::splat(f64::NEG_INFINITY));
        for p in soup.iter().flatten() {
            lo = lo.min(*p);
            hi = hi.max(*p);
        }
        let (center, radius) = match soup.is_empty() {
            true => (Vec3::ZERO, 1.0),
            false => ((lo + hi) * 0.5, (hi - lo).length() * 0.5),
        };
        let meshes = scene.shapes.iter().map(|s| s.mesh.clone()).collect();
        Ok(Arc::new(Self { meshes, bvh, prims, first_prim, center, radius }))
    }

    fn is_of(&self, scene: &Scene) -> bool {
        let same = |(own, shape): (&Arc<Mesh>, &Shape)| own.same_triangles(&shape.mesh);
        self.meshes.len() == scene.shapes.len() && self.meshes.iter().zip(&scene.shapes).all(same)
    }
}
