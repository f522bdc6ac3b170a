//! The frame of a list of centroids: its size, and where its centre may be if nobody states that size.
//!
//! Coordinates count from the frame's first pixel, so a frame is at least as large as its centroids
//! reach. How much larger it is, is told by
//!
//! - the gaps at its borders: centroids all over a frame of width W leave W / N at a border;
//! - the stars themselves, where the field is wide: they tell where the axis of the lens is, and that is
//!   near the centre of the frame.
//!
//! A list may be of a part of its frame, which the gaps do not show: half of the lists are taken to be such.

use super::list::CentroidList;
use super::table::{CentroidListError, check_inside};
use crate::base::least_squares::huber_sigma;
use crate::base::size::Size;
use crate::camera::{DistortionModel, agreed_size};
use crate::identify::fit::{JointFrame, MeasuredStar, fit_jointly};
use crate::identify::{Identification, UnknownCentre};
use nalgebra::Vector2;

/// How far the axis of a lens is from the centre of its frames: standard deviation on each axis, in units of
/// half the diagonal.
const USUAL_AXIS: f64 = 0.03;

/// The size of the frame of a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ListFrame {
    pub size: Size,
    /// Whether its width and its height are guesses: as far as the centroids reach.
    pub is_guessed: [bool; 2],
}

impl ListFrame {
    /// The frame of usable centroids, taken by a camera whose frames have one of `sizes`.
    pub fn from_list(list: &CentroidList, sizes: &[Size]) -> Result<Self, CentroidListError> {
        let stated = agreed_size([list.width, list.height], sizes)?;
        for centroid in &list.centroids {
            check_inside(&centroid.position, stated)
                .map_err(|problem| CentroidListError::of_row(centroid.row, problem))?;
        }
        Ok(Self {
            size: list.reached_size(stated),
            is_guessed: stated.map(|side| side.is_none()),
        })
    }

    /// Adds to the errors of an identified frame of guessed size that its centre is not known.
    pub fn add_unknown_centre(&self, list: &CentroidList, found: &mut Identification) {
        if self.is_guessed == [false; 2] {
            return;
        }
        let axis = lens_axis(list, found);
        let [x, y] = [0, 1].map(|along| {
            if !self.is_guessed[along] {
                return Beyond::default();
            }
            let reach = CentroidExtent {
                gap_px: list.reach_px(along)[0].max(0.0),
                side_px: self.size.sides()[along] as f64,
                stars: list.centroids.len(),
            };
            reach.centre_beyond(axis.map(|axis| axis[along]))
        });
        found.add_unknown_centre(&UnknownCentre {
            mean_px: Vector2::new(x.mean_px, y.mean_px),
            square_px2: Vector2::new(x.square_px2, y.square_px2),
            axis_sigma_px: USUAL_AXIS * found.camera.radius_px(),
        });
    }
}

/// A quantity with its standard error, in pixels.
#[derive(Debug, Clone, Copy)]
struct Measure {
    value_px: f64,
    sigma_px: f64,
}

/// How far the centroids of a list reach along one axis.
struct CentroidExtent {
    /// What they leave free before the first.
    gap_px: f64,
    /// As far as they reach.
    side_px: f64,
    stars: usize,
}

/// How far the centre of a frame lies beyond that of its centroids, along one axis: mean, and mean square.
#[derive(Debug, Clone, Copy, Default)]
struct Beyond {
    mean_px: f64,
    square_px2: f64,
}

