use alloc::string::String;
use core::f64::consts::PI;

use drt_math::{Affine, Mat3, Real, Rgb, RgbVec, Vec3, fm, vec3};

use crate::model::emitter::emission::Falloff;
use crate::model::texture::{Footprint, TexelChange, TexelError, TexelTangent, Texture};

/// A picture that a point throws: what makes a `projector` or a `spot` of it that has a texture. Both look along +z of a frame.
///
/// With a direction d of the frame, unit, a place p = (d_x, d_y)/d_z on the plane at distance one and the picture's half
/// width and height there h, the intensity is the strength times
///
/// | | factor | texture coordinates |
/// |---|---|---|
/// | projector | π T(u, v) / d_z³ where u and v are in \[0, 1\] | (1 - p/h)/2 |
/// | spot | T(u, v) times its falloff by angle | (1 + p/h)/2 |
///
/// as in Mitsuba 3: the projector's irradiance at distance one is then π T everywhere on the plane, and its picture is upright
/// where a camera's would be.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "unchecked::Slide"))]
pub struct Slide {
    /// `None` is white.
    texture: Option<Texture>,
    half: [f64; 2],
    /// Cutoff angle and beam width of a spot, in radians.
    beam: Option<[f64; 2]>,
}

/// Where light of a slide comes from.
struct Place {
    /// Half a picture towards positive coordinates, or negative ones.
    sign: f64,
    /// The direction at distance one.
    slope: [f64; 2],
    uv: [f64; 2],
    /// Intensity per strength of white, and its derivative by the direction.
    factor: f64,
    by_direction: Vec3,
}

impl Slide {
    /// The picture of a projector, white where there is no texture, with its half width and height at distance one.
    ///
    /// # Errors
    /// When these are not positive numbers, or light is negative somewhere.
    pub fn projector(texture: Option<Texture>, half: [f64; 2]) -> Result<Self, String> {
        Self { texture, half, beam: None }.checked()
    }

    /// That of a spot, over the square around its cone.
    ///
    /// # Errors
    /// When the cone is none, or as wide as a half-space, or light is negative somewhere.
    pub fn spot(texture: Texture, cutoff_angle: f64, beam_width: f64) -> Result<Self, String> {
        let half = [fm::tan(cutoff_angle); 2];
        let beam = Some([cutoff_angle, beam_width]);
        Self { texture: Some(texture), half, beam }.checked()
    }

    fn checked(self) -> Result<Self, String> {
        if let Some([cutoff, beam]) = self.beam
            && !(0.0 <= beam && beam <= cutoff && 0.0 < cutoff && cutoff < 0.5 * PI)
        {
            let [cutoff, beam] = [cutoff, beam].map(f64::to_degrees);
            return Err(alloc::format!(
                "its cutoff_angle is {cutoff} and its beam_width {beam} degrees; with a texture, \
                 0 <= beam_width <= cutoff_angle < 90 and cutoff_angle > 0 are expected"
            ));
        }
        if !self.half.iter().all(|h| *h > 0.0 && h.is_finite()) {
            return Err("its picture has no size".into());
        }
        if self.darkest().is_some_and(|light| light.to_array().into_iter().any(|c| c < 0.0)) {
            return Err("its texture is negative somewhere".into());
        }
        Ok(self)
    }

    /// True of a spot.
    pub(super) fn is_spot(&self) -> bool {
        self.beam.is_some()
    }

    /// False where the light jumps, at the picture's border or in it: what moves there has rims that no term samples.
    pub(super) fn is_continuous(&self) -> bool {
        let smooth = self.texture.as_ref().is_none_or(Texture::is_continuous);
        match (self.beam, &self.texture) {
            (Some([cutoff, beam]), _) => smooth && beam < cutoff,
            (None, Some(Texture::Bitmap(image))) => smooth && image.is_black_around(),
            (None, _) => false,
        }
    }

    /// Where the light along a unit direction of the frame comes from.
    fn place(&self, d: Vec3) -> Option<Place> {
        if d.z <= 0.0 {
            return None;
        }
        let sign = if self.is_spot() { 0.5 } else { -0.5 };
        let slope = [d.x, d.y].map(|c| c / d.z);
        let uv = [0.5 + sign * slope[0] / self.half[0], 0.5 + sign * slope[1] / self.half[1]];
        let (factor, by_direction) = match self.beam {
            Some([cutoff, beam]) => {
                let falloff = Falloff::new(Vec3::Z, d, cutoff, beam);
                (falloff.value, falloff.flow)
            }
            None if uv.iter().all(|c| (0.0..=1.0).contains(c)) => {
                let factor = PI / (d.z * d.z * d.z);
                (factor, Vec3::Z * (-3.0 * factor / d.z))
            }
            None => return None,
        };
        Some(Place { sign, slope, uv, factor, by_direction })
    }

