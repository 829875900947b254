//! Scenes in which the inside of a medium may move in several ways.
//!
//! Nothing scatters at the moving surfaces of most: next to one that does, an inside at rest has the
//! right mean, and no variance (theory sheet §14.1).

use drt_estimators::InteriorMotion;
use drt_estimators::emitter::Emitter;
use drt_estimators::surface::{Bsdf, RoughDielectric};
use drt_geom::procedural::{bumpy_sphere, cube, icosphere};
use drt_math::{Affine, Mat3, Rgb, Rng, Vec3, vec3};
use drt_medium::{Grid, GridMedium, Homogeneous, Layout, Phase, Volume};
use drt_motion::{Change, Effect, GeometryChange, Parameter, ValueChange};

use super::{Stirred, Way};
use crate::Result;
use crate::matrix::Set;
use crate::matrix::effects::{grow, translate, turn};
use crate::matrix::set::{at, block, diffuse};
use crate::motion::{changes, moves};

/// A scene, one parameter, and how the insides of its media may move, and may not.
#[derive(Clone, Debug)]
pub struct Case {
    /// The name in tables.
    pub name: &'static str,
    /// The scene.
    pub scene: drt_estimators::Scene,
    /// Right ways.
    pub right: Vec<Way>,
    /// Wrong ones.
    pub wrong: Vec<Way>,
    /// The half step of finite differences, where these are to agree too.
    pub step: Option<f64>,
}

/// A case under construction.
pub(super) struct Draft {
    case: Case,
    parameter: Parameter,
}

impl Draft {
    /// With the plan's choice, a blend, tetrahedra, and mean value coordinates.
    pub(super) fn new(
        name: &'static str,
        set: Set,
        effects: impl IntoIterator<Item = Effect>,
    ) -> Self {
        let effects = effects.into_iter().collect();
        let parameter = Parameter { name: name.into(), value: 0.0, effects };
        let case =
            Case { name, scene: set.scene, right: Vec::new(), wrong: Vec::new(), step: None };
        let draft = Self { case, parameter };
        let chosen = draft.way("plan", Vec::new());
        let draft = draft.right(chosen);
        draft
            .by("blend", &InteriorMotion::Blend)
            .by("tetrahedra", &InteriorMotion::Tetrahedral(None))
            .by("mean values", &InteriorMotion::MeanValue)
    }

    pub(super) fn case(self) -> Case {
        self.case
    }

    /// With finite differences of this half step.
    pub(super) fn differences(mut self, step: f64) -> Self {
        self.case.step = Some(step);
        self
    }

    fn way(&self, name: &'static str, insides: Vec<(usize, InteriorMotion)>) -> Way {
        Way { name, insides, parameter: self.parameter.clone() }
    }

    fn right(mut self, way: Way) -> Self {
        self.case.right.push(way);
        self
    }

    /// With all media moving by one kind.
    fn by(self, name: &'static str, kind: &InteriorMotion) -> Self {
        let media = 0..self.case.scene.media.len();
        let way = self.way(name, media.map(|m| (m, kind.clone())).collect());
        self.right(way)
    }

    pub(super) fn at_rest(self) -> Self {
        self.by("static with flux", &InteriorMotion::Static)
    }

    pub(super) fn affine(self) -> Self {
        self.by("affine", &InteriorMotion::Affine)
    }

    /// With tetrahedra of our own around the first medium: those right that are stirred, those wrong
    /// that are torn around the first of the further vertices, if any.
    pub(super) fn stirred(
        mut self,
        surfaces: &[&str],
        eye: Option<Vec3>,
        further: &[Vec3],
        torn: u32,
    ) -> Result<(Self, Stirred)> {
        let Self { case, parameter } = &self;
        let given = Stirred::new(&case.scene, parameter, surfaces, eye, further, SPEED)?;
        if torn > 0 {
            let way = self.way("torn inside", vec![given.clone().torn(torn).kind()]);
            self.case.wrong.push(way);
        }
        let right = self.way("given tetrahedra, stirred", vec![given.kind()]);
        Ok((self.right(right), given))
    }

    /// The same, and wrong where vertices on surfaces lag behind. Next to surfaces that scatter that
    /// would hide in noise without bounds.
    fn stirred_and_lagging(self, surfaces: &[&str], further: &[Vec3]) -> Result<Case> {
        let half = further.len() as u32 / 2;
        let (mut draft, given) = self.stirred(surfaces, None, further, half)?;
        let lagging = draft.way("surfaces at half their speed", vec![given.lagging(0.5).kind()]);
        draft.case.wrong.push(lagging);
        Ok(draft.case)
    }