impl CentroidExtent {
    /// `axis` is where the stars see the axis of the lens, from the centre of the guessed frame.
    fn centre_beyond(&self, axis: Option<Measure>) -> Beyond {
        /// Steps of the probability of a frame that is whole, and of one that is not.
        const STEPS: u32 = 400;
        /// A list of a part has at least this much of its frame.
        const MIN_PART: f64 = 1.0 / 3.0;
        // The gap at the other border, at the least as the mean of such gaps.
        let gap_px = self.gap_px + self.side_px / self.stars.max(1) as f64;
        let offsets = (0..STEPS).flat_map(|step| {
            let share = (f64::from(step) + 0.5) / f64::from(STEPS);
            let whole_px = -gap_px * libm::log(share) / 2.0;
            let part = MIN_PART + share * (1.0 - MIN_PART);
            [whole_px, self.side_px * (1.0 / part - 1.0) / 2.0]
        });
        let misfit = |offset_px: f64| {
            axis.map_or(0.0, |axis| {
                ((axis.value_px - offset_px) / axis.sigma_px).powi(2)
            })
        };
        let least = offsets.clone().map(misfit).fold(f64::INFINITY, f64::min);
        let mut sums = [0.0; 3];
        for offset_px in offsets {
            let weight = libm::exp((least - misfit(offset_px)) / 2.0);
            for (power, sum) in sums.iter_mut().enumerate() {
                *sum += weight * offset_px.powi(power as i32);
            }
        }
        Beyond {
            mean_px: sums[1] / sums[0],
            square_px2: sums[2] / sums[0],
        }
    }
}

/// Where the stars see the axis of the lens, from the centre of the guessed frame along x and y, with the
/// error as a measure of the frame's centre; `None` where they do not tell it, or the lens is no pinhole.
fn lens_axis(list: &CentroidList, found: &Identification) -> Option<[Measure; 2]> {
    /// What the model of a lens misses in the corners. A tilt moves stars there by the axis's offset times
    /// the square of their angle, so in narrow fields it may look like one.
    const MISSED_PX: f64 = 0.5;
    /// The places of the axis in the covariance, after ln f and three radial terms.
    const AXIS: [usize; 2] = [4, 5];
    if !found.camera.is_pinhole() {
        return None;
    }
    let stars = found.matches.iter().map(|named| {
        let centroid = &list.centroids[named.source.get()];
        let sigma_px = libm::hypot(centroid.error_px(), found.excess_sigma_px);
        MeasuredStar {
            pixel: centroid.position,
            icrs: named.light,
            sigma_px: huber_sigma(sigma_px, named.residual_px),
        }
    });
    let frame = JointFrame {
        stars: stars.collect(),
        icrs_to_camera: found.icrs_to_camera,
    };
    let model = Some(DistortionModel::BrownConrady);
    let fit = fit_jointly(&[frame], &found.camera, model)?;
    let (axis, centre) = (fit.camera.axis(), fit.camera.centre());
    let radius_px = fit.camera.radius_px();
    let radius_rad = radius_px / fit.camera.focal_length_px();
    let sigma_px = libm::hypot(
        USUAL_AXIS * radius_px,
        MISSED_PX / (radius_rad * radius_rad),
    );
    let measure = |value_px: f64, parameter: usize| Measure {
        value_px,
        sigma_px: libm::hypot(fit.covariance[(parameter, parameter)].sqrt(), sigma_px),
    };
    Some([
        measure(axis.x - centre.x, AXIS[0]),
        measure(axis.y - centre.y, AXIS[1]),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    const REACH: CentroidExtent = CentroidExtent {
        gap_px: 5.0,
        side_px: 1000.0,
        stars: 100,
    };

    #[test]
    fn without_an_axis_the_list_may_be_of_a_part() {
        let beyond = REACH.centre_beyond(None);
        let sigma_px = beyond.square_px2.sqrt();
        assert!((250.0..350.0).contains(&sigma_px), "{sigma_px}");
        assert!(beyond.mean_px < sigma_px);
    }

    #[test]
    fn an_axis_that_is_known_tells_whether_the_frame_is_whole() {
        let at = |value_px: f64| {
            let sigma_px = 30.0;
            REACH.centre_beyond(Some(Measure { value_px, sigma_px }))
        };
        let whole_px = at(0.0).square_px2.sqrt();
        assert!(whole_px < 20.0, "{whole_px}");
        let part = at(500.0);
        assert!((part.mean_px - 500.0).abs() < 30.0, "{part:?}");
        assert!((part.square_px2.sqrt() - 500.0).abs() < 30.0, "{part:?}");
        // Farther off than any part has it.
        assert!(at(1e5).square_px2.is_finite() && at(-1e5).square_px2 < 100.0);
    }
}
