//! The figures of a run and of a study.

use starpipe::base::statistics::normal_density;
use starpipe::lab::validation::{
    AttitudeSummary, CentroidSummary, CompletenessSummary, DifferenceSummary, Histogram,
    IdentificationSummary, Pull, PullSummary, StudyRow, ValidationSummary,
};
use starpipe::report::figure::{Axis, Dot, Marks, Panel, PlotLayer, Rgb, Sheet};

/// The 95th percentile beside the median.
const PALE_BLUE: Rgb = Rgb([120, 180, 220]);
const PALE_ORANGE: Rgb = Rgb([240, 170, 110]);

/// The figures of a run with their names.
pub(super) fn of_run(summary: &ValidationSummary) -> Vec<(&'static str, Sheet)> {
    let mut sheets = vec![
        ("identification", identification(&summary.identification)),
        ("completeness", completeness(&summary.completeness)),
        ("centroids", centroids(&summary.centroids)),
        ("pulls", pulls(&summary.pulls)),
        ("faintest", faintest(&summary.faintest)),
    ];
    sheets.extend(summary.attitude.as_ref().map(|a| ("attitude", attitude(a))));
    sheets
}

/// The figures of a study, one for each parameter, with their names.
pub(super) fn of_study(rows: &[StudyRow]) -> Vec<(&'static str, Sheet)> {
    let parameters = rows.chunk_by(|a, b| a.parameter == b.parameter);
    parameters
        .map(|rows| (rows[0].parameter, study(rows)))
        .collect()
}

fn identification(found: &IdentificationSummary) -> Sheet {
    let dots: Vec<Dot> = found
        .by_stars
        .iter()
        .map(|bin| {
            let middle = 0.5 * (bin.from_stars + bin.to_stars) as f64;
            let interval = [bin.right_low_percent, bin.right_high_percent];
            Dot::from((middle, bin.right_percent, interval))
        })
        .collect();
    let lowest = lowest_percent(&dots);
    let all = &found.all;
    Sheet::of_one(Panel {
        title: format!(
            "Identified correctly: {} of {} frames; {} not identified, {} wrong",
            all.right, all.frames, all.none, all.wrong
        ),
        x: Axis::new("stars brighter than the predicted limit").beginning_at(0.0),
        y: Axis::new("% of the frames").within(lowest, 100.0),
        layers: vec![PlotLayer::new(
            "with 95 % intervals (Clopper-Pearson)",
            Rgb::BLUE,
            Marks::Dots(dots),
        )],
        ..Panel::default()
    })
}

/// The start of an axis of rates: below all intervals.
fn lowest_percent(rates: &[Dot]) -> f64 {
    let lowest = rates.iter().filter_map(|rate| Some(rate.y_range?[0]));
    lowest.fold(90.0, f64::min).floor()
}

fn completeness(found: &CompletenessSummary) -> Sheet {
    // The first bin has all brighter stars.
    let bins = found.bins.get(1..).unwrap_or_default();
    let dots = bins.iter().map(|bin| {
        (
            bin.vmag,
            100.0 * bin.measured,
            [100.0 * bin.low, 100.0 * bin.high],
        )
    });
    let line = bins.iter().map(|bin| (bin.vmag, 100.0 * bin.predicted));
    let title = match (found.measured_limit_vmag, found.difference_mag) {
        (Some(limit), Some(difference)) => {
            format!("Half are found at V {limit:.2}, {difference:+.3} mag from the prediction")
        }
        _ => "Completeness".to_owned(),
    };
    Sheet::of_one(Panel {
        title,
        x: Axis::new("V magnitude"),
        y: Axis::new("% of isolated stars found").within(0.0, 100.0),
        layers: vec![
            PlotLayer::guide(Marks::Levels(vec![50.0])),
            PlotLayer::new("predicted", Rgb::ORANGE, Marks::Line(line.collect())),
            PlotLayer::new(
                "found, with 95 % intervals",
                Rgb::BLUE,
                Marks::Dots(dots.map(Dot::from).collect()),
            ),
        ],
        ..Panel::default()
    })
}

