//! Cross-crate tests of the drt family
