//! The parts into which the sky over a frame is divided.

use crate::base::coords::{Icrs, PixelPoint, UnitVector};
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::camera::CameraModel;
use crate::ephemeris::places::StarPlaces;
use crate::identify::Identification;
use crate::photometry::IdentifiedFrame;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Breadth of a ring of altitude.
const RING_DEG: f64 = 5.0;
/// Number of rings from the horizon to the zenith.
const RINGS: usize = 18;
/// Angle from the axis to the corners from which on a field is divided by altitude.
const WIDE_RAD: f64 = 30.0 * RAD_PER_DEG;
/// Cells along the longer side of a field that is not.
const CELLS_ALONG: f64 = 8.0;
/// How far around the centre of a cell its stars are, in breadths of a cell,
const REACH: f64 = 1.2;
/// and the standard deviation of their weights.
const WEIGHT_SIGMA: f64 = 0.45;
/// Cells that the same stars tell of: the area of two such weights together, over that of a cell.
pub(super) const CELLS_OF_A_STAR: f64 = 4.0 * PI * WEIGHT_SIGMA * WEIGHT_SIGMA;

/// Where a part of the sky is.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Place {
    /// Between two altitudes and two azimuths, in degrees; the azimuth is from north through east.
    Horizon {
        /// From, to.
        altitude_deg: [f64; 2],
        /// From, to.
        azimuth_deg: [f64; 2],
    },
    /// In a rectangle of the frame.
    Frame {
        /// From, to, in pixels.
        x: [f64; 2],
        /// From, to, in pixels.
        y: [f64; 2],
    },
}

/// The horizon's axes.
struct HorizonAxes {
    zenith: UnitVector<Icrs>,
    north: UnitVector<Icrs>,
    east: UnitVector<Icrs>,
}

/// Whether a field is divided by altitude, where the horizon is known.
pub(crate) fn is_wide(camera: &CameraModel) -> bool {
    camera.radius_rad() > WIDE_RAD
}

/// The parts into which the sky above the horizon is divided, from the horizon up.
pub fn horizon_places() -> Vec<Place> {
    let ring = |ring: usize| {
        let count = cells_in_ring(ring);
        let breadth_deg = 360.0 / count as f64;
        (0..count).map(move |cell| Place::Horizon {
            altitude_deg: [ring as f64, ring as f64 + 1.0].map(|at| at * RING_DEG),
            azimuth_deg: [cell as f64, cell as f64 + 1.0].map(|at| at * breadth_deg),
        })
    };
    (0..RINGS).flat_map(ring).collect()
}

/// The parts of the sky over a frame.
pub(super) struct SkyCellGrid<'a> {
    found: &'a Identification,
    /// Each part.
    pub places: Vec<Place>,
    /// The apparent direction of the centre of each; `None` where the lens images nothing.
    centers: Vec<Option<UnitVector<Icrs>>>,
    /// Angle of the breadth of a cell.
    breadth_rad: f64,
    horizon: Option<HorizonAxes>,
    /// Rows and columns of a frame's cells.
    size: [usize; 2],
}

impl<'a> SkyCellGrid<'a> {
    /// The parts of the sky over `frame`.
    pub(super) fn over(frame: &IdentifiedFrame<'a>) -> Self {
        let found = frame.identification;
        match HorizonAxes::of(&frame.identification.places).filter(|_| is_wide(&found.camera)) {
            Some(horizon) => Self::of_horizon(found, horizon, &frame.identification.places),
            None => Self::of_frame(found),
        }
    }

    fn of_horizon(found: &'a Identification, horizon: HorizonAxes, places: &StarPlaces) -> Self {
        let cells = horizon_places();
        let center = |place: &Place| match place {
            Place::Horizon {
                altitude_deg,
                azimuth_deg,
            } => {
                let middle_rad = |range: &[f64; 2]| 0.5 * (range[0] + range[1]) * RAD_PER_DEG;
                places.in_horizon(middle_rad(azimuth_deg), middle_rad(altitude_deg))
            }
            Place::Frame { .. } => None,
        };
        let centers = cells.iter().map(center).collect();
        Self {
            found,
            places: cells,
            centers,
            breadth_rad: RING_DEG * RAD_PER_DEG,
            horizon: Some(horizon),
            size: [0, 0],
        }
    }

