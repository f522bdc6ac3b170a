//! What the stages found in a frame, and what follows from all of it: comparison, notes, solution.

use super::body_in_frame::BodyInFrame;
use super::bright_stars::NamedFrame;
use super::context::Context;
use super::identification::SecondImages;
use super::note::Note;
use super::outcome::Outcome;
use super::place_time::PlaceTime;
use super::raw_color::RawColor;
use super::solution::{Background, Solution};
use super::source::Source;
use super::stopwatch::Timing;
use crate::base::statistics::Estimate;
use crate::base::units::DEG_PER_RAD;
use crate::calibration::Calibration;
use crate::detect::{Detections, SkyArea, Trail};
use crate::ephemeris::observer::Observation;
use crate::ephemeris::solar_system::moon_and_sun;
use crate::frame::{DefectiveColumn, Frame};
use crate::identify::{Identification, PredictedStar, Priors, ScalePrior, SkyRegion, SourceIndex};
use crate::photometry::comparison::{Comparison, FieldStar, FrameMeasurement, compare};
use crate::photometry::{self, FramePhotometry, IdentifiedFrame, PictureColors};
use crate::sky::{self, DarkLevel, DarkSource, SkyMap, SkyPicture, StatedLimit};
use std::collections::HashSet;

/// What the stages found in a frame.
pub(super) struct SolvedFrame<'a> {
    pub context: &'a Context<'a>,
    pub frame: &'a Frame<'a>,
    /// The calibration that was applied.
    pub calibration: Option<&'a Calibration>,
    /// What follows from the mosaic of a raw color frame.
    pub mosaic: Option<RawColor>,
    pub priors: Priors,
    pub detections: Detections,
    /// The detections as sources.
    pub sources: Vec<Source>,
    pub outcome: Outcome,
    pub bodies: Vec<BodyInFrame>,
    /// Satellites, aeroplanes and meteors, where they were searched.
    pub trails: Option<Vec<Trail>>,
    /// Stars that are there once more.
    pub second_images: SecondImages,
    /// The scale that was dropped because nothing matched with it.
    pub dropped_scale: Option<ScalePrior>,
    /// The direction that was stated, where the stars show another.
    pub other_than: Option<SkyRegion>,
    /// The number of stars that were to be measured, where more had to be.
    pub more_stars: Option<usize>,
    /// Columns that hold no light, and were left out.
    pub defects: &'a [DefectiveColumn],
    pub photometry: Option<FramePhotometry>,
    /// The sky at each place.
    pub sky: Option<SkyMap>,
    pub observation: Option<Observation>,
    /// What the stars contradict of place and time.
    pub place_time: Option<PlaceTime>,
}

