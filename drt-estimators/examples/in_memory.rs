//! A scene built in memory, a callback for every finished tile, and cancellation: what a program that
//! embeds the estimators needs.
//!
//! ```text
//! cargo run --release -p drt-estimators --example in_memory
//! ```

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use drt_estimators::emitter::Emitter;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Lens, Sensor};
use drt_estimators::surface::{Bsdf, Diffuse};
use drt_estimators::{Control, FinishedTile, Scene, SceneBuilder, Session, Settings, ShapeBuilder};
use drt_math::{Affine, Mat3, Rgb, vec3};
use drt_medium::{Homogeneous, Medium, Phase};
use drt_motion::{GeometryChange, Parameter};

/// Counts tiles and stops when told to.
#[derive(Default)]
struct Watch {
    tiles: AtomicU32,
    stop: AtomicBool,
}

impl Control for Watch {
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
    fn tile(&self, tile: &FinishedTile<'_>) {
        // Here a viewer would copy `tile.image()` to the screen.
        assert_eq!(tile.image().len(), (tile.pixels.1 - tile.pixels.0) as usize);
        self.tiles.fetch_add(1, Ordering::Relaxed);
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = fog_with_ball()?;
    let right = GeometryChange::Translate(vec3(1.0, 0.0, 0.0));
    let slide = Parameter::new("slide").effect("ball", right);
    let mut session = Session::new(&scene, &[slide], &Settings::default())?;
    print!("{}", session.plan());

    let watch = Watch::default();
    session.run(64, &watch);
    let result = session.rendering();
    println!("{} tiles, {} rays", watch.tiles.load(Ordering::Relaxed), result.counters.rays);
    let (image, d) = (result.image.total, result.derivatives[0].total.total);
    println!("mean radiance     {:.5} ± {:.5}", image.mean.g, image.stderr.g);
    println!("its derivative    {:.5} ± {:.5}", d.mean.g, d.stderr.g);

    watch.stop.store(true, Ordering::Relaxed);
    let finished = session.run(1 << 20, &watch);
    println!(
        "told to stop, it keeps the {} samples per pixel that were finished",
        session.rendering().spp
    );
    assert!(!finished);
    Ok(())
}

/// A grey ball in a box of fog under a lamp.
fn fog_with_ball() -> Result<Scene, Box<dyn std::error::Error>> {
    let fog = Homogeneous::new(Rgb::splat(0.4), Rgb::new(0.9, 0.85, 0.7), Rgb::ZERO)?;
    let lamp = Emitter::Point { position: vec3(1.0, -1.0, 4.0), intensity: Rgb::splat(60.0) };
    let view = [vec3(0.0, -6.0, 1.0), vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0)];
    let filter = Filter::new(FilterKind::TENT)?;
    let sensor = Sensor::look_at(view, Lens::with_fov(45.0), [32, 32], filter)?;
    let size = |s: f64| Affine { linear: Mat3::IDENTITY * s, ..Affine::IDENTITY };
    let walls = drt_geom::procedural::cube().transform(&size(2.0));
    let ball = drt_geom::procedural::icosphere(3).transform(&size(0.7));
    let grey = Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(0.5) });
    let scene = SceneBuilder::new()
        .medium("fog", Medium::new(fog, Phase::henyey_greenstein(0.3)?))
        .shape("walls", ShapeBuilder::interface(walls).interior("fog"))
        .shape("ball", ShapeBuilder::new(ball, grey))
        .emitter("lamp", lamp)
        .sensor("camera", sensor)
        .max_depth(6);
    Ok(scene.build()?)
}
