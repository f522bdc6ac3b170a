//! Makes a report of a solution.

use super::digits::{
    AIRMASS_DECIMALS, DIRECTION_DECIMALS, FLUX_DIGITS, FRACTION_DECIMALS, HORIZON_DECIMALS,
    MAG_DECIMALS, PIXEL_DECIMALS, SIGMA_DIGITS, YEAR_DECIMALS,
};
use super::frame_report::{
    ApparentReport, AttitudeReport, AttitudeSigma, BackgroundReport, CalibrationReport,
    CandidateReport, CompletenessReport, DateReport, DistortionReport, FrameReport,
    MagnitudeReport, MatchReport, NoteReport, ObservationReport, OpticsReport, PhotometryReport,
    PlaceTimeReport, SCHEMA, SiteReport, Status, TimingReport,
};
use super::sky::SkyReport;
use super::stars::{self, ReportedPointing};
use super::{annotations, bodies, reason, trails};
use crate::annotate::Scene;
use crate::base::clock::hours_of;
use crate::base::coords::{Camera, Icrs, Rotation};
use crate::base::format::{
    finite, half_turn_deg, significant, to_decimals, to_significant, turn_deg,
};
use crate::base::units::{ARCSEC_PER_RAD, DEG_PER_RAD};
use crate::calibration::Applied;
use crate::camera::CameraModel;
use crate::catalog::Catalog;
use crate::ephemeris::observer::Observation;
use crate::ephemeris::places::AttitudeFrame;
use crate::identify::{DateZone, FrameDate, Identification, StarMatch};
use crate::photometry::FramePhotometry;
use crate::photometry::completeness::MagnitudeBin;
use crate::solve::{
    Background, Contradiction, Note, Outcome, PlaceTime, Proposal, Solution, Timing,
};
use nalgebra::Matrix3;

impl FrameReport {
    /// The report of `solution`, whose stars are those of `catalog`; `frame` is its name.
    ///
    /// # Example
    /// ```
    /// use starpipe::{Catalog, Context, FrameReport, IndexedCatalog};
    /// use starpipe::{TextOptions, Workspace, solve_file};
    ///
    /// // The stars to V 7 are enough for wide fields, and are indexed in a moment.
    /// let catalog = Catalog::built_in().limited_to(7.0);
    /// let indexed = IndexedCatalog::build(&catalog, &|_| ());
    /// let context = Context::new(&indexed);
    /// let file = "fixtures/orion/orion.png";
    /// let solution = solve_file(file, None, &context, &mut Workspace::new())?;
    /// let report = FrameReport::new(file, &solution, &catalog);
    /// assert!(report.is_identified());
    /// let text = report.to_text(TextOptions::default());
    /// assert!(text.contains("Rigel (19 bet Ori)"));
    /// let json = report.to_json_line()?;
    /// assert!(json.starts_with(r#"{"schema":2,"frame":"fixtures/orion/orion.png","width":640"#));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(frame: &str, solution: &Solution, catalog: &Catalog) -> Self {
        let catalog = solution.catalog(catalog);
        let mut report = Self {
            schema: SCHEMA,
            frame: frame.to_owned(),
            width: solution.width,
            height: solution.height,
            row_order: solution.row_order,
            date: solution.date.as_ref().map(date),
            observation: solution.observation.as_ref().map(observation),
            place_time: solution.place_time.as_ref().map(place_time),
            exposure_s: solution
                .exposure_s
                .and_then(|s| significant(s, FLUX_DIGITS)),
            notes: solution.notes.iter().map(note).collect(),
            status: Status::NotIdentified,
            reason: None,
            reason_code: None,
            best_log10_false_alarm: None,
            remedies: Vec::new(),
            attitude: None,
            apparent: None,
            optics: None,
            matched: None,
            magnitude: None,
            photometry: solution.photometry.as_ref().map(photometry),
            prediction: None,
            sky: solution.sky.as_ref().map(SkyReport::new),
            calibration: solution.calibration.as_ref().map(calibration),
            background: background(solution.background.as_ref()),
            sentence: None,
            constellations: Vec::new(),
            annotations: Vec::new(),
            bodies: Vec::new(),
            trails: trails::reports(solution),
            stars: solution.sources.iter().map(stars::detection).collect(),
            timing_ms: timing(&solution.timing),
        };
        match &solution.outcome {
            Outcome::NotIdentified(reason) => {
                report.reason = Some(reason::text(reason, solution));
                report.reason_code = Some(reason.code());
                report.best_log10_false_alarm = reason.best_log10_false_alarm();
                report.remedies = reason.remedies();
            }
            Outcome::Identified(identification) => {
                report.add_identification(identification, catalog, solution.attitude_frame);
                if let Some(matched) = &mut report.matched {
                    matched.catalog = solution.deep_title().map(str::to_owned);
                }
                // The faintest of the brightest stars says nothing.
                report.magnitude = report.magnitude.take().filter(|_| !solution.attitude_only);
                bodies::add_to(&mut report, &solution.bodies, identification);
                if let Some(scene) = Scene::of(solution, catalog) {
                    annotations::add_to(&mut report, scene, catalog);
                }
            }
        }
        if let Some(comparison) = &solution.comparison {
            report.add_comparison(comparison);
        }
        if let Some(gain_e_per_adu) = solution.gain_e_per_adu {
            for star in &mut report.stars {
                star.add_electrons(gain_e_per_adu);
            }
        }
        report
    }

    fn add_identification(
        &mut self,
        identification: &Identification,
        catalog: &Catalog,
        attitude_frame: AttitudeFrame,
    ) {
        self.status = Status::Identified;
        self.attitude = Some(attitude(
            &identification.attitude(attitude_frame),
            &identification.attitude_covariance_rad2,
            (boresight_of(&identification.camera), attitude_frame),
        ));
        let places = &identification.places;
        self.apparent = Some(ApparentReport {
            aberration: places.has_aberration(),
            refraction: places.has_refraction(),
            date_assumed: self.date.is_none(),
        });
        self.optics = Some(optics(identification));
        self.matched = Some(match_quality(identification, self.stars.len()));
        self.magnitude = faintest(identification, catalog);
        let pointing = ReportedPointing { identification };
        pointing.add_to(&mut self.stars, catalog);
    }
}

