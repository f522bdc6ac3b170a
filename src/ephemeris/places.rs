//! Where do stars appear? Proper motion, aberration and refraction.
//!
//! ([`Star`], date, observer) → direction in ICRS axes
//!
//! 1. Proper motion takes the star from J2000.0 to the date.
//! 2. Aberration shifts it towards where the observer moves: by up to 20.7″ for the Earth's motion
//!    about the Sun and its rotation, by 5″ more in a low orbit.
//! 3. Refraction lifts it towards the zenith of a site.
//!
//! Caveats: annual parallax (below 0.8″) and the deflection of light by the Sun (below 0.02″ beyond 15°
//! from it) are left out.

use crate::base::coords::{Camera, Horizon, Icrs, Rotation, UnitVector};
use crate::base::epoch::ObservationDate;
use crate::catalog::Star;
use crate::ephemeris::observer::airmass::airmass_kasten_young;
use crate::ephemeris::observer::{Air, Site, earth_velocity_c};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

/// Speed of light in kilometres per second.
const LIGHT_KM_S: f64 = 299_792.458;

/// Where stars appear to an observer at a date.
///
/// # Example
/// ```
/// use starpipe::UnitVector;
/// use starpipe::ephemeris::places::StarPlaces;
///
/// // At the spring equinox the Earth moves towards the ecliptic longitude 270°.
/// let places = StarPlaces::at(&"2024-03-20T03:00:00Z".parse()?, None, None);
/// let pole = UnitVector::from_ra_dec(0.0, 90_f64.to_radians());
/// let arcsec = places.apparent(&pole).angle_to(&pole).to_degrees() * 3600.0;
/// assert!((arcsec - 18.8).abs() < 0.2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StarPlaces {
    years_since_j2000: f64,
    /// The observer's velocity in ICRS axes, in units of the speed of light.
    velocity_c: Option<Vector3<f64>>,
    refraction: Option<Refraction>,
}

/// The air through which the stars are seen.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Refraction {
    air: Air,
    zenith: UnitVector<Icrs>,
    /// On the horizon.
    north: UnitVector<Icrs>,
}

/// Which directions an attitude refers to, in axes of ICRS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum AttitudeFrame {
    /// Those of the catalogue at the date: coordinates of what is in the centre.
    #[default]
    Icrs,
    /// Those from which light reaches the camera: how the camera itself is turned.
    Apparent,
}

impl StarPlaces {
    /// Those of the catalogue with proper motion to a date in Julian years since J2000.0.
    pub const fn of_catalog(years_since_j2000: f64) -> Self {
        Self {
            years_since_j2000,
            velocity_c: None,
            refraction: None,
        }
    }

    /// Those at `date`, through the air of `site` where the time is known, for an observer with the
    /// velocity `velocity_km_s` relative to the Earth's centre, in ICRS axes. The site moves with the
    /// Earth's rotation.
    pub fn at(
        date: &ObservationDate,
        site: Option<Site>,
        velocity_km_s: Option<Vector3<f64>>,
    ) -> Self {
        let years_since_j2000 = date.years_since_j2000();
        let site = site.filter(|_| date.has_time());
        let in_space = site.map(|site| (site.air(), site.in_space(years_since_j2000)));
        let about_earth = in_space.as_ref().map(|(_, site)| site.velocity_km_s);
        let velocity_km_s = velocity_km_s.or(about_earth).unwrap_or_default();
        Self {
            years_since_j2000,
            velocity_c: Some(earth_velocity_c(years_since_j2000) + velocity_km_s / LIGHT_KM_S),
            refraction: in_space.map(|(air, site)| Refraction {
                air,
                zenith: site.zenith,
                north: site.north,
            }),
        }
    }

    /// The same without air.
    #[must_use]
    pub const fn without_refraction(self) -> Self {
        Self {
            refraction: None,
            ..self
        }
    }

    /// The date in Julian years since J2000.0.
    pub const fn years_since_j2000(&self) -> f64 {
        self.years_since_j2000
    }

    /// Whether the observer's motion is known.
    pub const fn has_aberration(&self) -> bool {
        self.velocity_c.is_some()
    }

    /// Whether there is air.
    pub const fn has_refraction(&self) -> bool {
        self.refraction.is_some()
    }

    /// Whether apparent directions are those of the catalogue.
    pub const fn are_of_catalog(&self) -> bool {
        !self.has_aberration() && !self.has_refraction()
    }

    /// Where the zenith is, if there is air.
    pub fn zenith(&self) -> Option<&UnitVector<Icrs>> {
        self.refraction
            .as_ref()
            .map(|refraction| &refraction.zenith)
    }

    /// What appears in a direction of the site's sky, if it is known: the azimuth is from north through
    /// east.
    pub fn in_horizon(&self, azimuth_rad: f64, altitude_rad: f64) -> Option<UnitVector<Icrs>> {
        let Refraction { zenith, north, .. } = self.refraction.as_ref()?;
        let (zenith, north) = (zenith.as_vector(), north.as_vector());
        let east = north.cross(zenith);
        let (sin_azimuth, cos_azimuth) = libm::sincos(azimuth_rad);
        let (sin_altitude, cos_altitude) = libm::sincos(altitude_rad);
        let along = north * cos_azimuth + east * sin_azimuth;
        Some(UnitVector::from_vector(
            along * cos_altitude + zenith * sin_altitude,
        ))
    }

