//! The calibration: frames are sorted out, the lens is chosen and fitted.

use super::contradictions::{MISFIT, MISFIT_PX, contradictions, distances_px};
use super::copies::without_copies;
use super::coverage::Coverage;
use super::cross_validation::{best_lens, rms_px};
use super::direction_scatter::variance_factor;
use super::frames::{LeftOutFrame, LensFrame, Unfit};
use super::mount::Mount;
use super::repeats::{CommonError, Repeats, StarError};
use super::scale_drift::{FrameScale, ScaleDrift};
use crate::base::least_squares::huber_sigma;
use crate::base::statistics::median;
use crate::camera::formats::Pointing;
use crate::camera::{CameraModel, KnownLens};
use crate::identify::fit::{JointFit, JointFrame, fit_jointly};
use std::f64::consts::LN_2;

/// Start of the comment before the table of a lens.
pub const MEASURED_BY: &str = "Measured by starpipe";
/// Rounds of fitting with the errors that the last residuals show.
const ROUNDS: usize = 5;
/// The relative difference of focal lengths at which a frame is of another lens.
const OTHER_FOCAL_LENGTH: f64 = 0.01;

/// Why no lens is measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// No frame is identified.
    #[error("none of the frames is identified, so no lens can be measured")]
    NoFrame,
    /// The stars do not determine a lens.
    #[error("the {stars} stars of {frames} frames do not determine a lens")]
    NotDetermined {
        /// Their stars.
        stars: usize,
        /// Frames that could be used.
        frames: usize,
    },
}

/// A lens that was measured in several frames.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct LensCalibration {
    /// The lens, known as far as there are stars.
    pub lens: KnownLens,
    /// The frames that it was measured in.
    pub frames: Vec<UsedFrame>,
    /// Frames that are left out.
    pub left_out: Vec<LeftOutFrame>,
    /// Number of stars.
    pub stars: usize,
    /// Standard deviation of their residuals on each axis, in pixels, from the median.
    pub rms_px: f64,
    /// The same of stars that a fit leaves out.
    pub held_out_rms_px: f64,
    /// Error on each axis, in pixels, that the errors of the centroids do not explain.
    pub excess_sigma_px: f64,
    /// Number of directions that the frames look into.
    pub directions: usize,
    /// Standard error on each axis, in pixels, that stars have in common in frames of one direction: of the
    /// median star. 0 where no two frames have one direction.
    pub common_sigma_px: f64,
    /// By how much the directions differ in their lenses, in standard errors: the errors of the lens are
    /// as much larger. 1 where they agree, and with a single one.
    pub direction_scatter: f64,
    /// Where in the frame the stars are, and their residuals there.
    pub coverage: Coverage,
    /// Change of the scale over time; without dates of two frames or more there is none.
    pub drift: Option<ScaleDrift>,
    /// How the camera stands, if it did not move, and site and time are known.
    pub mount: Option<Mount>,
}

impl LensCalibration {
    /// The lens as a table of `camera.toml`.
    pub fn to_toml(&self) -> String {
        let about = [
            format!(
                "{MEASURED_BY} {} with {} stars in {} frames; residuals {:.3} px on each axis,",
                env!("CARGO_PKG_VERSION"),
                self.stars,
                self.frames.len(),
                self.rms_px
            ),
            format!(
                "{:.3} px for stars that were left out of the fit.",
                self.held_out_rms_px
            ),
        ];
        self.lens.to_toml(&about)
    }
}

/// A frame that a lens was measured in.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct UsedFrame {
    /// Its name.
    pub name: String,
    /// Number of its stars.
    pub stars: usize,
    /// Standard deviation of their residuals on each axis, in pixels, from the median.
    pub rms_px: f64,
    /// Its scale relative to that of the lens, less 1.
    pub scale: FrameScale,
    /// Its attitude, if site, date and time are known.
    pub pointing: Option<Pointing>,
}

