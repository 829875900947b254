//! Edges at which what is seen can change: which faces lie around them, what is seen on their sides, and
//! how points on them are drawn as they matter to a viewer.
//!
//! ```
//! use drt_geom::edges::{Coincident, Fan, Wedge, faces_around};
//! use drt_math::vec3;
//!
//! // Two sheets hang down from the z axis, like a tent.
//! let ends = [vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0)];
//! let sheet = |x, face| Wedge::new(ends, [vec3(x, -1.0, 0.0); 2], [face; 2]);
//! let sheets = [sheet(1.0, 0), sheet(-1.0, 1)].map(|e| e.expect("has an area"));
//!
//! let coincident = Coincident::among(&sheets);
//! let group = coincident.groups().next().expect("one group, of both");
//! let faces = faces_around(&sheets[0], group.iter().map(|i| &sheets[*i]));
//! let fan = Fan { edge: &sheets[0], faces: &faces };
//! assert!((fan.widest_gap().expect("open above").between - 1.5708).abs() < 1e-4);
//!
//! // Seen along x, one looks past it above and at the first sheet below.
//! let sides = fan.sides(vec3(1.0, 0.0, 0.0)).expect("not along the edge");
//! assert_eq!(sides.outward().y, 1.0);
//! assert_eq!(sides.faces[1].map(|(face, _)| face), Some(0));
//! ```

mod coincident;
mod cone;
mod fan;
mod lobes;
pub mod tree;
mod wedge;

pub use crate::edges::coincident::Coincident;
pub use crate::edges::cone::{Cone, ConeSegment, ConeTree};
pub use crate::edges::fan::{EdgeSides, Fan, FanFace, Gap, faces_around};
pub use crate::edges::lobes::{Lobe, Lobes};
pub use crate::edges::wedge::Wedge;
