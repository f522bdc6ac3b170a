//! Where the observer is, and how it moves.

use clap::Args;
use serde::Serialize;

#[derive(Debug, Args, Serialize)]
pub(crate) struct ObserverOptions {
    /// Site: latitude and longitude (north and east positive) in degrees, and
    /// height in meters; with date and time, gives zenith distance, airmass and refraction
    #[arg(long, value_name = "LAT,LON[,HEIGHT_M]", allow_hyphen_values = true)]
    site: Option<String>,
    /// Pressure and temperature of the air at --site, in hPa and °C [default: those of the standard
    /// atmosphere at its height]
    #[arg(
        long,
        value_name = "HPA,CELSIUS",
        allow_hyphen_values = true,
        requires = "site"
    )]
    air: Option<String>,
    /// Velocity of a spacecraft relative to the Earth's center, in km/s along the axes of ICRS; with the
    /// date, for aberration
    #[arg(
        long,
        value_name = "VX,VY,VZ",
        allow_hyphen_values = true,
        conflicts_with = "site"
    )]
    velocity: Option<String>,
}
