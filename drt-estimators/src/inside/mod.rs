//! How the inside of each medium moves with each parameter (theory sheet §4.1, §14.1).
//!
//! Any continuous field is right that matches the normal velocity of the surfaces around the medium,
//! or misses it where the flux is added. The variance is finite only if the field also matches
//! surfaces on which paths have vertices, and cameras and point lights inside the medium: else rates
//! near them grow like 1/r. So, per medium and parameter:
//!
//! * nothing around it moves: static;
//! * everything around it moves by one affine field: that field;
//! * paths scatter once, and only surfaces without path vertices move (null or black): static, with
//!   the flux added, which single scattering finds exactly;
//! * some surface deforms: tetrahedra that carry the velocities of all surfaces;
//! * else: a blend of the affine fields around it (drt-motion's `Blend`).
//!
//! Where the surfaces pass through each other there are no tetrahedra; then the blend serves, with a
//! surface of few triangles counting triangle by triangle, and one of many as resting, with its flux
//! added.

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::fmt::Display;

use drt_math::{Affine, Vec3};
use drt_motion::interior::Blend;

use crate::Error;
use crate::kept::Kept;
use crate::settings::{GivenTetrahedra, InsideKind};
use crate::tangents::Tangents;
use crate::transport::World;

mod adjacency;
mod field;
mod mean_value;
mod parts;
mod tetrahedra;
mod transposed;

use adjacency::adjacency;
pub(crate) use field::{Field, Inside, Place};
use mean_value::MeanValue;
use parts::Part;
pub(crate) use tetrahedra::MARGIN;
pub(crate) use transposed::{InsideGradients, TransposedInsides};

/// The motions of all insides, and the shapes whose flux must be added.
#[derive(Clone, Debug, Default)]
pub(crate) struct Insides {
    /// Per medium: the parameters that move its inside, and how.
    pub(crate) volumes: Vec<Vec<(usize, Inside)>>,
    /// Per medium: what these motions share.
    pub(crate) fields: Vec<Option<Field>>,
    /// Shapes through which some medium has a flux for some parameter.
    pub(crate) flux_shapes: Vec<usize>,
    /// Per medium: parameters that need a flux.
    pub(crate) flux: Vec<Vec<usize>>,
}

impl Insides {
    /// Nothing moves, and nothing else makes up for it.
    pub(crate) fn at_rest(world: &World) -> Self {
        let media = world.scene.media.len();
        Self {
            volumes: alloc::vec![Vec::new(); media],
            fields: alloc::vec![None; media],
            flux: alloc::vec![Vec::new(); media],
            flux_shapes: Vec::new(),
        }
    }
}

/// The media that move as wholes: whichever parameter moves anything around one, everything there moves by one
/// affine field. The others are at rest, as all are in reverse mode, where vertices move one by one.
pub(crate) fn wholes(world: &World, tangents: &Tangents, asked: &[(usize, InsideKind)]) -> Insides {
    let mut insides = Insides::at_rest(world);
    for surroundings in all(world, tangents, asked) {
        let m = surroundings.medium;
        let moving = (0..tangents.names.len()).filter(|p| surroundings.moves(*p));
        let fields = moving.map(|p| Some((p, Inside::Affine(surroundings.one_affine_field(p)?))));
        // Other kinds have a transpose, which reverse mode takes to be what forward mode does.
        let wanted = matches!(surroundings.asked, None | Some(InsideKind::Affine));
        if wanted && world.medium(m).homogeneous().is_some() {
            insides.volumes[m] = fields.collect::<Option<_>>().unwrap_or_default();
        }
    }
    insides
}

pub(crate) fn plan(
    world: &World,
    tangents: &Tangents,
    asked: &[(usize, InsideKind)],
    kept: &mut Kept,
) -> Result<Insides, Error> {
    let mut insides = Insides::at_rest(world);
    for surroundings in all(world, tangents, asked) {
        surroundings.plan(&mut insides, kept)?;
        let m = surroundings.medium;
        insides.flux[m].sort_unstable();
        insides.flux[m].dedup();
    }
    insides.flux_shapes.sort_unstable();
    insides.flux_shapes.dedup();
    Ok(insides)
}