    /// From apparent directions, in ICRS axes, to the axes of the site's horizon, if it is known.
    pub fn horizon(&self) -> Option<Rotation<Icrs, Horizon>> {
        let Refraction { zenith, north, .. } = self.refraction.as_ref()?;
        let east = north.as_vector().cross(zenith.as_vector());
        Some(Rotation::from_matrix(Matrix3::from_rows(&[
            east.transpose(),
            north.as_vector().transpose(),
            zenith.as_vector().transpose(),
        ])))
    }

    /// Whether the air's horizon hides an apparent direction.
    pub fn is_below_horizon(&self, apparent: &UnitVector<Icrs>) -> bool {
        self.zenith()
            .is_some_and(|zenith| zenith.dot(apparent) < 0.0)
    }

    /// The airmass that light from an apparent direction passes, where the zenith is known and it comes from
    /// above the horizon.
    pub fn airmass(&self, apparent: &UnitVector<Icrs>) -> Option<f64> {
        let zenith_distance_rad = self.zenith()?.angle_to(apparent);
        (zenith_distance_rad < FRAC_PI_2).then(|| airmass_kasten_young(zenith_distance_rad))
    }

    /// Where a star appears.
    #[inline]
    pub fn of(&self, star: &Star) -> UnitVector<Icrs> {
        self.apparent(&star.direction_at(self.years_since_j2000))
    }

    /// Where something appears that is in a direction of the catalogue.
    ///
    /// # References
    /// - Lorentz transformation: Urban & Seidelmann 2013, Explanatory Supplement, eq. 7.40
    /// - Refraction: [`Air`]
    #[inline]
    pub fn apparent(&self, direction: &UnitVector<Icrs>) -> UnitVector<Icrs> {
        let mut seen = *direction;
        if let Some(velocity_c) = &self.velocity_c {
            let inverse_gamma = (1.0 - velocity_c.norm_squared()).sqrt();
            let along = seen.as_vector().dot(velocity_c) / (1.0 + inverse_gamma);
            seen = UnitVector::from_vector(
                seen.as_vector() * inverse_gamma + velocity_c * (1.0 + along),
            );
        }
        self.refracted(&seen)
    }

    /// Where something appears that would appear in this direction without air.
    #[inline]
    pub(crate) fn refracted(&self, airless: &UnitVector<Icrs>) -> UnitVector<Icrs> {
        let mut seen = *airless;
        if let Some(Refraction { air, zenith, .. }) = &self.refraction {
            let cosine = seen.dot(zenith);
            let per_sine = air.refraction_per_sine(cosine);
            let square = per_sine * per_sine * (1.0 - cosine * cosine);
            // The tangent of the refraction, over the sine of the zenith distance.
            let lift = per_sine * (1.0 + square / 3.0);
            let up = zenith.as_vector() - seen.as_vector() * cosine;
            seen = UnitVector::from_vector(seen.as_vector() + up * lift);
        }
        seen
    }

    /// The direction of the catalogue in which something is that appears in this one.
    pub fn astrometric(&self, apparent: &UnitVector<Icrs>) -> UnitVector<Icrs> {
        const CONVERGED_RAD: f64 = 1e-14;
        /// At the horizon a step takes away four fifths of an error.
        const MAX_STEPS: usize = 30;
        if self.are_of_catalog() {
            return *apparent;
        }
        let mut direction = *apparent;
        for _ in 0..MAX_STEPS {
            let off = self.apparent(&direction).as_vector() - apparent.as_vector();
            direction = UnitVector::from_vector(direction.as_vector() - off);
            if off.norm() < CONVERGED_RAD {
                break;
            }
        }
        direction
    }

    /// The attitude relative to some directions, of a camera whose attitude relative to apparent ones is
    /// given.
    pub fn attitude(
        &self,
        apparent: &Rotation<Icrs, Camera>,
        frame: AttitudeFrame,
    ) -> Rotation<Icrs, Camera> {
        match frame {
            AttitudeFrame::Icrs => self.astrometric_attitude(apparent),
            AttitudeFrame::Apparent => *apparent,
        }
    }

    /// The attitude relative to catalogue directions, of a camera whose attitude relative to apparent
    /// ones is given: both see the same in the boresight, and neither is turned about it.
    pub fn astrometric_attitude(
        &self,
        apparent: &Rotation<Icrs, Camera>,
    ) -> Rotation<Icrs, Camera> {
        let boresight = apparent.boresight();
        apparent.turned_to(&self.astrometric(&boresight))
    }

    /// The inverse of [`Self::astrometric_attitude`].
    pub fn apparent_attitude(
        &self,
        astrometric: &Rotation<Icrs, Camera>,
    ) -> Rotation<Icrs, Camera> {
        let boresight = astrometric.boresight();
        astrometric.turned_to(&self.apparent(&boresight))
    }
}

#[cfg(test)]
mod tests;
