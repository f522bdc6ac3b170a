//! The page of a prediction, or of sweeps.

use super::args::LimitArgs;
use super::figures;
use super::rows::changes_nothing;
use crate::cli::output::rows::csv_table;
use crate::cli::page::{catalog, figure, options, table};
use starpipe::base::format::five_digits;
use starpipe::catalog::Catalog;
use starpipe::predict::{Parameter, PredictionRow, Reading, Scenario, Spacing, Sweep};
use starpipe::report::page::{Fact, PageContent};

const PAPER: &str = "The equations are used as by the authors of the paper. --reading physical corrects errors in them.";
/// What a prediction alone is swept over in the figures of its page.
const SWEPT: [&str; 2] = ["exposure_s", "aperture_mm"];
/// Its values go from this part to this multiple of the scenario's.
const SWEPT_BY: f64 = 4.0;
const SWEPT_VALUES: usize = 31;

/// The page of the predictions `rows`.
pub(super) fn build(
    rows: &[PredictionRow],
    arguments: &LimitArgs,
    scenario: &Scenario,
) -> anyhow::Result<PageContent> {
    let camera = &scenario.camera.name;
    let of_scenario = PredictionRow::new(scenario, arguments.scenario.preset, Catalog::built_in());
    let mut page = PageContent {
        title: format!("Limiting magnitude of {camera}"),
        question: question(scenario),
        text: PredictionRow::to_text(rows),
        provenance: vec![
            options(),
            catalog(Catalog::built_in()),
            Fact::new("Camera", camera.clone()),
            Fact::new("Equations", scenario.reading.words()),
        ],
        ..PageContent::default()
    };
    if scenario.reading == Reading::Paper {
        page.notes.push(PAPER.to_owned());
    }
    let own = match &of_scenario {
        Ok(row) => {
            page.answer = answer(row);
            page.facts = facts(row);
            Some(row)
        }
        // The values of a sweep may have limits that the camera as it is does not have.
        Err(error) => {
            page.answer = format!("The camera as described has no limit: {error}");
            None
        }
    };
    let given: Vec<Sweep> = arguments
        .sweep
        .iter()
        .map(|sweep| sweep.0.clone())
        .collect();
    let drawn = if given.is_empty() {
        default_sweeps(scenario)
    } else {
        page.notes.extend(notes(rows));
        given.clone()
    };
    for sweep in &drawn {
        let Ok(sheet) = figures::of_sweeps([sweep].into_iter(), scenario) else {
            continue;
        };
        let caption = format!(
            "Limiting magnitude against {}; dot: the camera as described",
            sweep.parameter.title()
        );
        page.figures.push(figure(&sheet, &caption));
    }
    if !given.is_empty() {
        let csv = csv_table(rows.iter().map(PredictionRow::table_row))?;
        page.tables.push(table("Predictions", &csv)?);
    }
    if let Some(row) = own {
        let csv = csv_table(row.budget_rows())?;
        page.tables.push(table("Signal and noise budget", &csv)?);
    }
    Ok(page)
}

fn question(scenario: &Scenario) -> String {
    format!(
        "What is the faintest star that {} detects with an exposure of {} s and an aperture of {} mm?",
        scenario.camera.name,
        five_digits(scenario.conditions.exposure_s),
        five_digits(scenario.camera.aperture_mm)
    )
}

fn answer(row: &PredictionRow) -> String {
    let prediction = &row.prediction;
    let limit = format!(
        "V {:.2}: for such a star, the brightest pixel has a signal-to-noise ratio of {}.",
        prediction.limit_vmag,
        five_digits(prediction.snr)
    );
    match prediction.detector.limit50_vmag {
        Some(found) => {
            format!("{limit} starpipe's matched filter detects half of the stars of V {found:.2}.")
        }
        None => {
            limit
                + " starpipe's matched filter has no limiting magnitude: it detects noise as often as stars."
        }
    }
}

fn facts(row: &PredictionRow) -> Vec<Fact> {
    let prediction = &row.prediction;
    let e = |value: f64| format!("{} e", five_digits(value));
    let mut facts = vec![Fact::new(
        "Limit",
        format!("V {:.2}", prediction.limit_vmag),
    )];
    for (name, limit) in [
        (
            "50 % of stars detected at",
            prediction.detector.limit50_vmag,
        ),
        (
            "90 % of stars detected at",
            prediction.detector.limit90_vmag,
        ),
    ] {
        facts.extend(limit.map(|v| Fact::new(name, format!("V {v:.2}"))));
    }
    if let Some(faintest) = &row.faintest {
        let value = format!("V {:.2} ± {:.2}", faintest.mean_vmag, faintest.sigma_mag);
        facts.push(Fact::new("Expected faintest star in a field", value));
        let found = five_digits((faintest.stars_found * 10.0).round() / 10.0);
        facts.push(Fact::new("Stars detected in a field", found));
    }
    facts.extend([
        Fact::new("Signal in the brightest pixel", e(prediction.star_e)),
        Fact::new("Sky background per pixel", e(prediction.background_e)),
        Fact::new("Noise of the brightest pixel", e(prediction.noise_e)),
        Fact::new("Airmass", five_digits(prediction.airmass)),
    ]);
    facts
}

/// Parameters that change nothing.
fn notes(rows: &[PredictionRow]) -> Vec<String> {
    let parameter = |row: &PredictionRow| row.swept.map(|swept| swept.parameter);
    let sweeps = rows.chunk_by(|a, b| parameter(a) == parameter(b));
    let idle = sweeps.filter(|rows| PredictionRow::have_same_limits(rows));
    idle.filter_map(|rows| parameter(&rows[0]))
        .map(changes_nothing)
        .collect()
}

fn default_sweeps(scenario: &Scenario) -> Vec<Sweep> {
    let sweep = |name: &&str| {
        let parameter = Parameter::named(name).ok()?;
        let value = parameter.get(scenario)?;
        let ends = [value / SWEPT_BY, value * SWEPT_BY];
        Sweep::new(name, ends, SWEPT_VALUES, Spacing::Log).ok()
    };
    SWEPT.iter().filter_map(sweep).collect()
}
