//! Compares the results of one frame with the truth.

use super::light::LightMap;
use super::record::{BEYOND_LIMIT_MAG, FrameRecord, NameResult, RowKind, StarRecord};
use super::validator::{UnprocessedFrame, Validator};
use crate::base::coords::small_turn_rad;
use crate::base::format::{to_decimals, to_significant};
use crate::base::units::{ARCSEC_PER_RAD, DEG_PER_RAD};
use crate::catalog::StarIndex;
use crate::identify::{Identification, SourceIndex};
use crate::lab::robustness::Answer;
use crate::lab::simulate::TrueStar;
use crate::lab::trials::is_star_like;
use crate::photometry::comparison::{expected_zero_point_vmag, fitted_color_effect_mag};
use crate::photometry::{SUN_BV_MAG, filter_response};
use crate::predict::{CramerRao, Faintest};
use crate::solve::{Note, Outcome, Solution};
use std::collections::{HashMap, HashSet};

pub(super) struct Evaluation<'a> {
    validator: &'a Validator<'a>,
    number: u64,
    simulated: &'a UnprocessedFrame,
    solution: &'a Solution,
    light: LightMap<'a>,
    found: Option<&'a Identification>,
    /// The star that each source was identified as.
    names: HashMap<SourceIndex, StarIndex>,
    /// V magnitude of the faintest star in the table.
    faintest_vmag: f64,
}

/// Which detection belongs to which star.
#[derive(Default)]
struct Assignments {
    /// The nearest source of each star, by the star's number.
    of_star: HashMap<usize, SourceIndex>,
    /// The other star-like sources.
    others: Vec<(RowKind, SourceIndex)>,
    detected: u64,
    /// Stars with several sources.
    split: HashSet<usize>,
}

impl<'a> Evaluation<'a> {
    pub(super) fn new(
        validator: &'a Validator<'a>,
        number: u64,
        simulated: &'a UnprocessedFrame,
        solution: &'a Solution,
    ) -> Self {
        let found = solution.outcome.identification();
        let matches = found.map_or(&[][..], |found| &found.matches);
        Self {
            validator,
            number,
            simulated,
            solution,
            light: LightMap::of(&validator.protocol.setup.scenario, &simulated.truth),
            found,
            names: matches.iter().map(|m| (m.source, m.star)).collect(),
            faintest_vmag: validator.limit_vmag() + BEYOND_LIMIT_MAG,
        }
    }

    pub(super) fn records(&self) -> (FrameRecord, Vec<StarRecord>) {
        let assignments = self.assignments();
        let truth = &self.simulated.truth;
        let counted = truth.stars.iter().filter(|star| self.is_tabulated(star));
        let mut rows: Vec<StarRecord> = counted
            .map(|star| self.star_row(star, assignments.of_star.get(&star.number).copied()))
            .collect();
        let other = |&(kind, source): &(RowKind, SourceIndex)| {
            self.with_source(StarRecord::empty(self.number, kind), source, None)
        };
        rows.extend(assignments.others.iter().map(other));
        let frame = self.frame_row(&assignments, rows.len());
        (frame, rows)
    }

    fn is_tabulated(&self, star: &TrueStar) -> bool {
        star.v_mag <= self.faintest_vmag
    }

    fn assignments(&self) -> Assignments {
        /// Radius around a false detection without any star, in standard deviations of a spot plus
        /// one pixel.
        const DARK_SIGMAS: f64 = 3.0;
        let mut assignments = Assignments::default();
        let dark_px = DARK_SIGMAS * self.light.sigma_px() + 1.0;
        for (index, source) in self.solution.sources.iter().enumerate() {
            if !is_star_like(source) {
                continue;
            }
            assignments.detected += 1;
            let index = SourceIndex::new(index);
            let place = &source.position;
            let owner = self
                .light
                .owner(place)
                .filter(|star| self.is_tabulated(star));
            let Some(star) = owner else {
                let mut near = self.light.stars_near(place, dark_px);
                let kind = match near.any(|star| self.is_tabulated(star)) {
                    true => RowKind::Blend,
                    false => RowKind::False,
                };
                assignments.others.push((kind, index));
                continue;
            };
            let distance = |source: SourceIndex| {
                let found = &self.solution.source(source).position;
                found.distance_to(&star.position)
            };
            let nearest = assignments.of_star.entry(star.number).or_insert(index);
            if *nearest != index {
                assignments.split.insert(star.number);
            }
            if distance(index) < distance(*nearest) {
                *nearest = index;
            }
        }
        assignments
    }

