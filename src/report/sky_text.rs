//! The sky of a frame, as lines of a text report.

use super::sky::{SkyCellReport, SkyReport};
use super::text::labelled;
use crate::base::format::counted;

impl SkyReport {
    /// Its lines in a text report.
    pub(super) fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if let Some(zenith) = &self.zenith {
            let color = zenith
                .bv_mag
                .zip(zenith.bv_sigma_mag)
                .map_or_else(String::new, |(mag, sigma)| {
                    format!("B−V {mag:.2} ± {sigma:.2}, ")
                });
            lines.push(labelled(
                "zenith",
                &format!(
                    "{:.2} ± {:.2} mag/arcsec² (V), {color}{:.2} mcd/m²; naked-eye limit V {:.1}, Bortle {}",
                    zenith.mag_arcsec2,
                    zenith.sigma_mag,
                    zenith.luminance_mcd_m2,
                    zenith.naked_eye_limit_vmag,
                    zenith.bortle
                ),
            ));
        }
        if let Some(range) = self.range(|cell| cell.mag_arcsec2) {
            let cells = counted(self.cells.len(), "cell");
            let [bright, dark] = range;
            let text = format!("{bright:.2} to {dark:.2} mag/arcsec² (V) over {cells}");
            lines.push(labelled("sky", &text));
        }
        if let (Some("unlit"), Some(level), Some(sigma)) = (
            self.dark_level_source,
            self.dark_level_adu,
            self.dark_level_sigma_adu,
        ) {
            let text = format!(
                "{level:.1} ± {sigma:.1} ADU, measured outside the image circle of the lens"
            );
            lines.push(labelled("dark level", &text));
        }
        if self.dark_level_source == Some("darkest") {
            let text = "not known; assumed to be between 0 and the darkest part of the frame";
            lines.push(labelled("dark level", text));
        }
        if let Some(tone) = &self.tone_curve {
            let text = format!(
                "sky level proportional to (light)^γ with γ = {:.2} ± {:.2}, measured with stars; included \
                 in the errors",
                tone.exponent, tone.exponent_sigma
            );
            lines.push(labelled("tone curve", &text));
        }
        if let Some(why) = self.no_brightness_text {
            lines.push(labelled("sky", &format!("brightness not measured: {why}")));
        }
        if let (Some(mag), Some(sigma)) =
            (self.extinction_mag_per_airmass, self.extinction_sigma_mag)
        {
            let source = if self.extinction_measured {
                counted(self.stars, "star")
            } else {
                "mostly the assumed typical value, because the stars constrain it little".to_owned()
            };
            let text = format!("{mag:.3} ± {sigma:.3} mag per airmass ({source})");
            lines.push(labelled("extinction", &text));
        }
        if let (Some(share), Some(sigma)) = (self.cloud_share, self.cloud_share_sigma) {
            let text = format!("{:.0} ± {:.0} % of the sky", 100.0 * share, 100.0 * sigma);
            lines.push(labelled("clouds", &text));
        }
        let difference = |cell: &SkyCellReport| {
            let is_clear = cell.clear.is_some_and(|clear| clear > 0.9);
            is_clear.then_some(cell.limit_vmag? - cell.expected_limit_vmag?)
        };
        let differences: Vec<f64> = self.cells.iter().filter_map(difference).collect();
        if !differences.is_empty() {
            let mean = differences.iter().sum::<f64>() / differences.len() as f64;
            let text = format!(
                "measured minus expected {mean:+.2} mag, mean of {} clear cells",
                differences.len()
            );
            lines.push(labelled("limits", &text));
        }
        lines
    }

    /// The least and the largest value.
    fn range(&self, value: impl Fn(&SkyCellReport) -> Option<f64>) -> Option<[f64; 2]> {
        let values = self.cells.iter().filter_map(value).map(|value| [value; 2]);
        values.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }
}
