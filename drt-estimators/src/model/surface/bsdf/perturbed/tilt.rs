//! The normals of a map at a point, which of them scatter as seen from a direction, and how much light reaches them, over any scalar.

use drt_math::{Frame, Real, Vec3, vec3};

use crate::model::surface::horizon::{FADE, fade};
use crate::model::texture::TexturePoint;

/// The frame of a surface at a point, and the normal of a map there.
pub(super) struct Tilt<T> {
    frame: Frame<T>,
    /// Unit, in the frame.
    normal: Vec3<T>,
}

/// A normal that scatters.
#[derive(Clone, Copy)]
pub(super) struct Facet<T> {
    /// Unit, across the normal, in the world; frames of BSDFs follow it.
    pub(super) tangent: Vec3<T>,
    /// Unit, in the world.
    pub(super) normal: Vec3<T>,
    /// The unit normal of the surface.
    surface: Vec3<T>,
    /// The cosine between both normals.
    cos: T,
}

impl<T: Real> Tilt<T> {
    /// By a normal in the frame, of any length.
    pub(super) fn new(frame: Frame<T>, normal: Vec3<T>) -> Self {
        let length = normal.length();
        let normal = if length.re() > 0.0 { normal * length.recip() } else { Vec3::Z.lift() };
        Self { frame, normal }
    }

    /// The normal as the map has it.
    pub(super) fn plain(&self) -> Facet<T> {
        self.facet(self.normal)
    }

    /// The normal mirrored at that of the surface.
    pub(super) fn mirrored(&self) -> Facet<T> {
        self.facet(vec3(-self.normal.x, -self.normal.y, self.normal.z))
    }

    fn facet(&self, normal: Vec3<T>) -> Facet<T> {
        let along = Vec3::X.lift().reject(normal);
        let flat = along.re().max_abs() > 0.0;
        let along = if flat { along.normalize() } else { Vec3::Y.lift() };
        Facet {
            tangent: self.frame.to_world(along),
            normal: self.frame.to_world(normal),
            surface: self.frame.n,
            cos: normal.z,
        }
    }

    /// The cosine of a direction with the normal, positive where it sees the surface from the same side.
    fn facing(&self, w: Vec3<T>) -> T {
        let local = self.frame.to_local(w);
        let cos = local.dot(self.normal);
        if local.z.re() < 0.0 { -cos } else { cos }
    }

    /// True where the normal faces away from a direction that the surface faces, or the other way round.
    pub(super) fn is_invalid_from(&self, w: Vec3<T>) -> bool {
        self.facing(w).re() <= 0.0
    }

    /// The normals that scatter light that leaves to a direction, each with its share. Near its horizon the plain one goes over to the
    /// mirrored one, if it `flips`, and to nothing otherwise.
    pub(super) fn seen_from(&self, wo: Vec3<T>, flips: bool) -> [Option<(Facet<T>, T)>; 2] {
        let cos = self.facing(wo);
        let (within, share) = (cos.abs().re() < FADE, fade(cos));
        match (flips, cos.re() > 0.0) {
            (false, _) => [Some((self.plain(), share)), None],
            (true, false) => [None, Some((self.mirrored(), T::one()))],
            (true, true) if within => {
                [Some((self.plain(), share)), Some((self.mirrored(), T::one() - share))]
            }
            (true, true) => [Some((self.plain(), share)), None],
        }
    }
}

impl<T: Real> Facet<T> {
    /// Calls a function with the point, whose frames follow this normal's tangent.
    pub(super) fn with<R>(
        &self,
        at: &TexturePoint<'_>,
        f: impl FnOnce(&TexturePoint<'_>) -> R,
    ) -> R {
        f(&TexturePoint { tangent: Some(&self.tangent.re()), ..*at })
    }

    /// Both normals see the direction from the same side.
    pub(super) fn sees(&self, w: Vec3) -> bool {
        self.normal.re().dot(w) * self.surface.re().dot(w) > 0.0
    }

    /// The part of light from a direction that microfacets of a roughness that makes slopes like this one do not shadow: with the
    /// cosine c of the direction and the surface's normal, 2 / (1 + √(1 + α² (1/c² - 1))).
    pub(super) fn shadowed(&self, wi: Vec3<T>) -> T {
        let cos2 = self.cos.squared();
        let alpha2 = if cos2.re() > 0.0 {
            ((cos2.recip() - 1.0) * 0.125).max(T::zero()).min(T::one())
        } else {
            T::one()
        };
        let c = self.surface.dot(wi).abs();
        let sin2 = (T::one() - c.squared()).max(T::zero());
        c * 2.0 / (c + (c.squared() + alpha2 * sin2).sqrt())
    }

    /// The factor that fades light which grazes the surface.
    pub(super) fn fading(&self, wi: Vec3<T>) -> T {
        fade(self.surface.dot(wi))
    }
}
