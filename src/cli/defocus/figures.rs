//! The figures: errors over radius and noise, sections, the best radius over the noise, accuracy against reach.

use super::answer::{Answer, StarAnswer};
use super::study::{Study, Theory};
use crate::cli::plot::panel::{Axis, Cell, Dot, Layer, Marks, Panel, Sheet};
use crate::cli::plot::{BLUE, FigureForm, ORANGE, drawn};
use plotters::style::RGBColor;
use starpipe::base::format::five_digits as number;
use starpipe::model::defocus::{IsoLine, Surface};

const WHITE: RGBColor = RGBColor(255, 255, 255);
const BLACK: RGBColor = RGBColor(0, 0, 0);
/// Colours of a few lines that everybody can tell apart.
const COLOURS: [RGBColor; 4] = [BLUE, ORANGE, RGBColor(0, 158, 115), RGBColor(204, 121, 167)];
/// From the least error to the largest: dark blue to yellow, in even steps of lightness.
const SCALE: [[f64; 3]; 5] = [
    [68.0, 1.0, 84.0],
    [59.0, 82.0, 139.0],
    [33.0, 145.0, 140.0],
    [94.0, 201.0, 98.0],
    [253.0, 231.0, 37.0],
];
/// Colours that are told apart: neighbours of one colour are one rectangle.
const SHADES: f64 = 40.0;
/// Lines of a section.
const SECTIONS: usize = 4;

/// Names and contents of the files.
pub(super) fn of(
    answer: &Answer,
    studies: &[Study],
    form: FigureForm,
) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let stars = || answer.stars.iter().zip(studies);
    let sheet = |panels: Vec<Panel>, abreast| Sheet {
        abreast: panels.len().min(abreast),
        panels,
    };
    let errors = stars().map(|(_, study)| errors(answer, study)).collect();
    let sections = stars()
        .flat_map(|(_, study)| sections(answer, study))
        .collect();
    let mut sheets = vec![
        ("errors", sheet(errors, 2)),
        ("sections", sheet(sections, 2)),
    ];
    match studies {
        [study] if study.star.v_mag().is_none() => {
            let panel = radii_for_errors(answer, &answer.stars[0], study);
            sheets.push(("best-radius", Sheet::of_one(panel)));
        }
        _ => {
            sheets.push(("best-radius", Sheet::of_one(best_radii(answer))));
            sheets.push((
                "accuracy-and-reach",
                Sheet::of_one(accuracy_and_reach(answer)),
            ));
        }
    }
    drawn(sheets, form)
}

fn noise_axis(answer: &Answer) -> Axis {
    let [from, to] = answer.noises;
    // A range of more than a decade that begins far from zero is shown by ratios.
    let axis = match answer.noise_unit {
        "e" => Axis::log("noise of a pixel in the dark (e)", true),
        unit => Axis::of(format!("noise ({unit})")),
    };
    axis.within(from, to)
}

fn radius_axis(answer: &Answer) -> Axis {
    let [from, to] = answer.radii_px;
    Axis::of("radius (px)").within(from, to)
}

fn title_of(study: &Study, what: &str) -> String {
    match study.star.v_mag() {
        Some(v_mag) => format!("V {}: {what}", number(v_mag)),
        None => what.to_owned(),
    }
}

/// Errors as colours, and lines of equal error.
fn errors(answer: &Answer, study: &Study) -> Panel {
    let lines: Vec<Vec<(f64, f64)>> = study.isolines.iter().map(outline).collect();
    let words = study
        .isolines
        .iter()
        .zip(&lines)
        .filter_map(|(level, line)| {
            // Where the lines are farthest apart.
            let (noise, radius) = *line.get(line.len() / 3)?;
            Some((noise, radius, number(level.rms_px)))
        });
    let words = words.collect();
    let mut layers = vec![Layer::unnamed(BLACK, Marks::Cells(cells(study)))];
    if study.star.v_mag().is_none() {
        let paper = study
            .isolines
            .iter()
            .map(|line| paper_line(study, line.rms_px));
        layers.push(Layer::new(
            "the paper's surface",
            ORANGE,
            Marks::Lines(paper.collect()),
        ));
    }
    layers.push(Layer::unnamed(WHITE, Marks::Lines(lines)));
    layers.push(Layer::unnamed(BLACK, Marks::Words(words)));
    let range = range_of(study);
    Panel {
        title: title_of(
            study,
            &format!(
                "error: {} (blue) to {} px (yellow)",
                number(rounded(range[0])),
                number(rounded(range[1]))
            ),
        ),
        x: noise_axis(answer),
        y: radius_axis(answer),
        layers,
    }
}

/// To two digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}

/// Along the small radii and back along the large ones.
fn outline(line: &IsoLine) -> Vec<(f64, f64)> {
    let points = line.points.iter();
    let small = points
        .clone()
        .filter_map(|at| Some((at.noise, at.smallest_px?)));
    let large = points
        .rev()
        .filter_map(|at| Some((at.noise, at.largest_px?)));
    small.chain(large).collect()
}

