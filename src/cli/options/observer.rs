//! Where the observer is, and how it moves.

use super::values;
use clap::Args;
use starpipe::ephemeris::observer::{Air, Site};

#[derive(Debug, Args)]
pub(crate) struct ObserverOptions {
    /// Where the frames were taken: latitude and longitude (north and east positive) in degrees, and
    /// height in metres; with date and time, gives zenith distance, airmass and refraction
    #[arg(long, value_name = "LAT,LON[,HEIGHT_M]", allow_hyphen_values = true)]
    site: Option<Site>,
    /// Pressure and temperature of the air at --site, in hPa and °C [default: those of the standard
    /// atmosphere at its height]
    #[arg(long, value_name = "HPA,CELSIUS", value_parser = values::air, allow_hyphen_values = true,
          requires = "site")]
    air: Option<Air>,
    /// Velocity of a spacecraft relative to the Earth's centre, in km/s along the axes of ICRS; with the
    /// date, for aberration
    #[arg(long, value_name = "VX,VY,VZ", value_parser = values::velocity, allow_hyphen_values = true,
          conflicts_with = "site")]
    velocity: Option<[f64; 3]>,
}

impl ObserverOptions {
    /// The site with its air.
    pub(crate) fn site(&self) -> Option<Site> {
        let air = |site: Site| self.air.map_or(site, |air| site.with_air(air));
        self.site.map(air)
    }

    /// The velocity of a spacecraft.
    pub(crate) fn velocity_km_s(&self) -> Option<[f64; 3]> {
        self.velocity
    }
}