    fn of_frame(found: &'a Identification) -> Self {
        let camera = &found.camera;
        let (width, height) = (camera.width_px, camera.height_px);
        let cell_px = width.max(height) / CELLS_ALONG;
        let [rows, columns] =
            [height, width].map(|side| ((side / cell_px).round() as usize).max(1));
        let mut grid = Self {
            found,
            places: Vec::new(),
            centers: Vec::new(),
            breadth_rad: cell_px / camera.focal_length_px(),
            horizon: None,
            size: [rows, columns],
        };
        for row in 0..rows {
            for column in 0..columns {
                let range = |at: usize, count: usize, side: f64| {
                    [at as f64, at as f64 + 1.0].map(|at| at * side / count as f64 - 0.5)
                };
                let (x, y) = (range(column, columns, width), range(row, rows, height));
                let middle = PixelPoint::new(0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]));
                grid.centers.push(grid.direction_of(&middle));
                grid.places.push(Place::Frame { x, y });
            }
        }
        grid
    }

    /// The camera.
    pub(super) fn camera(&self) -> &CameraModel {
        &self.found.camera
    }

    /// The apparent direction that is imaged at a place.
    pub(super) fn direction_of(&self, pixel: &PixelPoint) -> Option<UnitVector<Icrs>> {
        self.found.apparent_direction_of(pixel)
    }

    /// The cell at a place that is imaged in an apparent direction; `None` below the horizon.
    pub(super) fn cell_of(
        &self,
        pixel: &PixelPoint,
        direction: &UnitVector<Icrs>,
    ) -> Option<usize> {
        let Some(horizon) = &self.horizon else {
            let [rows, columns] = self.size;
            let along = |at: f64, side: f64, count: usize| {
                (((at + 0.5) / side * count as f64).max(0.0) as usize).min(count - 1)
            };
            let camera = self.camera();
            let row = along(pixel.y, camera.height_px, rows);
            return Some(row * columns + along(pixel.x, camera.width_px, columns));
        };
        let altitude_deg = (FRAC_PI_2 - horizon.zenith.angle_to(direction)) * DEG_PER_RAD;
        if altitude_deg < 0.0 {
            return None;
        }
        let ring = ((altitude_deg / RING_DEG) as usize).min(RINGS - 1);
        let count = cells_in_ring(ring);
        let azimuth_rad = libm::atan2(horizon.east.dot(direction), horizon.north.dot(direction));
        let turn = (azimuth_rad / TAU).rem_euclid(1.0);
        let before: usize = (0..ring).map(cells_in_ring).sum();
        Some(before + ((turn * count as f64) as usize).min(count - 1))
    }

    /// Where the centre of a cell is in the frame.
    pub(super) fn pixel_of(&self, cell: usize) -> Option<PixelPoint> {
        let direction = self.centers[cell]?;
        let in_camera = self.found.icrs_to_camera.apply(&direction);
        self.camera().pixel_of(&in_camera)
    }

    /// Whether a direction is so near a cell's centre, in reaches of a cell.
    pub(super) fn is_near(&self, cell: usize, direction: &UnitVector<Icrs>, reaches: f64) -> bool {
        let reach_rad = reaches * REACH * self.breadth_rad;
        self.distance_sq(cell, direction)
            .is_some_and(|distance_sq| distance_sq < reach_rad * reach_rad)
    }

    /// The cells whose centres are so near that of a cell, in reaches of a cell; itself, too.
    pub(super) fn cells_near(&self, cell: usize, reaches: f64) -> impl Iterator<Item = usize> {
        let centers = self.centers.iter().enumerate();
        centers.filter_map(move |(other, center)| {
            self.is_near(cell, center.as_ref()?, reaches)
                .then_some(other)
        })
    }

    fn distance_sq(&self, cell: usize, direction: &UnitVector<Icrs>) -> Option<f64> {
        Some(2.0 - 2.0 * self.centers[cell]?.dot(direction))
    }

    /// How much a star in a direction tells of a cell: 1 at its centre; `None` if it is far away.
    pub(super) fn weight(&self, cell: usize, direction: &UnitVector<Icrs>) -> Option<f64> {
        let reach_rad = REACH * self.breadth_rad;
        let distance_sq = self.distance_sq(cell, direction)?;
        (distance_sq < reach_rad * reach_rad).then(|| {
            let sigmas_sq = distance_sq / (WEIGHT_SIGMA * self.breadth_rad).powi(2);
            libm::exp(-0.5 * sigmas_sq)
        })
    }
}

impl HorizonAxes {
    fn of(places: &StarPlaces) -> Option<Self> {
        Some(Self {
            zenith: places.in_horizon(0.0, FRAC_PI_2)?,
            north: places.in_horizon(0.0, 0.0)?,
            east: places.in_horizon(FRAC_PI_2, 0.0)?,
        })
    }
}

/// Cells in a ring: about as broad as high.
fn cells_in_ring(ring: usize) -> usize {
    let altitude_rad = (ring as f64 + 0.5) * RING_DEG * RAD_PER_DEG;
    (360.0 / RING_DEG * libm::cos(altitude_rad))
        .round()
        .max(1.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_have_cells_that_are_about_as_broad_as_high() {
        let all: usize = (0..RINGS).map(cells_in_ring).sum();
        assert_eq!(cells_in_ring(0), 72);
        assert_eq!(cells_in_ring(RINGS - 1), 3);
        assert!((800..850).contains(&all), "{all}");
    }
}
