//! The derivative check matrix: scenes × kinds of change, each derivative image compared with
//! finite differences that use common random numbers.
//!
//! A [`Stage`] is a scene with [`Cell`]s, one per parameter. [`Row`] is a cell's verdict.

pub mod caged;
mod cell;
pub mod clouds;
pub mod deforming;
pub(crate) mod effects;
pub mod estimators;
pub mod filters;
pub mod lenses;
pub mod lights;
pub mod materials;
pub mod media;
pub mod random;
pub mod reference;
pub mod riding;
pub mod scale;
pub(crate) mod set;
pub mod smooth;
pub mod still;
pub mod surfaces;
pub mod textures;
pub(crate) mod verdict;

pub use cell::{Cell, Stage};
pub use set::Set;
pub use verdict::{Fault, Row, Table};

/// Hands the names of all stages, by module, to another macro.
#[macro_export]
macro_rules! every_stage {
    ($with:ident) => {
        $with! {
            surfaces: room room_box_filter standing sunk sunk_by_point knot gloss blend near_lamp;
            lights: spot point_and_sun;
            materials: principled thin brushed pressed coated unmixed measured measured_brushed;
            lenses: thin_lens cropped instances;
            textures: picture mosaic stained marbled embossed picture_lamp under_a_sky sky_and_slide thrown;
            media: fog_box blob still_blob shade smoke glass dented_glass sunk_in_fog sunk_glass sunk_lamp beam
                layers sheet ember;
            deforming: wax mean_value_wax still_wax jelly sheared_glass nested touching pulse immersed
                lantern stirred_smoke still_smoke fine_milk fine_glass;
            riding: riding riding_tight riding_inside riding_still riding_mean_value dyed;
            clouds: cloud_under_a_sky;
            caged: caged_milk caged_glass caged_solid;
        }
    };
}
