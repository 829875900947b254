//! What a prepared scene's plan says.

use alloc::string::String;
use alloc::vec::Vec;

use crate::derivative::contraction::Motion;
use crate::model::plan::{MediumPlan, Plan};
use crate::terms::boundary_segments::Strategy;
use crate::terms::guiding::Guiding;
use crate::terms::prepared::Prepared;
use crate::terms::splatting::BoundarySource;
use crate::world::World;
use crate::world::lights::EmitterMask;

pub(super) fn describe(prepared: &Prepared, motion: Option<&Motion>) -> Plan {
    let world = &prepared.world;
    let has = |s: BoundarySource| prepared.sources.contains(&s);
    let radiative = prepared.radiative.as_ref();
    let light = match world.lit {
        EmitterMask::All => "all light",
        EmitterMask::Extended => "light of surfaces, media and the sky",
        EmitterMask::Delta => "light of points and directions",
    };
    let warped = prepared.warped.as_ref();
    let estimator = match (radiative, warped) {
        (Some(_), _) => "radiative",
        (_, Some(_)) => "warped",
        _ => "path-space",
    };
    let sees_edges = radiative.is_some_and(|r| r.has_edges(world));
    let mut plan = Plan {
        media: (0..world.scene.media.len()).map(|i| medium_plan(world, motion, i)).collect(),
        edges: match (radiative, warped) {
            (Some(r), _) => r.count,
            (_, Some(w)) => w.count,
            _ => prepared.boundary.count,
        },
        primary: has(BoundarySource::Edges(Strategy::Primary)) || has(BoundarySource::PrimaryEdges),
        direct: has(BoundarySource::Edges(Strategy::Direct))
            || prepared.boundary.shadows.is_some()
            || sees_edges,
        indirect: has(BoundarySource::Edges(Strategy::Indirect)) || sees_edges,
        borders: has(BoundarySource::Borders),
        antithetic: prepared.antithetic,
        ..Plan::default()
    };
    let mut skip = |what: &str| plan.skipped.push(String::from(what));
    if !world.has_media() {
        skip("tracking: the scene has no media");
    }
    let Some(motion) = motion else {
        skip("derivatives: there are no parameters");
        return plan;
    };
    for (i, reason) in motion.insides.unfilled.iter().enumerate() {
        if let Some(reason) = reason {
            skip(&alloc::format!("tetrahedra in {}: {reason}", medium_name(world, i)));
        }
    }
    if !motion.active.moves_geometry() {
        skip("boundary terms: no parameter moves geometry");
    }
    if prepared.flux.is_none() {
        skip("flux: every inside follows its surfaces");
    }
    plan.estimators = alloc::vec![alloc::format!("{estimator}, {light}")];
    plan.record = motion.active.any();
    plan.moving_shapes = motion
        .active
        .shapes
        .iter()
        .enumerate()
        .filter(|(_, m)| **m)
        .map(|(i, _)| world.shape_name(i))
        .collect();
    plan.flux_shapes = motion.insides.flux_shapes.iter().map(|s| world.shape_name(*s)).collect();
    plan
}

/// What is known of how a source is guided.
pub(super) fn describe_guide(source: BoundarySource, guiding: &Guiding) -> String {
    let name = match source {
        BoundarySource::Edges(Strategy::Primary) | BoundarySource::PrimaryEdges => {
            "camera boundary"
        }
        BoundarySource::Edges(Strategy::Direct) => "emitter boundary",
        BoundarySource::Edges(Strategy::Indirect) => "indirect boundary",
        BoundarySource::Borders => "pixel borders",
        BoundarySource::GrazingFlux => "grazing flux",
        BoundarySource::LightPaths => "light paths",
    };
    let Some((learnt, samples)) = guiding.outcome() else {
        return alloc::format!("{name}: where a pilot finds that it helps");
    };
    match &learnt.guide {
        Some(guide) => alloc::format!(
            "{name}: {:.2} of the work by {:.2} of the samples, with a pilot of {samples} and {} cells",
            1.0 / learnt.gain,
            guiding.share(),
            guide.cells()
        ),
        None => alloc::format!(
            "{name}: no, a pilot of {samples} samples promises {:.2} of the work",
            1.0 / learnt.gain
        ),
    }
}

fn medium_plan(world: &World, motion: Option<&Motion>, i: usize) -> MediumPlan {
    let item = &world.scene.media[i];
    let tracking = match item.item.extinction() {
        Some(_) => "closed form",
        None => "delta tracking",
    };
    let motions = motion.map_or_else(Vec::new, |m| {
        let insides = &m.insides;
        (0..m.parameters())
            .filter_map(|p| {
                let inside = insides.velocities[i].iter().find(|(q, _)| *q == p).map(|(_, m)| m);
                let name = inside.map_or("static", |v| v.name());
                let how = match (inside, insides.flux[i].contains(&p)) {
                    (None, false) => return None,
                    (_, false) => String::from(name),
                    (_, true) => alloc::format!("{name} with flux"),
                };
                Some((m.tangents.names[p].clone(), how))
            })
            .collect()
    });
    MediumPlan { medium: medium_name(world, i), tracking: tracking.into(), motion: motions }
}

fn medium_name(world: &World, i: usize) -> String {
    world.scene.media[i].id.clone().unwrap_or_else(|| alloc::format!("medium[{i}]"))
}
