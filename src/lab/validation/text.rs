//! Summary as text for people.

use super::summary::{
    AttitudeSummary, DifferenceSummary, IdentificationBin, Pull, PullSummary, Quantiles,
    ValidationSummary,
};
use std::fmt::Write as _;

const CENTROIDS_HEADING: &str = "
Centroids of isolated, unsaturated stars; errors on one axis
              SNR     stars     rms px   bound px           ratio  stated px    light  its ratio
";
const PULLS_HEADING: &str = "
Pulls: errors in units of their stated standard errors
                    values      mean       sd  beyond 2  beyond 3  beyond 5
    expected                         0        1    4.55 %    0.27 %    0.00 %
";

impl ValidationSummary {
    /// The summary as text of several lines, each with a line end.
    pub fn to_text(&self) -> String {
        let facts = &self.facts;
        let mut text = format!(
            "{} frames at random attitudes: {}, {} × {} px, seed {}, {}\n",
            self.frames,
            facts.camera,
            facts.width_px,
            facts.height_px,
            facts.seed,
            match facts.scale_known {
                true => "scale known from the camera description",
                false => "scale unknown",
            }
        );
        text += &self.identification_text();
        text += &self.detection_text();
        text += &self.completeness_text();
        text += &self.centroids_text();
        text += &self.pulls_text();
        if let Some(attitude) = &self.attitude {
            text += &attitude_text(attitude);
        }
        text + &self.differences_text() + &self.notes_text()
    }

    fn identification_text(&self) -> String {
        let all = &self.identification.all;
        let mut text = format!(
            "\nIdentification\n  right {} of {}: {:.2} % (95 %: {:.2} to {:.2} %); none {}, wrong {} (95 %: below {:.2} %)\n",
            all.right,
            all.frames,
            all.right_percent,
            all.right_low_percent,
            all.right_high_percent,
            all.none,
            all.wrong,
            all.wrong_high_percent + 0.005,
        );
        text += "  stars above the limit    frames    right   none  wrong     right                95 %\n";
        for bin in &self.identification.by_stars {
            text += &identification_line(bin);
        }
        text
    }

    fn detection_text(&self) -> String {
        let d = &self.detection;
        let per_frame = |count: u64| count as f64 / self.frames.max(1) as f64;
        format!(
            "\nDetection\n  {:.1} detections per frame, {:.1} of them named; {} of {} names are wrong, {} \
             of these name another star at the same position\n  false: {} in all frames, {} per million \
             pixels (95 %: {} to {}), requested {}\n  blends {}, rejected as not stars {}, stars split into \
             several detections {}\n",
            per_frame(d.detected),
            per_frame(d.named),
            d.misnamed,
            d.named,
            d.misnamed_companions,
            d.false_detections,
            d.false_per_mpx,
            d.false_low_per_mpx,
            d.false_high_per_mpx,
            self.facts.false_alarms_per_mpx,
            d.blends,
            d.rejected,
            d.split,
        )
    }

    fn completeness_text(&self) -> String {
        let c = &self.completeness;
        let mut text = format!(
            "\nCompleteness of isolated stars\n  predicted limiting magnitude (50 %): V {:.3}\n",
            c.predicted_limit_vmag
        );
        if let (Some(limit), Some(sigma), Some(predicted), Some(difference)) = (
            c.measured_limit_vmag,
            c.measured_limit_sigma_mag,
            c.predicted_fit_vmag,
            c.difference_mag,
        ) {
            let _ = writeln!(
                text,
                "  fitted to the detections: V {limit:.3} ± {sigma:.3}; to the predicted probabilities: V \
                 {predicted:.3}; difference {difference:+.3} mag"
            );
        }
        text += "        V     stars     found   measured              95 %  predicted\n";
        for bin in &c.bins {
            let interval = format!("{:.3} to {:.3}", bin.low, bin.high);
            let _ = writeln!(
                text,
                "  {:>7.2} {:>9} {:>9} {:>10.4} {interval:>17} {:>10.4}",
                bin.vmag, bin.stars, bin.detected, bin.measured, bin.predicted
            );
        }
        text
    }

