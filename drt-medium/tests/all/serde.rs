//! Media and changes survive serialisation; bad data is refused on the way in.

use crate::common::*;
use drt_math::{Affine, Rgb, vec3};
use drt_medium::{
    Filter, Grid, Homogeneous, Layout, Medium, MediumChange, MediumKind, Phase, PhaseBlend,
    Property, UniformMedium, ValueChange, Wrap,
};

fn round_trip(medium: &Medium) -> Medium {
    let text = serde_json::to_string(medium).expect("serialisable");
    serde_json::from_str(&text).expect("what was written")
}

#[test]
fn media_survive() {
    let mut medium = cloud(Layout::NodeCentred);
    medium.phase = Phase::HenyeyGreenstein { g: -0.3 };
    let again = round_trip(&medium);
    assert_eq!(again.grid(), medium.grid());
    assert_eq!(again.phase, medium.phase);
    let weights = Grid::new([2, 1, 1], 1, vec![0.1, 0.6]).expect("a valid grid");
    let parts = [Phase::henyey_greenstein_grid(weights.clone()).expect("valid"), Phase::Rayleigh];
    let blend = PhaseBlend::varying(weights, parts).expect("valid");
    medium.phase = Phase::Blend(Box::new(blend));
    assert_eq!(round_trip(&medium).phase, medium.phase);
    let x = medium.grid().expect("a grid").density().to_world().point(vec3(0.7, 0.6, 0.5));
    assert_eq!(again.coefficients(x), medium.coefficients(x));

    let grid = medium.grid().expect("a grid");
    let dyed = UniformMedium::new(Rgb::splat(0.5), grid.albedo().clone(), grid.emission().clone());
    let dyed = Medium::new(dyed.expect("valid"), Phase::Isotropic);
    assert_eq!(round_trip(&dyed).coefficients(x), dyed.coefficients(x));

    let h = Homogeneous::new(Rgb::new(0.1, 0.2, 0.3), Rgb::ONE, Rgb::splat(4.0)).expect("valid");
    let again = round_trip(&Medium::new(h, Phase::Rayleigh));
    assert_eq!(again.homogeneous(), Some(&h));
}

#[test]
fn grids_survive_with_all_their_settings() {
    let grid = Grid::new([2, 1, 1], 1, vec![0.1, 1e-300])
        .expect("a valid grid")
        .with_wrap(Wrap::Mirror)
        .with_filter(Filter::Nearest)
        .with_placement(Affine::translation(vec3(0.1, 0.2, 0.3)))
        .expect("a box");
    let text = serde_json::to_string(&grid).expect("serialisable");
    assert_eq!(serde_json::from_str::<Grid>(&text).expect("what was written"), grid);
    let wrong = text.replace("[2,1,1]", "[3,1,1]");
    let error = serde_json::from_str::<Grid>(&wrong).expect_err("a value is missing");
    assert!(error.to_string().contains("needs 3 values, found 2"), "{error}");
}

#[test]
fn changes_survive() {
    let changes = [
        MediumChange::Value {
            property: Property::SigmaT,
            op: ValueChange::MultiplyLog(0.5),
            voxels: Some([1, 2, 3]),
        },
        MediumChange::Place { map: Affine::IDENTITY, velocity: Affine::ZERO },
    ];
    let text = serde_json::to_string(&changes).expect("serialisable");
    assert_eq!(serde_json::from_str::<[MediumChange; 2]>(&text).expect("as written"), changes);
}

#[test]
fn negative_extinction_is_refused() {
    let h = Homogeneous::new(Rgb::splat(0.5), Rgb::ONE, Rgb::ZERO).expect("valid");
    let text = serde_json::to_string(&MediumKind::from(h)).expect("serialisable");
    let error = serde_json::from_str::<MediumKind>(&text.replacen("0.5", "-0.5", 1));
    assert!(error.expect_err("negative").to_string().contains("sigma_t is -0.5"));
}