    fn star_row(&self, star: &TrueStar, source: Option<SourceIndex>) -> StarRecord {
        let catalog = self.validator.context.indexed.catalog();
        let theory = self
            .validator
            .theory
            .of_star(&star.position, star.electrons);
        let bound = |of: fn(&CramerRao) -> f64| {
            let bound = theory.bound.as_ref().map(of);
            bound.filter(|b| b.is_finite()).map(significant)
        };
        let bound_flux_e = bound(|b| b.sigma_flux_e);
        let bv_mag = star.catalog.and_then(|known| catalog.star(known).bv_mag);
        let row = StarRecord {
            id: star.catalog.map(|known| catalog.designation(known)),
            vmag: Some(to_decimals(star.v_mag, 3)),
            bv_mag: bv_mag.map(|bv| to_decimals(f64::from(bv), 3)),
            true_x_px: Some(to_decimals(star.position.x, 5)),
            true_y_px: Some(to_decimals(star.position.y, 5)),
            true_flux_e: Some(significant(star.electrons)),
            isolated: Some(self.is_isolated(star, bound_flux_e)),
            saturated: Some(theory.saturated),
            probability: Some(to_decimals(self.probability(star), 5)),
            predicted_snr: Some(significant(theory.snr)),
            bound_x_px: bound(|b| b.sigma_x_px),
            bound_y_px: bound(|b| b.sigma_y_px),
            bound_flux_e,
            ..StarRecord::empty(self.number, RowKind::Star)
        };
        match source {
            Some(source) => self.with_source(row, source, Some(star)),
            None => row,
        }
    }

    /// Detection probability for the star's expected electrons on this frame.
    fn probability(&self, star: &TrueStar) -> f64 {
        let v_mag = self.validator.simulator.light().vmag_of(star.electrons);
        self.validator.detector.probability(v_mag)
    }

    /// Whether the star is entirely on the frame and the light of other stars near it is
    /// negligible.
    fn is_isolated(&self, star: &TrueStar, own_error_e: Option<f64>) -> bool {
        /// Distance from the border at which a star is entirely on the frame, in standard
        /// deviations of its spot plus one pixel.
        const WHOLE_SIGMAS: f64 = 4.0;
        /// Radius without another detectable star around an isolated one, in standard deviations of
        /// a spot plus pixels.
        const ALONE_SIGMAS: f64 = 8.0;
        const ALONE_PX: f64 = 2.0;
        /// Magnitudes below the predicted limit at which a star may still be detected.
        const MAY_BE_DETECTED_MAG: f64 = 0.5;
        /// Largest light of other stars at an isolated star, in units of the error of its own flux.
        const ALONE_PART: f64 = 0.05;
        let camera = self.validator.simulator.camera();
        let sigma_px = self.light.sigma_px();
        let whole_px = WHOLE_SIGMAS * sigma_px + 1.0;
        if !camera.nearly_contains(&star.position, -whole_px) {
            return false;
        }
        let bright_vmag = self.validator.limit_vmag() + MAY_BE_DETECTED_MAG;
        let others = self
            .light
            .stars_near(&star.position, ALONE_SIGMAS * sigma_px + ALONE_PX)
            .filter(|other| other.number != star.number);
        let mut light_e = 0.0;
        for other in others {
            if other.v_mag <= bright_vmag {
                return false;
            }
            let off = other.position.distance_to(&star.position) / sigma_px;
            light_e += other.electrons * filter_response(off);
        }
        light_e < ALONE_PART * own_error_e.unwrap_or_else(|| star.electrons.sqrt())
    }

    /// `row` with the measurements of a source; `star` is its true star.
    fn with_source(
        &self,
        row: StarRecord,
        source: SourceIndex,
        star: Option<&TrueStar>,
    ) -> StarRecord {
        let found = &self.solution.source(source);
        let sigma = |axis: usize| found.measured.map(|m| significant(m.sigma_px[axis]));
        let gain = self.validator.protocol.setup.scenario.camera.gain_e_per_adu;
        let flux_e = found.flux.map(|flux| flux * gain);
        let snr = found.measured.map(|m| m.snr);
        let sigma_flux_e = flux_e.zip(snr).map(|(flux_e, snr)| flux_e / snr);
        StarRecord {
            detected: star.is_some(),
            x: Some(to_decimals(found.position.x, 5)),
            y: Some(to_decimals(found.position.y, 5)),
            sigma_x: sigma(0),
            sigma_y: sigma(1),
            flux_e: flux_e.map(significant),
            sigma_flux_e: sigma_flux_e.map(significant),
            named: match self.names.get(&source) {
                None => NameResult::No,
                Some(name) if star.is_some_and(|star| star.catalog == Some(*name)) => {
                    NameResult::Right
                }
                Some(_) => NameResult::Wrong,
            },
            ..row
        }
    }