fn note(note: &Note) -> NoteReport {
    NoteReport {
        code: note.code(),
        text: note.to_string(),
    }
}

fn calibration(applied: &Applied) -> CalibrationReport {
    CalibrationReport {
        dark: applied.dark.clone(),
        flat: applied.flat.clone(),
        hot_pixels: applied.hot_pixels.clone(),
        mask: applied.mask.clone(),
    }
}

fn date(known: &FrameDate) -> DateReport {
    let has_time = known.date.has_time();
    let (source, ahead) = match known.zone {
        DateZone::Stated => ("stated", None),
        DateZone::Given(ahead) => ("option", Some(ahead)),
        DateZone::ByStars(ahead) => ("stars", Some(ahead)),
        DateZone::Unknown => ("assumed", None),
        DateZone::Contradicted => ("contradicted", None),
    };
    DateReport {
        iso: known.date.to_iso(),
        year: to_decimals(known.date.julian_epoch(), YEAR_DECIMALS),
        source: known.source,
        utc_offset_h: has_time.then(|| ahead.map_or(0.0, hours_of)),
        utc_offset_source: has_time.then_some(source),
        uncertainty_h: known.time_error().hours(),
    }
}

fn place_time(wrong: &PlaceTime) -> PlaceTimeReport {
    let deg = |angle_rad: f64| to_decimals(angle_rad * DEG_PER_RAD, 1);
    let mut report = PlaceTimeReport {
        contradicted_by: wrong
            .contradictions
            .iter()
            .map(Contradiction::code)
            .collect(),
        stars_below_horizon: None,
        lowest_star_deg: None,
        sun_altitude_deg: None,
        candidates: wrong.proposals.iter().map(candidate).collect(),
    };
    for contradiction in &wrong.contradictions {
        match contradiction {
            Contradiction::StarsBelowHorizon {
                below, lowest_rad, ..
            } => {
                report.stars_below_horizon = Some(*below);
                report.lowest_star_deg = Some(deg(*lowest_rad));
            }
            Contradiction::SunIsUp { altitude_rad } => {
                report.sun_altitude_deg = Some(deg(*altitude_rad));
            }
            Contradiction::Refraction { .. } | Contradiction::Planets { .. } => {}
        }
    }
    report
}

fn candidate(proposal: &Proposal) -> CandidateReport {
    let range = proposal.range;
    CandidateReport {
        change: proposal.change.code(),
        amount: proposal.change.amount(),
        amount_from: range.map(|[from, _]| from),
        amount_to: range.map(|[_, to]| to),
        lat_deg: to_decimals(proposal.site.lat_deg(), DIRECTION_DECIMALS),
        lon_deg: to_decimals(proposal.site.lon_deg(), DIRECTION_DECIMALS),
        date: proposal.date.to_iso(),
        odds_against: to_significant(proposal.odds_against, SIGMA_DIGITS),
    }
}

