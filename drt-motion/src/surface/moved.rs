use alloc::vec;
use alloc::vec::Vec;
use core::cell::OnceCell;

use drt_geom::Mesh;
use drt_math::{Affine, Mat3, Vec3};

use super::area::Unit;
use super::caged::Caged;
use super::normals::Neighbours;
use super::turned::TurnedNormals;
use super::{SmoothNormals, SurfaceMotion, VertexVectors};
use crate::error::Cause;
use crate::error::MotionError;
use crate::error::finite;
use crate::lists::Lists;
use crate::parameter::{Applied, GeometryChange};

/// A mesh at the parameters' values, and how it goes on moving from there.
#[derive(Clone, Debug)]
pub struct MovedMesh {
    /// The moved mesh.
    pub mesh: Mesh,
    /// Its velocity for each parameter.
    pub motions: Vec<SurfaceMotion>,
    /// How the vertex normals follow the positions, where they do: a mesh with vertex normals that
    /// some change deforms.
    pub smooth: Option<SmoothNormals>,
}

/// Something placed as a whole, such as a camera, at the parameters' values.
#[derive(Clone, Debug, PartialEq)]
pub struct MovedFrame {
    /// From the placement in the scene file to the moved one.
    pub map: Affine,
    /// Per parameter, the velocity field as a function of the moved position.
    pub velocities: Vec<Affine>,
}

