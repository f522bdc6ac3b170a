//! The figures: errors over radius and noise, sections, best radius, accuracy and limit; and those
//! of the paper, its spots and its surface.

use crate::cli::plot::{FigureForm, figure_files};
use starpipe::base::format::five_digits;
use starpipe::lab::defocus::{ErrorCurve, ErrorPoint, ExpectedError, IsoLine, PeakStudy, Surface};
use starpipe::lab::spot_radius::{
    DefocusReport, DefocusStar, DefocusStarReport, PredictedError, StarStudy,
};
use starpipe::report::figure::{
    Area, Axis, ColorScale, Dot, Marks, Panel, PanelKind, PlotLayer, Rgb, Sheet, grey, sequential,
};

/// Colors of a few lines that everybody can tell apart.
const COLORS: [Rgb; 4] = [Rgb::BLUE, Rgb::ORANGE, Rgb::GREEN, Rgb::PURPLE];
/// Radii of the paper's figure 1, in pixels.
const PAPER_SPOTS_PX: [f64; 2] = [0.6, 1.5];
/// Lines in a section.
const SECTION_LINES: usize = 4;

/// Names and contents of the files.
pub(super) fn draw(
    report: &DefocusReport,
    studies: &[StarStudy],
    form: FigureForm,
) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    figure_files(sheets(report, studies), form)
}

/// The figures with their names.
pub(super) fn sheets(report: &DefocusReport, studies: &[StarStudy]) -> Vec<(&'static str, Sheet)> {
    let errors = studies.iter().map(|study| errors(report, study)).collect();
    let sections = studies
        .iter()
        .flat_map(|study| sections(report, study))
        .collect();
    let mut sheets = vec![
        ("errors", Sheet::new(errors, 2)),
        ("sections", Sheet::new(sections, 2)),
    ];
    match studies {
        [study] if study.star.v_mag().is_none() => {
            let panel = radii_for_errors(report, &report.stars[0], study);
            sheets.push(("best-radius", Sheet::of_one(panel)));
            sheets.extend(of_paper(report, study));
        }
        _ => {
            sheets.push(("best-radius", Sheet::of_one(best_radii(report))));
            let panel = accuracy_and_reach(report);
            sheets.push(("accuracy-and-reach", Sheet::of_one(panel)));
        }
    }
    sheets
}

fn noise_axis(report: &DefocusReport) -> Axis {
    let [from, to] = report.noises;
    let axis = match report.noise_unit {
        "e" => Axis::log("noise of a dark pixel (e)", true),
        unit => Axis::new(format!("noise ({unit})")),
    };
    axis.within(from, to)
}

/// A number as figures name a line.
fn two_digits(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}

/// A noise with its unit; a part of full scale has none.
fn noise_label(report: &DefocusReport, noise: f64) -> String {
    let number = five_digits(two_digits(noise));
    match report.noise_unit {
        "e" => format!("noise {number} e"),
        _ => format!("noise {number}"),
    }
}

fn radius_axis(report: &DefocusReport) -> Axis {
    let [from, to] = report.radii_px;
    Axis::new("radius (px)").within(from, to)
}

fn title_of(study: &StarStudy, title: &str) -> String {
    match study.star.v_mag() {
        Some(v_mag) => format!("V {}: {title}", five_digits(v_mag)),
        None => title.to_owned(),
    }
}

fn label_of(star: &DefocusStarReport) -> String {
    star.vmag
        .map_or_else(String::new, |v_mag| format!("V {}", five_digits(v_mag)))
}

