//! Vertices of light paths.

use drt_math::Vec3;

/// A material point of a shape, however the shape moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MaterialPoint {
    pub(crate) shape: u32,
    pub(crate) at: drt_motion::SurfacePoint,
}

/// A point of what a vertex is on, which may move.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Matter {
    /// Of a surface.
    Surface(MaterialPoint),
    /// Of the inside of a medium.
    Volume(usize, Vec3),
}

/// A point on a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePoint {
    /// Index in the scene's triangle soup.
    pub(crate) prim: u32,
    pub(crate) shape: u32,
    pub(crate) triangle: u32,
    /// Weights of the triangle's second and third vertex.
    pub(crate) bary: [f64; 2],
    /// Unit geometric normal, on the front side.
    pub(crate) ng: Vec3,
    /// Unit shading normal.
    pub(crate) ns: Vec3,
}

impl SurfacePoint {
    pub(crate) fn material(&self) -> MaterialPoint {
        let at = drt_motion::SurfacePoint { triangle: self.triangle, bary: self.bary };
        MaterialPoint { shape: self.shape, at }
    }
}

/// Where a volume vertex touches a surface: the limit of points on one of its sides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    pub(crate) point: SurfacePoint,
    /// True when the vertex lies on the front side.
    pub(crate) front: bool,
}

/// What a vertex stands on.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    /// A scattering surface.
    Surface(SurfacePoint),
    /// The inside of the vertex's medium.
    Volume(Option<Contact>),
    /// A pinhole, a point light or an edge point: neither scatters nor is integrated over.
    Point,
}

/// A vertex of a light path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    pub(crate) x: Vec3,
    /// The medium of a volume vertex or point; at a surface, that of the segment which arrived.
    pub(crate) medium: Option<usize>,
    pub(crate) kind: Kind,
}

impl Vertex {
    pub(crate) fn matter(&self) -> Option<Matter> {
        match (&self.kind, self.medium) {
            (Kind::Surface(s), _) => Some(Matter::Surface(s.material())),
            (Kind::Volume(_), Some(m)) => Some(Matter::Volume(m, self.x)),
            _ => None,
        }
    }

    pub(crate) fn surface(&self) -> Option<&SurfacePoint> {
        match &self.kind {
            Kind::Surface(s) => Some(s),
            _ => None,
        }
    }
}
