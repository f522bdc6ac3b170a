//! The report of an experiment as text: one page.

use super::report::{ExperimentReport, LimitReport};
use super::summary::SimulatedReport;
use super::table::TableReport;
use crate::base::format::{degrees, hours};
use std::fmt::Write as _;

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
            text += &simulated_text(simulated, &self.limit, self.table.stars.len());
        }
        text
    }
}

fn limit_text(limit: &LimitReport) -> String {
    let mut text = "\nLimiting magnitude\n".to_owned();
    let _ = writeln!(
        text,
        "  V {:.2} from the paper's equations; the paper states {:.2}, and its faintest star has {:.2}",
        limit.limit_vmag, limit.paper_limit_vmag, limit.paper_faintest_vmag
    );
    let _ = writeln!(
        text,
        "  V {:.2} for half of the stars to be detected by the matched filter of starpipe, which sums the \
         light of a spot",
        limit.detector_limit_vmag
    );
    text
}

fn table_text(table: &TableReport) -> String {
    let mut text = format!(
        "\nThe paper's stars, identified from its centroids and magnitudes: {} of {} as in the paper\n",
        table.right,
        table.stars.len()
    );
    text += "  paper           found               V        x        y  residual\n";
    for star in &table.stars {
        let residual = star
            .residual_px
            .map_or("–".to_owned(), |px| format!("{px:.2} px"));
        let _ = writeln!(
            text,
            "  {:<15} {:<15} {:>5.2} {:>8.2} {:>8.2} {residual:>9}",
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
                "  center {} {}, up at {:.1}°, {:.2}″ per pixel, rms {:.2} px = {:.1}″",
                hours(field.ra_deg, 0),
                degrees(field.dec_deg, 0),
                field.up_pa_deg,
                field.pixel_scale_arcsec,
                field.rms_px,
                field.rms_px * field.pixel_scale_arcsec
            );
        }
    }
    text += &unlisted_text(table);
    text += &zenith_text(table);
    text
}

/// Compares the stated zenith distance with that of site, time and centre.
fn zenith_text(table: &TableReport) -> String {
    const TOLERANCE_DEG: f64 = 1.0;
    let Some(found_deg) = table.zenith_distance_deg else {
        return String::new();
    };
    let stated_deg = table.stated_zenith_distance_deg;
    let both = format!(
        "  zenith distance {stated_deg}° as stated in the paper, {found_deg:.1}° from site, time and center"
    );
    let limit = match table.limit_there_vmag {
        Some(v_mag) => format!("; at the latter, the limit is V {v_mag:.2}"),
        None => String::new(),
    };
    if (found_deg - stated_deg).abs() > TOLERANCE_DEG {
        format!("{both}: these contradict each other{limit}\n")
    } else {
        format!("{both}\n")
    }
}

/// The stars missing in the paper's table.
fn unlisted_text(table: &TableReport) -> String {
    let Some(field) = &table.field else {
        return String::new();
    };
    let v_mags = table.stars.iter().map(|star| star.vmag);
    let faintest = v_mags.fold(f64::NEG_INFINITY, f64::max);
    let (all, listed) = (field.stars_as_bright, table.stars.len());
    match field.brightest_unlisted_vmag {
        None => format!(
            "  the paper lists all {all} stars to V {faintest:.2} in the rectangle that its stars span\n"
        ),
        Some(missing) => format!(
            "  the paper lists {listed} of the {all} stars to V {faintest:.2} in the rectangle that its \
             stars span; the brightest missing one has V {missing:.2}\n"
        ),
    }
}

fn simulated_text(simulated: &SimulatedReport, limit: &LimitReport, paper_stars: usize) -> String {
    let mut text = format!(
        "\n{} frames simulated with this camera, sky and pointing, shifted by up to ±{} px: {} identified\n",
        simulated.frames, simulated.shift_px, simulated.frames_identified
    );
    let mut line = |label: &str, value: String| {
        let _ = writeln!(text, "  {label:<20} {value}");
    };
    if let Some(faintest) = &simulated.faintest {
        let (mean, sigma) = (faintest.mean_vmag, faintest.sigma_mag);
        let (least, most) = (faintest.least_vmag, faintest.most_vmag);
        let found = format!("V {mean:.2}, scatter {sigma:.2}, from {least:.2} to {most:.2}");
        line("faintest star named", found);
    }
    if let Some(expected) = &simulated.expected {
        let (mean, sigma) = (expected.mean_vmag, expected.sigma_mag);
        let limit = limit.detector_limit_vmag;
        let why =
            format!("from the limiting magnitude V {limit:.2} and the catalog stars in the field");
        line(
            "faintest expected",
            format!("V {mean:.2}, scatter {sigma:.2}, {why}"),
        );
        let named = simulated.stars_named;
        let found = expected.stars_found;
        line(
            "stars named",
            format!("{named:.1} per frame, {found:.1} expected"),
        );
    }
    let difference = simulated
        .faintest
        .and_then(|f| f.difference_mag.zip(f.difference_sigma_mag));
    if let Some((difference, sigma)) = difference {
        line("difference", format!("{difference:+.3} ± {sigma:.3} mag"));
    }
    if let Some(expected) = &simulated.expected_by_brightest_pixel {
        let (mean, sigma, found) = (expected.mean_vmag, expected.sigma_mag, expected.stars_found);
        let paper = limit.paper_faintest_vmag;
        let value = format!(
            "V {mean:.2}, scatter {sigma:.2}, {found:.1} stars; the paper has {paper:.2}, and {paper_stars} stars"
        );
        line("by the paper's rule", value);
    }
    let (wrong, faintest) = (simulated.named_wrongly, simulated.faintest_wrong);
    let wrongly = match wrong {
        0 => "none".to_owned(),
        _ => format!(
            "{wrong} in all frames; in {faintest} cases it is the faintest named star of the frame"
        ),
    };
    line("named wrongly", wrongly);
    text += &completeness_text(simulated);
    text
}

/// Share of stars found, by magnitude.
fn completeness_text(simulated: &SimulatedReport) -> String {
    let mut text = "\n  V                 stars     found  expected     named\n".to_owned();
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