fn centroids(found: &CentroidSummary) -> Sheet {
    let bins = &found.bins;
    // Standard error of a root mean square of 2n values, relative to it.
    let relative_error = |stars: usize| 1.0 / (4.0 * stars as f64).sqrt();
    let errors = bins.iter().map(|bin| {
        let sigma = bin.rms_px * relative_error(bin.stars);
        (
            bin.snr,
            bin.rms_px,
            [bin.rms_px - sigma, bin.rms_px + sigma],
        )
    });
    let bound = bins.iter().filter_map(|bin| Some((bin.snr, bin.bound_px?)));
    let ratios: Vec<_> = bins
        .iter()
        .filter_map(|bin| {
            let (ratio, sigma) = (bin.ratio?, bin.ratio_sigma?);
            Some(Dot::from((bin.snr, ratio, [ratio - sigma, ratio + sigma])))
        })
        .collect();
    let snr = || Axis::log("signal-to-noise ratio of the matched filter", true);
    Sheet::new(
        vec![
            Panel {
                title: "Error of a centroid on one axis".to_owned(),
                x: snr(),
                y: Axis::log("root mean square (px)", true),
                layers: vec![
                    PlotLayer::new(
                        "Cramér-Rao bound",
                        Rgb::ORANGE,
                        Marks::Line(bound.collect()),
                    ),
                    PlotLayer::new(
                        "measured",
                        Rgb::BLUE,
                        Marks::Dots(errors.map(Dot::from).collect()),
                    ),
                ],
                ..Panel::default()
            },
            Panel {
                title: "The same in units of the bound".to_owned(),
                x: snr(),
                y: Axis::new("measured / bound"),
                layers: vec![
                    PlotLayer::guide(Marks::Levels(vec![1.0])),
                    PlotLayer::new("± standard error", Rgb::BLUE, Marks::Dots(ratios)),
                ],
                ..Panel::default()
            },
        ],
        2,
    )
}

/// The bars of a histogram as a density.
fn densities(histogram: &Histogram, count: usize) -> Vec<([f64; 2], f64)> {
    let Histogram { from, step, counts } = histogram;
    let bar = |(bin, values): (usize, &usize)| {
        let low = from + step * bin as f64;
        let density = *values as f64 / (count.max(1) as f64 * step);
        ([low, low + step], density)
    };
    counts.iter().enumerate().map(bar).collect()
}

fn normal_curve(reach: f64, sd: f64) -> Vec<(f64, f64)> {
    let at = |i: i32| {
        let x = reach * f64::from(i) / 100.0;
        (x, normal_density(x / sd) / sd)
    };
    (-100..=100).map(at).collect()
}

fn pulls(found: &PullSummary) -> Sheet {
    let panel = |(name, pull): (&str, &Pull)| Panel {
        title: format!(
            "{name}: mean {:+.3}, standard deviation {:.3}",
            pull.mean, pull.sd
        ),
        x: Axis::new("error / stated standard error").within(-5.0, 5.0),
        y: Axis::new("density").beginning_at(0.0),
        layers: vec![
            PlotLayer::new(
                format!("{} values", pull.count),
                Rgb::BLUE,
                Marks::Bars(densities(&pull.histogram, pull.count)),
            ),
            PlotLayer::new(
                "standard normal",
                Rgb::ORANGE,
                Marks::Line(normal_curve(5.0, 1.0)),
            ),
        ],
        ..Panel::default()
    };
    let panels = [
        ("x", &found.x),
        ("y", &found.y),
        ("Flux", &found.flux),
        ("Turn about x", &found.attitude_x),
        ("Turn about y", &found.attitude_y),
        ("Roll", &found.roll),
    ];
    Sheet::new(panels.into_iter().map(panel).collect(), 3)
}

fn faintest(found: &DifferenceSummary) -> Sheet {
    let mut layers = vec![PlotLayer::new(
        format!("{} frames", found.count),
        Rgb::BLUE,
        Marks::Bars(densities(&found.histogram, found.count)),
    )];
    if let Some(sd) = found.expected_sd.filter(|sd| *sd > 0.0) {
        let curve = normal_curve(1.5, sd);
        let label = format!("expected scatter {sd:.2}, as a normal distribution");
        layers.push(PlotLayer::new(label, Rgb::ORANGE, Marks::Line(curve)));
    }
    Sheet::of_one(Panel {
        title: format!(
            "Faintest star minus expected: mean {:+.3} ± {:.3}, scatter {:.2} mag",
            found.mean, found.mean_sigma, found.sd
        ),
        x: Axis::new("faintest star named minus the faintest expected (mag)").within(-1.5, 1.5),
        y: Axis::new("density (1 / mag)").beginning_at(0.0),
        layers,
        ..Panel::default()
    })
}

