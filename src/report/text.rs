//! The report as text, at most [`LINE_WIDTH`] columns wide where names allow it.

use super::frame_report::{
    AttitudeReport, CalibrationReport, DateReport, FrameReport, MagnitudeReport, MatchReport,
    ObservationReport, OpticsReport, PhotometryReport, StarReport, Status,
};
use crate::base::format::{self, counted, decimals_for, printable};
use crate::base::remedy::{OptionNames, Remedy};
use crate::base::units::ARCSEC_PER_RAD;
use crate::ephemeris::places::AttitudeFrame;
use crate::identify::DateSource;
use crate::solve::Note;

/// Number of stars listed without [`TextOptions::all_stars`].
pub const STARS_SHOWN: usize = 20;

/// Largest width of a line, in columns.
const LINE_WIDTH: usize = 96;
/// Width of the labels in front of the lines, in columns.
const LABEL_WIDTH: usize = 12;

/// Options of the text report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct TextOptions {
    /// List every identified star, not only the [`STARS_SHOWN`] brightest.
    pub all_stars: bool,
    /// How options are called.
    pub option_names: OptionNames,
}

impl FrameReport {
    /// The report as text; every line has its end.
    pub fn to_text(&self, options: TextOptions) -> String {
        let mut lines = self.headline(options.option_names);
        lines.extend(self.matched.iter().map(identified_line));
        let deep = self
            .matched
            .iter()
            .filter_map(|matched| matched.catalog.as_deref());
        lines.extend(deep.map(|title| labelled("catalog", title)));
        lines.push(labelled(
            "picture",
            &format!("{} × {} px", self.width, self.height),
        ));
        lines.extend(self.best_line().filter(|_| options.all_stars));
        lines.extend(self.attitude.iter().flat_map(attitude_lines));
        lines.extend(self.optics.iter().flat_map(optics_lines));
        lines.extend(self.matched.iter().map(residual_line));
        lines.extend(
            self.magnitude
                .iter()
                .map(|magnitude| self.faintest_line(magnitude)),
        );
        lines.extend(self.photometry.iter().flat_map(photometry_lines));
        let magnitude = self.magnitude.as_ref();
        let predicted = self.prediction.iter();
        lines.extend(predicted.flat_map(|prediction| prediction.lines(magnitude)));
        if let Some(sky) = &self.sky {
            lines.extend(sky.lines());
        }
        lines.push(self.date_line(options.option_names));
        lines.extend(self.observation.iter().map(observation_line));
        lines.extend(self.calibration.iter().map(calibration_line));
        // The line of the date has said it.
        let notes = self
            .notes
            .iter()
            .filter(|note| note.code != Note::NoDate.code());
        lines.extend(notes.map(|note| labelled("note", &note.text)));
        lines.extend(self.background_line());
        lines.extend(self.sky_line());
        lines.push(self.timing_line());
        lines.extend(self.star_lines(options));
        lines.iter().map(|line| printable(line) + "\n").collect()
    }

    /// What the frame shows, or why it is not identified.
    fn headline(&self, names: OptionNames) -> Vec<String> {
        let text = match (&self.sentence, &self.reason) {
            (Some(sentence), _) => sentence.clone(),
            (None, Some(reason)) => {
                format!("not identified: {reason}{}", names.see(&self.remedies))
            }
            (None, None) => "not identified".to_owned(),
        };
        let name = format!("{}: ", self.frame);
        let mut lines = wrap(&text, LINE_WIDTH - 2, name.chars().count()).into_iter();
        let first = lines.next().unwrap_or_default();
        let others = lines.map(|line| format!("  {line}"));
        let first = (name + &first).trim_end().to_owned();
        std::iter::once(first).chain(others).collect()
    }

    /// How close the best arrangement came, where none was good enough.
    fn best_line(&self) -> Option<String> {
        let best = self.best_log10_false_alarm?;
        let text =
            format!("log10 of the false-alarm probability is {best:.1}; -8 or less is needed");
        Some(labelled("best match", &text))
    }

