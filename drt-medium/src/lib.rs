//! Homogeneous and voxel-grid participating media: tracking, transmittance, phase functions and their derivatives
