//! The stored derivatives that the check matrix is judged by; those of [insides](crate::insides) are beside these.
//!
//! Each stage is computed by other random numbers than those that the stored ones are of, and must agree with them in standard
//! errors. Where none are stored, or the scene has changed since, and everywhere with `DRT_RENEW=1`, the new ones are stored:
//! `cargo test --release -p drt-tests --test all -- --ignored references --nocapture`

use drt_tests::Result;
use drt_tests::matrix::reference::{long, stored};
use drt_tests::matrix::{
    Stage, caged, clouds, deforming, lenses, lights, materials, media, riding, still, surfaces,
    textures,
};
use drt_tests::reference::{Reference, SEED, write};

/// Other random numbers than those of what is stored.
pub(crate) fn next_seed(stored: &Result<Vec<Reference>>) -> u64 {
    stored.as_ref().map_or(SEED, |all| all[0].seed + 1)
}

/// How many of the stored references do not agree with new ones.
pub(crate) fn disagreeing(
    scene: &str,
    stored: &Result<Vec<Reference>>,
    new: &[Reference],
) -> usize {
    let agrees = |(old, new): (&Reference, &Reference)| {
        let found = new.agreement(old);
        let noise = 100.0 * new.layer().relative_noise(None);
        let (rms, max) = (found.rms_z, found.max_z);
        println!("{scene}: {}: rms z {rms:.2}, max z {max:.2}, noise {noise:.2} %", new.name);
        found.agrees
    };
    stored.iter().flatten().zip(new).filter(|pair| !agrees(*pair)).count()
}

/// True where new references take the place of those that are stored.
pub(crate) fn renews(stored: &Result<Vec<Reference>>) -> bool {
    stored.is_err() || std::env::var_os("DRT_RENEW").is_some()
}

fn renew(stage: Result<Stage>) {
    let stage = stage.unwrap().short();
    let stored = stored(&stage);
    let seed = next_seed(&stored);
    let new = stage.cells.iter().map(|cell| long(&stage, cell, seed));
    let new = new.collect::<Result<Vec<_>>>().unwrap();
    let failing = disagreeing(stage.name, &stored, &new);
    assert_eq!(failing, 0, "{failing} stored differences do not agree with new ones");
    if renews(&stored) {
        write(stage.name, &new).unwrap();
    }
}

/// A reference that has been read is what was stored, and a scene that has changed has none.
#[test]
fn changed_scenes_have_no_reference() {
    let stage = surfaces::room().unwrap().short();
    let references = stored(&stage).unwrap();
    assert_eq!(references.len(), stage.cells.len());
    let refused = |change: &dyn Fn(&mut Stage)| {
        let mut stage = stage.clone();
        change(&mut stage);
        stored(&stage).unwrap_err().to_string()
    };
    let brighter = |s: &mut Stage| s.cells[0].parameter.value = 0.01;
    let deeper = |s: &mut Stage| s.scene.integrator.max_depth = Some(4);
    let longer = |s: &mut Stage| s.cells[0].samples *= 2;
    let unknown = |s: &mut Stage| s.name = "none";
    let changes: [&dyn Fn(&mut Stage); 4] = [&brighter, &deeper, &longer, &unknown];
    for change in changes {
        let message = refused(change);
        assert!(message.contains("make it anew by `cargo test"), "{message}");
    }
}

macro_rules! stages {
    ($($room:ident: $($stage:ident)*;)*) => {
        $($(#[test] #[ignore = "minutes"] fn $stage() { renew($room::$stage()); })*)*
    };
}

drt_tests::every_stage!(stages);

stages! {
    lenses: parallel_rays;
    textures: engraved tiles plastered;
    still: mirrors veiled;
}
