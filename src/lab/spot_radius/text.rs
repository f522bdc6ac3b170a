//! The results of a study as text for people.

use super::report::{
    BestRadius, CurveRow, DefocusReport, DefocusStarReport, RequiredError, SpotRadius,
};
use super::surface::{ClosedFormReport, PaperSurface};
use crate::base::format::five_digits;
use crate::lab::defocus::{Centroiding, DefocusLens, IsoLine, Surface};
use std::fmt::Write as _;

/// Radii of the rows of the table, in pixels, where the grid has them.
const RADII_PX: [f64; 14] = [
    0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.2, 1.5, 1.8, 2.0, 2.4, 3.0,
];

impl DefocusReport {
    /// The report as text of several lines, each with its end.
    pub fn to_text(&self) -> String {
        let mut text = self.heading_text();
        for star in &self.stars {
            text += &self.radii_text(star);
        }
        for star in &self.stars {
            text += &star.curve_text();
            text += &self.isolines_text(star);
        }
        if let [star] = &self.stars[..] {
            text += &self.grid_text(star);
        }
        text
    }

    /// What all spots have in common, how centroids are measured, the noise, and the lens.
    pub fn heading_text(&self) -> String {
        let mut text = normalisation_text(self.stars.first().and_then(|star| star.peak));
        let centroid = match self.centroid {
            Centroiding::GaussianFit => "fit of a Gaussian",
            Centroiding::GreyWeighted => "center of gravity above a threshold",
            Centroiding::FixedWindow => "center of gravity in a fixed window",
        };
        let noise = match (self.noise.e, self.noise.relative) {
            (Some(e), _) => format!("{} e per dark pixel", five_digits(e)),
            (None, Some(relative)) => format!("{} of full scale", five_digits(relative)),
            (None, None) => String::new(),
        };
        let source = &self.noise.source;
        let _ = writeln!(text, "centroid: {centroid}; noise: {noise} ({source})");
        if let Some(lens) = &self.lens {
            text += &lens_text(lens);
        }
        text
    }

    fn radii_text(&self, star: &DefocusStarReport) -> String {
        let mut text = star.title();
        for (name, value) in self.radii_lines(star) {
            let _ = writeln!(text, "  {name:<26} {value}");
        }
        text
    }

    /// The required radii, the best one and that of the camera, each with its name.
    pub fn radii_lines(&self, star: &DefocusStarReport) -> Vec<(String, String)> {
        let of_required = |required: &RequiredError| {
            let error_px = five_digits(required.required_error_px);
            let name = format!("error of {error_px} px or less");
            (name, self.required_text(star, required))
        };
        let mut lines: Vec<_> = star.required.iter().map(of_required).collect();
        lines.push(("best".to_owned(), self.best_text(&star.best)));
        if let Some(present) = &star.present {
            let value = self.radius_and_error_text(present);
            lines.push(("the camera as described".to_owned(), value));
        }
        lines
    }

    fn best_text(&self, best: &BestRadius) -> String {
        let [from, to] = best.nearly_px;
        format!(
            "{}; at most 5 % more from {from:.2} to {to:.2} px{}",
            self.radius_and_error_text(&best.radius),
            if best.is_at_edge {
                "; at the edge of the tested range"
            } else {
                ""
            }
        )
    }

    fn required_text(&self, star: &DefocusStarReport, required: &RequiredError) -> String {
        let (Some(smallest), Some(largest)) = (&required.smallest, &required.largest) else {
            return format!(
                "no radius: the smallest error is {:.4} px, at {:.2} px",
                star.best.radius.error_px, star.best.radius.radius_px
            );
        };
        let (smallest, largest) = (self.radius_text(smallest), self.radius_text(largest));
        match required.is_at_edge {
            [false, true] => format!("from {smallest} up"),
            [true, false] => format!("up to {largest}"),
            [true, true] => "all radii".to_owned(),
            [false, false] => format!("from {smallest} to {largest}"),
        }
    }

    fn radius_and_error_text(&self, radius: &SpotRadius) -> String {
        let error_px = radius.error_px;
        format!("{}: error {error_px:.4} px", self.radius_text(radius))
    }

