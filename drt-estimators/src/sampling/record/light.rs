//! The part of a record that light's path leaves behind, which all its connections with a path from the camera share.
//!
//! A record goes from the camera on. What a connection leads to is recorded in that direction, too: its end, a copy of the light
//! path's vertex, and for each vertex but the last of the light path one node as the next one sees it, whose throughput is
//! counted from there. Connections end in the former; what lies behind is swept once for all of them, by its throughput per unit
//! of what comes from the camera (the prefix products of the 2021 paper, §5, and of the 2023 paper, Eqs. 49–54). So a path of m vertices and one of n have m n
//! connections of constant cost.

use alloc::vec::Vec;
use core::ops::Range;

use drt_math::{Rgb, Vec3};

use crate::sampling::record::{Node, PathRecord, Role};
use crate::sampling::trace::{Arrival, Connection, Endpoint, Observer};
use crate::world::Crossing;

/// A light path as the camera's side sees it.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightPath {
    /// From the emitter on.
    pub(crate) vertices: Vec<LightVertex>,
    pub(crate) crossings: Vec<Crossing>,
    /// The first vertex with the emitter, as next-event estimation would connect it, but for the first one's scattering.
    pub(crate) emission: Option<Connection>,
    /// On that segment.
    pub(crate) crossed: Range<usize>,
}

/// A vertex of a light path.
#[derive(Clone, Debug)]
pub(crate) struct LightVertex {
    pub(crate) end: Endpoint,
    /// Unit, towards the vertex or emitter before.
    pub(crate) wi: Vec3,
    /// From the next vertex, if there is one.
    pub(crate) seen: Option<SeenVertex>,
}

/// A vertex of a light path as the next one sees it.
#[derive(Clone, Debug)]
pub(crate) struct SeenVertex {
    /// Unit, from the next one.
    pub(crate) dir: Vec3,
    pub(crate) distance: f64,
    /// There.
    pub(crate) start_medium: Option<usize>,
    pub(crate) crossings: Range<usize>,
    /// Transmittance over the density of the distance.
    pub(crate) arrival: Rgb,
    pub(crate) scattered: Scattered,
}

/// How a vertex scatters the light that comes along the light path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scattered {
    /// The scattering function, with the cosine on the side of the emitter.
    pub(crate) value: Rgb,
    /// What makes that importance, over its density.
    pub(crate) inv_pdf: f64,
}

/// A connection of a node with a vertex of a light path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Joint<'a> {
    /// Of the light path.
    pub(crate) vertex: usize,
    /// The node's scattering towards it.
    pub(crate) leaving: Scattered,
    /// How it is reached.
    pub(crate) arrival: Arrival,
    pub(crate) crossings: &'a [Crossing],
    /// Scattering there.
    pub(crate) scattered: Scattered,
}

/// What listens to a walk and to how it is connected with a light path.
pub(crate) trait JointObserver: Observer {
    /// Emission that was met at `node` has another MIS weight than the walk gave it.
    fn emission(&mut self, _node: u32, _weight: f64) {}
    /// A node was connected with a vertex of a light path.
    fn join(&mut self, _joint: &Joint<'_>, _path: &LightPath) {}
    /// All connections with a light path have been made.
    fn joined(&mut self, _path: &LightPath) {}
}

impl LightPath {
    pub(crate) fn clear(&mut self) {
        self.vertices.clear();
        self.crossings.clear();
        (self.emission, self.crossed) = (None, 0..0);
    }