    fn faintest_line(&self, magnitude: &MagnitudeReport) -> String {
        let text = format!(
            "V {:.2}, star {}",
            magnitude.faintest_vmag, magnitude.faintest_id
        );
        labelled("faintest", &text)
    }

    fn date_line(&self, names: OptionNames) -> String {
        let text = match &self.date {
            Some(date) => {
                let source = match date.source {
                    DateSource::User => "as given",
                    DateSource::FileHeader => "from the file's header",
                    DateSource::FileName => "from the file's name",
                };
                let is_assumed = date.utc_offset_source == Some("assumed");
                let zone = if is_assumed { "" } else { " UTC" };
                let utc = date.iso.replace('T', " ").replace('Z', zone);
                let offset = offset_text(date);
                format!("{utc}, {source}{offset}")
            }
            None => {
                let see = names.see(&[Remedy::Date]);
                let error = match self.status {
                    Status::Identified => {
                        ", and aberration is not corrected; the stated error of the focal length allows for \
                         this"
                    }
                    Status::NotIdentified => "",
                };
                format!("unknown: star positions of J2000.0 are used{error}{see}")
            }
        };
        labelled("date", &text)
    }

    fn background_line(&self) -> Option<String> {
        let (level, noise) = (self.background.level?, self.background.noise?);
        let decimals = decimals_for(noise, 6);
        let text = format!("{level:.decimals$}, noise {noise:.decimals$} per pixel");
        Some(labelled("background", &text))
    }

    /// What is in front of the sky, where that is more than a hundredth of the frame.
    fn sky_line(&self) -> Option<String> {
        let share = self.background.sky_share.filter(|share| *share < 0.99)?;
        let text = format!(
            "{:.0} % of the frame; the rest is masked, or hidden by trees, houses or the like",
            100.0 * share
        );
        Some(labelled("visible sky", &text))
    }

    fn timing_line(&self) -> String {
        let timing = &self.timing_ms;
        let stages = [
            ("read", timing.read),
            ("detect", timing.detect),
            ("identify", timing.identify),
            ("photometry", timing.photometry),
        ];
        let taken: Vec<String> = stages
            .iter()
            .filter(|(_, ms)| *ms > 0.0)
            .map(|(stage, ms)| format!("{stage} {ms:.1}"))
            .collect();
        let text = format!("{:.1} ms: {}", timing.total, taken.join(", "));
        labelled("time", &text)
    }

    fn star_lines(&self, options: TextOptions) -> Vec<String> {
        let named: Vec<&StarReport> = self.stars.iter().filter(|s| s.id.is_some()).collect();
        if named.is_empty() {
            return Vec::new();
        }
        let shown = if options.all_stars {
            named.len()
        } else {
            STARS_SHOWN
        };
        let mut lines = vec![String::new()];
        lines.extend(star_table(&named[..named.len().min(shown)]));
        if named.len() > shown {
            lines.push(format!(
                "  and {} fainter{}",
                named.len() - shown,
                options.option_names.see(&[Remedy::AllStars])
            ));
        }
        lines
    }
}

/// What a local time was taken to be ahead of UTC.
fn offset_text(date: &DateReport) -> String {
    let hours = date.utc_offset_h.unwrap_or_default();
    match date.utc_offset_source {
        Some("option") => format!(", local time {hours} h ahead of UTC as given"),
        Some("stars") => format!(", local time {hours} h ahead of UTC as measured with the stars"),
        Some("assumed") => ", assumed to be UTC".to_owned(),
        Some("contradicted") => " (the stars contradict this time or the site)".to_owned(),
        _ => String::new(),
    }
}

fn observation_line(seen: &ObservationReport) -> String {
    let azimuth_deg = seen.azimuth_deg;
    let text = match (seen.apparent_zenith_distance_deg, seen.airmass) {
        (Some(apparent_deg), Some(airmass)) => format!(
            "{apparent_deg:.2}° from the zenith, azimuth {azimuth_deg:.2}°, airmass {airmass:.3}"
        ),
        _ => format!(
            "{:.2}° from the zenith, azimuth {azimuth_deg:.2}°",
            seen.zenith_distance_deg
        ),
    };
    labelled("direction", &text)
}

