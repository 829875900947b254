//! Parts of a scene that see nothing of each other but through what scatters.
//!
//! Where light goes from one medium (or vacuum) into another it meets an interface, and unless that
//! is a null surface it scatters there. So nothing in a tank of glass is in sight from outside; an edge
//! in it counts for vertices in it, and for those on the glass. Media that a null surface separates
//! are one chamber, and so are those on the two sides of a surface with a rim.

use alloc::vec::Vec;

use drt_geom::Topology;

use super::jumps::{Jump, Jumps};
use crate::transport::{Kind, Vertex, World};

/// The chamber of each medium.
#[derive(Clone, Debug, Default)]
pub(super) struct Chambers {
    /// Of vacuum first; each a name that they share.
    of: Vec<usize>,
}

/// Some of the chambers.
#[derive(Clone, Debug)]
pub(super) struct Among {
    has: Vec<bool>,
}

impl Chambers {
    pub(super) fn new(world: &World) -> Self {
        let mut of: Vec<usize> = (0..=world.scene.media.len()).collect();
        for (shape, boundary) in
            (0..).zip(&world.scene.shapes).filter_map(|(k, s)| Some((k, s.boundary?)))
        {
            let [a, b] = [boundary.interior, boundary.exterior].map(|m| of[number(m)]);
            if a != b && (world.is_null(shape) || !closed(world, shape)) {
                of.iter_mut().filter(|c| **c == b).for_each(|c| *c = a);
            }
        }
        Self { of }
    }

    fn of(&self, medium: Option<usize>) -> usize {
        self.of[number(medium)]
    }

    /// Those around a shape; `None` for any.
    fn around(&self, world: &World, shape: u32) -> Option<[usize; 2]> {
        let media = match world.scene.shapes[shape as usize].boundary {
            Some(b) => [b.interior, b.exterior],
            None => [world.medium_around(shape as usize)?; 2],
        };
        Some(media.map(|m| self.of(m)))
    }

    /// Those in which one of the shapes can be seen.
    pub(super) fn of_shapes(&self, world: &World, shapes: impl Iterator<Item = u32>) -> Among {
        let mut among = Among { has: alloc::vec![false; self.of.len()] };
        shapes.for_each(|s| among.add(self.around(world, s)));
        among
    }

    /// Those in which one of the edges can be seen.
    pub(super) fn of_edges<'a>(
        &self,
        world: &World,
        jumps: &Jumps,
        list: impl Iterator<Item = &'a Jump>,
    ) -> Among {
        let shapes = world.scene.shapes.len();
        let mut met = alloc::vec![false; shapes];
        for jump in list {
            met[jump.edge.shape as usize] = true;
            for (prim, _) in jumps.faces(jump) {
                met[world.point(prim, [0.0; 2]).0.shape as usize] = true;
            }
        }
        self.of_shapes(world, (0..shapes as u32).filter(|s| met[*s as usize]))
    }

    /// True when a vertex sees one of them.
    pub(super) fn in_sight(&self, world: &World, among: &Among, vertex: &Vertex) -> bool {
        let sides = match &vertex.kind {
            Kind::Surface(s) if world.bsdf_of(s.shape).is_transmissive() => {
                let boundary = world.scene.shapes[s.shape as usize].boundary;
                boundary.map_or([vertex.medium; 2], |b| [b.interior, b.exterior])
            }
            _ => [vertex.medium; 2],
        };
        sides.iter().any(|m| among.has[self.of(*m)])
    }
}

impl Among {
    fn add(&mut self, chambers: Option<[usize; 2]>) {
        match chambers {
            Some(some) => some.iter().for_each(|c| self.has[*c] = true),
            None => self.has.fill(true),
        }
    }

    /// Those that are in both.
    pub(super) fn and(&self, other: &Self) -> Self {
        Self { has: self.has.iter().zip(&other.has).map(|(a, b)| *a && *b).collect() }
    }
}

fn number(medium: Option<usize>) -> usize {
    medium.map_or(0, |m| m + 1)
}

