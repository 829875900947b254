//! One parameter that changes many things, as reverse mode sees it: the items it wants, and the
//! pairing of their gradient with the parameter's velocities.

use drt_estimators::emitter::Emitter;
use drt_estimators::surface::{Bsdf, BsdfChange, Property};
use drt_estimators::{Scene, SceneGradient, Target};
use drt_math::{Affine, Rgb, Vec3};
use drt_medium::MediumChange;
use drt_motion::parameter::Applied;
use drt_motion::surface::move_mesh;
use drt_motion::{Change, Effect, GeometryChange, Parameter, PropertyChange, Texels};

/// What the parameter changes: a property of a shape is that of its emitter or its BSDF.
pub fn targets(scene: &Scene, parameter: &Parameter) -> Vec<Target> {
    let target = |e: &Effect| match (scene.find(&e.target).expect("a known target"), &e.change) {
        (Target::Shape(i), Change::Property(c)) => match scene.shapes[i].emitter {
            Some(e) if c.property == "radiance" => Target::Emitter(e),
            _ => Target::Bsdf(scene.shapes[i].bsdf),
        },
        (target, _) => target,
    };
    parameter.effects.iter().map(target).collect()
}

/// The derivative along the parameter, at theta = 0, of what `gradient` is the gradient of.
pub fn pair(scene: &Scene, parameter: &Parameter, gradient: &SceneGradient) -> f64 {
    let effects = targets(scene, parameter).into_iter().zip(&parameter.effects);
    effects
        .map(|(target, e)| match &e.change {
            Change::Geometry(g) => geometry(scene, target, g, gradient),
            Change::Property(p) => property(scene, target, p, gradient),
            Change::Follow(_) => unreachable!("not used here"),
        })
        .sum()
}

fn field(change: &GeometryChange) -> Affine {
    change.velocity(0.0).expect("an affine change")
}

fn geometry(scene: &Scene, target: Target, change: &GeometryChange, g: &SceneGradient) -> f64 {
    match (target, change) {
        (Target::Shape(i), GeometryChange::VertexVelocity(v)) => {
            let gradient = g.vertices(scene, i).expect("wanted");
            gradient.iter().zip(v.iter()).map(|(g, v): (&Vec3, &Vec3)| g.dot(*v)).sum()
        }
        (Target::Shape(i), change) => {
            let mesh = &scene.shapes[i].mesh;
            let changes = [Applied { parameter: 0, theta: 0.0, change }];
            let moved = move_mesh(mesh, &changes, 1).expect("a valid change");
            g.shapes[i].as_ref().expect("wanted").dot(mesh, &moved.motions[0])
        }
        (Target::Emitter(i), change) => {
            let tangent = scene.emitters[i].item.emitter.velocity(&field(change));
            g.emitters[i].as_ref().expect("wanted").dot(&tangent)
        }
        (Target::Sensor(i), change) => {
            let tangent = scene.sensors[i].item.sensor.velocity(&field(change));
            g.sensor.as_ref().expect("wanted").dot(&tangent)
        }
        (Target::Medium(i) | Target::Coefficients(i), change) => {
            let velocity = field(change);
            medium(scene, i, &MediumChange::Place { map: Affine::IDENTITY, velocity }, g)
        }
        (Target::Bsdf(_), _) => unreachable!("nothing to move"),
    }
}

fn medium(scene: &Scene, i: usize, change: &MediumChange, g: &SceneGradient) -> f64 {
    let tangent = scene.media[i].item.tangent(change, 0.0).expect("a valid change");
    g.media[i].as_ref().expect("wanted").dot(&tangent)
}

/// What is on both sides.
fn plain(bsdf: &Bsdf) -> &Bsdf {
    match bsdf {
        Bsdf::TwoSided(b) => &b.front,
        other => other,
    }
}

fn texels(
    size: [u32; 2],
    texel: impl Fn([usize; 2]) -> Option<Rgb>,
    c: &PropertyChange,
    gradient: &[Rgb],
) -> f64 {
    let width = size[0] as usize;
    let changed =
        |i: &usize| c.texels.and_then(Texels::one).is_none_or(|[x, y]| y * width + x == *i);
    let rate = |i: usize| c.op.map_rate(0.0).value(texel([i % width, i / width]).expect("one"));
    (0..gradient.len()).filter(changed).map(|i| gradient[i].dot(rate(i))).sum()
}

fn property(scene: &Scene, target: Target, c: &PropertyChange, g: &SceneGradient) -> f64 {
    let (op, voxels) = (c.op, c.voxels);
    match target {
        Target::Medium(i) | Target::Coefficients(i) => {
            let property = drt_medium::Property::from_name(&c.property).expect("a property");
            let change = MediumChange::Value { property, op, voxels };
            medium(scene, i, &change, g)
        }
        Target::Bsdf(i) => {
            let property = Property::from_name(&c.property).expect("a property");
            let textures = &g.texels[i];
            if let Some((_, gradient)) = textures.iter().find(|(p, _)| *p == property) {
                let Bsdf::Textured(bsdf) = plain(&scene.bsdfs[i].item) else { unreachable!() };
                let textures = bsdf.textures.iter();
                let (_, texture) = textures.clone().find(|(p, _)| *p == property).expect("one");
                return texels(texture.size(), |at| texture.texel(at), c, &gradient.values());
            }
            let tangent = scene.bsdfs[i].item.tangent(&BsdfChange { property, op }, 0.0);
            let velocity = tangent.expect("a valid change");
            g.bsdfs[i].as_ref().expect("wanted").get(property).dot(velocity.get(property))
        }
        Target::Emitter(i) => {
            let emitter = &scene.emitters[i].item.emitter;
            if let (Some(_), Some(gradient)) = (c.texels, &g.emitter_texels[i]) {
                return match emitter {
                    Emitter::TexturedArea { texture, .. } => {
                        texels(texture.size(), |at| texture.texel(at), c, &gradient.values())
                    }
                    Emitter::Envmap { map, .. } => {
                        texels(map.size(), |at| map.texel(at), c, &gradient.values())
                    }
                    _ => unreachable!("no others have texels"),
                };
            }
            let rate = op.rate(emitter.property(&c.property).expect("a property"), 0.0);
            let tangent = emitter.property_tangent(&c.property, rate).expect("a valid change");
            g.emitters[i].as_ref().expect("wanted").dot(&tangent)
        }
        Target::Sensor(i) => {
            let sensor = &scene.sensors[i].item.sensor;
            let rate: Rgb = op.rate(sensor.property(&c.property).expect("a property"), 0.0);
            let tangent = sensor.property_tangent(&c.property, rate).expect("a valid change");
            g.sensor.as_ref().expect("wanted").dot(&tangent)
        }
        Target::Shape(_) => unreachable!("properties are those of materials and lights"),
    }
}