fn attitude_lines(attitude: &AttitudeReport) -> Vec<String> {
    let sigma = &attitude.sigma_arcsec;
    let sigma_arcsec = sigma.x.max(sigma.y);
    let sigma_deg = sigma_arcsec / 3600.0;
    let seconds = decimals_for(sigma_arcsec, 4);
    // One second of right ascension is up to 15″, so it takes one more digit.
    let ra = format::hours(attitude.ra_deg, (seconds + 1).min(4));
    let dec = format::degrees(attitude.dec_deg, seconds);
    let decimals = decimals_for(sigma_deg, 7);
    let roll_sigma_deg = sigma.roll / 3600.0;
    let roll_decimals = decimals_for(roll_sigma_deg, 6);
    vec![
        labelled(
            "center",
            &format!("RA {ra}  Dec {dec}  ± {}", format::small(sigma_arcsec)),
        ),
        labelled(
            "",
            &format!(
                "RA {:.decimals$}°  Dec {:+.decimals$}°  ± {sigma_deg:.decimals$}°  ({})",
                attitude.ra_deg,
                attitude.dec_deg,
                match attitude.frame_of {
                    AttitudeFrame::Icrs => "ICRS",
                    AttitudeFrame::Apparent => "apparent place, ICRS axes",
                }
            ),
        ),
        labelled(
            "roll",
            &format!(
                "image up at position angle {:.roll_decimals$}° ± {roll_sigma_deg:.roll_decimals$}°, \
                 from north through east",
                attitude.up_pa_deg
            ),
        ),
    ]
}

fn optics_lines(optics: &OpticsReport) -> Vec<String> {
    let sigma_px = optics.focal_length_sigma_px.unwrap_or(f64::NAN);
    let decimals = decimals_for(sigma_px, 2);
    let mut focal = format!("focal length {:.decimals$}", optics.focal_length_px);
    if sigma_px.is_finite() {
        focal += &format!(" ± {sigma_px:.decimals$}");
    }
    let pixel_arcsec = ARCSEC_PER_RAD / optics.focal_length_px;
    let mirrored = if optics.mirrored {
        "mirrored"
    } else {
        "not mirrored"
    };
    let field = match (optics.fov_x_deg.zip(optics.fov_y_deg), optics.valid_to_deg) {
        (Some((x, y)), _) => format!("{x:.3}° × {y:.3}°"),
        (None, to_deg) => format!("within {:.1}° of the axis", to_deg.unwrap_or(f64::NAN)),
    };
    let mut lines = vec![labelled(
        "field",
        &format!("{field}, {pixel_arcsec:.3}″ a pixel, {focal} px, {mirrored}",),
    )];
    let distortion = match &optics.distortion {
        None => "none measurable".to_owned(),
        Some(lens) => format!(
            "{}, up to {:.2} px {}",
            lens.model,
            lens.largest_px,
            edge_of_field(optics)
        ),
    };
    lines.push(labelled("distortion", &distortion));
    lines
}

/// Where a field ends.
fn edge_of_field(optics: &OpticsReport) -> &'static str {
    match optics.valid_to_deg {
        None => "in the corners",
        Some(_) => "at the edge of the field",
    }
}

fn photometry_lines(photometry: &PhotometryReport) -> Vec<String> {
    let limit = photometry.limit50_vmag.zip(photometry.limit50_sigma_mag);
    let limit_text = match (limit, &photometry.limit50_reason) {
        (Some((vmag, sigma)), _) => {
            format!("V {vmag:.2} ± {sigma:.2}, where half of the catalog's stars are detected")
        }
        (None, reason) => reason.clone().unwrap_or_default(),
    };
    let zero_point = photometry
        .zero_point_vmag
        .zip(photometry.zero_point_sigma_mag);
    let mut text = match zero_point {
        Some((vmag, sigma)) => format!(
            "V {vmag:.3} ± {sigma:.3} for 1 {}; {}, scatter {:.2} mag",
            photometry.flux_unit,
            counted(photometry.zero_point_stars, "star"),
            photometry.scatter_mag.unwrap_or(f64::NAN),
        ),
        None => photometry
            .no_zero_point
            .as_ref()
            .map_or_else(String::new, |reason| reason.text.clone()),
    };
    if let Some((term, sigma)) = photometry.color_term.zip(photometry.color_term_sigma) {
        text += &format!("; color term {term:+.2} ± {sigma:.2}");
    }
    vec![
        labelled("limit", &limit_text),
        labelled("zero point", &text),
    ]
}

