//! Placements: the steps inside a `<transform>`, first listed applied first.

use drt_estimators::sensor::look_at;
use drt_math::{Affine, Frame, Mat3, Vec3, vec3};

use super::element::Element;
use super::numbers::{number, numbers, triple};
use crate::CliError;

const VECTOR: &[&str] = &["x", "y", "z", "value"];

/// The composition of all steps.
pub(super) fn parse(e: &Element) -> Result<Affine, CliError> {
    e.only_attributes(&["name"])?;
    e.children.iter().try_fold(Affine::IDENTITY, |first, child| {
        let map = step(child)?.after(&first);
        if map.is_finite() { Ok(map) } else { Err(child.error("the placement overflows")) }
    })
}

fn step(e: &Element) -> Result<Affine, CliError> {
    if let Some(child) = e.children.first() {
        return Err(child.error(format!("not supported inside {e}")));
    }
    match e.tag.as_str() {
        "translate" => Ok(Affine::translation(vector(e, 0.0, VECTOR)?)),
        "scale" => Ok(Affine::about(Mat3::diagonal(vector(e, 1.0, VECTOR)?), Vec3::ZERO)),
        "rotate" => rotate(e),
        "matrix" => matrix(e),
        "lookat" | "lookAt" => lookat(e),
        _ => Err(e.error("expected translate, rotate, scale, matrix or lookat")),
    }
}

/// `x`, `y`, `z` with a default for those left out, or `value` with three numbers or one for all.
fn vector(e: &Element, default: f64, known: &[&str]) -> Result<Vec3, CliError> {
    e.only_attributes(known)?;
    if let Some(text) = e.attribute("value") {
        return match *numbers(e, text)? {
            [v] => Ok(Vec3::splat(v)),
            [x, y, z] => Ok(vec3(x, y, z)),
            _ => Err(e.error("`value` must hold one number or three")),
        };
    }
    let axis = |key| e.attribute(key).map_or(Ok(default), |text| number(e, key, text));
    Ok(vec3(axis("x")?, axis("y")?, axis("z")?))
}

fn rotate(e: &Element) -> Result<Affine, CliError> {
    let axis = vector(e, 0.0, &["x", "y", "z", "value", "angle"])?;
    let angle = number(e, "angle", e.required("angle")?)?;
    let size = axis.max_abs();
    if size == 0.0 {
        return Err(e.error("the axis is the zero vector; give x, y or z"));
    }
    let axis = (axis / size).normalize();
    Ok(Affine::about(Mat3::rotation(axis, angle.to_radians()), Vec3::ZERO))
}

/// 16 numbers row by row with a last row of 0 0 0 1, or 9 for a linear map.
fn matrix(e: &Element) -> Result<Affine, CliError> {
    e.only_attributes(&["value"])?;
    let m = numbers(e, e.required("value")?)?;
    let stride = match m.len() {
        9 => 3,
        16 => 4,
        n => return Err(e.error(format!("a matrix has 9 or 16 numbers, found {n}"))),
    };
    let row = |i: usize| vec3(m[stride * i], m[stride * i + 1], m[stride * i + 2]);
    let linear = Mat3::from_rows(row(0), row(1), row(2));
    if stride == 3 {
        return Ok(Affine::about(linear, Vec3::ZERO));
    }
    if m[12..] != [0.0, 0.0, 0.0, 1.0] {
        return Err(e.error("the last row must be 0 0 0 1: perspective maps are not supported"));
    }
    Ok(Affine { linear, translation: vec3(m[3], m[7], m[11]) })
}

fn lookat(e: &Element) -> Result<Affine, CliError> {
    e.only_attributes(&["origin", "target", "up"])?;
    let (origin, target) = (triple(e, "origin")?, triple(e, "target")?);
    let up = match e.attribute("up") {
        Some(_) => triple(e, "up")?,
        None if target == origin => Vec3::Y,
        // Mitsuba's choice: the first tangent of its frame around the viewing direction.
        None => Frame::from_normal((target - origin).normalize()).s,
    };
    look_at(origin, target, up).map_err(|err| e.error(err))
}
