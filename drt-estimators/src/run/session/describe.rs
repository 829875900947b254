//! What a prepared scene's plan says.

use alloc::string::String;

use crate::derivative::contraction::Motion;
use crate::model::plan::{MediumPlan, Plan};
use crate::run::component::Component;
use crate::terms::boundary_segments::Strategy;
use crate::terms::boundary_source::BoundarySource;
use crate::terms::prepared::Prepared;
use crate::world::World;
use crate::world::lights::EmitterMask;

pub(super) fn describe(component: &Component<Motion>) -> Plan {
    let Component { prepared, unknowns: motion, .. } = component;
    let Prepared { estimator, world, terms, .. } = prepared;
    let has = |s: BoundarySource| terms.sources.contains(&s);
    let light = match world.lit {
        EmitterMask::All => "all light",
        EmitterMask::Extended => "light of surfaces, media and the sky",
        EmitterMask::Delta => "light of points and directions",
    };
    let sees_edges = terms.edges.as_ref().is_some_and(|edges| edges.has_edges(world));
    let mut plan = Plan {
        media: (0..world.scene.media.len()).map(|i| medium_plan(world, motion, i)).collect(),
        edges: terms.edge_count,
        primary: has(BoundarySource::Edges(Strategy::Primary)) || has(BoundarySource::PrimaryEdges),
        direct: has(BoundarySource::Edges(Strategy::Direct))
            || terms.boundary.shadows.is_some()
            || sees_edges,
        indirect: has(BoundarySource::Edges(Strategy::Indirect)) || sees_edges,
        borders: has(BoundarySource::Borders),
        antithetic: terms.antithetic,
        ..Plan::default()
    };
    let mut skip = |what: &str| plan.skipped.push(String::from(what));
    if !world.has_media() {
        skip("tracking: the scene has no media");
    }
    if motion.parameters() == 0 {
        skip("derivatives: there are no parameters");
        return plan;
    }
    for (i, reason) in motion.insides.unfilled.iter().enumerate() {
        if let Some(reason) = reason {
            skip(&alloc::format!("tetrahedra in {}: {reason}", medium_name(world, i)));
        }
    }
    if !motion.active.moves_geometry() {
        skip("boundary terms: no parameter moves geometry");
    }
    if terms.flux.is_none() {
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

fn medium_plan(world: &World, motion: &Motion, i: usize) -> MediumPlan {
    let item = &world.scene.media[i];
    let tracking = match (item.item.extinction(), world.probed[i]) {
        (Some(_), _) => String::from("closed form"),
        (None, None) => String::from("delta tracking"),
        (None, Some(least)) => {
            alloc::format!("delta tracking, with probes where the extinction is below {least:.3}")
        }
    };
    let insides = &motion.insides;
    let moved = |p: usize| {
        let inside = insides.velocities[i].iter().find(|(q, _)| *q == p).map(|(_, m)| m);
        let name = inside.map_or("static", |v| v.name());
        let how = match (inside, insides.flux[i].contains(&p)) {
            (None, false) => return None,
            (_, false) => String::from(name),
            (_, true) => alloc::format!("{name} with flux"),
        };
        Some((motion.tangents.names[p].clone(), how))
    };
    let motions = (0..motion.parameters()).filter_map(moved).collect();
    MediumPlan { medium: medium_name(world, i), tracking, motion: motions }
}

fn medium_name(world: &World, i: usize) -> String {
    world.scene.media[i].id.clone().unwrap_or_else(|| alloc::format!("medium[{i}]"))
}