fn attitude(found: &AttitudeSummary) -> Sheet {
    let cumulative = |values: &[f64]| {
        let point = |(percent, value): (usize, &f64)| (*value, percent as f64);
        let points = values.iter().enumerate().map(point);
        // A logarithmic axis has no place for an error of zero.
        Marks::Line(points.filter(|(value, _)| *value > 0.0).skip(1).collect())
    };
    let (boresight, roll) = (&found.boresight_arcsec, &found.roll_arcsec);
    Sheet::of_one(Panel {
        title: format!("Errors of the attitude, of {} frames", found.frames),
        x: Axis::log("error (arcsec)", true),
        y: Axis::new("% of the frames with a smaller error").within(0.0, 100.0),
        layers: vec![
            PlotLayer::new(
                format!("boresight: median {:.2}″", boresight.p50),
                Rgb::BLUE,
                cumulative(&found.boresight_percentiles_arcsec),
            ),
            PlotLayer::new(
                format!("roll: median {:.1}″", roll.p50),
                Rgb::ORANGE,
                cumulative(&found.roll_percentiles_arcsec),
            ),
        ],
        ..Panel::default()
    })
}

/// A value of a row and its standard error.
type Measured = fn(&StudyRow) -> (Option<f64>, Option<f64>);

/// The rows of one parameter.
fn study(rows: &[StudyRow]) -> Sheet {
    let panel = |title: &str, y: Axis, layers: Vec<PlotLayer>| Panel {
        title: title.to_owned(),
        x: Axis::log(rows[0].title.clone(), rows[0].is_log),
        y,
        layers,
        ..Panel::default()
    };
    let (rate, rates) = rates(rows);
    let panels = vec![
        panel("Identified correctly", rate, rates),
        panel(
            "Half of the stars are found at",
            Axis::new("V magnitude"),
            limits(rows),
        ),
        panel(
            "Errors of centroids in units of the bound",
            Axis::new("root mean square / bound"),
            vec![
                PlotLayer::guide(Marks::Levels(vec![1.0])),
                measured("± standard error", rows, |row| {
                    (row.centroid_ratio, row.centroid_ratio_sigma)
                }),
            ],
        ),
        panel(
            "Errors of the attitude",
            Axis::log("error (arcsec)", true),
            attitude_errors(rows),
        ),
    ];
    Sheet::new(panels, 2)
}

fn rates(rows: &[StudyRow]) -> (Axis, Vec<PlotLayer>) {
    let rate = |row: &StudyRow| {
        let interval = [row.right_low_percent, row.right_high_percent];
        Dot::from((row.value, row.right_percent, interval))
    };
    let rates: Vec<Dot> = rows.iter().map(rate).collect();
    let axis = Axis::new("% of the frames").within(lowest_percent(&rates), 100.0);
    let layer = PlotLayer::new("with 95 % intervals", Rgb::BLUE, Marks::Dots(rates));
    (axis, vec![layer])
}

fn limits(rows: &[StudyRow]) -> Vec<PlotLayer> {
    let predicted = line(rows, |row| Some(row.predicted_limit_vmag));
    vec![
        PlotLayer::new("predicted", Rgb::ORANGE, predicted),
        measured("measured", rows, |row| {
            (row.measured_limit_vmag, row.measured_limit_sigma_mag)
        }),
    ]
}

fn attitude_errors(rows: &[StudyRow]) -> Vec<PlotLayer> {
    let line = |value| line(rows, value);
    vec![
        PlotLayer::new(
            "boresight 50 %",
            Rgb::BLUE,
            line(|row| row.boresight_p50_arcsec),
        ),
        PlotLayer::new("95 %", PALE_BLUE, line(|row| row.boresight_p95_arcsec)),
        PlotLayer::new("roll 50 %", Rgb::ORANGE, line(|row| row.roll_p50_arcsec)),
        PlotLayer::new("95 %", PALE_ORANGE, line(|row| row.roll_p95_arcsec)),
    ]
}

fn line(rows: &[StudyRow], value: fn(&StudyRow) -> Option<f64>) -> Marks {
    let points = rows.iter().filter_map(|row| Some((row.value, value(row)?)));
    Marks::Line(points.collect())
}

/// Dots with standard errors, where both are known.
fn measured(label: &str, rows: &[StudyRow], value: Measured) -> PlotLayer {
    let dots = rows.iter().filter_map(|row| {
        let (Some(value), Some(sigma)) = value(row) else {
            return None;
        };
        Some(Dot::from((
            row.value,
            value,
            [value - sigma, value + sigma],
        )))
    });
    PlotLayer::new(label, Rgb::BLUE, Marks::Dots(dots.collect()))
}
