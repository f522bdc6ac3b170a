//! Notes: what is odd about a frame, its header, or the priors.

use super::body_in_frame::BodyInFrame;
use super::bright_stars::MissingStar;
use super::outcome::Outcome;
use super::place_time::PlaceTime;
use super::raw_color::RawColor;
use crate::base::format::counted;
use crate::base::statistics::Estimate;
use crate::base::units::{ARCSEC_PER_RAD, DEG_PER_RAD};
use crate::calibration::ExposureMismatch;
use crate::camera::KnownLens;
use crate::catalog::Catalog;
use crate::centroids::LeftOut;
use crate::centroids::ListFrame;
use crate::detect::{Circle, MeasuredPsf, NoiseTail, SkyArea, StarTrails, Trail, Wings};
use crate::ephemeris::observer::Observation;
use crate::ephemeris::solar_system::BodyKind;
use crate::frame::{
    Assumption, DefectiveColumn, FrameMetadata, IgnoredValue, ImageChoice, Orientation,
};
use crate::identify::diagnosis::{DoubleImage, RepeatedSky};
use crate::identify::{DateZone, Identification, Priors, ScalePrior, ScaleSource, SkyRegion};
use crate::photometry::FramePhotometry;
use crate::photometry::comparison::{Comparison, Contradiction, ObservingSetup};
use std::fmt;

/// An error of the lens model, or of spots, that deserves a note, in pixels.
const LARGE_EXCESS_PX: f64 = 1.0;
/// Vignetting that deserves a note, in magnitudes in the corner.
const NOTABLE_CORNER_LOSS_MAG: f64 = 0.1;
/// Most stars or detections that a note lists.
const MAX_LISTED: usize = 5;