    /// The intensity per strength along a unit direction of the frame, and its gradient by that.
    pub(super) fn towards(&self, d: Vec3) -> (Rgb, RgbVec) {
        let Some(at) = self.place(d) else { return (Rgb::ZERO, RgbVec::ZERO) };
        let (value, [by_u, by_v]) = match &self.texture {
            None => (Rgb::ONE, [Rgb::ZERO; 2]),
            Some(t) => (t.at(at.uv), t.slopes(at.uv)),
        };
        let Place { sign, slope: [x, y], factor, by_direction, .. } = at;
        let u = vec3(1.0, 0.0, -x) * (sign / (self.half[0] * d.z));
        let v = vec3(0.0, 1.0, -y) * (sign / (self.half[1] * d.z));
        let gradient =
            (by_u * factor).outer(u) + (by_v * factor).outer(v) + value.outer(by_direction);
        (value * factor, gradient)
    }

    /// The least light of its texture, where it has one.
    pub(super) fn darkest(&self) -> Option<Rgb> {
        self.texture.as_ref().map(|t| t.bounds()[0])
    }

    /// Columns and rows of texels, where there are such.
    pub(super) fn texels(&self) -> Option<[u32; 2]> {
        self.texture.as_ref().map(Texture::size).filter(|size| *size != [0; 2])
    }

    /// The texture that tells its light, where one does.
    pub(super) fn texture(&self) -> Option<&Texture> {
        self.texture.as_ref()
    }

    /// Gives all texels other values.
    pub(super) fn set_texels(&mut self, values: &[Rgb]) -> Result<(), TexelError> {
        self.texture.as_mut().map_or(Ok(()), |texture| texture.set_texels(values))
    }

    /// Makes a change of texels, whose rates it returns.
    pub(super) fn change(&mut self, change: &TexelChange) -> Result<TexelTangent, TexelError> {
        self.texture.as_mut().map_or_else(|| Ok(TexelTangent::default()), |t| t.change(change))
    }

    /// The texels whose light goes along a unit direction of the frame, and the intensity per strength of what they hold.
    pub(super) fn footprint(&self, d: Vec3) -> Option<(Footprint, f64)> {
        let at = self.place(d)?;
        Some((self.texture.as_ref()?.footprint(at.uv)?, at.factor))
    }

    /// Integral over all directions of the intensity per strength, about: of a mean texture.
    pub(super) fn power(&self) -> f64 {
        let mean = self.texture.as_ref().map_or(1.0, |t| t.mean().mean());
        match self.beam {
            Some([cutoff, beam]) => mean * 2.0 * PI * super::cone_mean(beam, cutoff),
            // d_z³ is the area of the plane at distance one per solid angle.
            None => mean * PI * self.area(),
        }
    }

    /// Area of the picture at distance one.
    fn area(&self) -> f64 {
        4.0 * self.half[0] * self.half[1]
    }

    /// A direction of the frame from two uniform numbers, evenly over a spot's cone or over a projector's picture.
    pub(super) fn sample(&self, u: [f64; 2]) -> Vec3 {
        match self.beam {
            Some([cutoff, _]) => drt_math::warp::uniform_cone(u, fm::cos(cutoff)),
            None => {
                let [x, y] = [0, 1].map(|k| self.half[k] * (2.0 * u[k] - 1.0));
                vec3(x, y, 1.0).normalize()
            }
        }
    }

    /// The density of that per steradian.
    pub(super) fn pdf(&self, d: Vec3) -> f64 {
        match self.beam {
            Some([cutoff, _]) => drt_math::warp::uniform_cone_pdf(d, fm::cos(cutoff)),
            None => {
                let inside = d.z > 0.0
                    && Real::abs(d.x / d.z) <= self.half[0]
                    && Real::abs(d.y / d.z) <= self.half[1];
                if inside { 1.0 / (self.area() * d.z * d.z * d.z) } else { 0.0 }
            }
        }
    }
}

/// Orthonormal axes near those given, z first and x last; `None` where there are none.
pub(super) fn orthonormal(frame: &Mat3) -> Option<Mat3> {
    let [x, y, z] = frame.cols;
    let z = z.normalize();
    let y = y.reject(z).normalize();
    let x = x.reject(z).reject(y).normalize();
    let cols = [x, y, z];
    cols.iter().all(|c| c.is_finite()).then_some(Mat3 { cols })
}

/// Angular velocity of such axes in a velocity field.
pub(super) fn spin(frame: &Mat3, field: &Affine) -> Vec3 {
    let [x, y, z] = frame.cols;
    let [of_y, of_z] = [y, z].map(|v| field.vector(v));
    let (z_to_x, z_to_y, y_to_x) = (of_z.dot(x), of_z.dot(y), of_y.dot(x));
    let rates = [-(z * z_to_x) - y * y_to_x, x * y_to_x - z * z_to_y, y * z_to_y + x * z_to_x];
    let sum = x.cross(rates[0]) + y.cross(rates[1]) + z.cross(rates[2]);
    sum * 0.5
}

#[cfg(feature = "serde")]
mod unchecked {
    use super::{String, Texture};

    /// A picture as stored.
    #[derive(serde::Deserialize)]
    pub(super) struct Slide {
        texture: Option<Texture>,
        half: [f64; 2],
        beam: Option<[f64; 2]>,
    }

    impl TryFrom<Slide> for super::Slide {
        type Error = String;
        fn try_from(s: Slide) -> Result<Self, String> {
            Self { texture: s.texture, half: s.half, beam: s.beam }.checked()
        }
    }
}
