//! What is up there, and from where it is seen: the star catalogue, and the observer's site, air and time.

pub mod catalog;
pub mod observer;