/// One note about a frame. `Display` gives the sentence, [`code`](Self::code) a stable name.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Note {
    /// A value in the header is not used.
    IgnoredHeader(IgnoredValue),
    /// The largest image of the file is the frame, and it is not the first.
    LargestImage(ImageChoice),
    /// The picture is turned or mirrored from the rows of its file.
    Orientation(Orientation),
    /// The file leaves something open.
    Assumed(Assumption),
    /// Rows of a list are not used.
    RowsLeftOut(LeftOut),
    /// A list has no brightnesses; its rows were taken to be in their order.
    BrightnessUnknown,
    /// Nobody states the size of a list's frame, and so it is as large as the centroids reach.
    SizeGuessed {
        /// Columns and rows that it is taken to have.
        size_px: [usize; 2],
        /// Standard error of the frame's centre along x and y, in pixels; 0 where the side is known. `None`
        /// where the frame is not identified.
        centre_sigma_px: Option<[f64; 2]>,
    },
    /// Columns hold one value instead of light, and were left out.
    DefectiveColumns(Vec<usize>),
    /// The frame is a raw one of a color camera: what its pixels and its zero point are of.
    ColorMosaic(RawColor),
    /// The stars that were to be measured did not identify the frame, so all were measured.
    MoreStars {
        /// How many were to be.
        wanted: usize,
    },
    /// The sky of a frame that is not identified fills a circle, as by an all-sky lens.
    RoundPicture(Circle),
    /// A scale that was tried first is not that of the frame.
    OtherScale(OtherScale),
    /// The frame's centre is not where it was stated to be.
    OtherDirection(OtherDirection),
    /// Site, date and attitude contradict each other: the centre was below the horizon.
    BelowHorizon {
        /// How far below, in radians.
        depth_rad: f64,
    },
    /// The stars contradict the site or the time.
    SiteOrTime(PlaceTime),
    /// The time is that of a local clock, and was taken for UTC.
    ZoneAssumed,
    /// The frame was not taken with the lens that was measured, or that has changed.
    OtherLens {
        /// Focal length of that lens in the frame's centre, in pixels.
        known_px: f64,
        /// Focal length that the stars have, in pixels.
        found_px: f64,
    },
    /// The lens was measured in frames of another size.
    LensOfOtherSize {
        /// Columns and rows of those, in pixels.
        known_px: [f64; 2],
        /// Columns and rows of this frame, in pixels.
        found_px: [f64; 2],
    },
    /// The date is unknown.
    NoDate,
    /// The site is known but not the time of day, so there is no zenith distance.
    NoTimeOfDay,
    /// The exposure is unknown, so nothing can be predicted for the stated camera.
    NoExposure,
    /// The frame contradicts the stated camera.
    Camera(Contradiction),
    /// Grey levels are not proportional to light.
    NotLinear {
        /// Magnitudes in the frame for one magnitude of the catalogue.
        slope: Estimate,
        /// V magnitude near which the zero point holds.
        mean_v_mag: f64,
    },
    /// The light falls off towards the corners: by this many magnitudes, beyond what is stated.
    Vignetting(Estimate),
    /// The noise is not independent: the rate of false detections asked for holds less well.
    FalseDetections(NoiseTail),
    /// The spots are no round Gaussians of one size: their form was measured.
    Spots(MeasuredPsf),
    /// The stars are trails, and each position is that of the middle of one.
    StarTrails(StarTrails),
    /// Lines of light that are no stars.
    Trails(Vec<Trail>),
    /// The stars have light beyond the spots that are fitted to them.
    Wings(Wings),
    /// Every star occurs twice.
    DoubleImage(DoubleImage),
    /// The stars stand in the frame once more, as in a collage.
    RepeatedSky(RepeatedSky),
    /// The dark has another exposure than the frame.
    DarkExposure(ExposureMismatch),
    /// The Moon or a planet is in the frame.
    BodyInFrame(BodyInFrame),
    /// Bright catalogue stars in the frame have no sure name.
    BrightStarsNotNamed(Vec<MissingStar>),
    /// Positions of bright detections that have no sure name.
    BrightDetectionsNotNamed(Vec<[f64; 2]>),
    /// Attitude and optics alone were wanted: the names are those of the brightest stars.
    AttitudeOnly,
    /// The brightest stars told the pointing, and the others were not measured.
    PointingAtOnce,
    /// The sky was to be measured, and too few stars tell the clear sky.
    SkyNotMeasured,
    /// The residuals are larger than the centroid errors.
    LargeResiduals {
        /// Root mean square of the residuals, in pixels.
        rms_px: f64,
        /// Standard deviation on each axis that the centroid errors do not explain, in pixels.
        excess_sigma_px: f64,
    },
}