    /// Adds the interfaces of a segment as they are met from its other end; returns them, and the medium there.
    pub(crate) fn turn_round(
        &mut self,
        crossings: &[Crossing],
        mut medium: Option<usize>,
        distance: f64,
    ) -> (Range<usize>, Option<usize>) {
        let first = self.crossings.len();
        for c in crossings {
            self.crossings.push(Crossing { t: distance - c.t, after: medium, ..*c });
            medium = c.after;
        }
        self.crossings[first..].reverse();
        (first..self.crossings.len(), medium)
    }
}

impl PathRecord {
    /// Adds a connection with a vertex of a light path; returns its end.
    pub(crate) fn join(&mut self, joint: &Joint<'_>, path: &LightPath) -> usize {
        let Joint { vertex, leaving, arrival, scattered, .. } = *joint;
        let node = self.arrive(&arrival, joint.crossings) as usize;
        let Some(of_light) = path.vertices.get(vertex) else { return node };
        let Node { role, light, wi, value, inv_pdf, .. } = &mut self.nodes[node];
        (*role, *light) = (Role::Joined(leaving), vertex as u32);
        (*wi, *value, *inv_pdf) = (of_light.wi, scattered.value, scattered.inv_pdf);
        self.scatter_light(node, vertex, &scattered, path);
        node
    }

    /// Adds the vertices behind those that connections lead to, and returns their nodes.
    pub(crate) fn add_light_path(&mut self, path: &LightPath) -> Range<usize> {
        let first = self.nodes.len();
        let behind = |v: &usize| self.scattered[..].get(*v).is_some_and(|s| s.is_some());
        let Some(last) = (1..path.vertices.len()).rev().find(behind) else { return first..first };
        self.behind.resize(path.vertices.len(), 0);
        // Where the last one is is all that is asked of it.
        let of_last = &path.vertices[last];
        let nowhere = Arrival {
            parent: 0,
            end: of_last.end,
            dir: Vec3::ZERO,
            distance: 0.0,
            start_medium: None,
            arrival: Rgb::ZERO,
            throughput: Rgb::ZERO,
            emission_weight: 0.0,
        };
        let mut parent = self.arrive(&nowhere, &[]);
        self.nodes[parent as usize].role = Role::LastOfLight;
        self.nodes[parent as usize].light = last as u32;
        self.behind[last] = parent;
        for (v, of_light) in path.vertices[..last].iter().enumerate().rev() {
            let Some(seen) = &of_light.seen else { continue };
            let (dir, distance, start_medium) = (seen.dir, seen.distance, seen.start_medium);
            let (end, arrival, throughput) = (of_light.end, seen.arrival, seen.arrival);
            let emission_weight = 0.0;
            let arrival = Arrival {
                parent,
                end,
                dir,
                distance,
                start_medium,
                arrival,
                throughput,
                emission_weight,
            };
            parent = self.arrive(&arrival, &path.crossings[seen.crossings.clone()]);
            let passed = self.scattered.get(v + 1).copied().flatten().unwrap_or(Rgb::ZERO);
            let Scattered { value, inv_pdf } = seen.scattered;
            let node = &mut self.nodes[parent as usize];
            (node.role, node.light) = (Role::OfLight { passed }, v as u32);
            (node.wi, node.value, node.inv_pdf) = (of_light.wi, value, inv_pdf);
            self.behind[v] = parent;
            self.scatter_light(parent as usize, v, &seen.scattered, path);
        }
        first..self.nodes.len()
    }

    /// The light path goes on from a node towards the emitter.
    fn scatter_light(&mut self, node: usize, v: usize, scattered: &Scattered, path: &LightPath) {
        let Node { arrival: Some(arrival), role, .. } = &self.nodes[node] else { return };
        if let (0, Some(emission)) = (v, &path.emission) {
            let transport = emission.transport * scattered.inv_pdf;
            let connection = Connection { f: scattered.value, transport, ..*emission };
            self.connect(node as u32, &connection, &path.crossings[path.crossed.clone()]);
            return;
        }
        let passed = if let Role::OfLight { passed } = role { *passed } else { Rgb::ONE };
        let onward = passed
            * arrival.throughput
            * arrival.end.sigma_s()
            * (scattered.value * scattered.inv_pdf);
        if self.scattered.len() <= v {
            self.scattered.resize(v + 1, None);
        }
        let sum = self.scattered[v].get_or_insert(Rgb::ZERO);
        *sum += onward;
    }

    /// The node of a vertex of the light path as the next one sees it.
    pub(crate) fn of_light(&self, v: u32) -> Option<usize> {
        self.behind.get(v as usize).map(|node| *node as usize).filter(|node| *node > 0)
    }
}