/// Errors as colors, with lines of equal error.
fn errors(report: &DefocusReport, study: &StarStudy) -> Panel {
    let lines: Vec<Vec<(f64, f64)>> = study.isolines.iter().map(outline).collect();
    // A third along the outline the lines are farthest apart.
    let labels = line_labels(study, &lines, |line| line.len() / 3);
    let measured = |_, _, point: &ErrorPoint| point.is_sound().then_some(point.rms_px);
    let mut layers = vec![PlotLayer::colored(cells(study, measured), scale(study))];
    if study.star.v_mag().is_none() {
        let paper = study.isolines.iter();
        let paper = paper.map(|line| paper_line(study, line.rms_px)).collect();
        layers.push(PlotLayer::new(
            "surface of the paper",
            Rgb::ORANGE,
            Marks::Lines(paper),
        ));
    }
    layers.push(PlotLayer::unnamed(Rgb::PAPER, Marks::Lines(lines)));
    layers.push(PlotLayer::unnamed(Rgb::BLACK, labels));
    Panel {
        title: title_of(study, "centroid error, with contours"),
        x: noise_axis(report),
        y: radius_axis(report),
        layers,
        ..Panel::default()
    }
}

/// The error of each line, beside the point of it with the number `place`.
fn line_labels(
    study: &StarStudy,
    lines: &[Vec<(f64, f64)>],
    place: fn(&[(f64, f64)]) -> usize,
) -> Marks {
    let labels = study.isolines.iter().zip(lines);
    let labels = labels.filter_map(|(level, line)| {
        let (noise, radius) = *line.get(place(line))?;
        Some((noise, radius, five_digits(level.rms_px)))
    });
    Marks::Texts(labels.collect())
}

/// Along the smallest radii, and back along the largest.
fn outline(line: &IsoLine) -> Vec<(f64, f64)> {
    let largest = line.points.iter().rev();
    let largest = largest.filter_map(|at| Some((at.noise, at.largest_px?)));
    smallest_radii(line).into_iter().chain(largest).collect()
}

fn smallest_radii(line: &IsoLine) -> Vec<(f64, f64)> {
    let points = line.points.iter();
    points
        .filter_map(|at| Some((at.noise, at.smallest_px?)))
        .collect()
}

/// The smallest radius at which the paper's surface falls to an error, over the noise.
fn paper_line(study: &StarStudy, rms_px: f64) -> Vec<(f64, f64)> {
    let paper = Surface::of_paper();
    let radii = &study.errors.grid.spots_px;
    let noises = study.errors.grid.noises.iter();
    let points = noises.filter_map(|&noise| {
        let pair = radii.windows(2).find(|pair| {
            let [before, after] = [pair[0], pair[1]].map(|radius| paper.at(radius, noise));
            before > rms_px && after <= rms_px
        })?;
        Some((noise, pair[1]))
    });
    points.collect()
}

/// The paper's figures 1 and 3, and what its model of a spot costs where it is sampled.
fn of_paper(report: &DefocusReport, study: &StarStudy) -> Vec<(&'static str, Sheet)> {
    let DefocusStar::Peak(experiment) = &study.star else {
        return Vec::new();
    };
    let spots = PAPER_SPOTS_PX.map(|spot_px| spot(experiment, spot_px));
    let (own, paper) = (study.surface.as_ref().ok(), Surface::of_paper());
    let surfaces = [("this run", own), ("paper", Some(&paper))].into_iter();
    let surfaces =
        surfaces.filter_map(|(whose, surface)| Some(fitted(report, study, whose, surface?)));
    vec![
        ("spots", Sheet::new(spots.into(), 2)),
        ("surface", Sheet::new(surfaces.collect(), 2)),
        ("sampled", Sheet::of_one(sampled(report, study))),
    ]
}

/// The pixels of a spot in the middle of its window: the paper's figure 1.
fn spot(experiment: &PeakStudy, spot_px: f64) -> Panel {
    let half = experiment.half_window_px as f64;
    let pixels = experiment.pixels(spot_px);
    let side = 2 * experiment.half_window_px + 1;
    let levels = ColorScale {
        title: "level".to_owned(),
        ends: [0.0, experiment.peak],
        is_log: false,
        palette: grey,
    };
    let cell = |(number, value): (usize, &f64)| {
        let around = |i: usize| [i as f64 - half - 0.5, i as f64 - half + 0.5];
        Area {
            note: five_digits(*value),
            ..Area::rectangle(
                around(number % side),
                around(number / side),
                levels.color(*value),
            )
        }
    };
    let cells = pixels.iter().enumerate().map(cell).collect();
    let edge = half + 0.5;
    Panel {
        title: format!("a spot of radius {} px", five_digits(spot_px)),
        x: Axis::new("column (px)").within(-edge, edge),
        y: Axis::new("row (px)").within(-edge, edge),
        layers: vec![PlotLayer::colored(cells, levels)],
        kind: PanelKind::Map,
    }
}