impl SolvedFrame<'_> {
    /// Measures the photometry of an identified frame.
    pub(super) fn measure_photometry(&mut self) {
        let Some(identification) = self.outcome.identification() else {
            return;
        };
        let frame = self.identified_frame(identification);
        self.photometry = Some(photometry::measure(&frame, self.context.indexed));
    }

    /// Measures the sky at each place of an identified frame, where it is wanted, or of one whose camera is
    /// held. `comparison` is with the stated camera, `colors` reads those of the frame.
    pub(super) fn measure_sky<'p>(
        &mut self,
        comparison: Option<&Comparison>,
        colors: &dyn Fn() -> Option<PictureColors<'p>>,
    ) {
        let held = match self.outcome {
            Outcome::Identified(_) => None,
            Outcome::NotIdentified(_) => self.as_fixed(),
        };
        let Some(identification) = self.outcome.identification().or(held.as_ref()) else {
            return;
        };
        let camera = self.context.camera.as_ref().map(|camera| &camera.sheet);
        let by_camera = camera
            .zip(self.priors.exposure_s)
            .map(|(sheet, exposure_s)| {
                let dark_adu = sheet.dark_current_e_s * exposure_s / sheet.gain_e_per_adu;
                DarkLevel::stated(sheet.bias_adu + dark_adu, DarkSource::Camera)
            });
        let by_dark = self.calibration.and_then(Calibration::dark_level_adu);
        let by_dark = by_dark.map(|adu| DarkLevel::stated(adu, DarkSource::Dark));
        let has_flat = self.calibration.is_some_and(Calibration::has_flat);
        // A flat divides pixels without light by what is no light.
        let by_frame = self.frame.metadata.dark_level_adu.filter(|_| !has_flat);
        let by_frame = by_frame.map(|adu| DarkLevel::stated(adu, DarkSource::OpticalBlack));
        let usual = self.context.fixed_camera.as_ref();
        let picture = SkyPicture {
            frame: self.frame,
            flux_scale: self.mosaic.map_or(1.0, |mosaic| mosaic.flux_scale()),
            colors,
            dark: by_dark.or(by_camera).or(by_frame),
            usual_dark: usual.and_then(|usual| usual.dark).filter(|_| !has_flat),
            usual_curves: usual.and_then(|usual| usual.curves.as_ref()),
            is_flat: has_flat || camera.is_some(),
            moon: self.priors.date.map(|known| {
                let (moon, _) = moon_and_sun(&known.date, self.priors.site);
                moon.direction
            }),
        };
        let frame = self.identified_frame(identification);
        let stated = comparison.map(|comparison| StatedLimit {
            v_mag: comparison.central_limit_vmag,
            extinction_mag: -2.5 * libm::log10(comparison.budget.atmosphere_transmission),
        });
        let usual = usual.and_then(|usual| usual.clear_sky.as_ref());
        let measured = |usual| {
            sky::measure(
                &frame,
                &picture,
                self.context.indexed,
                stated.as_ref(),
                usual,
            )
        };
        // Stars that were paired by their places alone tell no zero point.
        let own = held.is_none().then(|| measured(None)).flatten();
        self.sky = own.or_else(|| measured(Some(usual?)));
    }

    /// Whether the frame is identified, and shows a wide field of a sky whose horizon is known.
    pub(super) fn shows_whole_sky(&self) -> bool {
        let found = self.outcome.identification();
        found.is_some_and(|found| found.places.zenith().is_some() && sky::is_wide(&found.camera))
    }

    fn as_fixed(&self) -> Option<Identification> {
        let size_px = [self.frame.width as f64, self.frame.height as f64];
        let held = self.context.fixed_camera.as_ref()?;
        let places = self.priors.places();
        held.identification(&self.detections, places, self.context.indexed, size_px)
    }

    fn identified_frame<'f>(&'f self, identification: &'f Identification) -> IdentifiedFrame<'f> {
        IdentifiedFrame {
            detections: &self.detections,
            identification,
            exposure_s: self.priors.exposure_s,
            vignetting: self.stated_vignetting(),
        }
    }

    /// Share of the light lost in the corners, by the camera's description; a flat removes it.
    fn stated_vignetting(&self) -> f64 {
        let camera = self.context.camera.as_ref();
        let camera = camera.filter(|_| !self.calibration.is_some_and(Calibration::has_flat));
        camera.map_or(0.0, |camera| camera.sheet.imperfections.vignetting)
    }

    /// The comparison with the stated camera; `None` without a camera or an exposure.
    pub(super) fn compare_with_camera(&self) -> Option<Comparison> {
        let camera = self.context.camera.as_ref()?;
        let photometry = self.photometry.as_ref();
        let zero_point = photometry.and_then(|measured| measured.zero_point.as_ref());
        let limit = photometry.and_then(|measured| measured.completeness.limit.as_ref().ok());
        let found = self.outcome.identification();
        let field = found.map_or(Vec::new(), |found| self.field(found));
        // Of the brightest stars alone the faintest says nothing.
        let of_all = found.filter(|_| !self.detections.is_truncated);
        let detected = (
            self.detections.spot_sigma_px,
            self.detections.threshold_sigma,
        );
        let (spot_sigma_px, threshold_sigma) = match self.mosaic {
            Some(_) => RawColor::of_raw_pixels(detected.0, detected.1),
            None => detected,
        };
        let frame = FrameMeasurement {
            detect: self.context.detect.clone(),
            size_px: self.frame.stored_size().sides(),
            exposure_s: self.priors.exposure_s,
            background_adu: self.detections.background_adu,
            noise_adu: self.detections.noise_adu,
            threshold_sigma,
            vignetting: self.stated_vignetting(),
            places: found
                .filter(|found| sky::is_wide(&found.camera))
                .and_then(|found| self.identified_frame(found).places_of_horizon()),
            wings: self.detections.wings.map_or(0.0, |wings| wings.share),
            spot_sigma_px: found.map(|_| spot_sigma_px),
            pixel_scale_rad: found.map(|found| 1.0 / found.camera.focal_length_px()),
            zenith_distance_deg: self.observation.as_ref().map(zenith_distance_deg),
            header_zenith_distance_deg: self.frame.metadata.zenith_distance_deg,
            zero_point_vmag: zero_point.map(|zero| Estimate {
                value: zero.v_mag,
                sigma: zero.sigma_mag,
            }),
            zero_point_colors: zero_point.map_or(&[], |zero| &zero.colors),
            has_color_term: zero_point.is_some_and(|zero| zero.color_term.is_some()),
            limit_vmag: limit.map(|limit| Estimate {
                value: limit.v_mag,
                sigma: limit.sigma_mag,
            }),
            faintest_vmag: of_all.and_then(|found| self.faintest_vmag(found)),
            field: &field,
        };
        compare(camera, &frame)
    }

    /// The solution; `timing` is that of its stages.
    pub(super) fn into_solution(self, comparison: Option<Comparison>, timing: Timing) -> Solution {
        let camera = self.context.camera.as_ref();
        Solution {
            width: self.frame.width,
            height: self.frame.height,
            row_order: Some(self.frame.metadata.row_order),
            date: self.priors.date,
            exposure_s: self.priors.exposure_s,
            spot_sigma_px: Some(self.detections.spot_sigma_px),
            notes: self.notes(comparison.as_ref()),
            sources: self.sources,
            background: Some(Background {
                level_adu: self.detections.background_adu,
                noise_adu: self.detections.noise_adu,
                sky_share: self
                    .detections
                    .sky_area
                    .as_ref()
                    .map_or(1.0, SkyArea::share),
            }),
            sky_area: self.detections.sky_area,
            observation: self.observation,
            place_time: self.place_time,
            site: self.priors.site,
            attitude_only: self.context.attitude_only,
            attitude_frame: self.context.attitude_frame,
            outcome: self.outcome,
            bodies: self.bodies,
            trails: self.trails,
            photometry: self.photometry,
            sky: self.sky,
            deep: None,
            comparison,
            gain_e_per_adu: camera.map(|camera| camera.sheet.gain_e_per_adu),
            calibration: self.calibration.map(Calibration::applied),
            timing,
        }
    }

    fn notes(&self, comparison: Option<&Comparison>) -> Vec<Note> {
        let (outcome, priors) = (&self.outcome, &self.priors);
        let mismatch = self
            .calibration
            .and_then(|calibration| calibration.exposure_mismatch(priors.exposure_s));
        let observation = self.observation.as_ref();
        let frame_px = [self.frame.width, self.frame.height];
        // What needs the names of all stars.
        let is_named = !self.context.attitude_only;
        let camera = self.context.camera.as_ref().filter(|_| is_named);
        Note::of_file(&self.frame.metadata)
            .chain(Note::of_defects(self.defects))
            .chain(self.mosaic.map(Note::ColorMosaic))
            .chain(Note::of_scale(self.dropped_scale, outcome))
            .chain(Note::of_direction(self.other_than.as_ref(), outcome))
            .chain(self.more_stars.map(|wanted| Note::MoreStars { wanted }))
            .chain(Note::of_lens(self.context.lens.as_deref(), outcome))
            .chain(Note::of_circle(self.detections.sky_area.as_ref(), outcome))
            .chain(Note::of_place_time(self.place_time.as_ref()))
            .chain(Note::of_observation(observation, priors, outcome))
            .chain(Note::of_zone(priors, outcome))
            .chain(Note::of_camera(camera, frame_px, comparison))
            .chain(Note::of_photometry(self.photometry.as_ref()))
            .chain(self.detections.noise_tail.map(Note::FalseDetections))
            .chain(self.detections.psf.map(Note::Spots))
            .chain(self.detections.trails.map(Note::StarTrails))
            .chain(Note::of_trails(self.trails.as_deref()))
            .chain(self.detections.wings.map(Note::Wings))
            .chain(self.second_images.double.map(Note::DoubleImage))
            .chain(self.second_images.repeated.map(Note::RepeatedSky))
            .chain(Note::of_bodies(
                &self.bodies,
                outcome,
                self.context.indexed.catalog(),
            ))
            .chain(mismatch.map(Note::DarkExposure))
            .chain(Note::of_residuals(outcome.identification()))
            .chain(Note::of_pointing(!is_named, outcome))
            .chain(self.notes_of_bright_stars())
            .chain(Note::of_date(priors, outcome))
            .chain(
                self.detections
                    .are_brightest
                    .then_some(Note::PointingAtOnce),
            )
            .chain(self.is_sky_missing().then_some(Note::SkyNotMeasured))
            .collect()
    }

    fn is_sky_missing(&self) -> bool {
        let is_found = self.outcome.identification().is_some();
        is_found && self.context.measure_sky && self.sky.is_none()
    }

    fn notes_of_bright_stars(&self) -> Vec<Note> {
        let identification = self.outcome.identification();
        let Some(identification) = identification.filter(|_| !self.context.attitude_only) else {
            return Vec::new();
        };
        let frame = NamedFrame {
            detections: &self.detections,
            identification,
            indexed: self.context.indexed,
        };
        let sources = self.bodies.iter().filter_map(|body| body.source);
        let known: HashSet<usize> = sources.map(SourceIndex::get).collect();
        let unnamed = frame.unnamed_detections(&known);
        Note::of_bright_stars(frame.missing_stars(), unnamed).collect()
    }

    /// V magnitude of the faintest identified star.
    fn faintest_vmag(&self, found: &Identification) -> Option<f64> {
        let catalog = self.context.indexed.catalog();
        let v_mag = found.matches.iter().map(|m| catalog.star(m.star).v_mag);
        v_mag.map(f64::from).reduce(f64::max)
    }

    /// All catalogue stars in the frame.
    fn field(&self, found: &Identification) -> Vec<FieldStar> {
        let view = found.view();
        let indexed = self.context.indexed;
        let stars = view.stars_to(indexed, indexed.faintest_v_mag());
        let inside = stars
            .iter()
            .filter(|star| found.camera.contains(&star.pixel))
            .filter(|star| self.detections.shows_sky(&star.pixel));
        let catalog = indexed.catalog();
        let star = |star: &PredictedStar| FieldStar {
            v_mag: f64::from(star.v_mag),
            bv_mag: catalog.star(star.star).bv_mag.map(f64::from),
        };
        inside.map(star).collect()
    }
}

/// Zenith distance of the frame's centre, in degrees: apparent above the horizon, true below it.
fn zenith_distance_deg(observation: &Observation) -> f64 {
    let apparent = observation.apparent.as_ref();
    let zenith_rad = apparent.map_or(observation.zenith_distance_rad, |a| a.zenith_distance_rad);
    zenith_rad * DEG_PER_RAD
}
