//! Predicts the positions of catalogue stars in a frame.

use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::camera::CameraModel;
use crate::catalog::StarIndex;
use crate::catalog::sky_grid::{GridStar, chord_of};
use crate::ephemeris::places::StarPlaces;
use crate::identify::index::IndexedCatalog;

/// Margin outside the frame, in units of its diagonal, within which a predicted star may still be
/// observed.
const MARGIN: f64 = 0.01;
/// Stars whose directions are looked up together, so that the memory accesses overlap.
const LANES: usize = 8;
/// Margin around a view, in units of its radius, within which stars are gathered, as the next view
/// differs a little.
const GATHERED_MARGIN: f64 = 0.04;
/// Room in the first, rough test of a star, in margins.
const NEAR: f64 = 3.0;
/// Magnitudes to go deeper where the stars are too few.
const DEEPER_MAG: f64 = 0.7;

/// A catalogue star at its predicted position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedStar {
    /// Position in the frame.
    pub pixel: PixelPoint,
    /// Apparent direction.
    pub direction: UnitVector<Icrs>,
    /// V magnitude.
    pub v_mag: f32,
    /// The star.
    pub star: StarIndex,
}

/// A camera, its attitude, and where stars appear.
#[derive(Debug, Clone, Copy)]
pub struct SkyView<'a> {
    /// The camera.
    pub camera: &'a CameraModel,
    /// The attitude.
    pub icrs_to_camera: &'a Rotation<Icrs, Camera>,
    /// Where the catalogue's stars appear.
    pub places: StarPlaces,
}

/// How deep to predict: at least a number of stars, and all to a magnitude.
#[derive(Debug, Clone, Copy)]
pub struct PredictionDepth {
    /// Number of stars.
    pub count: usize,
    /// V magnitude.
    pub v_mag: f64,
}

/// Catalogue stars around a direction: looked up once, predicted many times.
#[derive(Debug, Default)]
pub struct Surroundings {
    /// Brightest first.
    stars: Vec<GridStar>,
    /// Those just found.
    found: Vec<StarIndex>,
    around: Option<GatheredRegion>,
}

/// The region and depth that were gathered.
#[derive(Debug, Clone, Copy)]
struct GatheredRegion {
    centre: UnitVector<Icrs>,
    radius_rad: f64,
    faintest_v_mag: f64,
}

impl SkyView<'_> {
    /// The catalogue stars in the frame, or within 1 % of its diagonal outside it, down to a V
    /// magnitude, brightest first.
    pub fn stars_to(&self, sky: &IndexedCatalog, faintest_v_mag: f64) -> Vec<PredictedStar> {
        let mut predicted = Vec::new();
        Surroundings::default().stars_to(self, sky, faintest_v_mag, &mut predicted);
        predicted
    }

    /// Largest angle between the boresight and a star in the frame.
    fn reach_rad(&self) -> f64 {
        self.camera.radius_rad() * (1.0 + 2.0 * MARGIN)
    }

    fn boresight(&self) -> UnitVector<Icrs> {
        self.icrs_to_camera.inverse().apply(&UnitVector::BORESIGHT)
    }
}

impl Surroundings {
    /// Fills `predicted` with the stars of [`SkyView::stars_to`].
    pub fn stars_to(
        &mut self,
        view: &SkyView,
        sky: &IndexedCatalog,
        faintest_v_mag: f64,
        predicted: &mut Vec<PredictedStar>,
    ) {
        self.gather(view, sky, faintest_v_mag);
        let bright_enough = self
            .stars
            .partition_point(|star| star.v_mag <= faintest_v_mag as f32);
        let all = PredictionDepth {
            count: usize::MAX,
            v_mag: faintest_v_mag,
        };
        project(view, sky, &self.stars[..bright_enough], &all, predicted);
    }

    /// Fills `predicted` with the brightest stars of [`SkyView::stars_to`] to the depth `least`, or
    /// with all that the catalogue has. The search starts at `likely_v_mag`.
    pub fn stars_at_least(
        &mut self,
        view: &SkyView,
        sky: &IndexedCatalog,
        least: PredictionDepth,
        likely_v_mag: f64,
        predicted: &mut Vec<PredictedStar>,
    ) {
        let mut limit = likely_v_mag.max(least.v_mag);
        loop {
            let gathered_to = self.gather(view, sky, limit);
            project(view, sky, &self.stars, &least, predicted);
            if predicted.len() >= least.count || gathered_to > sky.faintest_v_mag() {
                return;
            }
            limit = gathered_to + DEEPER_MAG;
        }
    }

