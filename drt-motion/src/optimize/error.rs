use thiserror::Error;

/// A request that cannot be optimised. Variables are counted from 0, and so are the values of a field.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum OptimizeError {
    /// Lists that belong together differ in length.
    #[error("{what}: expected {expected} numbers, one per variable, found {found}")]
    Length {
        /// The list.
        what: &'static str,
        /// Variables.
        expected: usize,
        /// Numbers given.
        found: usize,
    },
    /// A NaN or infinity.
    #[error("variable {variable}: {what} is not finite")]
    NotFinite {
        /// The variable.
        variable: usize,
        /// The offending number.
        what: &'static str,
    },
    /// A learning rate that is negative or not finite.
    #[error(
        "variable {variable}: the learning rate is {value}; expected a positive number, or 0 to keep the value"
    )]
    LearningRate {
        /// The variable.
        variable: usize,
        /// The rate given.
        value: f64,
    },
    /// Bounds with nothing between them.
    #[error(
        "variable {variable}: the bounds {lower} and {upper} leave no room; expected lower < upper"
    )]
    Bounds {
        /// The variable.
        variable: usize,
        /// The lower bound.
        lower: f64,
        /// The upper bound.
        upper: f64,
    },
    /// A start outside of the bounds.
    #[error("variable {variable} starts at {value}, outside of its bounds {lower} to {upper}")]
    Start {
        /// The variable.
        variable: usize,
        /// The start.
        value: f64,
        /// The lower bound.
        lower: f64,
        /// The upper bound.
        upper: f64,
    },
    /// A start that has no logarithm.
    #[error("variable {variable} starts at {value}; what varies by its logarithm must be positive")]
    NotPositive {
        /// The variable.
        variable: usize,
        /// The start.
        value: f64,
    },
    /// A number of the method out of its range.
    #[error("{name} is {value}; expected {expected}")]
    Method {
        /// The number.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        expected: &'static str,
    },
    /// A gradient where the method needs second derivatives, too.
    #[error("Gauss-Newton steps need a curvature besides the gradient")]
    NoCurvature,
    /// Second derivatives that no noise explains.
    #[error("the curvature with its noise is not positive: it is not that of a sum of squares")]
    NotSquares,
    /// A method that fields cannot step by.
    #[error("fields step by Adam or momentum; Gauss-Newton steps need a matrix of all unknowns")]
    FieldMethod,
    /// A smoothing together with what would make its steps rough again.
    #[error("a smoothed field takes neither bounds nor logarithms: they act on single values")]
    SmoothedBounds,
    /// A field whose values do not spread evenly over the vertices of its smoothing.
    #[error("{values} values; expected a multiple of {vertices}, the vertices of the mesh")]
    Columns {
        /// The number of values.
        values: usize,
        /// The number of vertices, copies included.
        vertices: usize,
    },
    /// A corner of a triangle that is no vertex.
    #[error("triangle {triangle} names vertex {vertex}; expected less than {vertices}")]
    Triangle {
        /// The triangle, counted from 0.
        triangle: usize,
        /// The vertex that it names.
        vertex: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// A smoothing that double precision has no room for.
    #[error("smoothing with lambda {lambda} cannot be factorised; expected a smaller lambda")]
    Factorisation {
        /// The factor of the Laplacian.
        lambda: f64,
    },
}
