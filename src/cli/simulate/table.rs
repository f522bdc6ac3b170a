//! The table of what is on a frame.

use super::generator::Generator;
use crate::cli::output::rows::csv_table;
use serde::Serialize;
use starpipe::base::coords::{Camera, Icrs, PixelPoint, Rotation};
use starpipe::base::units::DEG_PER_RAD;
use starpipe::model::simulate::{TrueStar, Truth};

/// A row of the table.
#[derive(Debug, Serialize)]
struct TruthRow {
    /// star, false_star, trail or cosmic_ray
    kind: &'static str,
    id: Option<String>,
    vmag: Option<f64>,
    bv_mag: Option<f64>,
    ra_deg: Option<f64>,
    dec_deg: Option<f64>,
    x: f64,
    y: f64,
    /// The other end of a trail.
    x_end: Option<f64>,
    y_end: Option<f64>,
    electrons: Option<f64>,
    on_frame: bool,
}

/// The table of what is on a frame, brightest stars first.
pub(super) fn truth_table(
    truth: &Truth,
    generator: &Generator,
    attitude: Option<&Rotation<Icrs, Camera>>,
) -> anyhow::Result<String> {
    let camera = generator.simulator.camera();
    let star = |star: &TrueStar| {
        let known = star.catalog.map(|index| generator.catalog.star(index));
        let sky = attitude.map(|icrs_to_camera| {
            let direction = camera.direction_of(&star.position);
            let (ra_rad, dec_rad) = icrs_to_camera.inverse().apply(&direction).to_ra_dec();
            [ra_rad, dec_rad].map(|rad| decimals(rad * DEG_PER_RAD, 8))
        });
        TruthRow {
            // Without attitude the stars are those of a given list, none of them false.
            kind: if known.is_some() || attitude.is_none() {
                "star"
            } else {
                "false_star"
            },
            id: star
                .catalog
                .map(|index| generator.catalog.designation(index)),
            vmag: Some(decimals(star.v_mag, 4)),
            bv_mag: known
                .and_then(|known| known.bv_mag)
                .map(|bv_mag| decimals(f64::from(bv_mag), 3)),
            ra_deg: sky.map(|[ra_deg, _]| ra_deg),
            dec_deg: sky.map(|[_, dec_deg]| dec_deg),
            electrons: Some(decimals(star.electrons, 4)),
            ..row("star", star.position, None, camera.contains(&star.position))
        }
    };
    let mut stars: Vec<&TrueStar> = truth.stars.iter().chain(&truth.beyond).collect();
    stars.sort_by(|a, b| {
        b.electrons
            .total_cmp(&a.electrons)
            .then(a.number.cmp(&b.number))
    });
    let trails = truth
        .trails
        .iter()
        .map(|trail| row("trail", trail.from, Some(trail.to), true));
    let rays = truth.cosmic_rays.iter().map(|ray| TruthRow {
        electrons: Some(ray.electrons),
        ..row("cosmic_ray", ray.from, Some(ray.to), true)
    });
    let rows = stars.into_iter().map(star).chain(trails).chain(rays);
    csv_table(rows)
}

fn row(kind: &'static str, from: PixelPoint, to: Option<PixelPoint>, on_frame: bool) -> TruthRow {
    TruthRow {
        kind,
        id: None,
        vmag: None,
        bv_mag: None,
        ra_deg: None,
        dec_deg: None,
        x: decimals(from.x, 5),
        y: decimals(from.y, 5),
        x_end: to.map(|to| decimals(to.x, 5)),
        y_end: to.map(|to| decimals(to.y, 5)),
        electrons: None,
        on_frame,
    }
}

/// `value` rounded to `count` decimals, so that the table is the same on every machine.
fn decimals(value: f64, count: usize) -> f64 {
    format!("{value:.count$}").parse().unwrap_or(value)
}
