//! Is a lens that a file describes one that can be?

use super::distortion::Distortion;
use super::model::CameraModel;
use crate::base::coords::PixelPoint;
use crate::base::units::DEG_PER_RAD;

/// Why no camera has such a lens.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImplausibleLens {
    /// The focal length, or a term of the distortion, is no number for such a frame.
    #[error(
        "the focal length is {found_px:e} px; expected {low_px:.1} to {high_px:.3e} px for a frame of this size"
    )]
    FocalLength {
        /// What the file has.
        found_px: f64,
        /// The least.
        low_px: f64,
        /// The largest.
        high_px: f64,
    },
    /// The axis of the lens is far from the frame.
    #[error(
        "the axis of the lens is at ({x_px:.1}, {y_px:.1}) px; expected a position on the frame, or outside it by up to half its size"
    )]
    Axis {
        /// Along the rows.
        x_px: f64,
        /// Along the columns.
        y_px: f64,
    },
    /// The picture is stretched.
    #[error(
        "the ratio of the focal lengths along two directions of the frame is {ratio:.3}; expected square \
         pixels, within 25 %"
    )]
    Stretch {
        /// The larger one over the other.
        ratio: f64,
    },
    /// The distortion images two directions at one place.
    #[error(
        "the distortion is not monotonic: at {angle_deg:.2}° from the axis, ({x_px:.0}, {y_px:.0}) px, the \
         image folds back; reduce the distortion, or set valid_to_deg to the angle up to which the lens is \
         known"
    )]
    Fold {
        /// The last angle from the axis that is imaged there.
        angle_deg: f64,
        /// Where it is imaged.
        x_px: f64,
        /// Where it is imaged.
        y_px: f64,
    },
}

impl CameraModel {
    /// Whether such a camera can be.
    ///
    /// # Errors
    /// [`ImplausibleLens`] for focal lengths, axes, stretches and distortions that no lens has.
    pub fn check(&self) -> Result<(), ImplausibleLens> {
        self.check_frame()?;
        let axis = self.axis();
        self.border().try_for_each(|end| self.check_fold(axis, end))
    }

    /// [`check`](Self::check), but for a distortion that folds the picture.
    pub(crate) fn check_frame(&self) -> Result<(), ImplausibleLens> {
        /// Focal lengths in half diagonals of the frame: from beyond any fisheye to fields of 2″.
        const FOCAL_LENGTHS: [f64; 2] = [0.02, 2e5];
        /// The ratio of the focal lengths along two directions.
        const MAX_STRETCH: f64 = 1.25;
        let [low_px, high_px] = FOCAL_LENGTHS.map(|of_radius| of_radius * self.radius_px());
        let found_px = self.focal_length_px();
        if !(low_px..=high_px).contains(&found_px) {
            return Err(ImplausibleLens::FocalLength {
                found_px,
                low_px,
                high_px,
            });
        }
        let axis = self.axis();
        let is_near = |along: f64, side: f64| (-0.5 * side..=1.5 * side).contains(&along);
        if !is_near(axis.x, self.width_px) || !is_near(axis.y, self.height_px) {
            return Err(ImplausibleLens::Axis {
                x_px: axis.x,
                y_px: axis.y,
            });
        }
        let ratio = self.focal_length_ratio();
        if !(1.0..=MAX_STRETCH).contains(&ratio) {
            return Err(ImplausibleLens::Stretch { ratio });
        }
        Ok(())
    }

    /// The largest focal length over the smallest, of all directions on the frame.
    fn focal_length_ratio(&self) -> f64 {
        let distortion = self.distortion();
        let [stretch, skew] = distortion.map_or([0.0; 2], Distortion::stretch);
        let most = libm::hypot(stretch, skew);
        (1.0 + most) / (1.0 - most)
    }

    /// Pixels on the border of the frame.
    fn border(&self) -> impl Iterator<Item = PixelPoint> {
        const PARTS: u32 = 12;
        let [right, bottom] = [self.width_px - 0.5, self.height_px - 0.5];
        let around = [[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]];
        let corners = around.map(|[x, y]| PixelPoint::new(x, y));
        (0..4).flat_map(move |side| {
            let (from, to) = (corners[side], corners[(side + 1) % 4]);
            (0..PARTS).map(move |part| between(from, to, f64::from(part) / f64::from(PARTS)))
        })
    }

