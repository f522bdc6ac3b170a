//! The page of a night.

use super::text;
use crate::cli::output::rows::csv_table;
use crate::cli::page::{options, table};
use starpipe::night::{self, Moment, NightRow, NightSummary};
use starpipe::report::page::{Fact, PageContent, PageFigure};

/// The page of the frames of a night; `csv` is their table.
pub(super) fn build(
    rows: &[NightRow],
    summary: &NightSummary,
    csv: &str,
) -> anyhow::Result<PageContent> {
    let figure = night::svg(rows, summary).map(|svg| PageFigure {
        caption: "The night; point at a dot, or touch it, to see its values".to_owned(),
        svg,
        is_wide: true,
        is_colored: true,
    });
    let mut tables = Vec::new();
    if !summary.moments.is_empty() {
        let moments = summary.moments.iter().map(MomentLine::from_moment);
        tables.push(table("What changed", &csv_table(moments)?)?);
    }
    tables.push(table("Frames", csv)?);
    Ok(PageContent {
        title: match summary.first_date.as_str() {
            "" => "A night".to_owned(),
            date => format!("Night of {}", date.split('T').next().unwrap_or(date)),
        },
        question: "How was the night?".to_owned(),
        answer: text::answer(summary),
        facts: text::medians(summary)
            .map(|median| Fact::new(format!("Median {}", median.name), median.value))
            .collect(),
        text: text::text(summary),
        figures: figure.into_iter().collect(),
        tables,
        provenance: vec![options()],
        ..PageContent::default()
    })
}

/// A moment as a line of a table.
#[derive(serde::Serialize)]
struct MomentLine<'a> {
    date: &'a str,
    frame: usize,
    what: String,
}

impl<'a> MomentLine<'a> {
    fn from_moment(moment: &'a Moment) -> Self {
        Self {
            date: &moment.date,
            frame: moment.frame,
            what: moment.to_text(),
        }
    }
}