    fn centroids_text(&self) -> String {
        let mut text = CENTROIDS_HEADING.to_owned();
        for bin in &self.centroids.bins {
            let or_dash = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
            let bound = or_dash(bin.bound_px.map(|px| format!("{px:.5}")));
            let ratio = bin.ratio.zip(bin.ratio_sigma);
            let ratio = or_dash(ratio.map(|(ratio, sigma)| format!("{ratio:.3} ± {sigma:.3}")));
            let flux = or_dash(bin.flux_ratio.map(|ratio| format!("{ratio:.3}")));
            let _ = writeln!(
                text,
                "  {:>15} {:>9} {:>10.5} {bound:>10} {ratio:>15} {:>10.5} {:>8.4} {flux:>10}",
                format!("{:.1} to {:.1}", bin.from_snr, bin.to_snr),
                bin.stars,
                bin.rms_px,
                bin.stated_px,
                bin.flux_part,
            );
        }
        text
    }

    fn pulls_text(&self) -> String {
        let mut text = PULLS_HEADING.to_owned();
        for (name, pull) in self.pulls.named() {
            let _ = writeln!(
                text,
                "  {name:<14} {:>9} {:>9.3} {:>8.3} {:>7.2} % {:>7.2} % {:>7.2} %",
                pull.count,
                pull.mean,
                pull.sd,
                pull.beyond_2_percent,
                pull.beyond_3_percent,
                pull.beyond_5_percent
            );
        }
        text
    }

    fn differences_text(&self) -> String {
        let mut text = "\nMeasured minus expected, per frame\n".to_owned();
        let mut line = |name: &str, unit: &str, of: &DifferenceSummary| {
            let expected = of
                .expected_sd
                .map_or(String::new(), |sd| format!(", {sd:.3} expected"));
            let _ = writeln!(
                text,
                "  {name:<24} {:+.4} ± {:.4}{unit}, scatter {:.4}{expected}; {} frames",
                of.mean, of.mean_sigma, of.sd, of.count
            );
        };
        line("faintest star named", " mag", &self.faintest);
        line("measured limit", " mag", &self.frame_limit);
        line("zero point", " mag", &self.zero_point);
        line("background", " ADU", &self.background);
        let noise = &self.noise_ratio;
        let _ = writeln!(
            text,
            "  measured over true noise {:.4} ± {:.4}, scatter {:.4}; {} frames",
            noise.mean, noise.mean_sigma, noise.sd, noise.count
        );
        text
    }

    /// The frames with each note; empty where there are none.
    fn notes_text(&self) -> String {
        if self.notes.is_empty() {
            return String::new();
        }
        let mut text = "\nFrames with a note\n".to_owned();
        for (code, frames) in &self.notes {
            let _ = writeln!(text, "  {code:<28} {frames:>6}");
        }
        text
    }
}

impl PullSummary {
    /// All of them, with their names.
    pub fn named(&self) -> [(&'static str, &Pull); 10] {
        [
            ("star's x", &self.x),
            ("star's y", &self.y),
            ("star's flux", &self.flux),
            ("turn about x", &self.attitude_x),
            ("turn about y", &self.attitude_y),
            ("roll", &self.roll),
            ("focal length", &self.focal_length),
            ("zero point", &self.zero_point),
            ("linearity", &self.linearity),
            ("frame's limit", &self.frame_limit),
        ]
    }
}

fn identification_line(bin: &IdentificationBin) -> String {
    let stars = match bin.from_stars == bin.to_stars {
        true => bin.from_stars.to_string(),
        false => format!("{} to {}", bin.from_stars, bin.to_stars),
    };
    let interval = format!(
        "{:.2} to {:.2} %",
        bin.right_low_percent, bin.right_high_percent
    );
    format!(
        "  {stars:<22} {:>8} {:>8} {:>6} {:>6} {:>7.2} % {interval:>19}\n",
        bin.frames, bin.right, bin.none, bin.wrong, bin.right_percent
    )
}

fn attitude_text(attitude: &AttitudeSummary) -> String {
    let mut text = format!(
        "\nAttitude, of {} frames\n  arcseconds              50 %    68.3 %      95 %      99 %       all\n",
        attitude.frames
    );
    let mut line = |name: &str, q: &Quantiles| {
        let _ = writeln!(
            text,
            "  {name:<18} {:>9.3} {:>9.3} {:>9.3} {:>9.3} {:>9.3}",
            q.p50, q.p68, q.p95, q.p99, q.max
        );
    };
    line("boresight error", &attitude.boresight_arcsec);
    line("roll error", &attitude.roll_arcsec);
    let [x, y, roll] = attitude.rms_arcsec;
    let _ = writeln!(
        text,
        "  root mean square: about x {x:.3}, about y {y:.3}, roll {roll:.3}\n  mean NEES {:.3}, expected 3 \
         ± {:.3}\n  residuals {:.4} px root mean square",
        attitude.nees_mean, attitude.nees_sigma, attitude.rms_px
    );
    text
}
