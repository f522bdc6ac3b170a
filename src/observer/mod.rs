//! Where in the observer's sky a direction stands.

pub mod airmass;
