//! The answer for people.

use super::answer::{Answer, Best, CurveRow, Radius, Required, StarAnswer};
use starpipe::base::format::five_digits as number;
use starpipe::model::defocus::{Centroiding, IsoLine, Lens, Surface};
use std::fmt::Write as _;

/// Radii that the table has, where the grid reaches them.
const RADII_PX: [f64; 14] = [
    0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.2, 1.5, 1.8, 2.0, 2.4, 3.0,
];

pub(super) fn rendered(answer: &Answer) -> String {
    let mut text = heading(answer);
    for star in &answer.stars {
        text += &answers(answer, star);
    }
    for star in &answer.stars {
        text += &table(star);
        text += &equal_errors(answer, star);
    }
    if let [star] = &answer.stars[..] {
        text += &surface(answer, star);
    }
    text
}

fn heading(answer: &Answer) -> String {
    let how = match answer.centroid {
        Centroiding::GaussianFit => "fit of a Gaussian spot",
        Centroiding::GreyWeighted => "centre of the light above a threshold",
        Centroiding::FixedWindow => "centre of the light in a fixed window",
    };
    let mut text = match answer.stars.first().and_then(|star| star.peak) {
        Some(peak) => format!(
            "normalisation peak: the brightest pixel has {} of full scale at every radius, a wider spot more light.\n\
             A real star's light does not grow with its spot: that is --normalisation energy.\n",
            number(peak)
        ),
        None => {
            "normalisation energy: the star has the light it has, whatever the radius\n".to_owned()
        }
    };
    let noise = match (answer.noise.e, answer.noise.relative) {
        (Some(e), _) => format!("{} e of a pixel in the dark", number(e)),
        (None, Some(relative)) => format!("{} of full scale", number(relative)),
        (None, None) => String::new(),
    };
    let _ = writeln!(
        text,
        "centroid: {how}; noise: {noise} ({})",
        answer.noise.source
    );
    if let Some(lens) = &answer.lens {
        text += &words_of(lens);
    }
    text
}

fn words_of(lens: &Lens) -> String {
    format!(
        "defocus: geometric blur alone, at f/{} with a spot of {} px in focus; diffraction makes {} px at {} nm\n",
        number(lens.f_number),
        number(lens.focused_px),
        number((lens.diffraction_px() * 1e3).round() / 1e3),
        number(lens.wavelength_nm),
    )
}

fn answers(answer: &Answer, star: &StarAnswer) -> String {
    let title = star.vmag.map_or_else(
        || "\n".to_owned(),
        |v| format!("\nstar of V {}\n", number(v)),
    );
    let mut text = title;
    for required in &star.required {
        let name = format!("error of {} px or less", number(required.required_error_px));
        let _ = writeln!(
            text,
            "  {name:<26} {}",
            required_words(answer, star, required)
        );
    }
    let Best {
        radius,
        nearly_px,
        is_at_edge,
    } = &star.best;
    let _ = writeln!(
        text,
        "  {:<26} {}: error {:.4} px; within 5 % of it from {:.2} to {:.2} px{}",
        "best",
        radius_words(answer, radius),
        radius.error_px,
        nearly_px[0],
        nearly_px[1],
        if *is_at_edge {
            "; at the edge of the radii asked for"
        } else {
            ""
        }
    );
    if let Some(present) = &star.present {
        let _ = writeln!(
            text,
            "  {:<26} {}: error {:.4} px",
            "the camera as it is",
            radius_words(answer, present),
            present.error_px
        );
    }
    text
}

fn required_words(answer: &Answer, star: &StarAnswer, required: &Required) -> String {
    let (Some(smallest), Some(largest)) = (&required.smallest, &required.largest) else {
        return format!(
            "no radius: the best that can be had is {:.4} px, with {:.2} px",
            star.best.radius.error_px, star.best.radius.radius_px
        );
    };
    match required.is_at_edge {
        [false, true] => format!("from {} up", radius_words(answer, smallest)),
        [true, false] => format!("up to {}", radius_words(answer, largest)),
        [true, true] => "all radii asked for".to_owned(),
        [false, false] => format!(
            "from {} to {}",
            radius_words(answer, smallest),
            radius_words(answer, largest)
        ),
    }
}

fn radius_words(answer: &Answer, radius: &Radius) -> String {
    let mut words = format!("{:.2} px", radius.radius_px);
    if let Some(um) = radius.radius_um {
        let _ = write!(words, " = {um:.2} µm");
    }
    match (radius.defocus_um, &answer.lens) {
        (Some(um), _) => {
            let _ = write!(words, ", {um:.1} µm out of focus");
        }
        (None, Some(_)) => words += ", sharper than in focus",
        (None, None) => (),
    }
    words
}

/// The row of each of [`RADII_PX`].
fn rows_to_show(star: &StarAnswer) -> Vec<&CurveRow> {
    let curve = &star.curve;
    let mut rows: Vec<&CurveRow> = Vec::new();
    for wanted in RADII_PX {
        let off = |row: &&CurveRow| (row.radius_px - wanted).abs();
        let nearest = curve.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        let nearest = nearest.filter(|row| off(row) < 0.05);
        let before = rows.last().map(|row| row.radius_px);
        rows.extend(nearest.filter(|row| before != Some(row.radius_px)));
    }
    if rows.is_empty() {
        curve.iter().collect()
    } else {
        rows
    }
}