impl Note {
    /// Code for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::IgnoredHeader(_) => "header_value_ignored",
            Self::LargestImage(_) => "largest_image",
            Self::Orientation(_) => "orientation",
            Self::Assumed(assumption) => assumption.code(),
            Self::RowsLeftOut(_) => "rows_left_out",
            Self::BrightnessUnknown => "brightness_unknown",
            Self::SizeGuessed { .. } => "size_guessed",
            Self::DefectiveColumns(_) => "defective_columns",
            Self::ColorMosaic(_) => "color_mosaic",
            Self::MoreStars { .. } => "more_stars",
            Self::RoundPicture(_) => "round_picture",
            Self::OtherScale(scale) if scale.is_of_header => "header_scale_wrong",
            Self::OtherScale(_) => "scale_wrong",
            Self::OtherDirection(_) => "direction_wrong",
            Self::BelowHorizon { .. } => "below_horizon",
            Self::SiteOrTime(_) => "site_or_time_wrong",
            Self::ZoneAssumed => "time_zone_assumed",
            Self::OtherLens { .. } => "lens_differs",
            Self::LensOfOtherSize { .. } => "lens_of_other_size",
            Self::NoDate => "date_unknown",
            Self::NoTimeOfDay => "time_of_day_unknown",
            Self::NoExposure => "exposure_unknown",
            Self::Camera(contradiction) => contradiction.code(),
            Self::NotLinear { .. } => "not_linear",
            Self::Vignetting(_) => "vignetting",
            Self::FalseDetections(_) => "false_detections",
            Self::Spots(_) => "spots_not_round",
            Self::StarTrails(_) => "star_trails",
            Self::Trails(_) => "trails",
            Self::Wings(_) => "wings",
            Self::DoubleImage(_) => "double_image",
            Self::RepeatedSky(_) => "repeated_sky",
            Self::BodyInFrame(_) => "body_in_frame",
            Self::DarkExposure(_) => "dark_exposure_differs",
            Self::BrightStarsNotNamed(_) => "bright_stars_not_named",
            Self::BrightDetectionsNotNamed(_) => "bright_detections_not_named",
            Self::AttitudeOnly => "attitude_only",
            Self::PointingAtOnce => "pointing_at_once",
            Self::SkyNotMeasured => "sky_not_measured",
            Self::LargeResiduals { .. } => "large_residuals",
        }
    }

    /// The text of a note that says the same of every frame.
    const fn fixed_text(&self) -> Option<&'static str> {
        Some(match self {
            Self::BrightnessUnknown => {
                "the list has no flux and no magnitude; its rows are assumed to be sorted by brightness"
            }
            Self::NoDate => {
                "the date is unknown: star positions are those of J2000.0, and aberration is not corrected; \
                 the stated error of the focal length allows for this"
            }
            Self::NoTimeOfDay => {
                "the time of day is unknown, so zenith distance and refraction are not computed"
            }
            Self::ZoneAssumed => {
                "the time zone of the file's time is unknown and assumed to be UTC: if it is not, altitude \
                 and azimuth are wrong (utc_offset)"
            }
            Self::AttitudeOnly => {
                "attitude and optics are from the brightest stars; the other stars were not identified, and no \
                 magnitude was measured"
            }
            Self::PointingAtOnce => {
                "the brightest stars were enough to determine the pointing; the other stars were not measured"
            }
            Self::SkyNotMeasured => {
                "the sky was not measured: too few stars are bright enough to measure its transparency"
            }
            Self::NoExposure => "the exposure is unknown, so nothing is predicted for the camera",
            _ => return None,
        })
    }

    /// What the file says of its picture.
    pub(super) fn of_file(metadata: &FrameMetadata) -> impl Iterator<Item = Self> {
        let choice = metadata.choice.clone().map(Self::LargestImage);
        let orientation = Some(metadata.orientation).filter(|turn| !turn.is_upright());
        let ignored = metadata.ignored.iter().cloned();
        let assumed = metadata.assumed.iter().cloned();
        choice
            .into_iter()
            .chain(orientation.map(Self::Orientation))
            .chain(ignored.map(Self::IgnoredHeader))
            .chain(assumed.map(Self::Assumed))
    }

    /// That the size of a list's frame is a guess.
    pub(super) fn of_guessed_size(
        frame: &ListFrame,
        found: Option<&Identification>,
    ) -> Option<Self> {
        (frame.is_guessed != [false; 2]).then(|| Self::SizeGuessed {
            size_px: frame.size.sides(),
            centre_sigma_px: found.map(|found| found.centre_sigma_px),
        })
    }

    /// Columns without light, where there are any.
    pub(super) fn of_defects(defects: &[DefectiveColumn]) -> Option<Self> {
        let mut columns: Vec<usize> = defects.iter().map(|defect| defect.x).collect();
        columns.dedup();
        (!columns.is_empty()).then_some(Self::DefectiveColumns(columns))
    }

    /// A scale that was tried first and had to be dropped, where it is not the true one.
    pub(super) fn of_scale(dropped: Option<ScalePrior>, outcome: &Outcome) -> Option<Self> {
        let scale = dropped.filter(|scale| scale.source != ScaleSource::Camera)?;
        let found = outcome.identification()?;
        let [low_rad, high_rad] = scale.pixel_scale_range_rad(found.camera.width_px);
        let is_wrong = !(low_rad..=high_rad).contains(&(1.0 / found.camera.focal_length_px()));
        let stated = OtherScale {
            is_of_header: scale.source == ScaleSource::Header,
            pixel_scale_rad: [low_rad, high_rad],
        };
        is_wrong.then_some(Self::OtherScale(stated))
    }

    /// A direction that was stated, where it is not the true one.
    pub(super) fn of_direction(other_than: Option<&SkyRegion>, outcome: &Outcome) -> Option<Self> {
        let (stated, found) = (other_than?, outcome.identification()?);
        let distance_rad = found.icrs_to_camera.boresight().angle_to(&stated.centre);
        let radius_rad = stated.radius_rad;
        let direction = OtherDirection {
            distance_rad,
            radius_rad,
        };
        (distance_rad > radius_rad).then_some(Self::OtherDirection(direction))
    }

    /// What the names of an identified frame are where attitude and optics alone were wanted.
    pub(super) fn of_pointing(attitude_only: bool, outcome: &Outcome) -> Option<Self> {
        let is_found = outcome.identification().is_some();
        (attitude_only && is_found).then_some(Self::AttitudeOnly)
    }

    /// Why the lens that was measured was not held.
    pub(super) fn of_lens(lens: Option<&KnownLens>, outcome: &Outcome) -> Option<Self> {
        let (lens, found) = (lens?.camera(), outcome.identification()?);
        let [known_px, found_px] =
            [lens, &found.camera].map(|camera| [camera.width_px, camera.height_px]);
        if known_px != found_px {
            return Some(Self::LensOfOtherSize { known_px, found_px });
        }
        (!found.lens_is_known).then(|| Self::OtherLens {
            known_px: lens.central_focal_length_px(),
            found_px: found.camera.central_focal_length_px(),
        })
    }

    /// That a frame that is not identified looks like that of an all-sky lens.
    pub(super) fn of_circle(sky: Option<&SkyArea>, outcome: &Outcome) -> Option<Self> {
        let sky = sky.filter(|_| outcome.identification().is_none())?;
        sky.circle().map(Self::RoundPicture)
    }

    /// What an identified frame without a date lacks.
    pub(super) fn of_date(priors: &Priors, outcome: &Outcome) -> Option<Self> {
        let lacks_date = priors.date.is_none() && outcome.identification().is_some();
        lacks_date.then_some(Self::NoDate)
    }

    /// A contradiction between site, date and attitude, or what an observation lacks.
    pub(super) fn of_observation(
        observation: Option<&Observation>,
        priors: &Priors,
        outcome: &Outcome,
    ) -> Option<Self> {
        let Some(observation) = observation else {
            let lacks_time = priors.site.is_some() && outcome.identification().is_some();
            return lacks_time.then_some(Self::NoTimeOfDay);
        };
        Self::of_depth(observation)
    }

    /// A site or a time that the stars contradict, and where the frame's centre would be with them.
    pub(super) fn of_place_time(wrong: Option<&PlaceTime>) -> impl Iterator<Item = Self> {
        let stated = wrong.and_then(|wrong| wrong.stated.as_ref());
        let below = stated.and_then(Self::of_depth);
        below
            .into_iter()
            .chain(wrong.cloned().map(Self::SiteOrTime))
    }

    /// A local time that was taken for UTC, where that matters.
    pub(super) fn of_zone(priors: &Priors, outcome: &Outcome) -> Option<Self> {
        let known = priors.date.filter(|known| known.date.has_time())?;
        let is_assumed = known.zone == DateZone::Unknown && priors.site.is_some();
        (is_assumed && outcome.identification().is_some()).then_some(Self::ZoneAssumed)
    }

    /// A centre below the horizon.
    fn of_depth(observation: &Observation) -> Option<Self> {
        let depth_rad = observation.zenith_distance_rad - std::f64::consts::FRAC_PI_2;
        let is_below = observation.apparent.is_none();
        is_below.then_some(Self::BelowHorizon { depth_rad })
    }

    /// The contradictions of a frame of this size with the stated camera, or why it was not compared.
    pub(super) fn of_camera(
        camera: Option<&ObservingSetup>,
        frame_px: [usize; 2],
        comparison: Option<&Comparison>,
    ) -> Vec<Self> {
        match (camera, comparison) {
            (_, Some(found)) => found
                .contradictions
                .iter()
                .copied()
                .map(Self::Camera)
                .collect(),
            (Some(camera), None) => {
                let camera_px = camera.sheet.size().sides();
                let size = Self::Camera(Contradiction::Size {
                    frame_px,
                    camera_px,
                });
                let size = (frame_px != camera_px).then_some(size);
                size.into_iter().chain([Self::NoExposure]).collect()
            }
            (None, None) => Vec::new(),
        }
    }

    /// Satellites, aeroplanes and meteors, where there are any.
    pub(super) fn of_trails(trails: Option<&[Trail]>) -> Option<Self> {
        let trails = trails.filter(|trails| !trails.is_empty())?;
        Some(Self::Trails(trails.to_vec()))
    }

    /// The Moon and the planets in the frame that may be seen in it.
    pub(super) fn of_bodies(
        bodies: &[BodyInFrame],
        outcome: &Outcome,
        catalog: &Catalog,
    ) -> Vec<Self> {
        let matches = outcome.identification().map_or(&[][..], |m| &m.matches);
        let v_mag = matches
            .iter()
            .map(|m| f64::from(catalog.star(m.star).v_mag));
        let faintest = v_mag.reduce(f64::max);
        let notable = bodies.iter().filter(|body| body.is_notable(faintest));
        notable.copied().map(Self::BodyInFrame).collect()
    }

    /// Bright stars without a name, and positions of bright detections without one.
    pub(super) fn of_bright_stars(
        missing: Vec<MissingStar>,
        unnamed: Vec<[f64; 2]>,
    ) -> impl Iterator<Item = Self> {
        let missing = (!missing.is_empty()).then_some(Self::BrightStarsNotNamed(missing));
        let unnamed = (!unnamed.is_empty()).then_some(Self::BrightDetectionsNotNamed(unnamed));
        missing.into_iter().chain(unnamed)
    }

    /// Residuals that centroid errors do not explain.
    pub(super) fn of_residuals(found: Option<&Identification>) -> Option<Self> {
        let found = found.filter(|found| found.excess_sigma_px > LARGE_EXCESS_PX)?;
        Some(Self::LargeResiduals {
            rms_px: found.rms_px,
            excess_sigma_px: found.excess_sigma_px,
        })
    }

    /// Grey levels that are not proportional to light, and vignetting.
    pub(super) fn of_photometry(
        photometry: Option<&FramePhotometry>,
    ) -> impl Iterator<Item = Self> {
        let zero_point = photometry.and_then(|measured| measured.zero_point.as_ref());
        let nonlinear = zero_point.filter(|zero| zero.is_nonlinear);
        let slope = nonlinear.and_then(|zero| {
            Some(Self::NotLinear {
                slope: zero.linearity?,
                mean_v_mag: zero.mean_v_mag,
            })
        });
        let loss = zero_point.and_then(|zero| zero.corner_loss_mag);
        let loss = loss.filter(|loss| loss.value > NOTABLE_CORNER_LOSS_MAG);
        slope.into_iter().chain(loss.map(Self::Vignetting))
    }
}