    /// With a field right but for its divergence, which is `divergence` everywhere: without it, each
    /// volume vertex counts as if the medium scattered and glowed less at that rate, and absorbed more.
    fn without_divergence(mut self, divergence: f64) -> Result<Self> {
        let medium = &self.case.scene.media[0];
        let id = medium.id.clone().ok_or("a medium without a name")?;
        let now = medium.item.homogeneous().ok_or("a medium that varies")?.coefficients();
        // Emission is per absorption, which grows as the albedo falls.
        let glows = now.emission.to_array().into_iter().zip(now.albedo.to_array());
        let dims = glows.map(|(e, albedo)| -divergence * e / (1.0 - albedo));
        let dims: Vec<f64> = dims.collect();
        let mut way = self.way("divergence dropped", vec![(0, InteriorMotion::Affine)]);
        way.parameter.effects.extend([
            changes(&id, "albedo", ValueChange::Multiply(-divergence)),
            changes(&id, "emission", ValueChange::Add(Rgb::new(dims[0], dims[1], dims[2]))),
        ]);
        self.case.wrong.push(way);
        Ok(self)
    }
}

/// Of the stirred vertices.
const SPEED: f64 = 0.6;

/// The sun in all cases.
fn sun() -> Emitter {
    Emitter::Directional { direction: vec3(-0.7, -1.0, 0.6), irradiance: Rgb::new(4.0, 5.0, 6.0) }
}

pub(super) fn fog(sigma_t: [f64; 3], albedo: [f64; 3]) -> Result<Homogeneous> {
    Ok(Homogeneous::new(sigma_t.into(), albedo.into(), Rgb::ZERO)?)
}

/// A camera with fewer pixels than the check matrix needs.
pub(super) fn seen(origin: Vec3, target: Vec3, fov: f64, depth: u32) -> Result<Set> {
    let mut set = Set::new(origin, target, fov, depth)?;
    let sensor = &mut set.scene.sensors[0].item.sensor;
    *sensor = sensor.with_film([6; 2])?;
    Ok(set)
}

/// Random points in a box around the origin.
pub(super) fn scattered(count: usize, half: Vec3) -> Vec<Vec3> {
    let mut rng = Rng::new(3, 0, 0);
    let mut next = || 2.0 * rng.next_f64() - 1.0;
    (0..count).map(|_| vec3(next() * half.x, next() * half.y, next() * half.z)).collect()
}

/// A box of fog with a solid in it.
fn foggy(set: Set, reflectance: f64) -> Result<Set> {
    let body = at(&cube(), vec3(0.375, 0.25, 0.375), BODY);
    Ok(set
        .medium("fog", fog([0.7, 1.0, 1.4], [0.9, 0.8, 0.7])?, Phase::henyey_greenstein(0.3)?)
        .interface("border", cube(), "fog", None)
        .shape("body", body, diffuse([reflectance; 3]))
        .light("sun", sun()))
}

/// Where the solid in the fog is: its corners are numbers without rounding, so that its faces are flat.
const BODY: Vec3 = vec3(0.25, 0.125, 0.125);

/// Points in the fog and out of the body.
fn around_body() -> Vec<Vec3> {
    let all = scattered(30, Vec3::splat(0.9)).into_iter();
    all.filter(|p| (*p - BODY).length() > 0.7).collect()
}

/// A black body moves through fog.
///
/// # Errors
/// When the library rejects the scene.
pub fn black_body_in_fog() -> Result<Case> {
    let set = foggy(seen(vec3(0.3, 0.4, -3.6), vec3(0.2, 0.1, 0.0), 20.0, 3)?, 0.0)?;
    let effects = [translate("body", vec3(0.8, 0.5, -0.2))];
    let draft = Draft::new("black body moves in fog", set, effects).at_rest();
    draft.stirred_and_lagging(&["border", "body"], &around_body())
}

/// A grey body turns in the fog that the camera is in.
///
/// # Errors
/// When the library rejects the scene.
pub fn body_around_the_eye() -> Result<Case> {
    let eye = vec3(-0.4, -0.2, -0.85);
    let set = foggy(seen(eye, vec3(0.1, 0.0, 0.1), 70.0, 3)?, 0.5)?;
    let effects = [turn("body", vec3(0.3, 1.0, 0.2), BODY + vec3(0.3, 0.0, 0.0))];
    let draft = Draft::new("grey body turns in fog, camera inside", set, effects);
    let points = around_body();
    let half = points.len() as u32 / 2;
    Ok(draft.stirred(&["border", "body"], Some(eye), &points, half)?.0.case)
}