fn observation(seen: &Observation) -> ObservationReport {
    let deg = |angle_rad: f64| to_decimals(angle_rad * DEG_PER_RAD, HORIZON_DECIMALS);
    let site = &seen.site;
    ObservationReport {
        site: SiteReport {
            lat_deg: to_decimals(site.lat_deg(), DIRECTION_DECIMALS),
            lon_deg: to_decimals(site.lon_deg(), DIRECTION_DECIMALS),
            height_m: to_decimals(site.height_m(), 2),
        },
        zenith_distance_deg: deg(seen.zenith_distance_rad),
        apparent_zenith_distance_deg: seen.apparent.map(|a| deg(a.zenith_distance_rad)),
        azimuth_deg: turn_deg(seen.azimuth_rad * DEG_PER_RAD, HORIZON_DECIMALS),
        airmass: seen
            .apparent
            .map(|a| to_decimals(a.airmass, AIRMASS_DECIMALS)),
    }
}

/// The report of an attitude with the covariance of its small rotations.
pub(super) fn attitude(
    icrs_to_camera: &Rotation<Icrs, Camera>,
    covariance_rad2: &Matrix3<f64>,
    (at, frame_of): (&'static str, AttitudeFrame),
) -> AttitudeReport {
    let (boresight, up_pa_rad) = icrs_to_camera.boresight_and_up();
    let (ra_rad, dec_rad) = boresight.to_ra_dec();
    let covariance = covariance_rad2 * (ARCSEC_PER_RAD * ARCSEC_PER_RAD);
    let sigma = |axis: usize| to_significant(covariance[(axis, axis)].sqrt(), SIGMA_DIGITS);
    let element =
        |row: usize, column: usize| to_significant(covariance[(row, column)], SIGMA_DIGITS);
    let [x, y, roll] = [0, 1, 2].map(sigma);
    AttitudeReport {
        at,
        frame_of,
        ra_deg: turn_deg(ra_rad * DEG_PER_RAD, DIRECTION_DECIMALS),
        dec_deg: to_decimals(dec_rad * DEG_PER_RAD, DIRECTION_DECIMALS),
        up_pa_deg: half_turn_deg(up_pa_rad * DEG_PER_RAD, DIRECTION_DECIMALS),
        quaternion: icrs_to_camera.to_quaternion().map(|q| to_decimals(q, 10)),
        sigma_arcsec: AttitudeSigma { x, y, roll },
        covariance_arcsec2: [0, 1, 2].map(|row| [0, 1, 2].map(|column| element(row, column))),
    }
}

/// What the boresight of a camera is.
pub(super) fn boresight_of(camera: &CameraModel) -> &'static str {
    if camera.is_pinhole() {
        "centre"
    } else {
        "axis"
    }
}

fn optics(identification: &Identification) -> OpticsReport {
    let camera = &identification.camera;
    let axis = camera.axis();
    let degrees = |angle_rad: f64| to_decimals(angle_rad * DEG_PER_RAD, 6);
    let [fov_x_sigma_rad, fov_y_sigma_rad] = identification.fov_sigma_rad();
    let sigma_deg = |sigma_rad: f64| significant(sigma_rad * DEG_PER_RAD, SIGMA_DIGITS);
    OpticsReport {
        held: identification.lens_is_known,
        fov_x_deg: camera.fov_x_rad().map(degrees),
        fov_y_deg: camera.fov_y_rad().map(degrees),
        fov_x_sigma_deg: fov_x_sigma_rad.and_then(sigma_deg),
        fov_y_sigma_deg: fov_y_sigma_rad.and_then(sigma_deg),
        model: camera.projection().name(),
        focal_length_px: to_decimals(camera.central_focal_length_px(), PIXEL_DECIMALS),
        focal_length_sigma_px: finite(identification.focal_length_sigma_px, PIXEL_DECIMALS),
        mirrored: camera.mirrored,
        axis_px: [axis.x, axis.y].map(|along| to_decimals(along, PIXEL_DECIMALS)),
        valid_to_deg: camera.valid_to_rad().map(degrees),
        distortion: distortion(camera),
    }
}

pub(super) fn distortion(camera: &CameraModel) -> Option<DistortionReport> {
    let distortion = camera.distortion()?;
    let coefficients = distortion.coefficients_px().iter();
    Some(DistortionReport {
        model: distortion.model().name(),
        focal_length_px: to_decimals(camera.focal_length_px(), PIXEL_DECIMALS),
        radius_px: to_decimals(distortion.radius_px(), PIXEL_DECIMALS),
        largest_px: to_decimals(camera.largest_distortion_px(), PIXEL_DECIMALS),
        coefficients_px: coefficients.map(|c| to_decimals(*c, 6)).collect(),
    })
}