/// Where a frame's centre is from the direction that was stated for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtherDirection {
    /// Distance of the centre from that direction, in radians.
    pub distance_rad: f64,
    /// Largest distance that was stated, in radians.
    pub radius_rad: f64,
}

impl fmt::Display for OtherDirection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the frame's center is {:.1}° from the given direction, beyond the radius of {:.2}°: the direction was not \
             used",
            self.distance_rad * DEG_PER_RAD,
            self.radius_rad * DEG_PER_RAD
        )
    }
}

/// A scale that was stated for a frame, and is not its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtherScale {
    /// Whether the frame's header gives it, or else the program that calls.
    pub is_of_header: bool,
    /// Smallest and largest pixel scale that it allows, in radians.
    pub pixel_scale_rad: [f64; 2],
}

impl fmt::Display for OtherScale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = self.pixel_scale_rad.map(|rad| rad * ARCSEC_PER_RAD);
        f.write_str(match self.is_of_header {
            true => "the header's focal length and pixel size do not fit this frame: they give ",
            false => "the scale that was given does not fit this frame: it is ",
        })?;
        write!(f, "{low:.1}″ to {high:.1}″ per pixel")
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BrightnessUnknown
            | Self::NoDate
            | Self::NoTimeOfDay
            | Self::ZoneAssumed
            | Self::NoExposure
            | Self::AttitudeOnly
            | Self::PointingAtOnce
            | Self::SkyNotMeasured => f.write_str(self.fixed_text().unwrap_or_default()),
            Self::IgnoredHeader(value) => value.fmt(f),
            Self::LargestImage(choice) => choice.fmt(f),
            Self::Orientation(orientation) => write!(
                f,
                "the image is displayed {orientation}, as its header says (Orientation {}); x and y refer \
                 to the displayed picture",
                orientation.tag()
            ),
            Self::Assumed(assumption) => assumption.fmt(f),
            Self::RowsLeftOut(rows) => rows.fmt(f),
            Self::DefectiveColumns(columns) => write_columns(f, columns),
            Self::ColorMosaic(mosaic) => write_mosaic(f, mosaic),
            Self::OtherLens { known_px, found_px } => write_other_lens(f, *known_px, *found_px),
            Self::LensOfOtherSize { known_px, found_px } => {
                write_other_size(f, *known_px, *found_px)
            }
            Self::OtherScale(scale) => scale.fmt(f),
            Self::OtherDirection(direction) => direction.fmt(f),
            Self::BelowHorizon { depth_rad } => write!(
                f,
                "site, date and attitude contradict each other: the center of the frame would be {:.1}° \
                 below the horizon",
                depth_rad * DEG_PER_RAD
            ),
            Self::SiteOrTime(wrong) => wrong.fmt(f),
            Self::SizeGuessed {
                size_px,
                centre_sigma_px,
            } => write_guessed_size(f, *size_px, *centre_sigma_px),
            Self::MoreStars { wanted } => write!(
                f,
                "the brightest {wanted} detections did not identify the frame, so all were measured"
            ),
            Self::Camera(contradiction) => contradiction.fmt(f),
            Self::RoundPicture(circle) => write_circle(f, circle),
            Self::NotLinear { slope, mean_v_mag } => write!(
                f,
                "the detector response is not linear: 1 mag in the catalog is {:.2} ± {:.2} mag in this \
                 frame, and the zero point is accurate only near V {mean_v_mag:.1}",
                slope.value, slope.sigma
            ),
            Self::Vignetting(loss) => write!(
                f,
                "vignetting: stars at the edge of the field are {:.2} ± {:.2} mag dimmer than in the center; the zero \
                 point is for the center",
                loss.value, loss.sigma
            ),
            Self::FalseDetections(tail) => write_noise_tail(f, *tail),
            Self::Spots(psf) => write_spots(f, psf),
            Self::Wings(wings) => write_wings(f, wings),
            Self::StarTrails(trails) => write_trails(f, trails),
            Self::Trails(trails) => write_lines(f, trails),
            Self::DoubleImage(double) => write_double(f, double),
            Self::RepeatedSky(repeated) => repeated.fmt(f),
            Self::DarkExposure(mismatch) => mismatch.fmt(f),
            Self::BodyInFrame(seen) => write_body(f, seen),
            Self::BrightStarsNotNamed(stars) => {
                let list = listed(stars.iter().map(MissingStar::to_string));
                write!(f, "bright catalog stars that were not identified: {list}")
            }
            Self::BrightDetectionsNotNamed(places) => {
                let place = |[x, y]: &[f64; 2]| format!("({x:.1}, {y:.1})");
                let list = listed(places.iter().map(place));
                write!(f, "bright detections that were not identified: at {list}")
            }
            Self::LargeResiduals {
                rms_px,
                excess_sigma_px,
            } => write_residuals(f, *rms_px, *excess_sigma_px),
        }
    }
}

