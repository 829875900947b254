//! All triangles of a scene under one tree, and instances under another.

use alloc::collections::BTreeMap;
use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::{AlongSegment, BvhError, InstancePlacement, InstancedBvh, Mesh, TriangleBvh};
use drt_math::{Affine, Mat3, Vec3};

use crate::model::error::Error;
use crate::model::scene::{Instance, Scene, Shape};

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
    /// Which shapes emit: their triangles have the lowest numbers.
    emitting: Vec<bool>,
    instances: Vec<Instance>,
    pub(crate) bvh: InstancedBvh,
    /// The triangles that are no instances. Those of instances come after them, and are not listed.
    pub(crate) prims: Vec<Prim>,
    placed: Vec<Placed>,
    /// Per shape, the number of its first triangle.
    pub(crate) first_prim: Vec<u32>,
    /// Of the bounding box: the middle, and half the diagonal. The origin and 1 where nothing is.
    pub(crate) center: Vec3,
    pub(crate) radius: f64,
}

/// An instance.
#[derive(Debug)]
pub(crate) struct Placed {
    /// The number of its first triangle.
    first: u32,
    pub(crate) shape: u32,
    pub(crate) to_world: Affine,
    /// Takes normals to the world, up to positive factors: det |det|⁻¹ det M⁻ᵀ.
    pub(crate) normals: Mat3,
}

impl Geometry {
    /// Prepares the surfaces of a scene, unless `known` has the same. Where `known` has the same triangles in other places, its tree
    /// follows them.
    pub(crate) fn new(scene: &Scene, known: Option<&Arc<Self>>) -> Result<Arc<Self>, Error> {
        if let Some(known) = known.filter(|k| k.is_of(scene)) {
            return Ok(known.clone());
        }
        let fail =
            |e: BvhError| Error::Element { element: "scene geometry".into(), reason: e.into() };
        let (mut soup, mut prims) = (Vec::new(), Vec::new());
        let mut first_prim = alloc::vec![0; scene.shapes.len()];
        let own = |(i, _): &(usize, &Shape)| scene.placement(*i).is_none();
        // Of surfaces that coincide, the one with lower numbers is met first: a lamp in a ceiling's plane is seen.
        let mut shapes: Vec<(usize, &Shape)> =
            scene.shapes.iter().enumerate().filter(own).collect();
        shapes.sort_by_key(|(_, shape)| shape.emitter.is_none());
        for (i, shape) in shapes {
            first_prim[i] = prims.len() as u32;
            for t in 0..shape.mesh.triangles.len() as u32 {
                soup.push(shape.mesh.triangle(t));
                prims.push(Prim { shape: i as u32, triangle: t });
            }
        }
        let bvh = match known.filter(|known| known.is_numbered_as(scene)) {
            Some(known) => {
                let mut bvh = known.bvh.triangles().clone();
                bvh.refit(&soup).map(|()| bvh)
            }
            None => TriangleBvh::build(&soup),
        };
        let bvh = bvh.map_err(fail)?;
        let mut next = prims.len();
        // Shared as meshes are.
        let mut trees: BTreeMap<*const Mesh, Arc<TriangleBvh>> = BTreeMap::new();
        let (mut placed, mut placements) = (Vec::new(), Vec::new());
        for Instance { shape, to_world } in &scene.instances {
            let mesh = &scene.shapes[*shape].mesh;
            let tree = match trees.get(&Arc::as_ptr(mesh)) {
                Some(tree) => tree.clone(),
                None => {
                    let tree = Arc::new(TriangleBvh::of(mesh).map_err(fail)?);
                    trees.insert(Arc::as_ptr(mesh), tree.clone());
                    tree
                }
            };
            // More than there are numbers for are refused with the tree.
            first_prim[*shape] = next as u32;
            let [a, b, c] = to_world.linear.cols;
            let side = if to_world.linear.determinant() < 0.0 { -1.0 } else { 1.0 };
            let normals = Mat3 { cols: [b.cross(c) * side, c.cross(a) * side, a.cross(b) * side] };
            let (first, to_world) = (next as u32, *to_world);
            placed.push(Placed { first, shape: *shape as u32, to_world, normals });
            placements.push(InstancePlacement { tree, to_world });
            next += mesh.triangles.len();
        }
        let bvh = InstancedBvh::new(bvh, placements).map_err(fail)?;
        let bounds = bvh.bounds();
        let (center, radius) = match bounds.is_empty() {
            true => (Vec3::ZERO, 1.0),
            false => ((bounds.min + bounds.max) * 0.5, bounds.extent().length() * 0.5),
        };
        let meshes = scene.shapes.iter().map(|s| s.mesh.clone()).collect();
        let emitting = scene.shapes.iter().map(|s| s.emitter.is_some()).collect();
        let instances = scene.instances.clone();
        Ok(Arc::new(Self {
            meshes,
            emitting,
            instances,
            bvh,
            prims,
            placed,
            first_prim,
            center,
            radius,
        }))
    }

    fn is_of(&self, scene: &Scene) -> bool {
        let same = |(own, shape): (&Arc<Mesh>, &Shape)| own.same_triangles(&shape.mesh);
        self.is_numbered_as(scene) && self.meshes.iter().zip(&scene.shapes).all(same)
    }

    /// True where triangles have the numbers that they have in a scene.
    fn is_numbered_as(&self, scene: &Scene) -> bool {
        let same = |(own, shape): (&Arc<Mesh>, &Shape)| {
            core::ptr::eq(&**own, &*shape.mesh) || own.triangles == shape.mesh.triangles
        };
        self.meshes.len() == scene.shapes.len()
            && self.instances == scene.instances
            && self.meshes.iter().zip(&scene.shapes).all(same)
            && self.emitting.iter().zip(&scene.shapes).all(|(e, s)| *e == s.emitter.is_some())
    }

    /// As [`TriangleBvh::may_lie_along`]; true where there are instances.
    pub(crate) fn may_lie_along(&self, segment: &AlongSegment) -> bool {
        !self.placed.is_empty() || self.bvh.triangles().may_lie_along(segment)
    }

    /// A triangle, whether of an instance or not.
    #[inline]
    pub(crate) fn prim(&self, prim: u32) -> Prim {
        match self.prims.get(prim as usize) {
            Some(p) => *p,
            None => self.of_instance(prim).0,
        }
    }

    /// A triangle of an instance.
    #[cold]
    pub(crate) fn of_instance(&self, prim: u32) -> (Prim, &Placed) {
        let next = self.placed.partition_point(|p| p.first <= prim);
        let placed = &self.placed[next - 1];
        (Prim { shape: placed.shape, triangle: prim - placed.first }, placed)
    }
}
