//! Where the catalogue's stars fall in a frame.

use super::indexed_catalog::IndexedCatalog;
use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::camera::{CameraModel, LANES};
use crate::sky::catalog::StarIndex;
use crate::sky::catalog::sky_grid::{GridStar, chord_of};

/// Stars predicted so far outside the frame, in units of its diagonal, may still be seen on it.
const MARGIN: f64 = 0.01;
/// Lenses shift stars by no more than so much of the frame's half diagonal.
const UNDISTORTED_MARGIN: f64 = 0.1;
/// So much further than a view asks for, in units of its radius, stars are gathered: the next view is a little off.
const GATHERED_MARGIN: f64 = 0.04;
/// How much deeper to look where the stars are too few, in magnitudes.
const DEEPER_MAG: f64 = 0.7;

/// A catalogue star where camera and attitude put it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedStar {
    /// Its place in the frame.
    pub pixel: PixelPoint,
    /// Its direction at the time of the frame.
    pub direction: UnitVector<Icrs>,
    /// V magnitude.
    pub v_mag: f32,
    /// The star.
    pub star: StarIndex,
}

/// A camera in its attitude, at a time.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// The camera.
    pub camera: &'a CameraModel,
    /// The attitude.
    pub icrs_to_camera: &'a Rotation<Icrs, Camera>,
    /// When, in Julian years since J2000.0: the stars move.
    pub years_since_j2000: f64,
}

/// So many stars, and all that are so bright.
#[derive(Debug, Clone, Copy)]
pub struct Depth {
    /// How many.
    pub count: usize,
    /// Down to which V magnitude.
    pub v_mag: f64,
}

/// Catalogue stars around a direction: a field's are predicted many times, and looked up once.
#[derive(Debug, Default)]
pub struct Surroundings {
    /// Brightest first.
    stars: Vec<GridStar>,
    around: Option<Gathered>,
}

/// What was gathered.
#[derive(Debug, Clone, Copy)]
struct Gathered {
    centre: UnitVector<Icrs>,
    radius_rad: f64,
    faintest_v_mag: f64,
}

impl View<'_> {
    /// The catalogue stars in the frame, or within 1 % of its diagonal of it, down to a V magnitude, brightest first.
    pub fn stars_to(&self, sky: &IndexedCatalog, faintest_v_mag: f64) -> Vec<PredictedStar> {
        let mut predicted = Vec::new();
        Surroundings::default().stars_to(self, sky, faintest_v_mag, &mut predicted);
        predicted
    }

    /// The largest angle from the boresight at which there are stars of the frame.
    fn reach_rad(&self) -> f64 {
        self.camera.radius_rad() * (1.0 + 2.0 * MARGIN)
    }

    fn boresight(&self) -> UnitVector<Icrs> {
        self.icrs_to_camera.inverse().apply(&UnitVector::BORESIGHT)
    }
}

impl Surroundings {
    /// Makes `predicted` the stars of [`View::stars_to`].
    pub fn stars_to(
        &mut self,
        view: &View,
        sky: &IndexedCatalog,
        faintest_v_mag: f64,
        predicted: &mut Vec<PredictedStar>,
    ) {
        self.gather(view, sky, faintest_v_mag);
        let bright_enough = self
            .stars
            .partition_point(|star| star.v_mag <= faintest_v_mag as f32);
        let all = Depth {
            count: usize::MAX,
            v_mag: faintest_v_mag,
        };
        project(view, (sky, &self.stars[..bright_enough]), &all, predicted);
    }

    /// Makes `predicted` the brightest stars of [`View::stars_to`] to the depth `least`, or all of the catalogue's there are;
    /// most likely the count is brighter than `likely_v_mag`.
    pub fn stars_at_least(
        &mut self,
        view: &View,
        sky: &IndexedCatalog,
        (least, likely_v_mag): (Depth, f64),
        predicted: &mut Vec<PredictedStar>,
    ) {
        let mut limit = likely_v_mag.max(least.v_mag);
        loop {
            let gathered_to = self.gather(view, sky, limit);
            project(view, (sky, &self.stars), &least, predicted);
            if predicted.len() >= least.count || gathered_to > sky.faintest_v_mag() {
                return;
            }
            limit = gathered_to + DEEPER_MAG;
        }
    }

