//! All tests of the crate from outside, in one program.

mod cages;
mod common;
mod composition;
mod deformation;
mod errors;
mod field;
mod fit_cage;
mod gauss_newton;
mod interior_plan;
mod jets;
mod many_parameters;
mod mean_value;
mod mean_value_field;
mod normals;
mod parameters;
mod tetrahedral;
mod transpose;
mod two_sided_field;
mod values;
mod vertex_normals;
