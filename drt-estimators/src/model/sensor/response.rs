/// How a sensor weighs directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Response {
    /// A pinhole camera.
    #[default]
    Perspective,
    /// A camera of parallel rays.
    Orthographic,
    /// The cosine over the hemisphere around the forward axis; one pixel.
    Irradiance,
}
