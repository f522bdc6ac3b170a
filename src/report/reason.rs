//! The reasons why a frame was not identified, as text with what may help.

use crate::base::format::decimals_for;
use crate::base::units::DEG_PER_RAD;
use crate::identify::diagnosis::{Diagnosis, Excluded};
use crate::identify::{ScaleSource, SearchFailure};
use crate::solve::{Reason, Solution};

/// `reason` as text.
pub(super) fn text(reason: &Reason, solution: &Solution) -> String {
    match reason {
        Reason::Search(failure) => failure_text(failure, solution),
        Reason::Diagnosis(cause) => cause_text(cause),
    }
}

fn failure_text(failure: &SearchFailure, solution: &Solution) -> String {
    match failure {
        SearchFailure::TooFewStars { found, needed } => too_few(*found, *needed, solution),
        SearchFailure::NoMatch { .. } => no_match(solution),
        SearchFailure::NotConfirmed { .. } => {
            "catalog stars match the brightest detections, but too few of the other detections confirm the \
             match; give the field of view and the direction if you know them"
                .to_owned()
        }
        SearchFailure::Interrupted => {
            "the search reached the time limit per frame".to_owned()
        }
    }
}

fn cause_text(cause: &Diagnosis) -> String {
    match cause {
        Diagnosis::NoVariation { level_adu } => format!(
            "the frame is empty: every pixel has the value {level_adu}; check whether the lens was covered"
        ),
        Diagnosis::Saturated {
            share,
            sky,
            level_adu,
        } => format!(
            "the frame is overexposed: {:.0} % of the pixels are at full scale, {level_adu}, and the sky \
             background is at {:.0} % of full scale; use a shorter exposure, or a darker site",
            share * 100.0,
            sky * 100.0
        ),
        Diagnosis::Negative { spots } => format!(
            "the frame is a negative: {spots} dark spots in it look like stars; invert it, for example with \
             ImageMagick's `magick negative.png -negate positive.png`"
        ),
        Diagnosis::Trails {
            trails,
            angle_rad,
            length_px,
        } => trails_text(*trails, *angle_rad, *length_px),
        Diagnosis::DoubleExposure(double) => format!(
            "every star appears twice, as in a double exposure: {double}; use a single exposure"
        ),
        Diagnosis::TooNarrow {
            fov_x_rad,
            source,
            narrowest_rad,
            stars,
        } => too_narrow(*fov_x_rad, *source, *narrowest_rad, *stars),
        Diagnosis::HintsExclude(excluded) => excluded_text(excluded),
        seen => picture_text(seen),
    }
}

/// What the picture shows instead of stars, and what helps.
fn picture_text(cause: &Diagnosis) -> String {
    match cause {
        Diagnosis::StarTrails {
            turn_rad,
            center_px,
            ..
        } => star_trails(*turn_rad, *center_px),
        Diagnosis::BrightDisc {
            middle_px: [x, y],
            diameter_px,
        } => format!(
            "a bright disk, such as the Moon, the Sun or a lamp, outshines the stars: it is \
             {diameter_px:.0} px wide, around ({x:.0}, {y:.0}); point the camera away from it"
        ),
        Diagnosis::OutOfFocus { disc_px } => format!(
            "the stars are out of focus: they are disks of about {disc_px:.0} px; focus manually on a \
             bright star"
        ),
        Diagnosis::Mosaic {
            parts: [columns, rows],
        } => format!(
            "the frame is a mosaic or collage: seams divide it into at least {columns} × {rows} pictures; \
             use one of them at a time"
        ),
        Diagnosis::Clouds { variation } => format!(
            "the sky background is patchy, as with clouds (it varies by {:.0} %), and few stars are \
             visible; a clear sky is needed",
            variation * 100.0
        ),
        Diagnosis::Labels { words } => format!(
            "the picture looks like a star chart or a planetarium view, with {words} words in it; use a \
             photograph, or a view without labels and lines"
        ),
        Diagnosis::Black { hot_pixels } => black(*hot_pixels),
        Diagnosis::FewStars { stars } => format!(
            "only {stars} stars were detected, too few for a reliable identification; use a longer exposure \
             or a wider field of view"
        ),
        plain => plain_text(plain).to_owned(),
    }
}