fn write_guessed_size(
    f: &mut fmt::Formatter<'_>,
    [width, height]: [usize; 2],
    centre_sigma_px: Option<[f64; 2]>,
) -> fmt::Result {
    write!(
        f,
        "the size of the frame was not given; {width} × {height} pixels, the extent of the centroids, were \
         assumed"
    )?;
    let Some([x, y]) = centre_sigma_px else {
        return Ok(());
    };
    write!(
        f,
        "; the standard error of the frame's center is {x:.0} px along x and {y:.0} px along y, and the stated errors \
         include it"
    )
}

fn write_double(f: &mut fmt::Formatter<'_>, double: &DoubleImage) -> fmt::Result {
    write!(
        f,
        "every star appears twice: {double}; fluxes, zero point and limit are those of one of the two \
         images; positions and attitude may be off by up to this offset, and the stated error of the \
         attitude includes half of it"
    )
}

fn write_residuals(f: &mut fmt::Formatter<'_>, rms_px: f64, excess_sigma_px: f64) -> fmt::Result {
    write!(
        f,
        "the residuals of {rms_px:.1} px rms are larger than the centroid errors: the lens or the \
         point-spread function differs from the model; the stated errors include {excess_sigma_px:.1} px \
         per star on each axis for this"
    )
}

fn write_other_lens(f: &mut fmt::Formatter<'_>, known_px: f64, found_px: f64) -> fmt::Result {
    write!(
        f,
        "the lens in the camera description does not fit the stars (changed, refocused or moved?): its \
         focal length is {known_px:.2} px, but that of this frame is {found_px:.2} px"
    )
}