    fn frame_row(&self, assignments: &Assignments, star_rows: usize) -> FrameRecord {
        let (simulated, solution) = (self.simulated, self.solution);
        let pointing = &simulated.pointing;
        let attitude = pointing
            .places
            .astrometric_attitude(&pointing.icrs_to_camera);
        let (boresight, up_pa_rad) = attitude.boresight_and_up();
        let (ra_rad, dec_rad) = boresight.to_ra_dec();
        let degrees = |rad: f64| to_decimals(rad * DEG_PER_RAD, 7);
        let limit_vmag = self.validator.limit_vmag();
        let is_above_limit = |star: &&TrueStar| star.v_mag < limit_vmag;
        let above_limit = simulated.truth.stars.iter().filter(is_above_limit);
        let count = |of: RowKind| {
            let others = assignments.others.iter();
            others.filter(|(kind, _)| *kind == of).count() as u64
        };
        let [misnamed, misnamed_companions] = self.misnamed();
        FrameRecord {
            frame: self.number,
            seed: simulated.seed,
            ra_deg: degrees(ra_rad),
            dec_deg: degrees(dec_rad),
            up_pa_deg: degrees(up_pa_rad),
            status: self.answer(),
            reason: match &solution.outcome {
                Outcome::Identified(_) => None,
                Outcome::NotIdentified(reason) => Some(reason.code().to_owned()),
            },
            stars_above_limit: above_limit.count() as u64,
            detected: assignments.detected,
            rejected: solution.sources.len() as u64 - assignments.detected,
            named: self.names.len() as u64,
            misnamed,
            misnamed_companions,
            false_detections: count(RowKind::False),
            blends: count(RowKind::Blend),
            star_rows: star_rows as u64,
            split: assignments.split.len() as u64,
            notes: self.notes(),
            ..self.photometric_fields()
        }
    }

    /// Limits, background and noise; and what [`Self::attitude_fields`] has.
    fn photometric_fields(&self) -> FrameRecord {
        let (validator, truth) = (self.validator, &self.simulated.truth);
        let catalog = validator.context.indexed.catalog();
        let v_mag = |star: &StarIndex| f64::from(catalog.star(*star).v_mag);
        let faintest = self.names.values().map(v_mag).reduce(f64::max);
        // Only catalogue stars can be named.
        let known = truth.stars.iter().filter(|star| star.catalog.is_some());
        let expected = Faintest::of(known.map(|star| (star.v_mag, self.probability(star))));
        let photometry = self.solution.photometry.as_ref();
        let limit = photometry.and_then(|p| p.completeness.limit.as_ref().ok());
        let background = self.solution.background.as_ref();
        let sheet = &validator.protocol.setup.scenario.camera;
        let level_adu = sheet.bias_adu + truth.background_e / sheet.gain_e_per_adu;
        let noise_adu = validator.budget.background_noise_e / sheet.gain_e_per_adu;
        let zero_point = self.zero_point_mag();
        let linearity = photometry.and_then(|p| p.zero_point.as_ref()?.linearity);
        FrameRecord {
            faintest_vmag: faintest.map(|v_mag| to_decimals(v_mag, 3)),
            expected_faintest_vmag: expected.map(|e| to_decimals(e.mean_vmag, 4)),
            expected_faintest_sigma_mag: expected.map(|e| to_decimals(e.sigma_mag, 4)),
            predicted_limit_vmag: to_decimals(validator.limit_vmag() + self.limit_color_mag(), 4),
            measured_limit_vmag: limit.map(|limit| to_decimals(limit.v_mag, 4)),
            measured_limit_sigma_mag: limit.map(|limit| to_decimals(limit.sigma_mag, 4)),
            background_adu: background.map(|b| significant(b.level_adu)),
            true_background_adu: significant(level_adu),
            noise_adu: background.map(|b| significant(b.noise_adu)),
            true_noise_adu: significant(noise_adu),
            zero_point_error_mag: zero_point.map(|(error_mag, _)| to_decimals(error_mag, 5)),
            zero_point_sigma_mag: zero_point.map(|(_, sigma_mag)| to_decimals(sigma_mag, 5)),
            linearity: linearity.map(|slope| to_decimals(slope.value, 5)),
            linearity_sigma: linearity.map(|slope| to_decimals(slope.sigma, 5)),
            ..self.attitude_fields().unwrap_or_default()
        }
    }

