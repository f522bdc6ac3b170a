//! The nights of an archive as text and as lines of CSV.

use serde::Serialize;
use starpipe::base::format::{counted, printable};
use starpipe::store::CameraNight;
use std::fmt::Write as _;

/// A night as a line of CSV: its reasons in one cell.
#[derive(Serialize)]
pub(super) struct NightLine<'a> {
    night: &'a str,
    camera: &'a str,
    frames: usize,
    identified: usize,
    unread: usize,
    reasons: String,
    limit50_vmag: Option<f64>,
    predicted_limit50_vmag: Option<f64>,
    limit_difference_mag: Option<f64>,
    sky_mag_arcsec2: Option<f64>,
    zero_point_vmag: Option<f64>,
    zero_point_change_mag: Option<f64>,
    pointing_drift_deg: Option<f64>,
}

impl<'a> NightLine<'a> {
    pub(super) fn from_night(night: &'a CameraNight) -> Self {
        Self {
            night: &night.night,
            camera: &night.camera,
            frames: night.frames,
            identified: night.identified,
            unread: night.unread,
            reasons: reasons_text(night),
            limit50_vmag: night.limit50_vmag,
            predicted_limit50_vmag: night.predicted_limit50_vmag,
            limit_difference_mag: night.limit_difference_mag,
            sky_mag_arcsec2: night.sky_mag_arcsec2,
            zero_point_vmag: night.zero_point_vmag,
            zero_point_change_mag: night.zero_point_change_mag,
            pointing_drift_deg: night.pointing_drift_deg,
        }
    }
}

fn reasons_text(night: &CameraNight) -> String {
    let counted = night.reasons.iter();
    let counted = counted.map(|(code, frames)| format!("{code} {frames}"));
    counted.collect::<Vec<_>>().join(", ")
}

/// The text, or what stands for none.
fn or<'a>(text: &'a str, none: &'a str) -> &'a str {
    if text.is_empty() { none } else { text }
}

/// The nights as a table for people.
pub(super) fn nights_text(nights: &[CameraNight]) -> String {
    let mut text =
        "night       camera            frames  identified   limit  predicted  difference     \
                    sky  zero point  drift (deg)  reasons\n"
            .to_owned();
    for night in nights {
        let cell = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2}"));
        let _ = writeln!(
            text,
            "{:<10}  {:<16}  {:>6}  {:>10}  {:>6}  {:>9}  {:>10}  {:>6}  {:>10}  {:>11}  {}",
            or(&night.night, "no date"),
            printable(or(&night.camera, "-")),
            night.frames,
            night.identified,
            cell(night.limit50_vmag),
            cell(night.predicted_limit50_vmag),
            cell(night.limit_difference_mag),
            cell(night.sky_mag_arcsec2),
            cell(night.zero_point_vmag),
            cell(night.pointing_drift_deg),
            reasons_text(night)
        );
    }
    let frames = nights.iter().map(|night| night.frames).sum();
    text + &format!("{}\n", counted(frames, "frame"))
}