    /// Sees to it that all stars of `view` to a V magnitude are here; returns to which they are.
    fn gather(&mut self, view: &View, sky: &IndexedCatalog, faintest_v_mag: f64) -> f64 {
        let (centre, reach_rad) = (view.boresight(), view.reach_rad());
        let covers =
            |around: &Gathered| around.centre.angle_to(&centre) + reach_rad <= around.radius_rad;
        let around = self.around.filter(covers).unwrap_or_else(|| {
            self.stars.clear();
            Gathered {
                centre,
                radius_rad: reach_rad * (1.0 + GATHERED_MARGIN),
                faintest_v_mag: f64::NEG_INFINITY,
            }
        });
        if around.faintest_v_mag >= faintest_v_mag {
            return around.faintest_v_mag;
        }
        let (known, known_to) = (self.stars.len(), around.faintest_v_mag as f32);
        let Gathered {
            centre, radius_rad, ..
        } = around;
        sky.grid
            .for_each_within(&centre, radius_rad, faintest_v_mag as f32, |star| {
                if star.v_mag > known_to {
                    self.stars.push(*star);
                }
            });
        self.stars[known..].sort_unstable_by_key(|star| star.catalog);
        self.around = Some(Gathered {
            faintest_v_mag,
            ..around
        });
        faintest_v_mag
    }

    /// To be called where another catalogue may be next.
    pub fn forget(&mut self) {
        self.around = None;
    }
}

/// Makes `predicted` those of `stars`, brightest first, that are in the frame or nearly so, until there are so many that are so faint.
fn project(
    view: &View,
    (sky, stars): (&IndexedCatalog, &[GridStar]),
    least: &Depth,
    predicted: &mut Vec<PredictedStar>,
) {
    let camera = view.camera;
    let margin_px = MARGIN * camera.width_px.hypot(camera.height_px);
    // The cone is rounder than the frame: most of what it holds beside it needs no closer look.
    let nearly_px = margin_px + UNDISTORTED_MARGIN * camera.radius_px();
    let reach = [camera.width_px, camera.height_px]
        .map(|extent_px| (0.5 * extent_px + nearly_px) / camera.focal_length_px);
    let (boresight, chord) = (view.boresight(), chord_of(view.reach_rad()));
    let is_near = |star: &&GridStar| {
        let d = view.icrs_to_camera.matrix() * star.vector();
        d.z > 0.0 && d.x.abs() <= reach[0] * d.z && d.y.abs() <= reach[1] * d.z
    };
    let mut near = stars
        .iter()
        .filter(is_near)
        .filter(|star| star.is_within(boresight.as_vector(), chord * chord));
    predicted.clear();
    loop {
        let mut lanes = [None; LANES];
        for (lane, star) in lanes.iter_mut().zip(&mut near) {
            *lane = Some(star);
        }
        // One after the other without any decision: the memory of all is waited for at once.
        let directions = lanes.map(|lane| {
            lane.map_or(boresight, |star: &GridStar| {
                sky.stars()[star.catalog as usize].direction_at(view.years_since_j2000)
            })
        });
        let in_camera = directions.map(|direction| view.icrs_to_camera.apply(&direction));
        for ((lane, direction), pixel) in lanes
            .iter()
            .zip(directions)
            .zip(camera.pixels_of(&in_camera))
        {
            let Some(star) = lane else {
                return;
            };
            let Some(pixel) = pixel.filter(|p| camera.nearly_contains(p, margin_px)) else {
                continue;
            };
            if predicted.len() >= least.count && f64::from(star.v_mag) > least.v_mag {
                return;
            }
            predicted.push(PredictedStar {
                pixel,
                direction,
                v_mag: star.v_mag,
                star: StarIndex::from(star.catalog),
            });
        }
    }
}
