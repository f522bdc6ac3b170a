//! An experiment for people: one page.

use super::{ExperimentReport, LimitReport, SimulatedReport, TableReport};
use crate::report::{degrees, hours};
use std::fmt::Write as _;

/// Zenith distances that differ by more than this, in degrees, are not those of one direction.
const CONTRADICTION_DEG: f64 = 1.0;

impl ExperimentReport {
    /// The report as text of several lines, each with its end.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "Experiment {} of Tong, Li & Wang, Acta Optica Sinica 34, 1004003 (2014)\n  {}, {:.3}° N {:.3}° E, {} s\n",
            self.experiment, self.date, self.site_lat_deg, self.site_lon_deg, self.exposure_s
        );
        text += &limit_text(&self.limit);
        text += &table_text(&self.table);
        if let Some(simulated) = &self.simulated {
            text += &simulated_text(simulated, &self.limit);
        }
        text
    }
}

fn limit_text(limit: &LimitReport) -> String {
    format!(
        "\nThe limit, in V\n  {:.2}  by the paper's equations; the paper prints {:.2}, and its faintest star has {:.2}\n  {:.2}  of this detector, whose filter adds up the light of a spot: it finds half of such stars\n",
        limit.limit_vmag,
        limit.paper_limit_vmag,
        limit.paper_faintest_vmag,
        limit.detector_limit_vmag
    )
}

fn table_text(table: &TableReport) -> String {
    let mut text = format!(
        "\nThe paper's stars, from its centroids and magnitudes: {} of {} are the paper's\n  {:<10} {:<14} {:>5} {:>8} {:>8} {:>9}\n",
        table.right,
        table.stars.len(),
        "paper",
        "found",
        "V",
        "x",
        "y",
        "residual"
    );
    for star in &table.stars {
        let residual = star
            .residual_px
            .map_or("–".to_owned(), |px| format!("{px:.2} px"));
        let _ = writeln!(
            text,
            "  {:<10} {:<14} {:>5.2} {:>8.2} {:>8.2} {residual:>9}",
            star.paper_id,
            star.found_id.as_deref().unwrap_or("–"),
            star.vmag,
            star.x_px,
            star.y_px
        );
    }
    match &table.field {
        None => text += "  not identified\n",
        Some(field) => {
            let _ = writeln!(
                text,
                "  centre {} {}, up at {:.1}°, {:.2}″ a pixel, rms {:.2} px = {:.1}″",
                hours(field.ra_deg, 0),
                degrees(field.dec_deg, 0),
                field.up_pa_deg,
                field.pixel_scale_arcsec,
                field.rms_px,
                field.rms_px * field.pixel_scale_arcsec
            );
        }
    }
    if let Some(found_deg) = table.zenith_distance_deg {
        let stated_deg = table.stated_zenith_distance_deg;
        let verdict = if (found_deg - stated_deg).abs() > CONTRADICTION_DEG {
            ": they contradict each other"
        } else {
            ""
        };
        let _ = writeln!(
            text,
            "  zenith distance {stated_deg}° as stated, {found_deg:.1}° from site, time and centre{verdict}"
        );
    }
    text
}

fn simulated_text(simulated: &SimulatedReport, limit: &LimitReport) -> String {
    let mut text = format!(
        "\n{} frames simulated with that camera, sky and pointing, moved by up to ±{} px: {} identified\n",
        simulated.frames, simulated.shift_px, simulated.frames_identified
    );
    if let Some(faintest) = &simulated.faintest {
        let _ = writeln!(
            text,
            "  faintest star named   V {:.2}, scatter {:.2}, from {:.2} to {:.2}",
            faintest.mean_vmag, faintest.sigma_mag, faintest.least_vmag, faintest.most_vmag
        );
    }
    if let Some(expected) = &simulated.expected {
        let _ = writeln!(
            text,
            "  expected of it        V {:.2}, scatter {:.2}: noise lifts some stars above the limit of V {:.2}",
            expected.mean_vmag, expected.sigma_mag, limit.detector_limit_vmag
        );
    }
    if let Some(faintest) = &simulated.faintest
        && let (Some(difference), Some(sigma)) =
            (faintest.difference_mag, faintest.difference_sigma_mag)
    {
        let _ = writeln!(
            text,
            "  difference            {difference:+.3} ± {sigma:.3} mag"
        );
    }
    let expected = simulated.expected.map_or(f64::NAN, |e| e.stars_found);
    let _ = writeln!(
        text,
        "  stars named           {:.1} a frame, {:.1} expected; {} on all frames at the light of another star or of none,\n                        on {} frames the faintest among them",
        simulated.stars_named, expected, simulated.named_wrongly, simulated.faintest_wrong
    );
    let _ = writeln!(
        text,
        "\n  {:<14} {:>8} {:>9} {:>9} {:>9}",
        "V", "stars", "detected", "expected", "named"
    );
    for bin in &simulated.completeness {
        let _ = writeln!(
            text,
            "  {:<14} {:>8} {:>9} {:>9.1} {:>9}",
            format!("{:.2} to {:.2}", bin.from_vmag, bin.to_vmag),
            bin.stars,
            bin.detected,
            bin.expected,
            bin.named
        );
    }
    text
}
