//! Inputs: frames and lists of centroids, from files or standard input.

pub(crate) mod centroid_list;
pub(crate) mod frames;
pub(crate) mod names;
pub(crate) mod stdin;