/// A slab of something translucent, half lit through.
fn slab() -> Result<Set> {
    let slab = block([2, 1, 1], vec3(0.9, 0.25, 0.7));
    Ok(seen(vec3(0.3, 1.9, -2.0), Vec3::ZERO, 24.0, 3)?
        .medium("wax", fog([2.5, 2.0, 1.5], [0.9, 0.8, 0.6])?, Phase::henyey_greenstein(0.3)?)
        .interface("slab", slab, "wax", None)
        .light("sun", sun()))
}

/// A translucent slab is bent.
///
/// # Errors
/// When the library rejects the scene.
pub fn bent_slab() -> Result<Case> {
    let set = slab()?;
    let mesh = &set.scene.shapes[0].mesh;
    let bends = mesh.positions.iter().map(|p| {
        let along = vec3(-1.6 * p.x * p.y, 1.6 * p.x * p.x, 0.0);
        along + vec3(0.2, 0.1, 0.0)
    });
    let effects = [moves("slab", GeometryChange::VertexVelocity(bends.collect()))];
    let draft = Draft::new("translucent slab bends", set, effects).at_rest();
    draft.stirred_and_lagging(&["slab"], &scattered(16, vec3(0.8, 0.2, 0.6)))
}

/// The slab is stretched, so that one affine field does.
///
/// # Errors
/// When the library rejects the scene.
pub fn stretched_slab() -> Result<Case> {
    let factor = vec3(0.3, 0.8, -0.2);
    let effects = [grow("slab", factor, vec3(0.3, -0.25, 0.0))];
    let draft = Draft::new("translucent slab grows", slab()?, effects).at_rest().affine();
    let draft = draft.without_divergence(factor.x + factor.y + factor.z)?;
    draft.stirred_and_lagging(&["slab"], &scattered(16, vec3(0.8, 0.2, 0.6)))
}

/// A refractive ball with a glowing medium in it, under a bright sky.
fn glass_ball() -> Result<Set> {
    let ball = at(&icosphere(1), Vec3::splat(0.8), Vec3::ZERO);
    let glass = RoughDielectric { alpha: 0.5, eta: 1.2, ..RoughDielectric::default() };
    let floor = at(&cube(), vec3(2.0, 0.1, 2.0), vec3(0.0, -1.2, 0.0));
    let glow = Rgb::new(1.0, 0.8, 0.9);
    let syrup = Homogeneous::new(Rgb::new(1.0, 1.4, 1.8), Rgb::new(0.7, 0.6, 0.5), glow)?;
    Ok(seen(vec3(0.3, 0.6, -2.6), Vec3::ZERO, 36.0, 3)?
        .medium("syrup", syrup, Phase::henyey_greenstein(0.3)?)
        .filled("ball", ball, Bsdf::RoughDielectric(glass), "syrup", None)
        .shape("floor", floor, diffuse([0.3, 0.2, 0.1]))
        .light("sky", Emitter::Constant { radiance: Rgb::new(0.8, 0.9, 1.0) }))
}

/// Points in the middle of the ball, of which the first `TORN` are torn out, and others around them
/// that keep that away from the surface.
fn shell() -> Vec<Vec3> {
    let middle = scattered(TORN as usize, Vec3::splat(0.3));
    let around = scattered(48, Vec3::splat(1.0)).into_iter().map(|p| p.normalize() * 0.66);
    middle.into_iter().chain(around).collect()
}

/// Points that lose their tetrahedra in the ball.
const TORN: u32 = 10;

/// A refractive ball of syrup moves and swells.
///
/// # Errors
/// When the library rejects the scene.
pub fn glass_ball_moves() -> Result<Case> {
    let strain = Mat3::diagonal(vec3(0.3, 0.6, -0.2));
    let field = Affine { linear: strain, translation: vec3(0.4, 0.3, -0.3) };
    let effects = [moves("ball", GeometryChange::Matrix(field))];
    let draft = Draft::new("refractive ball moves and swells", glass_ball()?, effects).affine();
    let draft = draft.without_divergence(strain.trace())?;
    Ok(draft.stirred(&["ball"], None, &shell(), 0)?.0.case)
}