    fn radius_text(&self, radius: &SpotRadius) -> String {
        let mut text = format!("{:.2} px", radius.radius_px);
        if let Some(um) = radius.radius_um {
            let _ = write!(text, " = {um:.2} µm");
        }
        match (radius.defocus_um, &self.lens) {
            (Some(um), _) => {
                let _ = write!(text, ", {um:.1} µm out of focus");
            }
            (None, Some(_)) => text += ", smaller than the spot in focus",
            (None, None) => (),
        }
        text
    }

    /// The radii of each line of equal error at a few noises.
    fn isolines_text(&self, star: &DefocusStarReport) -> String {
        let mut text = format!(
            "\n  radii (px) with equal error, by noise ({})\n",
            self.noise_unit
        );
        let noises = self.noises_shown();
        let _ = write!(text, "  {:>9}", "error px");
        for noise in noises {
            let _ = write!(text, " {:>11}", five_digits(noise));
        }
        if star.peak.is_some() {
            text += "   smallest as parabola: R²  off by      line off by   noise as parabola of it: R²";
        }
        text.push('\n');
        for line in &star.equal_error {
            let _ = write!(text, "  {:>9}", five_digits(line.rms_px));
            for noise in noises {
                let _ = write!(text, " {:>11}", radii_text(line, noise));
            }
            if star.peak.is_some() {
                text += &parabolas_text(line);
            }
            text.push('\n');
        }
        text
    }

    /// First, last and two noises between: even steps, or even ratios where they are in electrons.
    fn noises_shown(&self) -> [f64; 4] {
        let [from, to] = self.noises;
        [0.0, 1.0, 2.0, 3.0].map(|third| match self.noise_unit {
            "e" => from * libm::pow(to / from, third / 3.0),
            _ => from + (to - from) * third / 3.0,
        })
    }

    /// The grid, and how well the closed form and the surface agree with its errors.
    fn grid_text(&self, star: &DefocusStarReport) -> String {
        let surface = &star.surface;
        let scatter_px = surface.scatter_px.unwrap_or(f64::NAN);
        let mut text = format!(
            "\n  {} radii from {} to {} px, {} noises from {} to {}, {} trials at each\n",
            self.radii,
            five_digits(self.radii_px[0]),
            five_digits(self.radii_px[1]),
            self.noise_count,
            five_digits(self.noises[0]),
            five_digits(self.noises[1]),
            self.trials,
        );
        if let Some(closed_form) = &star.closed_form {
            text += &closed_form_text(closed_form, scatter_px);
        }
        let (Some(own), Some(residual_px)) = (&surface.coefficients, surface.residual_px) else {
            let reason = surface.missing.as_deref().unwrap_or_default();
            return text + &format!("  no surface: {reason}\n");
        };
        let _ = writeln!(
            text,
            "  surface (eq. 13): residual {residual_px:.5} px, expected by chance {scatter_px:.5} px"
        );
        if let Some(paper) = &surface.paper {
            text += &paper_text(own, paper);
        }
        text
    }
}

fn normalisation_text(peak: Option<f64>) -> String {
    match peak {
        Some(peak) => format!(
            "normalisation peak: the brightest pixel has {} of full scale at every radius, so a wider spot has more light.\n\
             For a real star the total light is constant: use normalisation energy.\n",
            five_digits(peak)
        ),
        None => "normalisation energy: the total light of the star is the same at every radius\n"
            .to_owned(),
    }
}

fn lens_text(lens: &DefocusLens) -> String {
    format!(
        "defocus: geometric blur only, at f/{} with a spot of {} px in focus; diffraction limit {} px at {} \
         nm\n",
        five_digits(lens.f_number),
        five_digits(lens.focused_px),
        five_digits((lens.diffraction_px() * 1e3).round() / 1e3),
        five_digits(lens.wavelength_nm),
    )
}

impl DefocusStarReport {
    fn title(&self) -> String {
        match self.vmag {
            Some(v_mag) => format!("\nstar of V {}\n", five_digits(v_mag)),
            None => "\n".to_owned(),
        }
    }