fn identified_line(matched: &MatchReport) -> String {
    let text = format!(
        "{} of {}; false-alarm probability 10^{:.0}",
        matched.matched,
        counted(matched.detected, "detection"),
        matched.log10_false_alarm,
    );
    labelled("identified", &text)
}

fn residual_line(matched: &MatchReport) -> String {
    let text = format!(
        "{:.3} px, {} rms",
        matched.rms_px,
        format::small(matched.rms_arcsec)
    );
    labelled("residuals", &text)
}

/// The table of stars with its heading.
fn star_table(stars: &[&StarReport]) -> Vec<String> {
    let id = |star: &StarReport| star.id.clone().unwrap_or_default();
    let name = |star: &StarReport| star.name.clone().unwrap_or_default();
    let width = |text: &dyn Fn(&StarReport) -> String, heading: &str| {
        let longest = stars.iter().map(|s| text(s).chars().count()).max();
        longest.unwrap_or(0).max(heading.len())
    };
    let id_width = width(&id, "star");
    let name_width = width(&name, "");
    let row = |id: &str, name: &str, rest: &str| {
        let gap = if name_width > 0 { "  " } else { "" };
        format!("  {id:<id_width$}{gap}{name:<name_width$}{rest}")
    };
    let heading = format!(
        "{:>7}{:>10}{:>10}{:>9}{:>14}{:>9}",
        "V", "x", "y", "SNR", "residual (px)", "chance"
    );
    let mut lines = vec![row("star", "", &heading)];
    lines.extend(stars.iter().map(|star| {
        let rest = format!(
            "{:>7}{:>10.2}{:>10.2}{:>9}{:>14}{:>9}",
            or_dash(star.vmag, |v| format!("{v:.2}")),
            star.x,
            star.y,
            or_dash(star.snr, snr),
            or_dash(star.residual_px, |px| format!("{px:.3}")),
            or_dash(star.p_chance, |p| format!("{p:.0e}")),
        );
        row(&id(star), &name(star), &rest)
    }));
    lines
}

fn snr(value: f64) -> String {
    let decimals = usize::from(value < 100.0);
    format!("{value:.decimals$}")
}

fn or_dash(value: Option<f64>, print: impl Fn(f64) -> String) -> String {
    value.map_or_else(|| "–".to_owned(), print)
}

fn calibration_line(applied: &CalibrationReport) -> String {
    let parts = [
        ("dark", &applied.dark),
        ("flat", &applied.flat),
        ("hot pixels", &applied.hot_pixels),
        ("mask", &applied.mask),
    ];
    let applied = parts.into_iter().filter_map(|(kind, file)| {
        let file = file.as_ref()?;
        Some(format!("{kind} {file}"))
    });
    labelled("calibrated", &applied.collect::<Vec<_>>().join(", "))
}

pub(super) fn labelled(label: &str, text: &str) -> String {
    format!("  {label:<LABEL_WIDTH$}{text}")
}

/// Wraps `text` at blanks into lines of at most `width` characters, except for longer words; `lead` of the first
/// line are taken.
fn wrap(text: &str, width: usize, lead: usize) -> Vec<String> {
    let mut lines = Vec::new();
    let (mut line, mut taken) = (String::new(), lead);
    for word in text.split_whitespace() {
        let length = word.chars().count();
        if taken + 1 + length > width && taken > 0 {
            lines.push(std::mem::take(&mut line));
            taken = 0;
        }
        if !line.is_empty() {
            line.push(' ');
            taken += 1;
        }
        line.push_str(word);
        taken += length;
    }
    lines.push(line);
    lines
}