/// Causes without a number.
fn plain_text(cause: &Diagnosis) -> &'static str {
    match cause {
        Diagnosis::Drawing => {
            "the picture looks like a drawing, a text or a screenshot; use a photograph of the night sky"
        }
        Diagnosis::Daylight => {
            "the sky is bright and blue, as in daylight; take the picture at night, when stars are visible"
        }
        Diagnosis::Aurora => {
            "the green light of an aurora hides the stars; use a shorter exposure, or a part of the sky \
             without aurora"
        }
        other => other.code(),
    }
}

fn star_trails(turn_rad: f64, [x, y]: [f64; 2]) -> String {
    /// The sky turns once in a sidereal day.
    const MINUTES_PER_DEG: f64 = 23.934_47 * 60.0 / 360.0;
    let turn_deg = turn_rad * DEG_PER_RAD;
    let minutes = turn_deg * MINUTES_PER_DEG;
    format!(
        "the stars are trails around ({x:.0}, {y:.0}): the sky rotated by about {turn_deg:.0}°, as it does \
         in {minutes:.0} minutes; expose for seconds, or use a single picture of the series"
    )
}

fn black(hot_pixels: usize) -> String {
    let hot = match hot_pixels {
        0 => String::new(),
        1 => " and 1 hot pixel".to_owned(),
        _ => format!(" and {hot_pixels} hot pixels"),
    };
    format!("the picture is black, with only noise{hot}; uncover the lens, or expose longer")
}

fn too_narrow(fov_x_rad: [f64; 2], source: ScaleSource, narrowest_rad: f64, stars: f64) -> String {
    let stated = match source {
        ScaleSource::User | ScaleSource::Program => "that was given",
        ScaleSource::Camera => "from the camera description",
        ScaleSource::Header => "from the file's header",
    };
    format!(
        "the field of view {stated}, {} wide, is too narrow for the catalog: {} expected in this field, and \
         fields of {} or more have enough; use a catalog with fainter stars",
        range(fov_x_rad),
        expected(stars),
        degrees(narrowest_rad),
    )
}

/// How many stars are expected.
fn expected(stars: f64) -> String {
    match stars.round() {
        0.0 => "less than 1 star is".to_owned(),
        1.0 => "1 star is".to_owned(),
        stars => format!("{stars:.0} stars are"),
    }
}

fn too_few(found: usize, needed: usize, solution: &Solution) -> String {
    let others = solution.sources.len().saturating_sub(found);
    let found = match found {
        0 => "no star was detected".to_owned(),
        1 => "only 1 star was detected".to_owned(),
        _ => format!("only {found} stars were detected"),
    };
    let others = match others {
        0 => String::new(),
        1 => " (and 1 detection that does not look like a star)".to_owned(),
        _ => format!(" (and {others} detections that do not look like stars)"),
    };
    let help = match solution.background {
        Some(_) => "; use a longer exposure or a lower detection threshold",
        None => "",
    };
    format!("{found}{others}, but at least {needed} are needed{help}")
}

fn no_match(solution: &Solution) -> String {
    let stars = solution
        .sources
        .iter()
        .filter(|source| source.measured.is_none_or(|m| m.flags.is_star_like()))
        .count();
    let tried = match solution.sources.len() {
        all if all == stars => format!("the {all} detections"),
        all => format!("the {stars} detections of {all} that look like stars"),
    };
    format!(
        "{tried} match no part of the sky; if the frame shows stars, give the field of view and the \
         direction if you know them; for the narrow field of a telescope, use a catalog with fainter stars"
    )
}

fn trails_text(trails: usize, angle_rad: f64, length_px: f64) -> String {
    let angle_deg = (angle_rad * DEG_PER_RAD).round();
    let direction = match angle_deg.abs() as u32 {
        0 => "horizontal".to_owned(),
        90 => "vertical".to_owned(),
        angle if angle_deg > 0.0 => format!("at {angle}°, rising to the right"),
        angle => format!("at {angle}°, falling to the right"),
    };
    format!(
        "the stars are trailed: {trails} trails are about {length_px:.0} px long and {direction}; use a \
         shorter exposure, a steadier mount or tracking"
    )
}