/// Measures the lens of the camera of `frames`; `left_out` are frames that were not identified.
///
/// # Errors
/// [`CalibrateError`] if there are too few stars.
pub fn calibrate(
    frames: Vec<LensFrame>,
    left_out: Vec<LeftOutFrame>,
) -> Result<LensCalibration, CalibrateError> {
    let mut left_out = left_out;
    let frames = alike(frames, &mut left_out);
    let mut frames = without_copies(frames, &mut left_out);
    if frames.is_empty() {
        return Err(CalibrateError::NoFrame);
    }
    loop {
        let not_determined = CalibrateError::NotDetermined {
            stars: frames.iter().map(LensFrame::stars).sum(),
            frames: frames.len(),
        };
        let fitted = FittedLens::new(&frames).ok_or(not_determined.clone())?;
        let misfits = fitted.misfits();
        if misfits.is_empty() {
            return fitted.calibration(frames, left_out).ok_or(not_determined);
        }
        for (number, why) in misfits.into_iter().rev() {
            let name = frames.remove(number).name;
            left_out.push(LeftOutFrame { name, why });
        }
    }
}

/// The frames that most others are like in size and focal length.
fn alike(frames: Vec<LensFrame>, left_out: &mut Vec<LeftOutFrame>) -> Vec<LensFrame> {
    let kinds: Vec<_> = frames.iter().map(LensFrame::kind).collect();
    let alike =
        |kind: &(u64, u64, bool)| frames.iter().filter(|frame| frame.kind() == *kind).count();
    // Of equally frequent ones the first.
    let Some(&kind) = kinds.iter().rev().max_by_key(|kind| alike(kind)) else {
        return frames;
    };
    let focal_px = |frame: &LensFrame| frame.camera.central_focal_length_px();
    let of_kind = frames.iter().filter(|frame| frame.kind() == kind);
    let mut focal_lengths_px = most_alike(&of_kind.map(focal_px).collect::<Vec<_>>());
    let expected_px = median(&mut focal_lengths_px);
    let mut kept = Vec::new();
    for frame in frames {
        let found_px = focal_px(&frame);
        let why = if frame.kind() != kind {
            let named = |(width, height, mirrored): (u64, u64, bool)| {
                format!(
                    "{width} x {height} px{}",
                    if mirrored { ", mirrored" } else { "" }
                )
            };
            Unfit::OtherSize {
                found: named(frame.kind()),
                expected: named(kind),
            }
        } else if (found_px / expected_px - 1.0).abs() > OTHER_FOCAL_LENGTH {
            Unfit::OtherFocalLength {
                found_px,
                expected_px,
            }
        } else {
            kept.push(frame);
            continue;
        };
        left_out.push(LeftOutFrame {
            name: frame.name,
            why,
        });
    }
    kept
}

/// The focal lengths that most others are like; of equally many the first.
fn most_alike(focal_lengths_px: &[f64]) -> Vec<f64> {
    let like = |focal_px: &f64| {
        let are_like = |other: &&f64| (*other / focal_px - 1.0).abs() <= OTHER_FOCAL_LENGTH;
        let alike = focal_lengths_px.iter().filter(are_like);
        alike.copied().collect::<Vec<f64>>()
    };
    let sets = focal_lengths_px.iter().rev().map(like);
    sets.max_by_key(Vec::len).unwrap_or_default()
}

/// A lens fitted to frames.
struct FittedLens {
    fit: JointFit,
    errors: ExcessErrors,
    /// The stars with all of their errors.
    weighted: Vec<JointFrame>,
    repeats: Repeats,
    held_out_rms_px: f64,
    /// Median distance of the stars of each frame, in pixels.
    distances_px: Vec<f64>,
}

impl FittedLens {
    fn new(frames: &[LensFrame]) -> Option<Self> {
        let stated: Vec<JointFrame> = frames.iter().map(|frame| frame.joint.clone()).collect();
        let repeats = Repeats::new(frames);
        let richest = frames
            .iter()
            .max_by_key(|frame| (frame.stars(), frame.camera.distortion_model()))?;
        let start = richest.camera;
        // Residuals tell the errors, and these weigh the stars for the choice of a lens.
        let first = fit_jointly(&stated, &start, start.distortion_model())?;
        let (mut errors, mut weighted) = reweighed(&stated, &first, &repeats);
        let tested = best_lens(&weighted, &repeats, errors.independent_stars, &first.camera)?;
        let mut fit = fit_jointly(
            &weighted,
            &first.camera.reprojected(tested.projection),
            tested.model,
        )?;
        for _ in 0..ROUNDS {
            (errors, weighted) = reweighed(&stated, &fit, &repeats);
            fit = fit_jointly(&weighted, &fit.camera, tested.model)?;
        }
        Some(Self {
            errors,
            weighted,
            repeats,
            held_out_rms_px: tested.rms_px,
            distances_px: distances_px(&fit),
            fit,
        })
    }

