//! Errors of a scene or a request.

mod effect;
mod element;
mod setting;

use alloc::string::String;
use alloc::vec::Vec;

use thiserror::Error;

pub use crate::model::error::effect::EffectError;
pub use crate::model::error::element::ElementError;
pub use crate::model::error::setting::SettingError;

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
        reason: EffectError,
    },
    /// A [group](crate::fit::Group) of unknowns is unusable, or its values are.
    #[error("group `{group}`: {reason}")]
    Group {
        /// The group.
        group: String,
        /// What is wrong.
        reason: String,
    },
    /// An element of the scene is unusable.
    #[error("{element}: {reason}")]
    Element {
        /// Id, or kind and order, of the element.
        element: String,
        /// What is wrong.
        reason: ElementError,
    },
    /// A setting is unusable.
    #[error("setting `{setting}`: {reason}")]
    Setting {
        /// The setting.
        setting: &'static str,
        /// What is wrong.
        reason: SettingError,
    },
}

impl Error {
    /// The parameter whose value takes a property out of the range in which it has a meaning, where that is what is
    /// wrong.
    #[must_use]
    pub fn out_of_range(&self) -> Option<&str> {
        match self {
            Self::Effect { parameter, reason, .. } if reason.is_out_of_range() => Some(parameter),
            _ => None,
        }
    }
}