    /// Angles from the axis grow from there to the `end`, or to where the lens is known.
    fn check_fold(&self, axis: PixelPoint, end: PixelPoint) -> Result<(), ImplausibleLens> {
        const STEPS: u32 = 32;
        const BISECTIONS: u32 = 20;
        /// Nothing is known beyond this share of the largest angle.
        const NEARLY: f64 = 0.999;
        // Terms that are too large for numbers image nothing, not even the axis.
        let on_axis = self.direction_of(&axis);
        let angle_at = |share: f64| {
            let direction = self.direction_of(&between(axis, end, share))?;
            Some(direction.angle_to(on_axis.as_ref()?))
        };
        let mut last = [0.0, 0.0];
        for step in 1..=STEPS {
            let share = f64::from(step) / f64::from(STEPS);
            let beyond = |[_, last_rad]: [f64; 2], share: f64| {
                angle_at(share).filter(|angle_rad| *angle_rad > last_rad)
            };
            if let Some(angle_rad) = beyond(last, share) {
                last = [share, angle_rad];
                continue;
            }
            let mut range = [last[0], share];
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (range[0] + range[1]);
                match beyond(last, middle) {
                    Some(angle_rad) => (range[0], last) = (middle, [middle, angle_rad]),
                    None => range[1] = middle,
                }
            }
            if last[1] >= NEARLY * self.max_angle_rad() {
                return Ok(());
            }
            let place = between(axis, end, last[0]);
            return Err(ImplausibleLens::Fold {
                angle_deg: last[1] * DEG_PER_RAD,
                x_px: place.x,
                y_px: place.y,
            });
        }
        Ok(())
    }
}

fn between(from: PixelPoint, to: PixelPoint, share: f64) -> PixelPoint {
    PixelPoint::new(
        from.x + share * (to.x - from.x),
        from.y + share * (to.y - from.y),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Distortion, DistortionModel, Projection};

    fn camera(model: DistortionModel, terms_px: &[f64]) -> CameraModel {
        let camera = CameraModel::pinhole(640.0, 480.0, 900.0, false);
        camera.with_distortion(Some(Distortion::new(model, camera.radius_px(), terms_px)))
    }

    #[test]
    fn lenses_that_can_be_are_taken_and_others_are_not() {
        let pinhole = |focal_px| CameraModel::pinhole(640.0, 480.0, focal_px, false);
        assert_eq!(pinhole(900.0).check(), Ok(()));
        let boundless = camera(DistortionModel::Radial, &[f64::INFINITY]).check();
        assert!(
            matches!(boundless, Err(ImplausibleLens::Fold { .. })),
            "{boundless:?}"
        );
        for focal_px in [1e308, 1e9, 1.0, f64::NAN, f64::INFINITY, -900.0] {
            let found = pinhole(focal_px).check();
            assert!(
                matches!(found, Err(ImplausibleLens::FocalLength { .. })),
                "{focal_px}"
            );
        }
        for projection in Projection::ALL {
            let all_sky = pinhole(150.0).with_projection(projection);
            assert_eq!(all_sky.check(), Ok(()), "{projection:?}");
            assert_eq!(all_sky.limited_to(1.2).check(), Ok(()), "{projection:?}");
        }
        let barrel = camera(DistortionModel::Radial, &[-30.0]);
        assert_eq!(barrel.check(), Ok(()));
        // r − 0.5 r³ has its maximum at r = 0.82, within the corners.
        let folded = camera(DistortionModel::Radial, &[-200.0]);
        assert!(matches!(folded.check(), Err(ImplausibleLens::Fold { .. })));
        assert_eq!(folded.limited_to(0.2).check(), Ok(()));
        let stretched = |px: f64| {
            let mut terms_px = [0.0; 9];
            terms_px[7] = px;
            camera(DistortionModel::Stretched, &terms_px).check()
        };
        assert_eq!(stretched(40.0), Ok(()));
        let found = stretched(133.0);
        assert!(
            matches!(found, Err(ImplausibleLens::Stretch { .. })),
            "{found:?}"
        );
        let mut terms_px = [0.0; 7];
        terms_px[3] = 700.0;
        let aside = camera(DistortionModel::BrownConrady, &terms_px).check();
        assert!(
            matches!(aside, Err(ImplausibleLens::Axis { .. })),
            "{aside:?}"
        );
    }
}