fn write_circle(f: &mut fmt::Formatter<'_>, circle: &Circle) -> fmt::Result {
    let Circle { centre, radius_px } = circle;
    write!(
        f,
        "the sky fills a circle of {radius_px:.0} px around ({:.0}, {:.0}), as with a fisheye lens; identification \
         needs stars near the middle of the circle",
        centre.x, centre.y
    )
}

fn write_other_size(f: &mut fmt::Formatter<'_>, known: [f64; 2], found: [f64; 2]) -> fmt::Result {
    let [x, y] = [known[0] / found[0], known[1] / found[1]];
    write!(
        f,
        "the lens in the camera description is not used, because it was measured in frames of {} x {} px, \
         and this frame is {}",
        known[0],
        known[1],
        if x == y && x.fract() == 0.0 {
            format!("binned {x} x {x}")
        } else if found[0] == known[1] && found[1] == known[0] {
            "rotated by 90°".to_owned()
        } else {
            "from another camera, or cropped".to_owned()
        }
    )
}

fn write_columns(f: &mut fmt::Formatter<'_>, columns: &[usize]) -> fmt::Result {
    let list = listed(columns.iter().map(usize::to_string));
    write!(
        f,
        "defective columns, which have a constant value in all or some of their rows, are ignored there: x \
         = {list}"
    )
}