/// Where the paper's surface falls to an error.
fn paper_line(study: &Study, rms_px: f64) -> Vec<(f64, f64)> {
    let paper = Surface::of_paper();
    let radii = &study.errors.grid.spots_px;
    let noises = study.errors.grid.noises.iter();
    let points = noises.filter_map(|&noise| {
        let fallen = radii.windows(2).find(|pair| {
            let [before, after] = [pair[0], pair[1]].map(|radius| paper.at(radius, noise));
            before > rms_px && after <= rms_px
        })?;
        Some((noise, fallen[1]))
    });
    points.collect()
}

/// The twentieth and the nineteenth twentieth of the errors: the ends of the colours.
fn range_of(study: &Study) -> [f64; 2] {
    let sound = study.errors.points.iter().filter(|point| point.is_sound());
    let mut errors: Vec<f64> = sound.map(|point| point.rms_px).collect();
    errors.sort_by(f64::total_cmp);
    let at = |twentieths: usize| errors.get(errors.len() * twentieths / 20).copied();
    [at(1).unwrap_or(1e-3), at(19).unwrap_or(1.0)]
}

fn cells(study: &Study) -> Vec<Cell> {
    let grid = &study.errors.grid;
    let [least, most] = range_of(study);
    let edges = |values: &[f64]| -> Vec<f64> {
        let middles = values.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        let (first, last) = (values[0], values[values.len() - 1]);
        std::iter::once(first)
            .chain(middles)
            .chain([last])
            .collect()
    };
    let (columns, rows) = (edges(&grid.noises), edges(&grid.spots_px));
    let mut cells: Vec<Cell> = Vec::new();
    for (row, points) in study.errors.points.chunks(grid.noises.len()).enumerate() {
        let mut shade_before = None;
        for (column, point) in points.iter().enumerate() {
            let part = (point.rms_px / least).ln() / (most / least).ln();
            let shade = point
                .is_sound()
                .then(|| (part.clamp(0.0, 1.0) * SHADES).round());
            match (cells.last_mut(), shade) {
                (Some(cell), Some(_)) if column > 0 && shade == shade_before => {
                    cell.x[1] = columns[column + 1]
                }
                (_, Some(shade)) => cells.push(Cell {
                    x: [columns[column], columns[column + 1]],
                    y: [rows[row], rows[row + 1]],
                    colour: colour_of(shade / SHADES),
                }),
                (_, None) => (),
            }
            shade_before = shade;
        }
    }
    cells
}

/// Between the colours of [`SCALE`].
fn colour_of(part: f64) -> RGBColor {
    let place = part * (SCALE.len() - 1) as f64;
    let below = (place as usize).min(SCALE.len() - 2);
    let rest = place - below as f64;
    let mixed =
        |i: usize| (SCALE[below][i] * (1.0 - rest) + SCALE[below + 1][i] * rest).round() as u8;
    RGBColor(mixed(0), mixed(1), mixed(2))
}

/// Indices of a few among so many, evenly spread.
fn a_few(count: usize) -> Vec<usize> {
    let few = SECTIONS.min(count);
    (0..few)
        .map(|i| (i * (count - 1)) / (few - 1).max(1))
        .collect()
}

/// The error over the radius at a few noises and over the noise at a few radii.
fn sections(answer: &Answer, study: &Study) -> [Panel; 2] {
    let grid = &study.errors.grid;
    let radii = &grid.spots_px;
    let mut over_radius: Vec<Layer> = a_few(grid.noises.len())
        .into_iter()
        .zip(COLOURS)
        .filter_map(|(number_of, colour)| {
            let curve = study.curves[number_of].as_ref()?;
            let [first, last] = curve.range_px();
            let inside = radii
                .iter()
                .filter(|radius| (first..=last).contains(*radius));
            let line = inside.map(|&radius| (radius, curve.at(radius))).collect();
            Some(Layer::new(
                number(rounded(grid.noises[number_of])),
                colour,
                Marks::Line(line),
            ))
        })
        .collect();
    let theory = study.rows.iter().map(|row| match &row.theory {
        Theory::Expected(expected) => (row.spot_px, expected.rms_px),
        Theory::Reach(reach) => (row.spot_px, reach.bound_px),
    });
    over_radius.push(Layer::guide(Marks::Line(theory.collect())));
    over_radius.push(Layer::unnamed(BLACK, Marks::Dots(dots(study))));
    let over_noise = a_few(radii.len())
        .into_iter()
        .zip(COLOURS)
        .map(|(number_of, colour)| {
            let curves = grid.noises.iter().zip(&study.curves);
            let line = curves.filter_map(|(&noise, curve)| {
                let curve = curve.as_ref()?;
                let [first, last] = curve.range_px();
                let radius = radii[number_of];
                (first..=last)
                    .contains(&radius)
                    .then(|| (noise, curve.at(radius)))
            });
            let label = format!("{} px", number(rounded(radii[number_of])));
            Layer::new(label, colour, Marks::Line(line.collect()))
        });
    let line_is = match study.star.v_mag() {
        None => "closed form",
        Some(_) => "bound",
    };
    [
        Panel {
            title: title_of(
                study,
                &format!("over the radius; dots: own noise, grey: its {line_is}"),
            ),
            x: radius_axis(answer),
            y: Axis::log("error (px)", true),
            layers: over_radius,
        },
        Panel {
            title: title_of(study, "over the noise, at four radii"),
            x: noise_axis(answer),
            y: Axis::log("error (px)", true),
            layers: over_noise.collect(),
        },
    ]
}

