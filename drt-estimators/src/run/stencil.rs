//! The values of a parameter at which images are rendered for a finite difference.

use alloc::string::String;
use alloc::vec::Vec;

use drt_motion::Parameter;

use crate::derivative::tangents;
use crate::model::error::Error;
use crate::model::scene::Scene;

/// How far from its value a parameter is taken, in steps, and what each image counts by, over twice the step.
pub(crate) struct Stencil {
    pub(crate) offsets: Vec<f64>,
    pub(crate) weights: Vec<f64>,
}

impl Stencil {
    /// A difference over both sides where the scene is valid at both, and otherwise over one.
    pub(crate) fn at(
        scene: &Scene,
        parameters: &[Parameter],
        p: usize,
        step: f64,
    ) -> Result<Self, Error> {
        let ends = |offset: f64| {
            let mut moved = parameters.to_vec();
            moved[p].value += offset * step;
            match tangents::apply(scene, &moved) {
                Ok(_) => Ok(None),
                Err(e) if e.out_of_range().is_some() => Ok(Some(e)),
                Err(e) => Err(e),
            }
        };
        let side = match [ends(-1.0)?, ends(1.0)?] {
            [None, None] => {
                return Ok(Self { offsets: [-1.0, 1.0].into(), weights: [-1.0, 1.0].into() });
            }
            [Some(_), None] => 1.0,
            [None, Some(_)] => -1.0,
            [Some(e), Some(_)] => return Err(e),
        };
        let (offsets, weights): (&[f64], &[f64]) = match ends(2.0 * side)? {
            None => (&[0.0, 1.0, 2.0], &[-3.0, 4.0, -1.0]),
            Some(_) => (&[0.0, 1.0], &[-2.0, 2.0]),
        };
        let towards = |numbers: &[f64]| numbers.iter().map(|n| n * side).collect();
        Ok(Self { offsets: towards(offsets), weights: towards(weights) })
    }

    /// The order of a difference to one side; `None` of one to both.
    fn one_sided_order(&self) -> Option<usize> {
        self.offsets.contains(&0.0).then_some(self.offsets.len() - 1)
    }
}

/// The parameters whose [differences](crate::finite_differences) are one-sided, because a property's range ends within
/// a step of their values, with the order of the difference: 2, or 1 where the range ends within two steps on the other
/// side as well.
///
/// # Errors
/// As [`finite_differences`](crate::finite_differences), as far as the parameters' effects go.
pub fn one_sided_differences(
    scene: &Scene,
    parameters: &[Parameter],
    step: f64,
) -> Result<Vec<(String, usize)>, Error> {
    let mut found = Vec::new();
    for (p, parameter) in parameters.iter().enumerate() {
        let order = Stencil::at(scene, parameters, p, step)?.one_sided_order();
        found.extend(order.map(|order| (parameter.name.clone(), order)));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use drt_math::{Rgb, ValueChange};
    use drt_medium::{Homogeneous, Medium, Phase};
    use drt_motion::{Change, Effect, PropertyChange};

    use super::*;
    use crate::model::scene::Named;
    use crate::model::surface::{Bsdf, Diffuse};

    #[test]
    fn differences_look_to_where_there_is_something() {
        let gray = Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(0.5) });
        let fog = Homogeneous::new(Rgb::ONE, Rgb::splat(0.5), Rgb::ZERO).expect("a medium");
        let scene = Scene {
            bsdfs: vec![Named::new("gray", gray)],
            media: vec![Named::new("fog", Medium::new(fog, Phase::Isotropic))],
            ..Scene::default()
        };
        let change = |property: &str, op| {
            let (property, voxels, texels) = (property.into(), None, None);
            Change::Property(PropertyChange { property, op, voxels, texels })
        };
        let of = |[target, property]: [&str; 2], value: f64, direction: f64| {
            let op = ValueChange::Add(Rgb::splat(direction));
            let effects = vec![Effect { target: target.into(), change: change(property, op) }];
            let parameters = [Parameter { name: "p".into(), value, effects }];
            Stencil::at(&scene, &parameters, 0, 0.25).map(|s| (s.offsets, s.weights))
        };
        let at = |value, direction| of(["gray", "reflectance"], value, direction);
        assert_eq!(at(0.0, 1.0).unwrap(), (vec![-1.0, 1.0], vec![-1.0, 1.0]));
        assert_eq!(at(-0.5, 1.0).unwrap(), (vec![0.0, 1.0, 2.0], vec![-3.0, 4.0, -1.0]));
        assert_eq!(at(0.5, -1.0).unwrap(), (vec![0.0, -1.0, -2.0], vec![3.0, -4.0, 1.0]));
        // Albedos end at one, beyond which two steps of these lead, but not two of those.
        let albedo = |direction| of(["fog", "albedo"], 0.0, direction);
        assert_eq!(albedo(1.9).unwrap(), (vec![-1.0, 1.0], vec![-1.0, 1.0]));
        let at_zero = |direction: f64| of(["fog", "albedo"], -0.5 / direction, direction);
        assert_eq!(at_zero(1.0).unwrap().0, [0.0, 1.0, 2.0]);
        assert_eq!(at_zero(4.0).unwrap(), (vec![0.0, 1.0], vec![-2.0, 2.0]));
        // Beyond the range there is no difference at all.
        assert_eq!(at(-1.0, 1.0).unwrap_err().out_of_range(), Some("p"));
    }
}
