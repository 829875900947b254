//! Parameters as lists of effects, and the velocity fields of moving and deforming geometry