/// A surface in the colors of the errors: the paper's figure 3.
fn fitted(report: &DefocusReport, study: &StarStudy, whose: &str, surface: &Surface) -> Panel {
    let value = |spot_px: f64, noise: f64, _: &ErrorPoint| Some(surface.at(spot_px, noise));
    Panel {
        title: format!("the fitted surface (eq. 13), {whose}"),
        x: noise_axis(report),
        y: radius_axis(report),
        layers: vec![PlotLayer::colored(cells(study, value), scale(study))],
        ..Panel::default()
    }
}

/// The closed form over the radius for spots that are integrated over the pixels, and sampled.
fn sampled(report: &DefocusReport, study: &StarStudy) -> Panel {
    let grid = &study.errors.grid;
    let count = grid.noises.len();
    let line = |all: &[ExpectedError], noise: usize| {
        let column = all.iter().skip(noise).step_by(count);
        let points = grid.spots_px.iter().zip(column);
        Marks::Line(points.map(|(&spot_px, at)| (spot_px, at.rms_px)).collect())
    };
    let layers = a_few(count).flat_map(|(noise, color)| {
        let label = noise_label(report, grid.noises[noise]);
        let integrated = study.expected.as_ref();
        let integrated = integrated.map(|all| PlotLayer::new(label, color, line(all, noise)));
        let sampled = study.sampled.as_ref();
        let sampled = sampled.map(|all| PlotLayer::guide(line(all, noise)));
        sampled.into_iter().chain(integrated)
    });
    Panel {
        title: "closed form at four noises; gray: spots sampled, not integrated".to_owned(),
        x: radius_axis(report),
        y: Axis::log("error (px)", true),
        layers: layers.collect(),
        ..Panel::default()
    }
}

/// The 5th and the 95th percentile of the errors: the ends of the colors.
fn color_range_px(study: &StarStudy) -> [f64; 2] {
    let sound = study.errors.points.iter().filter(|point| point.is_sound());
    let mut errors: Vec<f64> = sound.map(|point| point.rms_px).collect();
    errors.sort_by(f64::total_cmp);
    let at = |twentieths: usize| errors.get(errors.len() * twentieths / 20).copied();
    [at(1).unwrap_or(1e-3), at(19).unwrap_or(1.0)]
}

/// One of a few colors: neighboring cells of one shade are drawn as one.
fn shade(part: f64) -> Rgb {
    const SHADES: f64 = 40.0;
    sequential((part.clamp(0.0, 1.0) * SHADES).round() / SHADES)
}

/// The colors of errors.
fn scale(study: &StarStudy) -> ColorScale {
    ColorScale {
        title: "error (px)".to_owned(),
        ends: color_range_px(study),
        is_log: true,
        palette: shade,
    }
}

/// The grid as cells, with the colors of the errors that `error_px` gives; those beside each other
/// with one shade are one cell.
fn cells(study: &StarStudy, error_px: impl Fn(f64, f64, &ErrorPoint) -> Option<f64>) -> Vec<Area> {
    let grid = &study.errors.grid;
    let scale = scale(study);
    let (columns, rows) = (edges(&grid.noises), edges(&grid.spots_px));
    let mut cells = Vec::new();
    for (row, points) in study.errors.points.chunks(grid.noises.len()).enumerate() {
        let colors = points.iter().enumerate().map(|(column, point)| {
            let error_px = error_px(grid.spots_px[row], grid.noises[column], point)?;
            Some(scale.color(error_px))
        });
        let colors: Vec<Option<Rgb>> = colors.collect();
        let mut column = 0;
        for alike in colors.chunk_by(|a, b| a == b) {
            let x = [columns[column], columns[column + alike.len()]];
            let y = [rows[row], rows[row + 1]];
            cells.extend(alike[0].map(|color| Area::rectangle(x, y, color)));
            column += alike.len();
        }
    }
    cells
}