/// The ball deforms.
///
/// # Errors
/// When the library rejects the scene.
pub fn glass_ball_deforms() -> Result<Case> {
    let set = glass_ball()?;
    let mesh = &set.scene.shapes[0].mesh;
    let velocity = mesh.positions.iter().map(|p| vec3(p.x + p.y * p.z, 0.8 * p.y, p.x * p.x));
    let effects = [moves("ball", GeometryChange::VertexVelocity(velocity.collect()))];
    let draft = Draft::new("refractive ball deforms", set, effects);
    Ok(draft.stirred(&["ball"], None, &shell(), TORN)?.0.case)
}

/// Smoke in a box that turns with it.
///
/// # Errors
/// When the library rejects the scene.
pub fn turning_grid() -> Result<Case> {
    let size = 4_usize;
    let values = (0..size.pow(3)).map(|i| 1.0 + 0.9 * (2.3 * i as f64).sin()).collect();
    let place = Affine { linear: Mat3::diagonal(Vec3::splat(1.6)), translation: Vec3::splat(-0.8) };
    let grid = Grid::new([size; 3], 1, values)?.with_layout(Layout::NodeCentred);
    let [albedo, glow] = [[0.9, 0.7, 0.5].into(), Rgb::ZERO].map(Volume::Constant);
    let smoke = GridMedium::new(grid.with_placement(place)?, 1.5, albedo, glow)?;
    let set = seen(vec3(0.3, 0.95, -3.0), Vec3::ZERO, 30.0, 3)?
        .medium("smoke", smoke, Phase::henyey_greenstein(-0.2)?)
        .interface("box", at(&cube(), Vec3::splat(0.8), Vec3::ZERO), "smoke", None)
        .light("sun", sun());
    let ride = Effect { target: "smoke".into(), change: Change::Follow("box".into()) };
    let effects = [turn("box", vec3(0.2, 1.0, 0.3), vec3(0.5, 0.0, 0.0)), ride];
    let draft = Draft::new("cube turns with its grid", set, effects).at_rest().affine();
    draft.stirred_and_lagging(&["box"], &scattered(16, Vec3::splat(0.7)))
}

/// A blob without a surface of its own deforms.
///
/// # Errors
/// When the library rejects the scene.
pub fn blob() -> Result<Case> {
    let blob = at(&bumpy_sphere(0, 0.3, 3.0), Vec3::splat(0.8), Vec3::ZERO);
    let breathes = blob.positions.iter().map(|p| *p * (1.0 + p.x * p.y) + vec3(0.0, p.z, 0.0));
    let effects = [moves("blob", GeometryChange::VertexVelocity(breathes.collect()))];
    let set = seen(vec3(0.4, 0.5, -2.6), Vec3::ZERO, 24.0, 3)?
        .medium("milk", fog([3.0, 2.2, 1.5], [0.95, 0.8, 0.6])?, Phase::henyey_greenstein(0.4)?)
        .interface("blob", blob, "milk", None)
        .light("sun", sun());
    let draft = Draft::new("null-bounded blob deforms", set, effects).at_rest();
    draft.stirred_and_lagging(&["blob"], &scattered(16, Vec3::splat(0.35)))
}

/// A ball of one medium moves in a box of another, which deforms.
///
/// # Errors
/// When the library rejects the scene.
pub fn nested() -> Result<Case> {
    let ball = at(&icosphere(0), Vec3::splat(0.45), vec3(0.2, 0.1, -0.1));
    let velocity = cube().positions.iter().map(|p| vec3(0.3 * p.y, 0.5 * p.y * p.z, 0.2)).collect();
    let effects = [
        translate("ball", vec3(0.6, 0.3, -0.4)),
        moves("box", GeometryChange::VertexVelocity(velocity)),
    ];
    let set = seen(vec3(0.4, 0.7, -3.8), Vec3::ZERO, 22.0, 3)?
        .medium("thin", fog([0.5, 0.7, 0.9], [0.9, 0.8, 0.6])?, Phase::henyey_greenstein(0.3)?)
        .medium("thick", fog([3.0, 2.0, 2.5], [0.6, 0.9, 0.8])?, Phase::Isotropic)
        .interface("box", cube(), "thin", None)
        .interface("ball", ball, "thick", Some("thin"))
        .light("sun", sun());
    let draft = Draft::new("ball moves in a box that deforms", set, effects).at_rest();
    let further = scattered(30, Vec3::splat(0.9)).into_iter();
    let further: Vec<Vec3> =
        further.filter(|p| (*p - vec3(0.2, 0.1, -0.1)).length() > 0.6).collect();
    draft.stirred_and_lagging(&["box", "ball"], &further)
}
