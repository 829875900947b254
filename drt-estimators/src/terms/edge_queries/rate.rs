//! How often paths query edges.

/// How often a path queries edges.
#[derive(Clone, Copy, Debug)]
pub(crate) enum QueryRate {
    /// So many times on average, each time from one of its vertices.
    Average(f64),
    /// Once from each of its vertices.
    EveryVertex,
}

impl Default for QueryRate {
    fn default() -> Self {
        Self::Average(0.0)
    }
}

impl QueryRate {
    /// Whether there are queries at all.
    pub(crate) fn any(self) -> bool {
        !matches!(self, Self::Average(0.0))
    }

    /// Queries of a path on average; `None` where there are none, or where they belong to its vertices.
    pub(crate) fn average(self) -> Option<f64> {
        match self {
            Self::Average(queries) if queries > 0.0 => Some(queries),
            _ => None,
        }
    }

    /// Another average, where there is one.
    pub(crate) fn or_average(self, queries: Option<f64>) -> Self {
        match (self.average(), queries) {
            (Some(_), Some(queries)) => Self::Average(queries),
            _ => self,
        }
    }
}