fn match_quality(identification: &Identification, detected: usize) -> MatchReport {
    let pixel_arcsec = ARCSEC_PER_RAD / identification.camera.central_focal_length_px();
    MatchReport {
        detected,
        matched: identification.matches.len(),
        rms_px: to_decimals(identification.rms_px, PIXEL_DECIMALS),
        rms_arcsec: to_significant(identification.rms_px * pixel_arcsec, SIGMA_DIGITS),
        log10_false_alarm: to_decimals(identification.log10_false_alarm, 2),
        catalog: None,
    }
}

fn faintest(identification: &Identification, catalog: &Catalog) -> Option<MagnitudeReport> {
    let v_mag = |star_match: &&StarMatch| catalog.star(star_match.star).v_mag;
    let faintest = identification
        .matches
        .iter()
        .max_by(|a, b| v_mag(a).total_cmp(&v_mag(b)))?;
    Some(MagnitudeReport {
        faintest_vmag: to_decimals(f64::from(v_mag(&faintest)), 3),
        faintest_id: catalog.designation(faintest.star),
        ..MagnitudeReport::default()
    })
}

fn photometry(measured: &FramePhotometry) -> PhotometryReport {
    let zero_point = measured.zero_point.as_ref();
    let color = zero_point.and_then(|zero| zero.color_term);
    let corner_loss = zero_point.and_then(|zero| zero.corner_loss_mag);
    let linearity = zero_point.and_then(|zero| zero.linearity);
    let limit = measured.completeness.limit;
    let fitted = limit.as_ref().ok();
    let mag = |value: f64| finite(value, MAG_DECIMALS);
    let bin = |bin: &MagnitudeBin| CompletenessReport {
        vmag: to_decimals(bin.v_mag, MAG_DECIMALS),
        stars: bin.stars,
        detected: bin.detected,
    };
    PhotometryReport {
        zero_point_vmag: zero_point.and_then(|zero| mag(zero.v_mag)),
        zero_point_sigma_mag: zero_point.and_then(|zero| mag(zero.sigma_mag)),
        no_zero_point: measured.no_zero_point.map(|reason| NoteReport {
            code: reason.code(),
            text: reason.to_string(),
        }),
        flux_unit: measured.exposure_s.map_or("ADU", |_| "ADU/s"),
        scatter_mag: zero_point.and_then(|zero| mag(zero.scatter_mag)),
        zero_point_stars: zero_point.map_or(0, |zero| zero.stars),
        zero_point_mean_vmag: zero_point.and_then(|zero| mag(zero.mean_v_mag)),
        zero_point_bv_mag: zero_point.and_then(|zero| zero.bv_mag).and_then(mag),
        color_term: color.and_then(|term| mag(term.value)),
        color_term_sigma: color.and_then(|term| mag(term.sigma)),
        corner_loss_mag: corner_loss.and_then(|loss| mag(loss.value)),
        corner_loss_sigma_mag: corner_loss.and_then(|loss| mag(loss.sigma)),
        linearity: linearity.and_then(|slope| mag(slope.value)),
        linearity_sigma: linearity.and_then(|slope| mag(slope.sigma)),
        limit50_vmag: fitted.and_then(|limit| mag(limit.v_mag)),
        limit50_sigma_mag: fitted.and_then(|limit| mag(limit.sigma_mag)),
        limit50_width_mag: fitted.and_then(|limit| mag(limit.width_mag)),
        lost_share: fitted.and_then(|limit| mag(limit.lost)),
        limit50_reason: limit.err().map(|reason| reason.to_string()),
        completeness: measured.completeness.bins.iter().map(bin).collect(),
    }
}

fn background(measured: Option<&Background>) -> BackgroundReport {
    BackgroundReport {
        level: measured.and_then(|sky| significant(sky.level_adu, FLUX_DIGITS)),
        noise: measured.and_then(|sky| significant(sky.noise_adu, FLUX_DIGITS)),
        sky_share: measured.map(|sky| to_decimals(sky.sky_share, FRACTION_DECIMALS)),
    }
}

fn timing(measured: &Timing) -> TimingReport {
    TimingReport {
        read: to_decimals(measured.read_ms, 3),
        detect: to_decimals(measured.detect_ms, 3),
        identify: to_decimals(measured.identify_ms, 3),
        pointing: to_decimals(measured.pointing_ms, 3),
        naming: to_decimals(measured.naming_ms, 3),
        photometry: to_decimals(measured.photometry_ms, 3),
        total: to_decimals(measured.total_ms, 3),
    }
}