fn table(star: &StarAnswer) -> String {
    let or_dash = |value: Option<f64>, decimals: usize| {
        value.map_or("–".to_owned(), |value| format!("{value:.decimals$}"))
    };
    let mut text = star.vmag.map_or_else(
        || "\n".to_owned(),
        |v| format!("\nstar of V {}\n", number(v)),
    );
    if star.peak.is_some() {
        text += "  radius px   error px ± 1 σ         expected   of it sampling and window\n";
    } else {
        text += "  radius px   error px ± 1 σ         Cramér-Rao     found   limit V   peak / full well\n";
    }
    for row in rows_to_show(star) {
        let error = format!(
            "{} ± {}",
            or_dash(row.error_px, 5),
            or_dash(row.error_sigma_px, 5)
        );
        let _ = write!(text, "  {:>9.2}   {error:<20}", row.radius_px);
        let _ = if star.peak.is_some() {
            writeln!(
                text,
                " {:>10} {:>10}",
                or_dash(row.expected_px, 5),
                or_dash(row.bias_px, 5)
            )
        } else {
            let found = 100.0 * row.found as f64 / row.trials as f64;
            writeln!(
                text,
                " {:>10} {found:>8.1} % {:>8} {:>12}",
                or_dash(row.bound_px, 5),
                or_dash(row.limit_vmag, 2),
                or_dash(row.peak_of_full_well, 2)
            )
        };
    }
    text
}

fn equal_errors(answer: &Answer, star: &StarAnswer) -> String {
    let mut text = format!(
        "\n  radii (px) of equal error at a noise of ({})\n",
        answer.noise_unit
    );
    let shown = noises_to_show(answer);
    let _ = write!(text, "  {:>9}", "error px");
    for noise in &shown {
        let _ = write!(text, " {:>11}", number(*noise));
    }
    let is_peak = star.peak.is_some();
    if is_peak {
        text +=
            "   smallest as parabola: R²  off by      line off by   noise as parabola of it: R²";
    }
    text.push('\n');
    for line in &star.equal_error {
        let _ = write!(text, "  {:>9}", number(line.rms_px));
        for noise in &shown {
            let _ = write!(text, " {:>11}", radii_at(line, *noise));
        }
        if let (true, Some(parabola), Some(turned)) =
            (is_peak, &line.radius_of_noise, &line.noise_of_radius)
        {
            let _ = write!(
                text,
                "   {:>24.4}  {:.4} px   {:.4} px     {:.4}",
                parabola.explained, parabola.residual, parabola.residual_of_line, turned.explained
            );
        }
        text.push('\n');
    }
    text
}

/// A few of the grid's noises, of electrons by ratios.
fn noises_to_show(answer: &Answer) -> [f64; 4] {
    let [from, to] = answer.noises;
    [0.0, 1.0, 2.0, 3.0].map(|third| match answer.noise_unit {
        "e" => from * (to / from).powf(third / 3.0),
        _ => from + (to - from) * third / 3.0,
    })
}

/// The radii of a line at the noise that is nearest.
fn radii_at(line: &IsoLine, noise: f64) -> String {
    /// Noises by this ratio, as a natural logarithm, are about the same.
    const ABOUT: f64 = 0.15;
    let off = |at: f64| (at / noise).ln().abs();
    let nearest = line
        .points
        .iter()
        .min_by(|a, b| off(a.noise).total_cmp(&off(b.noise)));
    let end = |px: Option<f64>| px.map_or_else(String::new, |px| format!("{px:.2}"));
    match nearest {
        Some(at) if off(at.noise) < ABOUT => match (at.smallest_px, at.largest_px) {
            (None, None) => "all".to_owned(),
            (smallest, largest) => format!("{} – {}", end(smallest), end(largest)),
        },
        _ => "none".to_owned(),
    }
}

fn surface(answer: &Answer, star: &StarAnswer) -> String {
    let found = &star.surface;
    let mut text = format!(
        "\n  {} radii from {} to {} px, {} noises from {} to {}, {} trials at each\n",
        answer.radii,
        number(answer.radii_px[0]),
        number(answer.radii_px[1]),
        answer.noise_count,
        number(answer.noises[0]),
        number(answer.noises[1]),
        answer.trials,
    );
    if let Some(closed) = &star.closed_form {
        let _ = writeln!(
            text,
            "  closed form: mean square {:.4} ± {:.4} of that expected; RMS difference {:.5} px, of chance {:.5} px",
            closed.mean_square_ratio,
            closed.mean_square_ratio_sigma,
            closed.difference_px,
            found.scatter_px.unwrap_or(f64::NAN)
        );
    }
    let (Some(own), Some(residual)) = (&found.coefficients, found.residual_px) else {
        let _ = writeln!(
            text,
            "  no surface: {}",
            found.missing.as_deref().unwrap_or_default()
        );
        return text;
    };
    let _ = writeln!(
        text,
        "  surface (eq. 13): residual {residual:.5} px, of chance {:.5} px",
        found.scatter_px.unwrap_or(f64::NAN)
    );
    if let Some(paper) = &found.paper {
        let _ = writeln!(
            text,
            "  the paper's: residual {} px; RMS over the grid from our surface {:.5} px, from our errors {:.5} px",
            number(paper.residual_px),
            paper.surface_difference_px,
            paper.errors_difference_px
        );
        text += &coefficients(own, &paper.coefficients);
    }
    text
}

/// Ours beside the paper's, a row for each power of the radius.
fn coefficients(own: &Surface, paper: &Surface) -> String {
    let mut text = "  coefficients of radius^j noise^i\n".to_owned();
    for (name, surface) in [("ours", own), ("paper", paper)] {
        let _ = write!(text, "  {name:<6} j");
        for i in 0..surface.coefficients.len() {
            let _ = write!(text, " {:>12}", format!("i = {i}"));
        }
        text.push('\n');
        for (j, row) in surface.coefficients.iter().enumerate() {
            let _ = write!(text, "  {:<6} {j}", "");
            for coefficient in row {
                let _ = write!(text, " {coefficient:>12.4e}");
            }
            text.push('\n');
        }
    }
    text
}
