use alloc::string::String;
use alloc::vec::Vec;

/// Values over the surface of a mesh, such as colours.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MeshAttribute {
    /// What it is called: `vertex_` or `face_`, and its name in the file.
    pub name: String,
    /// Three channels at each corner of each triangle, linear in between.
    pub values: Vec<[[f32; 3]; 3]>,
}

impl MeshAttribute {
    /// The value at a point of a triangle, given by the weights of its second and third corner.
    #[must_use]
    pub fn at(&self, triangle: u32, [s, t]: [f64; 2]) -> [f64; 3] {
        let corners = &self.values[triangle as usize];
        let weights = [1.0 - s - t, s, t];
        core::array::from_fn(|c| (0..3).map(|k| weights[k] * f64::from(corners[k][c])).sum())
    }
}
