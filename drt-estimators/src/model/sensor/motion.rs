//! Cameras that move, and whose numbers change.

use drt_math::{Affine, Rgb, Vec3};

use crate::model::sensor::{Aperture, Lens, Sensor, SensorError, SensorTangent, unit};

/// Gram–Schmidt on (right, up, forward), forward first and right last.
///
/// The result depends only on the map applied to the axes, however it is split into steps,
/// because each step's matrix is triangular in the axes.
pub(super) fn orthonormalize([right, up, forward]: [Vec3; 3]) -> Option<[Vec3; 3]> {
    let forward = unit(forward)?;
    let up = unit(up.reject(forward))?;
    let right = unit(right.reject(forward).reject(up))?;
    Some([right, up, forward])
}

impl Sensor {
    /// The camera moved by a map of space.
    ///
    /// Under a map that is not rigid the viewing line and the upright plane go along as material
    /// ones would and the axes are made orthonormal again; the image stays one of square pixels
    /// with the same field of view. Clip distances do not change. The film of an orthographic camera scales with the map,
    /// and so do its clip distances.
    ///
    /// # Errors
    /// When the map is singular or not finite, or makes pixels of an orthographic camera oblong.
    pub fn moved(&self, map: &Affine) -> Result<Self, SensorError> {
        let p = &self.pinhole;
        let axes = [p.right, p.up, p.forward].map(|v| map.vector(v));
        if self.is_orthographic() {
            return self.moved_film(map, axes);
        }
        let [right, up, forward] = orthonormalize(axes).ok_or(SensorError::Flattened)?;
        let position = map.point(p.position);
        super::finite(position.is_finite(), "position after the motion")?;
        let pinhole = super::Pinhole { position, right, up, forward, ..*p };
        Ok(Self { pinhole, ..self.clone() })
    }

    /// The rates of a camera carried by a velocity field: the derivative of
    /// [`moved`](Self::moved) at the identity.
    #[must_use]
    pub fn velocity(&self, field: &Affine) -> SensorTangent {
        let p = &self.pinhole;
        let [u, f] = [p.up, p.forward].map(|v| field.vector(v));
        // Rates of rotation of forward towards up and right, and of up towards right.
        let (up_of_f, right_of_f) = (f.dot(p.up), f.dot(p.right));
        let right_of_u = u.dot(p.right);
        let grows = if self.is_orthographic() { u.dot(p.up) } else { 0.0 };
        SensorTangent {
            position: field.point(p.position),
            right: -(p.forward * right_of_f) - p.up * right_of_u,
            up: p.right * right_of_u - p.forward * up_of_f,
            forward: p.up * up_of_f + p.right * right_of_f,
            pixel_size: p.pixel_size * grows,
            ..SensorTangent::default()
        }
    }

    /// A property that a parameter can change, three equal numbers. Names and units are the scene
    /// file's: `fov` (degrees, along its axis), `principal_point_offset_x` and `_y`; of a thin lens `aperture_radius`
    /// and `focus_distance`, too.
    ///
    /// # Errors
    /// When cameras have no such property.
    pub fn property(&self, name: &str) -> Result<Rgb, SensorError> {
        self.has_properties(name)?;
        let mut numbers = (self.lens, self.aperture);
        Ok(Rgb::splat(*slot(&mut numbers, name)?.1))
    }

    /// The camera with a property changed.
    ///
    /// # Errors
    /// When there is no such property, or the value is unusable.
    pub fn with_property(&self, name: &str, value: Rgb) -> Result<Self, SensorError> {
        self.has_properties(name)?;
        let mut numbers = (self.lens, self.aperture);
        let (known, number) = slot(&mut numbers, name)?;
        *number = scalar(known, value)?;
        let (lens, aperture) = numbers;
        let camera = self.with(lens, self.film, self.window)?;
        match aperture {
            Some(aperture) => camera.with_aperture(aperture),
            None => Ok(camera),
        }
    }

    /// The rates of the camera when a property has the given rate.
    ///
    /// # Errors
    /// When there is no such property, or the rates differ.
    pub fn property_tangent(&self, name: &str, rate: Rgb) -> Result<SensorTangent, SensorError> {
        self.has_properties(name)?;
        let lens = Lens { fov: 0.0, principal_point_offset: [0.0, 0.0], ..self.lens };
        let none = Aperture { radius: 0.0, focus_distance: 0.0 };
        let mut numbers = (lens, self.aperture.map(|_| none));
        let (known, number) = slot(&mut numbers, name)?;
        *number = scalar(known, rate)?;
        let (lens, aperture) = (numbers.0, numbers.1.unwrap_or(none));
        let [x, y] = lens.principal_point_offset;
        Ok(SensorTangent {
            pixel_size: lens.fov * self.lens.pixel_size_slope(self.window.whole),
            principal: [-x * self.window.whole[0], -y * self.window.whole[1]],
            aperture_radius: aperture.radius,
            focus_distance: aperture.focus_distance,
            ..SensorTangent::default()
        })
    }
}

impl Sensor {
    fn has_properties(&self, name: &str) -> Result<(), SensorError> {
        if self.is_orthographic() { Err(SensorError::NoProperties(name.into())) } else { Ok(()) }
    }
}

/// The number a property name stands for.
fn slot<'a>(
    (lens, aperture): &'a mut (Lens, Option<Aperture>),
    name: &str,
) -> Result<(&'static str, &'a mut f64), SensorError> {
    match (name, aperture) {
        ("aperture_radius", Some(a)) => return Ok(("aperture_radius", &mut a.radius)),
        ("focus_distance", Some(a)) => return Ok(("focus_distance", &mut a.focus_distance)),
        _ => {}
    }
    match name {
        "fov" => Ok(("fov", &mut lens.fov)),
        "principal_point_offset_x" => {
            Ok(("principal_point_offset_x", &mut lens.principal_point_offset[0]))
        }
        "principal_point_offset_y" => {
            Ok(("principal_point_offset_y", &mut lens.principal_point_offset[1]))
        }
        _ => Err(SensorError::UnknownProperty(name.into())),
    }
}

fn scalar(name: &'static str, value: Rgb) -> Result<f64, SensorError> {
    super::finite(value.is_finite(), name)?;
    if value == Rgb::splat(value.r) { Ok(value.r) } else { Err(SensorError::NotScalar(name)) }
}