/// All media, and what is around them.
fn all<'a>(
    world: &'a World,
    tangents: &'a Tangents,
    asked: &'a [(usize, InsideKind)],
) -> impl Iterator<Item = Surroundings<'a>> {
    let adjacent = adjacency(world);
    (0..world.scene.media.len()).map(move |medium| {
        let touches = |s: &usize| adjacent[*s].contains(&medium);
        let shapes: Vec<usize> = (0..world.scene.shapes.len()).filter(touches).collect();
        let parts = parts::parts(world, tangents, medium, &shapes);
        Surroundings { world, tangents, medium, shapes, parts, asked: asked_for(asked, medium) }
    })
}

/// A medium and what is around it.
struct Surroundings<'a> {
    world: &'a World,
    tangents: &'a Tangents,
    medium: usize,
    shapes: Vec<usize>,
    parts: Vec<Part>,
    asked: Option<&'a InsideKind>,
}

impl Surroundings<'_> {
    fn plan(&self, insides: &mut Insides, kept: &mut Kept) -> Result<(), Error> {
        let m = self.medium;
        let mut fielded = Vec::new();
        for p in (0..self.tangents.names.len()).filter(|p| self.moves(*p)) {
            let affine = self.one_affine_field(p);
            match (self.asked, affine) {
                (Some(InsideKind::Affine), None) => return Err(self.not_affine(p)),
                (None | Some(InsideKind::Affine), Some(field)) => {
                    insides.volumes[m].push((p, Inside::Affine(field)));
                }
                (Some(InsideKind::Static), _) => self.add_flux(p, |_| true, insides),
                (None, None) if !self.is_worth_a_field(p) => self.add_flux(p, |_| true, insides),
                _ => fielded.push(p),
            }
        }
        if fielded.is_empty() {
            return Ok(());
        }
        let field = self.field(&fielded, kept)?;
        for p in fielded {
            let inside = match &field {
                Field::Blend(_) => {
                    let is_left_out = |s| self.is_deformed_whole(s, p);
                    if self.shapes.iter().any(|s| is_left_out(*s)) {
                        self.add_flux(p, is_left_out, insides);
                    }
                    let fields = self.parts.iter().map(|part| part.velocities[p]).enumerate();
                    Inside::Blend(fields.filter(|(_, v)| !v.is_zero()).collect())
                }
                Field::MeanValue(field) => {
                    let Self { world, tangents, shapes, parts, .. } = self;
                    let velocities = field.velocities(world, tangents, m, shapes, parts, p)?;
                    Inside::MeanValue(velocities)
                }
                Field::Tetrahedra(tetrahedra) => {
                    let given = self.given().map_or(Ok(None), |given| {
                        tetrahedra::given_velocities(self.world, m, given, p)
                    })?;
                    Inside::Tetrahedra(match given {
                        Some(given) => given,
                        None => {
                            let Self { world, tangents, shapes, parts, .. } = self;
                            let (velocities, left) = tetrahedra::velocities(
                                tetrahedra, world, tangents, shapes, parts, p,
                            );
                            if !left.is_empty() {
                                insides.flux[m].push(p);
                                insides.flux_shapes.extend(left);
                            }
                            velocities
                        }
                    })
                }
            };
            insides.volumes[m].push((p, inside));
        }
        insides.fields[m] = Some(field);
        Ok(())
    }

    /// Whether anything around the medium moves with a parameter.
    fn moves(&self, p: usize) -> bool {
        let shape = |s: &usize| self.tangents.shapes[*s].iter().any(|(q, _)| *q == p);
        self.shapes.iter().any(shape) || self.parts.iter().any(|part| !part.velocities[p].is_zero())
    }

    /// The field that everything around moves by, if it is one.
    fn one_affine_field(&self, p: usize) -> Option<Affine> {
        let first = self.parts.iter().find(|part| part.point.is_none())?.velocities[p];
        // A point has one velocity, whatever the field is elsewhere.
        let agrees = |part: &Part| match part.point {
            Some(x) => part.velocities[p].point(x) == first.point(x),
            None => part.velocities[p] == first,
        };
        let whole = self.shapes.iter().all(|s| !self.is_deformed_whole(*s, p));
        (whole && self.parts.iter().all(agrees)).then_some(first)
    }

    /// Whether a surface deforms and does not count triangle by triangle.
    fn is_deformed_whole(&self, shape: usize, p: usize) -> bool {
        parts::is_deformed_by(self.tangents, shape, p)
            && !parts::is_split(self.world, self.tangents, shape)
    }

    /// Whether the flux alone would be too noisy.
    fn is_worth_a_field(&self, p: usize) -> bool {
        let moves = |part: &Part| !part.velocities[p].is_zero();
        let scatters = self.parts.iter().any(|part| part.scatters && moves(part))
            || self.shapes.iter().any(|s| self.world.scatters(*s) && self.is_deformed_whole(*s, p));
        self.world.max_depth > 2 || scatters
    }

    /// Leaves the inside at rest next to the shapes that move and are chosen.
    fn add_flux(&self, p: usize, chosen: impl Fn(usize) -> bool, insides: &mut Insides) {
        insides.flux[self.medium].push(p);
        let moving = |s: &&usize| self.tangents.shapes[**s].iter().any(|(q, _)| *q == p);
        let shapes = self.shapes.iter().filter(moving).filter(|s| chosen(**s));
        insides.flux_shapes.extend(shapes);
    }

    fn given(&self) -> Option<&GivenTetrahedra> {
        match self.asked {
            Some(InsideKind::Tetrahedral(given)) => given.as_deref(),
            _ => None,
        }
    }

    /// What the motions by some parameters share.
    fn field(&self, parameters: &[usize], kept: &mut Kept) -> Result<Field, Error> {
        let Self { world, medium, shapes, parts, .. } = self;
        let tetrahedra = |kept: &mut Kept| match self.given() {
            Some(given) => tetrahedra::given(world, *medium, shapes, &given.mesh).map(Arc::new),
            None => {
                let points: Vec<Vec3> = parts.iter().filter_map(|part| part.point).collect();
                let make = || tetrahedra::around(world, *medium, shapes, &points);
                kept.tetrahedra(*medium, &world.scene, shapes, &points, make)
            }
        };
        let deforms =
            |s: &usize| parameters.iter().any(|p| parts::is_deformed_by(self.tangents, *s, *p));
        match self.asked {
            Some(InsideKind::Tetrahedral(_)) => Ok(Field::Tetrahedra(tetrahedra(kept)?)),
            Some(InsideKind::MeanValue) => {
                Ok(Field::MeanValue(MeanValue::new(world, *medium, shapes, parts)?))
            }
            None if shapes.iter().any(deforms) => match tetrahedra(kept) {
                Ok(field) => Ok(Field::Tetrahedra(field)),
                Err(_) => self.blend(),
            },
            _ => self.blend(),
        }
    }

    fn blend(&self) -> Result<Field, Error> {
        let sites = self.parts.iter().map(|part| parts::site(self.world, self.medium, part));
        Ok(Field::Blend(Blend::new(sites.collect::<Result<_, _>>()?)))
    }

    fn not_affine(&self, parameter: usize) -> Error {
        unusable(
            self.world,
            self.medium,
            alloc::format!(
                "its inside cannot move affinely with parameter `{}`: not everything around it \
                 moves by the same affine map",
                self.tangents.names[parameter]
            ),
        )
    }
}

/// How a medium's inside is to move, if that was said.
fn asked_for(asked: &[(usize, InsideKind)], medium: usize) -> Option<&InsideKind> {
    asked.iter().rev().find(|(m, _)| *m == medium).map(|(_, kind)| kind)
}

fn unusable(world: &World, medium: usize, reason: impl Display) -> Error {
    let name = world.scene.media[medium].id.clone();
    Error::Element {
        element: name.unwrap_or_else(|| alloc::format!("medium[{medium}]")),
        reason: alloc::format!("{reason}"),
    }
}