fn write_wings(f: &mut fmt::Formatter<'_>, wings: &Wings) -> fmt::Result {
    let (percent, sigma_percent) = (100.0 * wings.share, 100.0 * wings.sigma);
    write!(
        f,
        "the point-spread function has wings outside the fitted spots: fluxes are increased by {percent:.1} \
         ± {sigma_percent:.1} % for their light"
    )
}

fn write_lines(f: &mut fmt::Formatter<'_>, trails: &[Trail]) -> fmt::Result {
    let place = |trail: &Trail| {
        let [begin, end] = [trail.begin, trail.end];
        format!(
            "({:.1}, {:.1}) to ({:.1}, {:.1})",
            begin.x, begin.y, end.x, end.y
        )
    };
    let list = listed(trails.iter().map(place));
    let count = counted(trails.len(), "trail");
    write!(f, "{count} of satellites, aircraft or meteors: {list}")
}

fn write_trails(f: &mut fmt::Formatter<'_>, trails: &StarTrails) -> fmt::Result {
    write!(
        f,
        "the stars are trailed by {:.0} px at {:.0}° from the image's x axis: each position is the middle \
         of a trail, so attitude and optics are for mid-exposure",
        trails.length_px,
        trails.angle_rad * DEG_PER_RAD
    )
}

