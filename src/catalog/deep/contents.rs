//! What a deep catalogue has, and how narrow a field it is enough for.

use crate::base::units::WHOLE_SKY_SQ_DEG;
use crate::catalog::{Band, Catalog};

/// What a catalogue has.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct DeepContents {
    /// Its kind, for people.
    pub kind: String,
    /// The band of its magnitudes.
    pub band: Band,
    /// Number of stars.
    pub stars: u64,
    /// Share of the sky that it covers.
    pub share_of_sky: f64,
    /// Epoch of the positions, where it is known.
    pub epoch_year: Option<f64>,
}

impl DeepContents {
    /// Those of a catalogue in memory.
    pub fn of(catalog: &Catalog) -> Self {
        Self {
            kind: catalog.title().to_owned(),
            band: Band::JohnsonV,
            stars: catalog.stars().len() as u64,
            share_of_sky: 1.0,
            epoch_year: Some(catalog.epoch_year()),
        }
    }

    /// Mean density of the stars where it covers the sky.
    pub fn per_sq_deg(&self) -> f64 {
        self.stars as f64 / (WHOLE_SKY_SQ_DEG * self.share_of_sky.max(1e-9))
    }

    /// Width of the narrowest field, with sides as 3 to 2, that has on average as many stars as identification needs.
    pub fn narrowest_fov_deg(&self) -> f64 {
        narrowest_fov_deg(self.per_sq_deg())
    }
}

/// Width of the narrowest field, with sides as 3 to 2, that has on average as many stars as identification needs, of
/// a catalogue with this density.
pub fn narrowest_fov_deg(per_sq_deg: f64) -> f64 {
    /// In a field with half as many, four stars can be expected with near certainty.
    const STARS: f64 = 10.0;
    (1.5 * STARS / per_sq_deg).sqrt()
}