/// Applies changes to a mesh, in the order given, for `parameters` parameters in all.
///
/// A later change carries along the velocities of the earlier ones: of f2(f1(x)), the parameter of
/// f1 moves the result by Df2 times what it moved f1(x).
///
/// Vertex normals turn with affine changes. As soon as one change moves single vertices, even at
/// theta = 0, the normals in the file give way to [`SmoothNormals`], so that the moved mesh is one
/// smooth function of the parameters.
///
/// # Errors
/// When a change is [unusable](GeometryChange::check), does not fit the mesh, or takes it out of
/// the range of numbers.
pub fn move_mesh(
    mesh: &Mesh,
    changes: &[Applied<'_, GeometryChange>],
    parameters: usize,
) -> Result<MovedMesh, MotionError> {
    let mut moved = mesh.clone();
    let mut fields = Fields::new(parameters);
    let mut deformed = false;
    let sources = Sources::new(mesh, changes);
    let caged = Caged::new(mesh, changes)?;
    for c in changes {
        check(c, parameters)?;
    }
    let turned = TurnedNormals::new(mesh, changes, parameters)?;
    if let Some(turned) = &turned {
        moved.normals = Some(turned.normals());
    }
    let mut linear = Mat3::IDENTITY;
    // Affine changes become one map until positions are asked for: a mesh is moved once, whatever their number.
    let mut pending: Option<(Affine, &Applied<'_, GeometryChange>)> = None;
    for c in changes {
        let fail = |cause| c.error(cause);
        let velocities = vertex_velocities(mesh, &caged, &sources, c.change).map_err(fail)?;
        let mut all_finite = true;
        if let Some(velocities) = velocities {
            settle(&mut moved, pending.take())?;
            deformed = true;
            if c.theta != 0.0 {
                fields.pin(&moved.positions);
            }
            for (i, v) in velocities.stored() {
                moved.positions[i] += v * c.theta;
                all_finite &= moved.positions[i].is_finite();
            }
            fields.add(c.parameter, Field::Vertices(velocities), &moved.positions);
        } else if let Some(step) = Step::new(c) {
            // Normals are made unit anew, which would not leave them the same bits.
            if step.map != Affine::IDENTITY {
                let map = pending.map_or(step.map, |(before, _)| step.map.after(&before));
                all_finite = map.is_finite();
                pending = Some((map, c));
                linear = step.map.linear * linear;
                fields.carry(&step);
            }
            if matches!(fields.list[c.parameter], Field::Vertices(_)) {
                settle(&mut moved, pending.take())?;
            }
            fields.add(c.parameter, Field::Affine(step.velocity), &moved.positions);
        }
        finite(all_finite, "a moved position").map_err(fail)?;
    }
    settle(&mut moved, pending)?;
    let smooth = (deformed && mesh.normals.is_some()).then(|| SmoothNormals::new(mesh));
    if let Some(smooth) = &smooth {
        moved.normals = Some(smooth.normals(&moved));
    }
    let smooth_units = smooth.as_ref().map(|smooth| SmoothUnits {
        smooth,
        units: smooth.units(&moved),
        neighbours: OnceCell::new(),
    });
    let motion = |(parameter, field): (usize, Field)| {
        let motion = field.into_motion(&moved, smooth_units.as_ref());
        match turned.as_ref().and_then(|turned| turned.rates(parameter, &linear)) {
            None => motion,
            Some(rates) => {
                let positions = VertexVectors::zeros(moved.positions.len());
                let turning = SurfaceMotion::Vertices { positions, normals: Some(rates.into()) };
                motion.plus(&turning, &moved)
            }
        }
    };
    let motions = fields.list.into_iter().enumerate().map(motion).collect();
    Ok(MovedMesh { mesh: moved, motions, smooth })
}

/// Moves a mesh by the map of affine changes, which ends with the one given.
fn settle(
    mesh: &mut Mesh,
    pending: Option<(Affine, &Applied<'_, GeometryChange>)>,
) -> Result<(), MotionError> {
    let Some((map, last)) = pending else { return Ok(()) };
    *mesh = mesh.transform(&map);
    let all_finite = mesh.positions.iter().all(|x| x.is_finite());
    finite(all_finite, "a moved position").map_err(|cause| last.error(cause))
}

/// Applies changes to something placed as a whole, in the order given, for `parameters` parameters
/// in all.
///
/// # Errors
/// When a change is [unusable](GeometryChange::check) or not affine.
pub fn move_affine(
    changes: &[Applied<'_, GeometryChange>],
    parameters: usize,
) -> Result<MovedFrame, MotionError> {
    let mut map = Affine::IDENTITY;
    let mut velocities = vec![Affine::ZERO; parameters];
    for c in changes {
        check(c, parameters)?;
        let step = Step::new(c).ok_or_else(|| c.error(Cause::NotAffine))?;
        map = step.map.after(&map);
        if step.map != Affine::IDENTITY {
            for v in &mut velocities {
                *v = step.carry(v);
            }
        }
        velocities[c.parameter] = velocities[c.parameter].plus(&step.velocity);
        finite(map.is_finite(), "the moved placement").map_err(|cause| c.error(cause))?;
    }
    Ok(MovedFrame { map, velocities })
}

fn check(c: &Applied<'_, GeometryChange>, parameters: usize) -> Result<(), MotionError> {
    if c.parameter >= parameters {
        return Err(c.error(Cause::ParameterIndex { count: parameters }));
    }
    c.change.check(c.theta).map_err(|cause| c.error(cause))
}

/// An affine change at its parameter's value.
struct Step {
    map: Affine,
    inverse: Affine,
    velocity: Affine,
}

impl Step {
    fn new(c: &Applied<'_, GeometryChange>) -> Option<Self> {
        let map = c.change.affine(c.theta)?;
        Some(Self { map, inverse: map.inverse(), velocity: c.change.velocity(c.theta)? })
    }

    /// The field u of positions before the step, as a field of positions after it: L u(map⁻¹ y).
    fn carry(&self, u: &Affine) -> Affine {
        // What moves all points alike, or none, as many parameters do.
        if u.linear == Mat3::ZERO {
            return Affine { linear: u.linear, translation: self.map.vector(u.translation) };
        }
        Affine { linear: self.map.linear * u.linear, translation: self.map.vector(u.translation) }
            .after(&self.inverse)
    }
}

/// The velocity fields of all parameters.
///
/// Most changes leave most fields as they are: one that moves vertices singly all but those that are affine functions of
/// the position, and so does a translation.
struct Fields {
    list: Vec<Field>,
    /// The fields that are affine and differ from place to place.
    varying: Vec<usize>,
}

impl Fields {
    fn new(parameters: usize) -> Self {
        Self { list: vec![Field::Affine(Affine::ZERO); parameters], varying: Vec::new() }
    }

    /// Takes the fields through an affine change of the positions.
    fn carry(&mut self, step: &Step) {
        if step.map.linear == Mat3::IDENTITY {
            self.varying.iter().for_each(|p| self.list[*p].carry(step));
        } else {
            self.list.iter_mut().for_each(|field| field.carry(step));
        }
    }

    /// Ties the fields to the vertices, which are at `positions`, before they are moved singly: what is an affine function
    /// of the position now would not be one afterwards.
    fn pin(&mut self, positions: &[Vec3]) {
        for p in self.varying.drain(..) {
            if let Field::Affine(u) = &self.list[p] {
                self.list[p] = Field::Vertices(at_vertices(u, positions));
            }
        }
    }

    fn add(&mut self, parameter: usize, other: Field, positions: &[Vec3]) {
        let field = &mut self.list[parameter];
        let varied = field.varies();
        field.add(other, positions);
        match (varied, field.varies()) {
            (false, true) => self.varying.push(parameter),
            (true, false) => self.varying.retain(|p| *p != parameter),
            _ => {}
        }
    }
}

/// A velocity field on the vertices, kept affine for as long as it is.
#[derive(Clone, Debug)]
enum Field {
    Affine(Affine),
    Vertices(VertexVectors),
}

impl Field {
    fn varies(&self) -> bool {
        matches!(self, Self::Affine(u) if u.linear != Mat3::ZERO)
    }

    fn carry(&mut self, step: &Step) {
        match self {
            Self::Affine(u) => *u = step.carry(u),
            Self::Vertices(v) => *v = v.map(|v| step.map.vector(v)),
        }
    }

    fn add(&mut self, other: Self, positions: &[Vec3]) {
        *self = match (core::mem::replace(self, Self::Affine(Affine::ZERO)), other) {
            (Self::Affine(a), Self::Affine(b)) => Self::Affine(a.plus(&b)),
            (Self::Affine(u), Self::Vertices(v)) | (Self::Vertices(v), Self::Affine(u)) => {
                Self::Vertices(if u.is_zero() { v } else { at_vertices(&u, positions).plus(&v) })
            }
            (Self::Vertices(a), Self::Vertices(b)) => Self::Vertices(a.plus(&b)),
        };
    }

    fn into_motion(self, moved: &Mesh, smooth: Option<&SmoothUnits<'_>>) -> SurfaceMotion {
        let positions = match self {
            Self::Affine(u) if u.is_zero() => return SurfaceMotion::Rest,
            // Angles weigh recomputed normals; where they change, these do not turn as the field.
            Self::Affine(u) if smooth.is_some() && !keeps_angles(&u.linear) => {
                at_vertices(&u, &moved.positions)
            }
            Self::Affine(u) => return SurfaceMotion::Affine(u),
            Self::Vertices(v) if v.is_zero() => return SurfaceMotion::Rest,
            Self::Vertices(v) => v,
        };
        let normals = smooth.map(|smooth| smooth.rates(moved, &positions));
        SurfaceMotion::Vertices { positions, normals }
    }
}

/// The recomputed normals of a mesh, and what their rates depend on.
struct SmoothUnits<'a> {
    smooth: &'a SmoothNormals,
    units: Vec<Unit>,
    /// Made when a parameter moves few vertices.
    neighbours: OnceCell<Neighbours>,
}

impl SmoothUnits<'_> {
    fn rates(&self, moved: &Mesh, velocities: &VertexVectors) -> VertexVectors {
        if velocities.few().is_some() {
            let around = self.neighbours.get_or_init(|| self.smooth.neighbours(moved));
            return self.smooth.rates_of_few(&self.units, moved, around, velocities);
        }
        let all = Vec::from(velocities.clone());
        self.smooth.rates_from(&self.units, moved, &all).into()
    }
}

/// Whether the linear part of a velocity field is a spin plus a uniform growth, up to rounding.
fn keeps_angles(a: &Mat3) -> bool {
    let deviatoric = *a + a.transpose() + Mat3::IDENTITY * (a.trace() * (-2.0 / 3.0));
    let size = |m: &Mat3| m.cols.iter().fold(0.0, |s, c| f64::max(s, c.max_abs()));
    size(&deviatoric) <= 16.0 * f64::EPSILON * size(a)
}

fn at_vertices(u: &Affine, positions: &[Vec3]) -> VertexVectors {
    positions.iter().map(|&x| u.point(x)).collect::<Vec<_>>().into()
}

/// The vertices of a mesh that stem from each vertex of its file; empty where no change asks for them.
struct Sources(Option<Lists>);

impl Sources {
    fn new(mesh: &Mesh, changes: &[Applied<'_, GeometryChange>]) -> Self {
        let single =
            |c: &Applied<'_, GeometryChange>| matches!(c.change, GeometryChange::Vertex { .. });
        let pairs = || (0..mesh.positions.len() as u32).map(|i| (mesh.source_vertex(i), i));
        let count = mesh.source_vertex_count as usize;
        Self(changes.iter().any(single).then(|| Lists::new(count, &pairs().collect::<Vec<_>>())))
    }

    fn of(&self, source: u32) -> &[u32] {
        self.0.as_ref().map_or(&[], |lists| lists.of(source as usize))
    }
}

/// Velocities of the mesh's vertices, from a change given in the order of the mesh's file; `None`
/// for a change of space as a whole.
fn vertex_velocities(
    mesh: &Mesh,
    caged: &Caged<'_>,
    sources: &Sources,
    change: &GeometryChange,
) -> Result<Option<VertexVectors>, Cause> {
    let count = mesh.source_vertex_count as usize;
    let vertices = mesh.positions.len();
    match change {
        GeometryChange::VertexVelocity(v) if v.len() == count => {
            let moving = (0..vertices as u32).map(|i| (i, v[mesh.source_vertex(i) as usize]));
            let moving = moving.filter(|(_, v)| *v != Vec3::ZERO).collect();
            Ok(Some(VertexVectors::of_few(vertices, moving)))
        }
        GeometryChange::VertexVelocity(v) => {
            Err(Cause::VertexCount { expected: count, found: v.len() })
        }
        &GeometryChange::Vertex { index, direction } if (index as usize) < count => {
            let few = sources.of(index).iter().map(|i| (*i, direction)).collect();
            Ok(Some(VertexVectors::of_few(vertices, few)))
        }
        &GeometryChange::Vertex { index, .. } => Err(Cause::VertexIndex { index, count }),
        GeometryChange::Cage { mesh: cage, vertices } => {
            Ok(caged.velocities(cage, vertices).map(Into::into))
        }
        GeometryChange::Translate(_)
        | GeometryChange::Rotate { .. }
        | GeometryChange::Scale { .. }
        | GeometryChange::Matrix(_)
        | GeometryChange::VertexNormals(_) => Ok(None),
    }
}