    /// The frames whose stars the lens misses, with the reason; where it misses those of all alike, the frames
    /// that contradict the others.
    fn misfits(&self) -> Vec<(usize, Unfit)> {
        /// Lenses that differ more than this, in the variance of their errors, are compared.
        const CONTRADICTION: f64 = 25.0;
        let missed = self.missed();
        if missed.is_empty() && self.variance_factor() > CONTRADICTION {
            return contradictions(&self.weighted, &self.fit);
        }
        missed
    }

    /// By how much the squared errors of the lens are larger than the stars alone say.
    fn variance_factor(&self) -> f64 {
        variance_factor(&self.weighted, &self.fit, &self.repeats.directions)
    }

    /// The frames whose stars the lens misses, and those of the others not.
    fn missed(&self) -> Vec<(usize, Unfit)> {
        let expected_px = median(&mut self.distances_px.clone());
        let limit_px = (MISFIT * expected_px).max(MISFIT_PX);
        let frames = self.distances_px.iter().enumerate();
        let missed = frames.filter(|(_, found_px)| **found_px > limit_px);
        missed
            .map(|(number, &found_px)| {
                (
                    number,
                    Unfit::Misfit {
                        found_px,
                        expected_px,
                    },
                )
            })
            .collect()
    }

    /// The error that stars have in common in frames of one direction, of the median star.
    fn common_sigma_px(&self, frames: &[LensFrame]) -> f64 {
        if self.repeats.direction_count() == frames.len() {
            return 0.0;
        }
        let stars = frames.iter().flat_map(|frame| &frame.joint.stars);
        let mut noises_px: Vec<f64> = stars.map(|star| star.sigma_px).collect();
        self.errors.common.sigma_px(median(&mut noises_px))
    }

    fn calibration(
        self,
        frames: Vec<LensFrame>,
        left_out: Vec<LeftOutFrame>,
    ) -> Option<LensCalibration> {
        let factor = self.variance_factor();
        let common_sigma_px = self.common_sigma_px(&frames);
        let Self {
            fit,
            errors,
            repeats,
            held_out_rms_px,
            ..
        } = self;
        let excess_sigma_px = errors.excess_sigma_px;
        let attitudes = fit.attitudes.iter().copied();
        let frames: Vec<LensFrame> = frames
            .into_iter()
            .zip(attitudes)
            .map(|(frame, attitude)| frame.with_attitude(attitude))
            .collect();
        let camera = limited(&fit.camera, &frames, &repeats);
        let used = frames
            .iter()
            .zip(&fit.residuals_px)
            .map(|(frame, residuals)| UsedFrame {
                name: frame.name.clone(),
                stars: frame.stars(),
                rms_px: rms_of(residuals.iter()),
                scale: FrameScale::fit(frame, &fit.camera, excess_sigma_px),
                pointing: frame.pointing(),
            });
        let used: Vec<UsedFrame> = used.collect();
        let dated = frames.iter().zip(&used).filter_map(|(frame, used)| {
            let years = frame.date?.years_since_j2000();
            Some((years, used.scale))
        });
        Some(LensCalibration {
            coverage: Coverage::new(&camera, &frames, &fit.residuals_px),
            drift: ScaleDrift::fit(&dated.collect::<Vec<_>>()),
            mount: Mount::measure(&frames),
            stars: frames.iter().map(LensFrame::stars).sum(),
            rms_px: rms_of(fit.residuals_px.iter().flatten()),
            lens: KnownLens::new(camera, fit.covariance * factor)?,
            directions: repeats.direction_count(),
            common_sigma_px,
            direction_scatter: factor.sqrt(),
            frames: used,
            left_out,
            held_out_rms_px,
            excess_sigma_px,
        })
    }
}