/// True when a shape has no rim.
fn closed(world: &World, shape: u32) -> bool {
    let topology = Topology::of(&world.scene.shapes[shape as usize].mesh);
    topology.edges.iter().all(|e| e.faces[1] != drt_geom::NONE)
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use drt_geom::{Mesh, procedural};
    use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};

    use super::*;
    use crate::kept::Kept;
    use crate::scene::MediumBoundary;
    use crate::surface::Bsdf;
    use crate::transport::Lit;
    use crate::transport::tests::scenes::{Build, diffuse, glass, homogeneous};

    const TANK: u32 = 0;
    const PEBBLE: u32 = 1;
    const STONE: u32 = 2;

    /// A pebble in a tank of water, and a stone beside the tank at some place.
    fn tank(bsdf: Bsdf, mesh: Mesh, stone: Vec3) -> World {
        let mut b = Build::default();
        let water = homogeneous(Rgb::splat(0.5), Rgb::splat(0.9), Rgb::ZERO, 0.0);
        let water = b.medium("water", water);
        let bsdf = b.bsdf("tank-bsdf", bsdf);
        let boundary = MediumBoundary { interior: Some(water), exterior: None };
        b.shape("tank", mesh, bsdf).boundary = Some(boundary);
        let grey = b.bsdf("grey", diffuse(0.5, 0.5, 0.5));
        let at = |place: Vec3| {
            let place = Affine { linear: Mat3::IDENTITY * 0.2, translation: place };
            procedural::icosphere(1).transform(&place)
        };
        b.shape("pebble", at(vec3(0.1, -0.2, 0.15)), grey);
        b.shape("stone", at(stone), grey);
        let scene = b.camera(vec3(0.0, 0.5, 6.0), Vec3::ZERO, 4);
        World::new(scene, 0, None, None, Lit::All, &mut Kept::default()).expect("a valid scene")
    }

    const ASIDE: Vec3 = vec3(3.0, 0.0, 0.0);

    fn water() -> Vertex {
        Vertex { x: vec3(0.5, 0.5, 0.5), medium: Some(0), kind: Kind::Volume(None) }
    }

    /// A vertex on a shape that was reached through a medium.
    fn on(world: &World, shape: u32, medium: Option<usize>) -> Vertex {
        let prims = 0..world.geometry.prims.len() as u32;
        let mut points = prims.map(|p| world.point(p, [1.0 / 3.0; 2]));
        let (point, x) = points.find(|(p, _)| p.shape == shape).expect("a triangle of it");
        Vertex { x, medium, kind: Kind::Surface(point) }
    }

    /// Whether the pebble, the stone and the tank are in sight from a vertex.
    fn in_sight(world: &World, vertex: &Vertex) -> [bool; 3] {
        let chambers = Chambers::new(world);
        [PEBBLE, STONE, TANK].map(|shape| {
            let of_shape = chambers.of_shapes(world, core::iter::once(shape));
            // Its edges, where it has any, tell the same.
            let jumps = Jumps::collect(world, &[false; 3]);
            let edges: Vec<&Jump> = jumps.list.iter().filter(|j| j.edge.shape == shape).collect();
            let of_edges = chambers.of_edges(world, &jumps, edges.iter().copied());
            assert!(edges.is_empty() || of_edges.has == of_shape.has);
            assert!(edges.is_empty() == world.is_null(shape));
            chambers.in_sight(world, &of_shape, vertex)
        })
    }

    #[test]
    fn what_is_in_a_closed_body_of_glass_is_in_sight_from_its_inside() {
        let world = tank(glass(), procedural::cube(), ASIDE);
        assert_eq!(in_sight(&world, &water()), [true, false, true]);
        assert_eq!(in_sight(&world, &on(&world, PEBBLE, Some(0))), [true, false, true]);
        assert_eq!(in_sight(&world, &on(&world, STONE, None)), [false, true, true]);
        // Glass scatters from both sides, from wherever it was reached.
        for reached in [None, Some(0)] {
            assert_eq!(in_sight(&world, &on(&world, TANK, reached)), [true; 3]);
        }
        let chambers = Chambers::new(&world);
        let [inside, outside] =
            [PEBBLE, STONE].map(|s| chambers.of_shapes(&world, core::iter::once(s)));
        assert!(!chambers.in_sight(&world, &inside.and(&outside), &on(&world, TANK, None)));
    }

    #[test]
    fn what_is_not_glass_scatters_on_the_side_that_was_reached() {
        let world = tank(diffuse(0.5, 0.5, 0.5), procedural::cube(), ASIDE);
        assert_eq!(in_sight(&world, &on(&world, TANK, None)), [false, true, true]);
        assert_eq!(in_sight(&world, &on(&world, TANK, Some(0))), [true, false, true]);
    }

    #[test]
    fn null_surfaces_and_those_with_a_rim_join() {
        let mut open = procedural::cube();
        open.triangles.pop();
        for (bsdf, mesh) in [(Bsdf::Null, procedural::cube()), (glass(), open)] {
            let world = tank(bsdf, mesh, ASIDE);
            for vertex in [water(), on(&world, STONE, None), on(&world, TANK, None)] {
                let [pebble, stone, _] = in_sight(&world, &vertex);
                assert!(pebble && stone, "{:?}", world.scene.bsdfs[0].item);
            }
        }
    }

    #[test]
    fn what_an_interface_comes_near_may_be_anywhere() {
        let world = tank(glass(), procedural::cube(), vec3(1.1, 0.0, 0.0));
        for vertex in [water(), on(&world, PEBBLE, Some(0)), on(&world, STONE, None)] {
            assert!(in_sight(&world, &vertex)[1]);
        }
    }
}