    /// The errors over the radius.
    fn curve_text(&self) -> String {
        let is_peak = self.peak.is_some();
        let mut text = self.title()
            + if is_peak {
                "  radius px   error px ± 1 σ         expected   of it sampling and window\n"
            } else {
                "  radius px   error px ± 1 σ         Cramér-Rao     found   limit V   peak / full well\n"
            };
        for row in self.rows_shown() {
            text += &row.to_text(is_peak);
        }
        text
    }

    /// The rows nearest to [`RADII_PX`]; all rows if none is near.
    fn rows_shown(&self) -> Vec<&CurveRow> {
        let mut rows: Vec<&CurveRow> = Vec::new();
        for wanted in RADII_PX {
            let distance = |row: &&CurveRow| (row.radius_px - wanted).abs();
            let nearest = self
                .curve
                .iter()
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))
                .filter(|row| distance(row) < 0.05);
            let last = rows.last().map(|row| row.radius_px);
            rows.extend(nearest.filter(|row| last != Some(row.radius_px)));
        }
        if rows.is_empty() {
            self.curve.iter().collect()
        } else {
            rows
        }
    }
}

impl CurveRow {
    fn to_text(self, is_peak: bool) -> String {
        let error_px = or_dash(self.error_px, 5);
        let sigma_px = or_dash(self.error_sigma_px, 5);
        let error = format!("{error_px} ± {sigma_px}");
        let first = format!("  {:>9.2}   {error:<20}", self.radius_px);
        if is_peak {
            return format!(
                "{first} {:>10} {:>10}\n",
                or_dash(self.expected_px, 5),
                or_dash(self.bias_px, 5)
            );
        }
        let found_percent = 100.0 * self.found as f64 / self.trials as f64;
        format!(
            "{first} {:>10} {found_percent:>8.1} % {:>8} {:>12}\n",
            or_dash(self.bound_px, 5),
            or_dash(self.limit_vmag, 2),
            or_dash(self.peak_of_full_well, 2)
        )
    }
}

fn or_dash(value: Option<f64>, decimals: usize) -> String {
    value.map_or("–".to_owned(), |value| format!("{value:.decimals$}"))
}

/// The radii of a line at the noise of it that is nearest to `noise`.
fn radii_text(line: &IsoLine, noise: f64) -> String {
    /// Largest distance of a noise, as a natural logarithm.
    const NEAR: f64 = 0.15;
    let distance = |at: f64| libm::log(at / noise).abs();
    let nearest = line
        .points
        .iter()
        .min_by(|a, b| distance(a.noise).total_cmp(&distance(b.noise)))
        .filter(|at| distance(at.noise) < NEAR);
    let end = |px: Option<f64>| px.map_or_else(String::new, |px| format!("{px:.2}"));
    match nearest.map(|at| (at.smallest_px, at.largest_px)) {
        None => "none".to_owned(),
        Some((None, None)) => "all".to_owned(),
        Some((smallest, largest)) => format!("{} – {}", end(smallest), end(largest)),
    }
}

fn parabolas_text(line: &IsoLine) -> String {
    let (Some(radius), Some(noise)) = (&line.radius_of_noise, &line.noise_of_radius) else {
        return String::new();
    };
    format!(
        "   {:>24.4}  {:.4} px   {:.4} px     {:.4}",
        radius.explained, radius.residual, radius.residual_of_line, noise.explained
    )
}

fn closed_form_text(closed_form: &ClosedFormReport, scatter_px: f64) -> String {
    format!(
        "  closed form: measured over expected mean square error {:.4} ± {:.4}; RMS difference {:.5} px, \
         expected by chance {scatter_px:.5} px\n",
        closed_form.mean_square_ratio,
        closed_form.mean_square_ratio_sigma,
        closed_form.difference_px,
    )
}

fn paper_text(own: &Surface, paper: &PaperSurface) -> String {
    format!(
        "  the paper's surface: residual {} px; RMS difference over the grid from our surface {:.5} px, \
         from our errors {:.5} px\n{}",
        five_digits(paper.residual_px),
        paper.surface_difference_px,
        paper.errors_difference_px,
        coefficients_text(own, &paper.coefficients)
    )
}

/// Our coefficients and the paper's, a row for each power of the radius.
fn coefficients_text(own: &Surface, paper: &Surface) -> String {
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
