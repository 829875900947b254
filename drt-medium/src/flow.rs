//! Velocities of a medium's grids that are no affine field: given at nodes and interpolated between
//! them, in a way that the nodes' owner defines.

use alloc::sync::Arc;
use core::fmt::Debug;

use drt_math::{Affine, Vec3};

/// Nodes with weights that sum to one; all zero where the grids rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeWeights {
    /// Numbers of the nodes.
    pub nodes: [u32; 4],
    /// Their weights.
    pub weights: [f64; 4],
}

impl NodeWeights {
    /// The mean of the nodes' velocities.
    ///
    /// # Panics
    /// When the velocities belong to other nodes.
    #[inline]
    #[must_use]
    pub fn velocity(&self, nodes: &[Vec3]) -> Vec3 {
        let mut u = Vec3::ZERO;
        for k in 0..4 {
            u += nodes[self.nodes[k] as usize] * self.weights[k];
        }
        u
    }

    /// The transpose of [`velocity`](Self::velocity): adds to the gradient by the nodes' velocities.
    ///
    /// # Panics
    /// When the gradient belongs to other nodes.
    #[inline]
    pub fn scatter(&self, adjoint: Vec3, nodes: &mut [Vec3]) {
        for k in 0..4 {
            nodes[self.nodes[k] as usize] += adjoint * self.weights[k];
        }
    }
}

/// How velocities given at nodes fill space. Where the grids are, they must be continuous.
pub trait FlowBasis: Debug + Send + Sync {
    /// The nodes whose velocities make up that of the grids at a point of the world.
    fn weights(&self, x: Vec3) -> NodeWeights;
}

/// A velocity field of grids, interpolated between nodes.
#[derive(Clone, Debug)]
pub struct Flow {
    /// Where the nodes are, in effect; the same for all parameters, as a rule.
    pub basis: Arc<dyn FlowBasis>,
    /// A velocity for each node, in scene units per unit of the parameter.
    pub nodes: Arc<[Vec3]>,
}

impl PartialEq for Flow {
    /// Of one basis, and equal at its nodes.
    fn eq(&self, o: &Self) -> bool {
        Arc::ptr_eq(&self.basis, &o.basis) && self.nodes == o.nodes
    }
}

impl Flow {
    /// True when no node moves.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.nodes.iter().all(|v| *v == Vec3::ZERO)
    }

    /// The velocity at a point of the world.
    #[must_use]
    pub fn velocity(&self, x: Vec3) -> Vec3 {
        self.basis.weights(x).velocity(&self.nodes)
    }

    /// Adds a flow of the same basis; false for one of another.
    pub(crate) fn add(&mut self, o: &Self) -> bool {
        let same = Arc::ptr_eq(&self.basis, &o.basis);
        if same {
            self.nodes = self.nodes.iter().zip(&*o.nodes).map(|(a, b)| *a + *b).collect();
        }
        same
    }

    /// The flow after the grids, and the nodes with them, have been moved by a map of the world.
    pub(crate) fn carry(&mut self, map: &Affine) {
        let (basis, from) = (self.basis.clone(), map.inverse());
        self.basis = Arc::new(Carried { basis, from });
        self.nodes = self.nodes.iter().map(|v| map.vector(*v)).collect();
    }
}

/// Nodes that an affine map has moved.
#[derive(Debug)]
struct Carried {
    basis: Arc<dyn FlowBasis>,
    from: Affine,
}

impl FlowBasis for Carried {
    fn weights(&self, x: Vec3) -> NodeWeights {
        self.basis.weights(self.from.point(x))
    }
}

/// The weights of nodes at the last point asked for: parameters mostly share a basis.
#[derive(Clone, Debug, Default)]
pub struct FlowPlace {
    last: Option<(Arc<dyn FlowBasis>, Vec3)>,
    weights: NodeWeights,
}

impl FlowPlace {
    /// The weights of a basis at a point.
    #[inline]
    pub fn at(&mut self, basis: &Arc<dyn FlowBasis>, x: Vec3) -> &NodeWeights {
        let known = self.last.as_ref().is_some_and(|(b, at)| *at == x && Arc::ptr_eq(b, basis));
        if !known {
            self.weights = basis.weights(x);
            self.last = Some((basis.clone(), x));
        }
        &self.weights
    }
}
