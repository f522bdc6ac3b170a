//! Rows of results, one for each kind of frame.

use super::evaluation::ClutterFrameResult;
use super::kind::ClutterKind;
use crate::base::format::{to_decimals, to_significant};
use crate::lab::robustness::{Answers, Interval};
use crate::predict::Scenario;
use serde::Serialize;

const HEADING: &str = "                  frames   right  wrong  detected  false/Mpx requested    named   wrong            95 %   stated\n";

/// The results of all frames of a kind.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct KindResult {
    pub camera: String,
    pub kind: ClutterKind,
    pub is_sky: bool,
    pub frames: usize,
    pub right: usize,
    pub wrong: usize,
    pub wrong_high_percent: f64,
    pub detected: usize,
    pub false_detections: usize,
    pub false_per_mpx: f64,
    pub asked_per_mpx: f64,
    pub named: usize,
    pub misnamed: usize,
    pub misnamed_low_percent: f64,
    pub misnamed_high_percent: f64,
    pub stated_misnamed: f64,
}

impl KindResult {
    /// The results of the frames of a kind in a study of `scenario`.
    pub fn new(kind: ClutterKind, results: &[ClutterFrameResult], scenario: &Scenario) -> Self {
        let answers: Answers = results.iter().map(|result| result.answer).collect();
        let sum = |of: fn(&ClutterFrameResult) -> usize| results.iter().map(of).sum::<usize>();
        let megapixels: f64 = results.iter().map(|result| result.megapixels).sum();
        let (named, misnamed) = (sum(|r| r.named), sum(|r| r.misnamed));
        let false_detections = sum(|r| r.false_detections);
        let stated: f64 = results.iter().map(|r| r.stated_misnamed).sum();
        let share = Interval::of(misnamed, named);
        let percent = |share: f64| to_significant(100.0 * share, 4);
        Self {
            camera: scenario.camera.name.clone(),
            kind,
            is_sky: kind.is_sky(),
            frames: results.len(),
            right: answers.right,
            wrong: answers.wrong,
            wrong_high_percent: percent(answers.wrong_interval().high),
            detected: sum(|r| r.detected),
            false_detections,
            false_per_mpx: to_significant(false_detections as f64 / megapixels, 4),
            asked_per_mpx: scenario.conditions.false_alarms_per_mpx,
            named,
            misnamed,
            misnamed_low_percent: percent(share.low),
            misnamed_high_percent: percent(share.high),
            stated_misnamed: to_decimals(stated, 3),
        }
    }

    /// The rows as text, with sums over the frames with and without sky.
    pub fn to_text(rows: &[Self]) -> String {
        let mut text = HEADING.to_owned();
        for row in rows {
            text += &row.line();
        }
        for (name, is_sky) in [("with sky", true), ("without sky", false)] {
            let of_part = || rows.iter().filter(|row| row.is_sky == is_sky);
            if of_part().count() > 1 {
                text += &sums(name, of_part());
            }
        }
        text
    }

    fn line(&self) -> String {
        let names = names(self.named, self.misnamed, self.stated_misnamed);
        format!(
            "{:<16} {:>7} {:>7} {:>6} {:>9} {:>10.3} {:>9} {names}\n",
            self.kind.name(),
            self.frames,
            self.right,
            self.wrong,
            self.detected,
            self.false_per_mpx,
            self.asked_per_mpx,
        )
    }
}

fn sums<'a>(name: &str, rows: impl Iterator<Item = &'a KindResult> + Clone) -> String {
    let sum = |of: fn(&KindResult) -> usize| rows.clone().map(of).sum::<usize>();
    let stated = rows.clone().map(|row| row.stated_misnamed).sum();
    let names = names(sum(|r| r.named), sum(|r| r.misnamed), stated);
    format!(
        "{name:<16} {:>7} {:>7} {:>6} {:>9} {:>10} {:>9} {names}\n",
        sum(|r| r.frames),
        sum(|r| r.right),
        sum(|r| r.wrong),
        sum(|r| r.detected),
        "",
        "",
    )
}

/// Numbers of names and wrong names, the interval of their share, and the stated number.
fn names(named: usize, misnamed: usize, stated: f64) -> String {
    let share = Interval::of(misnamed, named);
    let [low, high] = [share.low, share.high].map(|share| 100.0 * share);
    let interval = match named {
        0 => "–".to_owned(),
        _ => format!("{low:.3} to {high:.3} %"),
    };
    format!("{named:>8} {misnamed:>7} {interval:>15} {stated:>8.2}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;
    use crate::lab::robustness::Answer;

    fn result(answer: Answer, named: usize, misnamed: usize) -> ClutterFrameResult {
        ClutterFrameResult {
            answer,
            megapixels: 2.0,
            detected: 30,
            false_detections: 4,
            named,
            misnamed,
            stated_misnamed: 0.25,
        }
    }

    #[test]
    fn a_row_counts_frames_and_names() {
        let results = [
            result(Answer::Right, 20, 1),
            result(Answer::Wrong, 10, 10),
            result(Answer::None, 0, 0),
        ];
        let row = KindResult::new(
            ClutterKind::Foliage,
            &results,
            &Scenario::of(Preset::Imx174),
        );
        assert_eq!((row.frames, row.right, row.wrong), (3, 1, 1));
        assert_eq!((row.named, row.misnamed), (30, 11));
        assert_eq!(row.stated_misnamed, 0.75);
        assert_eq!(row.false_per_mpx, 2.0);
        let text = KindResult::to_text(&[row.clone(), row]);
        assert!(text.lines().all(|line| line.chars().count() < 120));
        assert!(text.contains("with sky") && !text.contains("without sky"));
    }
}