    /// The codes of the notes; that of the exposure, which the pipeline is not told, says nothing.
    fn notes(&self) -> Option<String> {
        let notes = self.solution.notes.iter();
        let said = notes.filter(|note| !matches!(note, Note::NoExposure));
        let codes: Vec<&str> = said.map(Note::code).collect();
        (!codes.is_empty()).then(|| codes.join(" "))
    }

    /// By how much fainter the predicted limit is for the color for which the measured one holds.
    fn limit_color_mag(&self) -> f64 {
        let photometry = self.solution.photometry.as_ref();
        let zero_point = photometry.and_then(|measured| measured.zero_point.as_ref());
        zero_point.map_or(0.0, |zero| {
            let light = self.validator.simulator.light();
            let at_bv_mag = zero.color_term.map(|_| SUN_BV_MAG);
            fitted_color_effect_mag(light, &zero.colors, at_bv_mag)
        })
    }

    /// Measured minus true zero point of the frame's exposure, and its stated standard error.
    fn zero_point_mag(&self) -> Option<(f64, f64)> {
        let photometry = self.solution.photometry.as_ref()?;
        let measured = photometry.zero_point.as_ref()?;
        let scenario = &self.validator.protocol.setup.scenario;
        let colors = &measured.colors;
        let of_a_second = expected_zero_point_vmag(scenario, colors, measured.color_term.is_some());
        let expected = of_a_second + 2.5 * libm::log10(scenario.conditions.exposure_s);
        Some((measured.v_mag - expected, measured.sigma_mag))
    }

    fn answer(&self) -> Answer {
        let truth = self.simulated;
        self.found.map_or(Answer::None, |found| {
            Answer::of(
                found,
                self.validator.simulator.camera(),
                &truth.pointing.icrs_to_camera,
            )
        })
    }

    /// Number of misnamed sources, and of those among them named as another star at the same
    /// position.
    fn misnamed(&self) -> [u64; 2] {
        let (mut wrong, mut companions) = (0, 0);
        for (source, star) in &self.names {
            let place = &self.solution.source(*source).position;
            let is_it = |other: &TrueStar| other.catalog == Some(*star);
            if !self.light.owner(place).is_some_and(is_it) {
                wrong += 1;
                companions += u64::from(self.light.stars_at(place).any(is_it));
            }
        }
        [wrong, companions]
    }

    /// Errors of attitude and focal length of a right answer, and their stated standard errors.
    fn attitude_fields(&self) -> Option<FrameRecord> {
        let found = self.found.filter(|_| self.answer() == Answer::Right)?;
        let truth = &self.simulated.pointing.icrs_to_camera;
        let turn = found.icrs_to_camera.matrix() * truth.matrix().transpose();
        let error_rad = small_turn_rad(&turn);
        let factor = found.attitude_covariance_rad2.cholesky();
        let nees = factor.map(|factor| error_rad.dot(&factor.solve(&error_rad)));
        let error_arcsec = error_rad * ARCSEC_PER_RAD;
        let sigma_arcsec = found.attitude_sigma_rad().map(|rad| rad * ARCSEC_PER_RAD);
        let true_focal_px = self.validator.simulator.camera().central_focal_length_px();
        let some = |value: f64| Some(significant(value));
        Some(FrameRecord {
            error_x_arcsec: some(error_arcsec.x),
            error_y_arcsec: some(error_arcsec.y),
            error_roll_arcsec: some(error_arcsec.z),
            sigma_x_arcsec: some(sigma_arcsec[0]),
            sigma_y_arcsec: some(sigma_arcsec[1]),
            sigma_roll_arcsec: some(sigma_arcsec[2]),
            nees: nees.map(significant),
            focal_error_px: some(found.camera.central_focal_length_px() - true_focal_px),
            focal_sigma_px: some(found.focal_length_sigma_px),
            rms_px: some(found.rms_px),
            ..FrameRecord::default()
        })
    }
}

fn significant(value: f64) -> f64 {
    /// Significant digits of measured values.
    const DIGITS: i32 = 7;
    to_significant(value, DIGITS)
}
