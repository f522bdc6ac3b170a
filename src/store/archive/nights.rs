//! How faint did each camera see in each night?

use super::frame_row::UNREAD;
use super::frames::FrameSummary;
use super::parts::{Archive, PartState};
use super::read::open;
use crate::base::coords::{Icrs, UnitVector};
use crate::base::statistics::median_of;
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::store::error::StoreError;
use parquet::errors::ParquetError;
use parquet::file::reader::ChunkReader;
use serde::Serialize;
use std::collections::BTreeMap;

/// What one camera saw in one night. Values are medians over its frames.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct CameraNight {
    /// Date of the evening; empty for frames without a date.
    pub night: String,
    /// The stated camera; empty where none is.
    pub camera: String,
    /// All frames.
    pub frames: usize,
    /// Identified frames.
    pub identified: usize,
    /// Frames that could not be read or searched.
    pub unread: usize,
    /// Number of frames that are not identified or not read, by the code of the reason.
    pub reasons: BTreeMap<String, usize>,
    /// V magnitude at which half of the stars are detected.
    pub limit50_vmag: Option<f64>,
    /// The limit that the camera should reach.
    pub predicted_limit50_vmag: Option<f64>,
    /// Measured minus predicted limit, of the frames that have both.
    pub limit_difference_mag: Option<f64>,
    /// Sky brightness in V.
    pub sky_mag_arcsec2: Option<f64>,
    /// Zero point.
    pub zero_point_vmag: Option<f64>,
    /// Largest difference of the zero point from that median.
    pub zero_point_change_mag: Option<f64>,
    /// Largest angle, in degrees, between the directions of two successive frames in a system that
    /// turns with the Earth: 0 for a camera that stands still.
    pub pointing_drift_deg: Option<f64>,
}

/// One night of one camera: its frames.
#[derive(Default)]
struct Night {
    summary: CameraNight,
    limits: Vec<f64>,
    predicted: Vec<f64>,
    differences: Vec<f64>,
    skies: Vec<f64>,
    zero_points: Vec<f64>,
    /// Date (MJD), and direction in the system that turns with the Earth.
    pointings: Vec<(f64, UnitVector<Icrs>)>,
}

/// Frames by night and camera.
#[derive(Default)]
pub struct Nights(BTreeMap<[String; 2], Night>);

impl Nights {
    /// Adds the frames of a part: the content of its file.
    ///
    /// # Errors
    /// [`ParquetError`] if it is no such table.
    pub fn add(&mut self, part: impl ChunkReader + 'static) -> Result<(), ParquetError> {
        FrameSummary::for_each(part, |frame| {
            let key = [frame.night.clone(), frame.camera.clone()];
            self.0.entry(key).or_default().add(frame);
        })
    }

    /// What each camera saw in each night, by night and camera.
    pub fn finish(self) -> Vec<CameraNight> {
        let nights = self.0.into_iter();
        let finished = nights.map(|([night, camera], frames)| CameraNight {
            night,
            camera,
            ..frames.finish()
        });
        finished.collect()
    }
}

/// What each camera saw in each night, by night and camera, in the parts that are whole.
///
/// # Errors
/// [`StoreError::File`], [`StoreError::Table`].
pub fn summary(archive: &Archive) -> Result<Vec<CameraNight>, StoreError> {
    let mut nights = Nights::default();
    for path in archive.tables_of_frames(PartState::Whole) {
        let added = nights.add(open(&path)?);
        added.map_err(StoreError::table("reading", &path))?;
    }
    Ok(nights.finish())
}

impl Night {
    fn add(&mut self, frame: FrameSummary) {
        let summary = &mut self.summary;
        summary.frames += 1;
        match frame.status.as_str() {
            "identified" => summary.identified += 1,
            UNREAD => summary.unread += 1,
            _ => {}
        }
        if !frame.reason_code.is_empty() {
            *summary.reasons.entry(frame.reason_code).or_default() += 1;
        }
        self.limits.extend(frame.limit50_vmag);
        self.predicted.extend(frame.predicted_limit50_vmag);
        self.differences.extend(frame.limit_difference_mag);
        self.skies.extend(frame.sky_mag_arcsec2);
        self.zero_points.extend(frame.zero_point_vmag);
        if let (Some(t_min), Some(ra_deg), Some(dec_deg)) =
            (frame.t_min, frame.ra_deg, frame.dec_deg)
        {
            let turned_rad = ra_deg * RAD_PER_DEG - earth_rotation_rad(t_min);
            let direction = UnitVector::from_ra_dec(turned_rad, dec_deg * RAD_PER_DEG);
            self.pointings.push((t_min, direction));
        }
    }

    fn finish(self) -> CameraNight {
        let zero_point_vmag = rounded_median(&self.zero_points);
        let change = |median: f64| {
            let changes = self.zero_points.iter().map(|zero| (zero - median).abs());
            changes.fold(0.0, f64::max)
        };
        CameraNight {
            limit50_vmag: rounded_median(&self.limits),
            predicted_limit50_vmag: rounded_median(&self.predicted),
            limit_difference_mag: rounded_median(&self.differences),
            sky_mag_arcsec2: rounded_median(&self.skies),
            zero_point_vmag,
            zero_point_change_mag: zero_point_vmag.map(change).map(rounded),
            pointing_drift_deg: drift_deg(self.pointings).map(rounded),
            ..self.summary
        }
    }
}

fn rounded_median(values: &[f64]) -> Option<f64> {
    median_of(values.iter().copied()).map(rounded)
}

/// To the digits that values of frames have.
fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

fn drift_deg(mut pointings: Vec<(f64, UnitVector<Icrs>)>) -> Option<f64> {
    pointings.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let steps = pointings.windows(2);
    let steps = steps.map(|pair| pair[0].1.angle_to(&pair[1].1) * DEG_PER_RAD);
    steps.reduce(f64::max)
}

/// Rotation of the Earth since a fixed time.
///
/// # Reference
/// Capitaine et al. 2000, A&A 355, 398; UT1 is taken as UTC, 0.004° at most.
fn earth_rotation_rad(mjd: f64) -> f64 {
    const TURNS_PER_DAY: f64 = 1.002_737_811_911_354_6;
    const TURNS_AT_J2000: f64 = 0.779_057_273_264;
    let turns = TURNS_AT_J2000 + TURNS_PER_DAY * (mjd - 51_544.5);
    std::f64::consts::TAU * turns.fract()
}
