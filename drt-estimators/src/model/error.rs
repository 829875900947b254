//! What can be wrong with a scene or a request.

use alloc::string::String;
use alloc::vec::Vec;

use thiserror::Error;

/// A scene or request that cannot be used; the message names the item and what was expected.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// No item has this name.
    #[error("no element is called `{name}`; known ids: {}", known.join(", "))]
    UnknownTarget {
        /// The name asked for.
        name: String,
        /// Names that exist.
        known: Vec<String>,
    },
    /// More than one item has this name.
    #[error(
        "more than one element is called `{name}`; address it by kind and order, such as shape[0]"
    )]
    AmbiguousTarget {
        /// The name asked for.
        name: String,
    },
    /// An effect does not apply to its target.
    #[error("parameter `{parameter}`, effect on `{target_name}`: {reason}")]
    Effect {
        /// The parameter.
        parameter: String,
        /// The effect's target.
        target_name: String,
        /// Why it does not apply.
        reason: String,
    },
    /// An element of the scene is unusable.
    #[error("{element}: {reason}")]
    Element {
        /// Kind and id or order of the element.
        element: String,
        /// What is wrong and what was expected.
        reason: String,
    },
    /// A setting is unusable.
    #[error("setting `{setting}`: {reason}")]
    Setting {
        /// The setting.
        setting: String,
        /// What is wrong and what was expected.
        reason: String,
    },
}