fn excluded_text(excluded: &Excluded) -> String {
    let (ra_rad, dec_rad) = excluded.boresight.to_ra_dec();
    let mut text = format!(
        "{} stars match in a field {} wide around RA {:.2}°, Dec {:+.2}°",
        excluded.stars,
        degrees(excluded.fov_x_rad),
        ra_rad * DEG_PER_RAD,
        dec_rad * DEG_PER_RAD,
    );
    text += &match excluded.allowed_fov_x_rad {
        Some(allowed) => {
            let allowed = range(allowed);
            format!(", which is outside the given range of widths, {allowed}")
        }
        None => ", but only if the given scale is ignored".to_owned(),
    };
    text
}

/// An angle with three significant digits.
fn degrees(angle_rad: f64) -> String {
    let angle_deg = angle_rad * DEG_PER_RAD;
    let decimals = decimals_for(angle_deg / 10.0, 4);
    format!("{angle_deg:.decimals$}°")
}

fn range([low_rad, high_rad]: [f64; 2]) -> String {
    format!("{} to {}", degrees(low_rad), degrees(high_rad))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, UnitVector};
    use crate::base::units::RAD_PER_DEG;
    use crate::solve::sample;
    use crate::solve::{Outcome, Source};

    fn text_of(reason: Reason, detections: usize) -> String {
        let source = Source {
            position: PixelPoint::new(1.0, 2.0),
            measured: None,
            flux: None,
        };
        let outcome = Outcome::NotIdentified(reason.clone());
        let solution = Solution {
            sources: vec![source; detections],
            ..sample::solution(100, 100, outcome)
        };
        text(&reason, &solution)
    }

    #[test]
    fn a_reason_names_found_and_needed_stars_and_what_may_help() {
        let few = Reason::Search(SearchFailure::TooFewStars {
            found: 1,
            needed: 4,
        });
        assert_eq!(
            text_of(few, 3),
            "only 1 star was detected (and 2 detections that do not look like stars), but at least 4 are \
             needed"
        );
        let no_match = |best_log10_false_alarm| {
            Reason::Search(SearchFailure::NoMatch {
                best_log10_false_alarm,
            })
        };
        assert!(text_of(no_match(None), 12).contains("12 detections"));
        assert!(!text_of(no_match(Some(-6.34)), 12).contains("6.3"));
        assert_eq!(no_match(Some(-6.34)).best_log10_false_alarm(), Some(-6.34));
        assert_eq!(no_match(Some(f64::NAN)).best_log10_false_alarm(), None);
    }

    #[test]
    fn an_excluded_solution_names_the_priors_that_exclude_it() {
        let excluded = Excluded {
            fov_x_rad: 11.427 * RAD_PER_DEG,
            boresight: UnitVector::from_ra_dec(10.0 * RAD_PER_DEG, -5.0 * RAD_PER_DEG),
            stars: 40,
            allowed_fov_x_rad: Some([18.0 * RAD_PER_DEG, 22.0 * RAD_PER_DEG]),
        };
        assert_eq!(
            text_of(
                Reason::Diagnosis(Diagnosis::HintsExclude(Box::new(excluded))),
                50
            ),
            "40 stars match in a field 11.4° wide around RA 10.00°, Dec -5.00°, which is outside the given \
             range of widths, 18.0° to 22.0°"
        );
    }

    #[test]
    fn the_direction_of_trails_is_given_as_seen() {
        for (angle_deg, expected) in [
            (0.3_f64, "long and horizontal"),
            (90.0, "long and vertical"),
            (-89.9, "long and vertical"),
            (35.0, "at 35°, rising to the right"),
            (-35.0, "at 35°, falling to the right"),
        ] {
            let text = trails_text(12, angle_deg * RAD_PER_DEG, 23.4);
            assert!(text.contains(expected) && text.contains("23 px"), "{text}");
        }
    }
}
