pub(crate) mod tree;