/// Edges of the cells around `values`.
fn edges(values: &[f64]) -> Vec<f64> {
    let middles = values.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
    let (first, last) = (values[0], values[values.len() - 1]);
    std::iter::once(first)
        .chain(middles)
        .chain([last])
        .collect()
}

/// The error over the radius at a few noises, and over the noise at a few radii.
fn sections(report: &DefocusReport, study: &StarStudy) -> [Panel; 2] {
    let guide = match study.star.v_mag() {
        None => "closed form",
        Some(_) => "bound",
    };
    let error = || Axis::log("error (px)", true);
    [
        Panel {
            title: title_of(
                study,
                &format!("error versus radius; dots: at the given noise, gray: {guide}"),
            ),
            x: radius_axis(report),
            y: error(),
            layers: over_radius(report, study),
            ..Panel::default()
        },
        Panel {
            title: title_of(study, "error versus noise, at four radii"),
            x: noise_axis(report),
            y: error(),
            layers: over_noise(study),
            ..Panel::default()
        },
    ]
}

/// Indices of a few of `count` values, evenly spread.
fn a_few(count: usize) -> impl Iterator<Item = (usize, Rgb)> {
    let few = SECTION_LINES.min(count);
    let indices = (0..few).map(move |i| (i * (count - 1)) / (few - 1).max(1));
    indices.zip(COLORS)
}

/// A curve at a radius within its range.
fn at(curve: &ErrorCurve, radius: f64) -> Option<f64> {
    let [first, last] = curve.range_px();
    (first..=last).contains(&radius).then(|| curve.at(radius))
}

fn over_radius(report: &DefocusReport, study: &StarStudy) -> Vec<PlotLayer> {
    let grid = &study.errors.grid;
    let section = |(noise, color): (usize, Rgb)| {
        let curve = study.curves[noise].as_ref()?;
        let radii = grid.spots_px.iter();
        let line = radii.filter_map(|&radius| Some((radius, at(curve, radius)?)));
        let label = noise_label(report, grid.noises[noise]);
        Some(PlotLayer::new(label, color, Marks::Line(line.collect())))
    };
    let mut layers: Vec<PlotLayer> = a_few(grid.noises.len()).filter_map(section).collect();
    let theory = study.points.iter().map(|at| match &at.theory {
        PredictedError::Expected(expected) => (at.spot_px, expected.rms_px),
        PredictedError::Reach(reach) => (at.spot_px, reach.bound_px),
    });
    layers.push(PlotLayer::guide(Marks::Line(theory.collect())));
    layers.push(PlotLayer::unnamed(Rgb::BLACK, Marks::Dots(dots(study))));
    layers
}

fn over_noise(study: &StarStudy) -> Vec<PlotLayer> {
    let grid = &study.errors.grid;
    let section = |(number, color): (usize, Rgb)| {
        let radius = grid.spots_px[number];
        let curves = grid.noises.iter().zip(&study.curves);
        let line = curves.filter_map(|(&noise, curve)| Some((noise, at(curve.as_ref()?, radius)?)));
        let label = format!("{} px", five_digits(two_digits(radius)));
        PlotLayer::new(label, color, Marks::Line(line.collect()))
    };
    a_few(grid.spots_px.len()).map(section).collect()
}

/// The errors at the noise of the study, few enough to be told apart.
fn dots(study: &StarStudy) -> Vec<Dot> {
    const MAX: usize = 50;
    let step = study.points.len().div_ceil(MAX);
    let points = study.points.iter().step_by(step);
    let sound = points.filter(|at| at.point.is_sound());
    sound
        .map(|at| {
            let (rms, sigma) = (at.point.rms_px, at.point.rms_sigma_px);
            Dot::from((at.spot_px, rms, [rms - sigma, rms + sigma]))
        })
        .collect()
}