/// The errors at the own noise, few enough to be told apart.
fn dots(study: &Study) -> Vec<Dot> {
    const MOST: usize = 50;
    let every = study.rows.len().div_ceil(MOST);
    let sound = study
        .rows
        .iter()
        .step_by(every)
        .filter(|row| row.point.is_sound());
    sound
        .map(|row| {
            let (rms, sigma) = (row.point.rms_px, row.point.rms_sigma_px);
            (row.spot_px, rms, [rms - sigma, rms + sigma])
        })
        .collect()
}

/// The best radius at each noise, and those between which the error is hardly larger.
fn best_of(star: &StarAnswer) -> Vec<Dot> {
    let best = star.best_by_noise.iter().filter_map(|at| {
        let best = at.best?;
        Some((at.noise, best.spot_px, best.nearly_px))
    });
    best.collect()
}

/// The best radius of each star over the noise.
fn best_radii(answer: &Answer) -> Panel {
    let layers = answer.stars.iter().zip(COLOURS).map(|(star, colour)| {
        let label = star
            .vmag
            .map_or_else(String::new, |v_mag| format!("V {}", number(v_mag)));
        Layer::new(label, colour, Marks::Dots(best_of(star)))
    });
    Panel {
        title: "Best radius, and those whose error is at most 5 % larger".to_owned(),
        x: noise_axis(answer),
        y: Axis::of("radius (px)"),
        layers: layers.collect(),
    }
}

/// The best radius, and the smallest that meets each error, over the noise.
fn radii_for_errors(answer: &Answer, star: &StarAnswer, study: &Study) -> Panel {
    let mut layers = vec![Layer::new(
        "best, to 5 % of its error",
        BLUE,
        Marks::Dots(best_of(star)),
    )];
    let lines = study.isolines.iter().map(|line| {
        let smallest = line.points.iter();
        smallest
            .filter_map(|at| Some((at.noise, at.smallest_px?)))
            .collect()
    });
    let lines: Vec<Vec<(f64, f64)>> = lines.collect();
    let words = study.isolines.iter().zip(&lines);
    let words = words.filter_map(|(level, line)| {
        let (noise, radius) = *line.get(line.len() * 2 / 3)?;
        Some((noise, radius, number(level.rms_px)))
    });
    let words = Marks::Words(words.collect());
    let parabolas = study
        .isolines
        .iter()
        .zip(&lines)
        .filter_map(|(level, line)| {
            let [c0, c1, c2] = level.radius_of_noise?.coefficients;
            let at = |&(noise, _): &(f64, f64)| (noise, c0 + noise * (c1 + noise * c2));
            Some(line.iter().map(at).collect())
        });
    layers.push(Layer::new(
        "parabolas",
        RGBColor(150, 150, 150),
        Marks::Lines(parabolas.collect()),
    ));
    layers.push(Layer::new(
        "smallest for an error (px)",
        ORANGE,
        Marks::Lines(lines),
    ));
    layers.push(Layer::unnamed(BLACK, words));
    Panel {
        title: title_of(study, "radius over the noise"),
        x: noise_axis(answer),
        y: radius_axis(answer),
        layers,
    }
}

/// What a wider spot costs in reach, and gives or costs in accuracy: one line for each star, radii beside it.
fn accuracy_and_reach(answer: &Answer) -> Panel {
    let points = |star: &StarAnswer| -> Vec<(f64, (f64, f64))> {
        let rows = star.curve.iter();
        rows.filter_map(|row| Some((row.radius_px, (row.limit_vmag?, row.smooth_error_px?))))
            .collect()
    };
    let mut layers = Vec::new();
    for (star, colour) in answer.stars.iter().zip(COLOURS) {
        let points = points(star);
        let bound = star
            .curve
            .iter()
            .filter_map(|row| Some((row.limit_vmag?, row.bound_px?)));
        layers.push(Layer::guide(Marks::Line(bound.collect())));
        let label = star
            .vmag
            .map_or_else(String::new, |v_mag| format!("V {}", number(v_mag)));
        let line = points.iter().map(|(_, point)| *point).collect();
        layers.push(Layer::new(label, colour, Marks::Line(line)));
        let marked = [0.3, 0.5, 0.7, 1.0, 1.5, 2.0]
            .into_iter()
            .filter_map(|wanted: f64| {
                let (_, (limit, error)) = points
                    .iter()
                    .find(|(radius, _)| (radius - wanted).abs() < 0.02)?;
                Some((*limit, *error, number(wanted)))
            });
        layers.push(Layer::unnamed(colour, Marks::Words(marked.collect())));
    }
    Panel {
        title: "Accuracy against reach; numbers: radius (px), grey: Cramér-Rao bound".to_owned(),
        x: Axis::of("half of the stars are found at V"),
        y: Axis::log("error of the centroid (px)", true),
        layers,
    }
}