    /// Gathers all stars of `view` down to a V magnitude; returns the magnitude reached.
    fn gather(&mut self, view: &SkyView, sky: &IndexedCatalog, faintest_v_mag: f64) -> f64 {
        let (centre, reach_rad) = (view.boresight(), view.reach_rad());
        let covers = |around: &GatheredRegion| {
            around.centre.angle_to(&centre) + reach_rad <= around.radius_rad
        };
        let around = self.around.filter(covers).unwrap_or_else(|| {
            self.stars.clear();
            GatheredRegion {
                centre,
                radius_rad: reach_rad * (1.0 + GATHERED_MARGIN),
                faintest_v_mag: f64::NEG_INFINITY,
            }
        });
        if around.faintest_v_mag >= faintest_v_mag {
            return around.faintest_v_mag;
        }
        let known_to = around.faintest_v_mag as f32;
        self.found.clear();
        let GatheredRegion {
            centre, radius_rad, ..
        } = around;
        sky.grid
            .for_each_within(&centre, radius_rad, faintest_v_mag as f32, |star| {
                if star.v_mag > known_to {
                    self.found.push(star.index);
                }
            });
        self.found.sort_unstable();
        let found = self
            .found
            .iter()
            .map(|index| *sky.grid.star(index.get() as u32));
        self.stars.extend(found);
        self.around = Some(GatheredRegion {
            faintest_v_mag,
            ..around
        });
        faintest_v_mag
    }

    /// Forgets the stars: call it when the catalogue may change.
    pub fn forget(&mut self) {
        self.around = None;
    }
}

/// Largest tangents of the angles from the boresight, along x and y, of what a pinhole sees on its frame
/// and nearly so. `None` where it does not see all of the frame, and for other lenses.
fn tangent_reach(camera: &CameraModel, margin_px: f64) -> Option<[f64; 2]> {
    if !camera.is_pinhole() {
        return None;
    }
    let centre = camera.centre();
    let [top_left, .., bottom_right] = camera.corners();
    let columns = [top_left.x, centre.x, bottom_right.x];
    let rows = [top_left.y, centre.y, bottom_right.y];
    let mut reach = [0.0_f64; 2];
    for x in columns {
        for y in rows {
            let direction = camera.direction_of(&PixelPoint::new(x, y))?;
            let d = direction.as_vector();
            if d.z <= 0.0 {
                return None;
            }
            reach = [
                reach[0].max((d.x / d.z).abs()),
                reach[1].max((d.y / d.z).abs()),
            ];
        }
    }
    // Between these places a border may bulge.
    let margin = NEAR * margin_px / camera.focal_length_px();
    Some(reach.map(|along| along + margin))
}

/// Fills `predicted` with those of `stars` (brightest first) that lie in the frame or nearly so,
/// until both the number and the magnitude of `least` are reached.
fn project(
    view: &SkyView,
    sky: &IndexedCatalog,
    stars: &[GridStar],
    least: &PredictionDepth,
    predicted: &mut Vec<PredictedStar>,
) {
    let camera = view.camera;
    let margin_px = MARGIN * libm::hypot(camera.width_px, camera.height_px);
    let (boresight, chord) = (view.boresight(), chord_of(view.reach_rad()));
    // The cone is larger than the frame: a quick test rejects most stars outside it.
    let reach = tangent_reach(camera, margin_px);
    let is_near = |star: &&GridStar| {
        let d = view.icrs_to_camera.matrix() * star.vector();
        reach.is_none_or(|[x, y]| d.z > 0.0 && d.x.abs() <= x * d.z && d.y.abs() <= y * d.z)
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
        // No branches here, so that the memory accesses overlap.
        let directions = lanes.map(|lane| {
            lane.map_or(boresight, |star: &GridStar| {
                view.places.of(&sky.stars()[star.index.get()])
            })
        });
        for (lane, direction) in lanes.iter().zip(directions) {
            let Some(star) = lane else {
                return;
            };
            let pixel = camera.pixel_of(&view.icrs_to_camera.apply(&direction));
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
                star: star.index,
            });
        }
    }
}
