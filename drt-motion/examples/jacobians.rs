//! Derivatives of the area and volume of a deforming shape, without rendering anything.
//!
//! Area changes by the integral of the area Jacobian's rate, volume by the flux of the velocity
//! through the surface. Both are summed forward, parameter by parameter, and once more in reverse:
//! one pass gives the gradient of the area with respect to every vertex.

use drt_geom::procedural::bumpy_sphere;
use drt_math::{Affine, Mat3, Vec3, vec3};
use drt_motion::parameter::geometry_changes;
use drt_motion::surface::{JetAdjoint, MovedMesh, VertexGradient, move_mesh};
use drt_motion::{Change, Effect, GeometryChange, MotionError, Parameter, SurfacePoint};

fn parameters() -> Vec<Parameter<&'static str>> {
    let on_shape = |change| vec![Effect { target: "shape", change: Change::Geometry(change) }];
    // x moves in proportion to y: volume stays, area does not.
    let shear = Mat3::from_rows(Vec3::Y, Vec3::ZERO, Vec3::ZERO);
    let shear = Affine { linear: shear, translation: Vec3::ZERO };
    let stretch = GeometryChange::Scale { factor: vec3(1.0, 0.5, 0.0), pivot: Vec3::ZERO };
    let dent = GeometryChange::Vertex { index: 7, direction: Vec3::Z };
    let turn = GeometryChange::Rotate { axis: vec3(1.0, 1.0, 1.0), pivot: Vec3::X };
    [
        ("stretch", 0.3, stretch),
        ("dent", 0.02, dent),
        ("shear", -0.4, GeometryChange::Matrix(shear)),
        ("turn", 1.0, turn),
    ]
    .into_iter()
    .map(|(name, value, change)| Parameter { name: name.into(), value, effects: on_shape(change) })
    .collect()
}

fn moved(parameters: &[Parameter<&'static str>]) -> Result<MovedMesh, MotionError> {
    let shape = bumpy_sphere(3, 0.3, 6.0);
    move_mesh(&shape, &geometry_changes(parameters, &"shape")?, parameters.len())
}

fn centers(moved: &MovedMesh) -> impl Iterator<Item = SurfacePoint> {
    let count = moved.mesh.triangles.len() as u32;
    (0..count).map(|triangle| SurfacePoint { triangle, bary: [1.0 / 3.0; 2] })
}

/// Derivatives of area and volume with respect to one parameter. Velocities are linear on
/// triangles, so their values at the centers integrate them exactly.
fn forward(moved: &MovedMesh, parameter: usize) -> [f64; 2] {
    let mut rates = [0.0; 2];
    for center in centers(moved) {
        let jet = moved.motions[parameter].jet(&moved.mesh, &center);
        let area = moved.mesh.area(center.triangle);
        rates[0] += jet.j_dot * area;
        rates[1] += jet.u.dot(moved.mesh.normal(center.triangle)) * area;
    }
    rates
}

fn main() -> Result<(), MotionError> {
    let parameters = parameters();
    let here = moved(&parameters)?;

    let mut gradient = VertexGradient::zeros(&here.mesh);
    for center in centers(&here) {
        let j = here.mesh.area(center.triangle);
        gradient.scatter(&here.mesh, &center, &JetAdjoint { j, ..JetAdjoint::default() });
    }

    println!("parameter    d area  (reverse)  (differences)  d volume  (differences)");
    for (index, parameter) in parameters.iter().enumerate() {
        let measured = |shift: f64| -> Result<[f64; 2], MotionError> {
            let mut shifted = parameters.clone();
            shifted[index].value += shift;
            let mesh = moved(&shifted)?.mesh;
            Ok([mesh.surface_area(), mesh.volume()])
        };
        let h = 1e-4;
        let (plus, minus) = (measured(h)?, measured(-h)?);
        let difference = [0, 1].map(|i| (plus[i] - minus[i]) / (2.0 * h));
        let [area, volume] = forward(&here, index);
        let reverse = gradient.dot(&here.mesh, &here.motions[index]);
        println!(
            "{:9} {area:9.6}  {reverse:9.6}      {:9.6} {volume:9.6}      {:9.6}",
            parameter.name, difference[0], difference[1]
        );
    }
    Ok(())
}
