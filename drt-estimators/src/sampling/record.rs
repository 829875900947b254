//! The path record: what a walk leaves behind when its derivative is wanted.

mod light;

use alloc::vec::Vec;
use core::ops::Range;

use drt_math::{Rgb, Vec3};

use crate::model::sensor::ViewSample;
pub(crate) use crate::sampling::record::light::{
    Joint, JointObserver, LightPath, LightVertex, Scattered, SeenVertex,
};
use crate::sampling::trace::{Arrival, Connection, Endpoint, Observer, OutgoingRay, Pixel};
use crate::world::Crossing;
use crate::world::vertex::Vertex;

/// A vertex of the record. Node 0 is the camera; every other knows its parent, which comes before.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// How the walk got here; `None` at the camera.
    pub(crate) arrival: Option<Arrival>,
    pub(crate) crossings: Range<usize>,
    pub(crate) connections: Range<usize>,
    /// The direction the walk left in.
    pub(crate) wi: Vec3,
    /// The scattering function's value for it.
    pub(crate) value: Rgb,
    /// Its inverse density, Russian roulette included.
    pub(crate) inv_pdf: f64,
    pub(crate) role: Role,
    /// The walk left in one of the single directions of a smooth surface.
    pub(crate) single: bool,
    /// Index of the vertex of a light path that the node is, where it is one.
    pub(crate) light: u32,
    /// The control radiance of the ray by which the walk arrived, see [`probe`](crate::terms::interior).
    pub(crate) control: Rgb,
}

/// What made a node.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Role {
    /// The walk from the camera.
    Walked,
    /// A connection with a vertex of a light path, to which the parent scatters like this.
    Joined(Scattered),
    /// A vertex of a light path as the next one sees it, with the throughput from there. So much of what the next one scatters
    /// comes from the camera.
    OfLight { passed: Rgb },
    /// The last vertex of a light path that anything is connected with.
    LastOfLight,
    /// A point of a segment that no walk stopped at, where coefficients of a medium are differentiated.
    Probe,
}

impl Node {
    /// The vertex, unless this is the camera or the environment.
    pub(crate) fn vertex(&self) -> Option<&Vertex> {
        match &self.arrival.as_ref()?.end {
            Endpoint::Surface(v) | Endpoint::Volume(v, _) => Some(v),
            Endpoint::Environment => None,
        }
    }
}

/// What a ray of the camera serves.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CameraRay {
    /// Column and row of the pixel.
    pub(crate) pixel: [u32; 2],
    /// The point of the lens where it starts, as [`ViewSample::lens`].
    pub(crate) lens: [f64; 2],
}

/// A recorded path: a tree, since equiangular side vertices branch off its segments.
#[derive(Clone, Debug, Default)]
pub(crate) struct PathRecord {
    /// Where the camera's ray starts.
    pub(crate) origin: Vec3,
    pub(crate) camera_ray: CameraRay,
    pub(crate) nodes: Vec<Node>,
    pub(crate) crossings: Vec<Crossing>,
    pub(crate) connections: Vec<(Connection, Range<usize>)>,
    /// The path's value.
    pub(crate) value: Rgb,
    /// By vertex of a light path: what it scatters of what comes from the camera; its node as the next one sees it, or 0.
    scattered: Vec<Option<Rgb>>,
    behind: Vec<u32>,
}

impl PathRecord {
    /// Empties the record for a camera ray of a `pixel` with filter weight `value`.
    pub(crate) fn begin(&mut self, pixel: [u32; 2], view: &ViewSample, value: Rgb) {
        self.origin = view.origin;
        self.camera_ray = CameraRay { pixel, lens: view.lens };
        self.nodes.clear();
        self.crossings.clear();
        self.connections.clear();
        self.value = Rgb::ZERO;
        self.scattered.clear();
        self.behind.clear();
        self.nodes.push(Node {
            arrival: None,
            crossings: 0..0,
            connections: 0..0,
            wi: view.direction,
            value,
            inv_pdf: 1.0,
            role: Role::Walked,
            single: false,
            light: 0,
            control: Rgb::ZERO,
        });
    }

    /// The segments up to a node.
    pub(crate) fn segments(&self, mut node: usize) -> u32 {
        let mut n = 0;
        while let Some(a) = &self.nodes[node].arrival {
            n += 1;
            node = a.parent as usize;
        }
        n
    }

    fn keep(&mut self, crossings: &[Crossing]) -> Range<usize> {
        let start = self.crossings.len();
        self.crossings.extend_from_slice(crossings);
        start..self.crossings.len()
    }

    /// Adds a vertex and returns its node.
    pub(crate) fn arrive(&mut self, arrival: &Arrival, crossings: &[Crossing]) -> u32 {
        let crossings = self.keep(crossings);
        let c = self.connections.len();
        self.nodes.push(Node {
            arrival: Some(*arrival),
            crossings,
            connections: c..c,
            wi: Vec3::ZERO,
            value: Rgb::ZERO,
            inv_pdf: 0.0,
            role: Role::Walked,
            single: false,
            light: 0,
            control: Rgb::ZERO,
        });
        self.nodes.len() as u32 - 1
    }

    /// The walk leaves a node.
    pub(crate) fn scatter(&mut self, leaving: &OutgoingRay, value: Rgb, inv_pdf: f64) {
        let node = &mut self.nodes[leaving.node as usize];
        (node.wi, node.value, node.inv_pdf) = (leaving.dir, value, inv_pdf);
        node.single = leaving.pdf().is_none();
    }

    /// A node was connected to a light.
    #[inline]
    pub(crate) fn connect(&mut self, node: u32, connection: &Connection, crossings: &[Crossing]) {
        let crossings = self.keep(crossings);
        self.connections.push((*connection, crossings));
        let end = self.connections.len();
        let node = &mut self.nodes[node as usize];
        if node.connections.is_empty() {
            node.connections.start = end - 1;
        }
        node.connections.end = end;
    }
}

/// Light only: the plain forward renderer.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Radiance(pub(crate) Rgb);

impl Observer for Radiance {
    const RECORDS: bool = false;

    fn contribution(&mut self, _: Pixel, _: u32, value: Rgb) {
        self.0 += value;
    }
}

impl JointObserver for Radiance {}

/// Light by the number of segments it took.
#[derive(Clone, Debug, Default)]
pub(crate) struct RadianceBySegments(pub(crate) Vec<Rgb>);

impl RadianceBySegments {
    /// The number of segments that some light took at least; `None` without any.
    pub(crate) fn fewest_segments(&self) -> Option<u32> {
        self.0.iter().position(|v| !v.is_zero()).map(|i| i as u32)
    }

    /// True without any light.
    pub(crate) fn is_dark(&self) -> bool {
        self.fewest_segments().is_none()
    }

    /// The light that took at most `segments` segments.
    pub(crate) fn within(&self, segments: u32) -> Rgb {
        let n = self.0.len().min(segments as usize + 1);
        self.0[..n].iter().fold(Rgb::ZERO, |sum, v| sum + *v)
    }
}

impl Observer for RadianceBySegments {
    const RECORDS: bool = false;

    fn contribution(&mut self, _: Pixel, segments: u32, value: Rgb) {
        let i = segments as usize;
        if self.0.len() <= i {
            self.0.resize(i + 1, Rgb::ZERO);
        }
        self.0[i] += value;
    }
}