/// The camera, known as far from the axis as there are stars.
fn limited(camera: &CameraModel, frames: &[LensFrame], repeats: &Repeats) -> CameraModel {
    /// As many stars at least are as far from the axis; one that frames of one direction repeat is one.
    const OUTERMOST: usize = 5;
    /// A lens that is known so far of the way to the corners is known up to them.
    const NEARLY: f64 = 0.9;
    let axis = camera.direction_of(&camera.axis());
    let stars = frames.iter().flat_map(|frame| &frame.joint.stars);
    let mut angles_rad = vec![0.0_f64; repeats.place_count()];
    for (star, place) in stars.zip(repeats.places.iter().flatten()) {
        let direction = camera.direction_of(&star.pixel);
        if let Some((direction, axis)) = direction.zip(axis.as_ref()) {
            angles_rad[*place] = angles_rad[*place].max(direction.angle_to(axis));
        }
    }
    angles_rad.sort_by(|a, b| b.total_cmp(a));
    let known_rad = angles_rad.get(OUTERMOST.min(angles_rad.len().saturating_sub(1)));
    let corners = camera.corners();
    let corners_rad = corners
        .iter()
        .filter_map(|corner| Some(camera.direction_of(corner)?.angle_to(axis.as_ref()?)));
    let corner_rad = corners_rad.fold(0.0, f64::max);
    match known_rad {
        // What is beyond the stars may fold.
        Some(known_rad)
            if corner_rad == 0.0 || *known_rad < NEARLY * corner_rad || camera.check().is_err() =>
        {
            camera.limited_to(*known_rad)
        }
        _ => *camera,
    }
}

/// Standard deviation of residuals on each axis.
fn rms_of<'a>(residuals: impl Iterator<Item = &'a [f64; 2]>) -> f64 {
    rms_px(&mut residuals.map(|[x, y]| x * x + y * y).collect::<Vec<_>>())
}

/// What errors the stars have besides the stated ones.
#[derive(Debug, Clone, Copy)]
struct ExcessErrors {
    /// On each axis, in pixels, what the stated ones lack to explain the residuals.
    excess_sigma_px: f64,
    /// What frames of one direction have in common.
    common: CommonError,
    /// As many stars without anything in common tell as much.
    independent_stars: f64,
}

/// The errors that the residuals of `fit` show, and the stars with them; outliers have larger ones.
fn reweighed(
    stated: &[JointFrame],
    fit: &JointFit,
    repeats: &Repeats,
) -> (ExcessErrors, Vec<JointFrame>) {
    let excess_sigma_px = excess_sigma_px(stated, fit);
    let common = repeats.common_error(stated, fit, excess_sigma_px);
    let alone = stated.iter().zip(&fit.residuals_px);
    let alone = alone.map(|(frame, residuals)| {
        let stars = frame.stars.iter().zip(residuals);
        stars
            .map(|(star, residual)| {
                let [x, y] = *residual;
                let sigma_px = libm::hypot(star.sigma_px, excess_sigma_px);
                StarError {
                    noise_px: star.sigma_px,
                    sigma_px: huber_sigma(sigma_px, libm::hypot(x, y)),
                    residual_px: *residual,
                }
            })
            .collect()
    });
    let alone: Vec<Vec<StarError>> = alone.collect();
    let sigmas_px = repeats.sigmas_px(&common, &alone);
    let counted = alone.iter().flatten().zip(sigmas_px.iter().flatten());
    let errors = ExcessErrors {
        excess_sigma_px,
        common,
        independent_stars: counted
            .map(|(star, sigma_px)| (star.sigma_px / sigma_px).powi(2))
            .sum(),
    };
    let frames = stated.iter().zip(&fit.attitudes).zip(&sigmas_px);
    let weighted = frames.map(|((frame, attitude), sigmas_px)| {
        let mut frame = frame.clone();
        frame.icrs_to_camera = *attitude;
        for (star, sigma_px) in frame.stars.iter_mut().zip(sigmas_px) {
            star.sigma_px = *sigma_px;
        }
        frame
    });
    (errors, weighted.collect())
}

/// The error on each axis that the stated ones lack to explain the median residual.
fn excess_sigma_px(stated: &[JointFrame], fit: &JointFit) -> f64 {
    const BISECTIONS: usize = 40;
    let stars = stated.iter().flat_map(|frame| &frame.stars);
    let stars: Vec<_> = stars.zip(fit.residuals_px.iter().flatten()).collect();
    let median_sq = |excess_px: f64| {
        let squares = stars.iter().map(|(star, [x, y])| {
            (x * x + y * y) / (star.sigma_px.powi(2) + excess_px * excess_px)
        });
        median(&mut squares.collect::<Vec<_>>())
    };
    let expected = 2.0 * LN_2;
    let mut range_px = [0.0, 100.0];
    if median_sq(0.0) <= expected {
        return 0.0;
    }
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (range_px[0] + range_px[1]);
        range_px[usize::from(median_sq(middle) <= expected)] = middle;
    }
    range_px[1]
}