fn write_mosaic(f: &mut fmt::Formatter<'_>, mosaic: &RawColor) -> fmt::Result {
    f.write_str("the frame is a raw color mosaic")?;
    if let Some(pattern) = mosaic.pattern {
        write!(f, " ({pattern})")?;
    }
    f.write_str(": stars were measured in the mean of the filters around each pixel; ")?;
    match mosaic.green_over_mean {
        Some(ratio) => write!(
            f,
            "fluxes and the zero point refer to the green pixels, {ratio:.2} times that mean"
        ),
        None => f.write_str(
            "fluxes and the zero point refer to that mean: a quarter red, half green, a quarter blue",
        ),
    }
}

fn write_body(f: &mut fmt::Formatter<'_>, seen: &BodyInFrame) -> fmt::Result {
    let BodyInFrame { body, position, .. } = seen;
    let article = if body.kind == BodyKind::Moon {
        "the "
    } else {
        ""
    };
    write!(
        f,
        "{article}{} (V {:.1}) is in the frame at ({:.1}, {:.1})",
        body.kind.name(),
        body.v_mag,
        position.x,
        position.y
    )?;
    match (seen.source, seen.uncertainty_px < 1.0) {
        (Some(_), _) => f.write_str(", and the detection at this position is identified with it"),
        (None, true) => {
            f.write_str(", but no detection at this position can be identified with it")
        }
        (None, false) => write!(
            f,
            " within {:.0} px, because time or site is uncertain; no detection can be identified with it",
            seen.uncertainty_px
        ),
    }
}

fn write_spots(f: &mut fmt::Formatter<'_>, psf: &MeasuredPsf) -> fmt::Result {
    let [least_px, largest_px] = psf.sigma_range_px;
    write!(
        f,
        "the stars are not round Gaussians of one size (standard deviation {least_px:.2} to {largest_px:.2} \
         px, axis ratio up to {:.1}): the stars are fitted with the point-spread function measured in the \
         frame",
        psf.axis_ratio
    )?;
    if psf.is_comatic {
        f.write_str("; they have coma, so errors of the focal length and the lens model may be larger than stated")?;
    }
    Ok(())
}

fn write_noise_tail(f: &mut fmt::Formatter<'_>, tail: NoiseTail) -> fmt::Result {
    let cause = match tail {
        NoiseTail::Correlated => "is correlated between pixels",
        NoiseTail::Coarse => "is smaller than one gray level, with rare large values",
        NoiseTail::CutOff => "is clipped at the lowest value of the frame",
    };
    write!(
        f,
        "the noise {cause}: the rate of false detections may be ten times higher than stated"
    )
}

/// A list for people; what is beyond its first items is counted.
fn listed(items: impl ExactSizeIterator<Item = String>) -> String {
    let more = items.len().saturating_sub(MAX_LISTED);
    let mut list: Vec<String> = items.take(MAX_LISTED).collect();
    if more > 0 {
        list.push(format!("{more} more"));
    }
    list.join(", ")
}
