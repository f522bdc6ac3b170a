//! A camera that stands still: where it will point, and the sky in frames whose stars are not identified.

use crate::base::coords::{Camera, Horizon, Icrs, Rotation};
use crate::base::neighbors::PointTree;
use crate::base::units::RAD_PER_DEG;
use crate::camera::CameraModel;
use crate::detect::Detections;
use crate::ephemeris::places::StarPlaces;
use crate::identify::{
    Identification, IndexedCatalog, Priors, SkyRegion, SkyView, SourceIndex, StarMatch,
};
use crate::sky::{ClearSky, CurveEvidence, DarkLevel};
use nalgebra::Matrix3;
use std::f64::consts::PI;

/// A camera on a mount that does not move.
#[derive(Debug, Clone)]
pub struct FixedCamera {
    /// Its lens.
    pub camera: CameraModel,
    /// How it stands in the sky of its site: apparent directions, in the axes of the horizon, to camera axes.
    pub pointing: Rotation<Horizon, Camera>,
    /// Standard error of that about each axis, in radians.
    pub sigma_rad: f64,
    /// Standard deviation of the spots of its stars, in pixels.
    pub spot_sigma_px: Option<f64>,
    /// The air and the camera on a clear sky, for frames with too few stars to tell them.
    pub clear_sky: Option<ClearSky>,
    /// The level of a pixel without light, for frames that do not tell it.
    pub dark: Option<DarkLevel>,
    /// What its frames tell of its tone curve.
    pub curves: Option<CurveEvidence>,
}

/// How far from where it is held the boresight is searched for first.
const NEAR_RAD: f64 = RAD_PER_DEG;

impl FixedCamera {
    /// The attitude when the stars are at `places`; `None` where site or time are not known.
    pub fn attitude(&self, places: &StarPlaces) -> Option<Rotation<Icrs, Camera>> {
        let horizon = places.horizon()?;
        Some(Rotation::from_matrix(
            self.pointing.matrix() * horizon.matrix(),
        ))
    }

    /// `priors` with the region in which the boresight is. Regions that are stated stay.
    pub(super) fn near(&self, priors: &Priors, places: &StarPlaces) -> Option<Priors> {
        if priors.near.is_some() {
            return None;
        }
        let near = SkyRegion {
            centre: self.attitude(places)?.boresight(),
            radius_rad: NEAR_RAD,
        };
        Some(Priors {
            near: Some(near),
            ..*priors
        })
    }

    /// What the frame of these detections is if the camera still stands like this: each star is the
    /// nearest detection to its place that no brighter star has.
    pub(super) fn identification(
        &self,
        detections: &Detections,
        places: StarPlaces,
        catalog: &IndexedCatalog,
        size_px: [f64; 2],
    ) -> Option<Identification> {
        let icrs_to_camera = self.attitude(&places)?;
        let camera = self.camera;
        if [camera.width_px, camera.height_px] != size_px {
            return None;
        }
        let view = SkyView {
            camera: &camera,
            icrs_to_camera: &icrs_to_camera,
            places,
        };
        let position_sigma_px = self.sigma_rad * camera.focal_length_px();
        let (matches, radius_px) = paired(&view, detections, catalog, position_sigma_px);
        Some(Identification {
            camera,
            icrs_to_camera,
            places,
            lens_is_known: true,
            attitude_covariance_rad2: Matrix3::from_diagonal_element(self.sigma_rad.powi(2)),
            focal_length_sigma_px: 0.0,
            centre_sigma_px: [0.0; 2],
            excess_sigma_px: 0.0,
            matches,
            rms_px: radius_px,
            log10_false_alarm: 0.0,
        })
    }
}

/// Stars of `view` and the detections that they are, and the distance within which these are sought.
fn paired(
    view: &SkyView,
    detections: &Detections,
    catalog: &IndexedCatalog,
    position_sigma_px: f64,
) -> (Vec<StarMatch>, f64) {
    /// The distance in standard errors, and at least.
    const SIGMAS: f64 = 4.0;
    const MIN_PX: f64 = 1.5;
    let radius_px = (SIGMAS * position_sigma_px).max(MIN_PX);
    let [width_px, height_px] = [view.camera.width_px, view.camera.height_px];
    let density_px2 = detections.sources.len() as f64 / (width_px * height_px);
    let p_chance = 1.0 - libm::exp(-density_px2 * PI * radius_px * radius_px);
    let tree = PointTree::new(detections.sources.iter().map(|source| source.position));
    let mut is_taken = vec![false; detections.sources.len()];
    let mut matches = Vec::new();
    // Brightest first.
    for star in view.stars_to(catalog, catalog.faintest_v_mag()) {
        let mut nearest: Option<(usize, f64)> = None;
        tree.for_each_within(&star.pixel, radius_px, |near| {
            let is_free =
                !is_taken[near.index] && detections.sources[near.index].flags.is_star_like();
            if is_free && nearest.is_none_or(|(_, distance)| near.distance_px < distance) {
                nearest = Some((near.index, near.distance_px));
            }
        });
        let Some((index, residual_px)) = nearest else {
            continue;
        };
        is_taken[index] = true;
        matches.push(StarMatch {
            source: SourceIndex::new(index),
            star: star.star,
            light: star.direction,
            residual_px,
            p_chance,
        });
    }
    matches.sort_by_key(|found| found.source.get());
    (matches, radius_px)
}
