//! Scene, job and image files for drt, and the drt command