/// The best radius at each noise, and the radii between which the error is at most 5 % larger.
fn best_of(star: &DefocusStarReport) -> Marks {
    let best = star.best_by_noise.iter().filter_map(|at| {
        let best = at.best?;
        Some((at.noise, best.spot_px, best.nearly_px))
    });
    Marks::Dots(best.map(Dot::from).collect())
}

/// The best radius of each star over the noise.
fn best_radii(report: &DefocusReport) -> Panel {
    let stars = report.stars.iter().zip(COLORS);
    let layers = stars.map(|(star, color)| PlotLayer::new(label_of(star), color, best_of(star)));
    Panel {
        title: "Best radius, and radii with at most 5 % more error".to_owned(),
        x: noise_axis(report),
        y: Axis::new("radius (px)"),
        layers: layers.collect(),
        ..Panel::default()
    }
}

/// The best radius and the smallest that meets each error, over the noise.
fn radii_for_errors(report: &DefocusReport, star: &DefocusStarReport, study: &StarStudy) -> Panel {
    let lines: Vec<_> = study.isolines.iter().map(smallest_radii).collect();
    let parabolas = study.isolines.iter().zip(&lines);
    let parabolas = parabolas.filter_map(|(level, line)| {
        let [c0, c1, c2] = level.radius_of_noise?.coefficients;
        let at = |&(noise, _): &(f64, f64)| (noise, c0 + noise * (c1 + noise * c2));
        Some(line.iter().map(at).collect())
    });
    let parabolas = Marks::Lines(parabolas.collect());
    let labels = line_labels(study, &lines, |line| line.len() * 2 / 3);
    Panel {
        title: title_of(study, "radius versus noise"),
        x: noise_axis(report),
        y: radius_axis(report),
        layers: vec![
            PlotLayer::new(
                "best, and range with up to 5 % more error",
                Rgb::BLUE,
                best_of(star),
            ),
            PlotLayer::new("parabolas", Rgb::GREY, parabolas),
            PlotLayer::new(
                "smallest that meets an error (px)",
                Rgb::ORANGE,
                Marks::Lines(lines),
            ),
            PlotLayer::unnamed(Rgb::BLACK, labels),
        ],
        ..Panel::default()
    }
}

/// Error over limiting magnitude as the radius grows: a line for each star, a few radii beside it.
fn accuracy_and_reach(report: &DefocusReport) -> Panel {
    let stars = report.stars.iter().zip(COLORS);
    Panel {
        title: "Centroid error and limit; numbers: radius (px), gray: Cramér-Rao bound".to_owned(),
        x: Axis::new("50 % detection limit (V)"),
        y: Axis::log("centroid error (px)", true),
        layers: stars
            .flat_map(|(star, color)| accuracy_of(star, color))
            .collect(),
        ..Panel::default()
    }
}

fn accuracy_of(star: &DefocusStarReport, color: Rgb) -> [PlotLayer; 3] {
    const LABELLED_PX: [f64; 6] = [0.3, 0.5, 0.7, 1.0, 1.5, 2.0];
    let bound = star
        .curve
        .iter()
        .filter_map(|row| Some((row.limit_vmag?, row.bound_px?)));
    let points = star.curve.iter();
    let points = points.filter_map(|row| {
        let point = (row.limit_vmag?, row.smooth_error_px?);
        Some((row.radius_px, point))
    });
    let points: Vec<(f64, (f64, f64))> = points.collect();
    let labels = LABELLED_PX.into_iter().filter_map(|wanted| {
        let near = points
            .iter()
            .find(|(radius, _)| (radius - wanted).abs() < 0.02);
        let (_, (limit, error)) = near?;
        Some((*limit, *error, five_digits(wanted)))
    });
    let labels = Marks::Texts(labels.collect());
    let line = points.iter().map(|(_, point)| *point).collect();
    [
        PlotLayer::guide(Marks::Line(bound.collect())),
        PlotLayer::new(label_of(star), color, Marks::Line(line)),
        PlotLayer::unnamed(color, labels),
    ]
}
