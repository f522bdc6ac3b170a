//! The table of what is on a simulated frame.

use super::camera::Pointing;
use super::truth::{TrueStar, Truth};
use crate::base::coords::PixelPoint;
use crate::base::units::DEG_PER_RAD;
use crate::camera::CameraModel;
use crate::catalog::Catalog;
use serde::Serialize;

/// A star, a trail or a cosmic ray.
#[derive(Debug, Serialize)]
pub struct TruthRow {
    /// `star`, `false_star`, `trail` or `cosmic_ray`.
    pub kind: &'static str,
    /// The catalogue's identifier.
    pub id: Option<String>,
    /// Johnson V.
    pub vmag: Option<f64>,
    /// B−V.
    pub bv_mag: Option<f64>,
    /// Right ascension at the frame's date.
    pub ra_deg: Option<f64>,
    /// Declination at the frame's date.
    pub dec_deg: Option<f64>,
    /// Position in pixels; of a trail or a cosmic ray, one end.
    pub x: f64,
    /// Position in pixels.
    pub y: f64,
    /// The other end.
    pub x_end: Option<f64>,
    /// The other end.
    pub y_end: Option<f64>,
    /// Electrons on all its pixels.
    pub electrons: Option<f64>,
    /// Whether its position is on the frame.
    pub on_frame: bool,
}

/// What is on a frame of `camera`, brightest stars first. Without pointing the stars are those of a
/// list, and `catalog` is not used. Directions are those of the catalogue at the date.
pub fn truth_table(
    truth: &Truth,
    camera: &CameraModel,
    catalog: &Catalog,
    pointing: Option<&Pointing>,
) -> Vec<TruthRow> {
    let star = |star: &TrueStar| {
        let known = star.catalog.map(|index| catalog.star(index));
        let sky = pointing.and_then(|pointing| {
            let direction = camera.direction_of(&star.position)?;
            let apparent = pointing.icrs_to_camera.inverse().apply(&direction);
            let (ra_rad, dec_rad) = pointing.places.astrometric(&apparent).to_ra_dec();
            Some([ra_rad, dec_rad].map(|rad| decimals(rad * DEG_PER_RAD, 8)))
        });
        TruthRow {
            // Of a list, no star is false.
            kind: if known.is_some() || pointing.is_none() {
                "star"
            } else {
                "false_star"
            },
            id: star.catalog.map(|index| catalog.designation(index)),
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
    stars
        .into_iter()
        .map(star)
        .chain(trails)
        .chain(rays)
        .collect()
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
