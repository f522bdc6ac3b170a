//! The page of a study.

use super::args::DefocusArgs;
use super::tables::curve_table;
use super::{figures, plan};
use crate::cli::page::{figure, options, table};
use starpipe::base::format::five_digits;
use starpipe::lab::spot_radius::{DefocusReport, DefocusStarReport, StarStudy};
use starpipe::report::page::{Fact, PageContent, PageFigure};

/// A note if no radius on one side of the best one was tried.
const AT_EDGE: &str = "The best radius is at an end of the range: a better one may lie outside. \
    Widen the range with --radius-px.";

/// The page of the results; `notes` are what was warned of.
pub(super) fn build(
    arguments: &DefocusArgs,
    report: &DefocusReport,
    studies: &[StarStudy],
    mut notes: Vec<String>,
) -> anyhow::Result<PageContent> {
    let stars = &report.stars;
    if let (
        [],
        [
            DefocusStarReport {
                vmag: Some(v_mag), ..
            },
        ],
    ) = (&arguments.vmag[..], &stars[..])
    {
        notes.push(plan::chosen_for_you(*v_mag));
    }
    if stars.iter().any(|star| star.best.is_at_edge) {
        notes.push(AT_EDGE.to_owned());
    }
    let heading = report.heading_text();
    let assumed: Vec<&str> = heading.lines().collect();
    if report.normalisation == "peak" {
        notes.push(assumed[..2].join(" "));
    }
    let drawn: Vec<PageFigure> = figures::sheets(report, studies)
        .iter()
        .map(|(name, sheet)| figure(sheet, caption(name)))
        .collect();
    Ok(PageContent {
        title: "Spot radius with the smallest centroid error".to_owned(),
        question: format!(
            "Which spot radius has the smallest centroid error? {} radii from {} to {} px.",
            report.radii,
            five_digits(report.radii_px[0]),
            five_digits(report.radii_px[1])
        ),
        answer: stars.iter().map(answer).collect::<Vec<_>>().join(" "),
        facts: stars.iter().flat_map(|star| facts(report, star)).collect(),
        notes,
        text: report.to_text(),
        figures: drawn,
        tables: vec![table("Error versus radius", &curve_table(report)?)?],
        provenance: vec![
            options(),
            Fact::new("Seed", report.seed.to_string()),
            Fact::new("Assumed", assumed.join("; ")),
        ],
        ..PageContent::default()
    })
}

fn name_of(star: &DefocusStarReport) -> String {
    star.vmag
        .map_or_else(String::new, |v_mag| format!("V {}: ", five_digits(v_mag)))
}

fn answer(star: &DefocusStarReport) -> String {
    let [from, to] = star.best.nearly_px;
    format!(
        "{}{:.2} px, with an error of {:.4} px. From {from:.2} to {to:.2} px it is at most 5 % larger.",
        name_of(star),
        star.best.radius.radius_px,
        star.best.radius.error_px
    )
}

fn facts(report: &DefocusReport, star: &DefocusStarReport) -> Vec<Fact> {
    let lines = report.radii_lines(star).into_iter();
    lines
        .map(|(name, value)| Fact::new(format!("{}{name}", name_of(star)), value))
        .collect()
}

fn caption(name: &str) -> &'static str {
    match name {
        "errors" => "Centroid error versus noise and radius, with contours",
        "sections" => "Centroid error at four noise levels and at four radii",
        "best-radius" => "Best radius as a function of the noise",
        "accuracy-and-reach" => "Trade-off: centroid error against limiting magnitude",
        "spots" => "Spots of the paper's figure 1",
        "surface" => "Surface fitted to the errors (eq. 13): this run and the paper",
        _ => "The error if pixels are sampled at their centers",
    }
}
