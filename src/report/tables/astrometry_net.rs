//! Tables as astrometry.net writes them, for programs that read its results.
//!
//! Pixels count from 1, as in FITS, in the rows of the file.
//!
//! # Reference
//! astrometry.net 0.97, `solve-field --corr`, `--rdls` and `--axy`.

use super::fits_table;
use crate::base::coords::PixelPoint;
use crate::base::table::{Column, columns};
use crate::report::{FrameReport, StarReport};
use crate::solve::Solution;

/// A detection and its star. Names are those of astrometry.net.
#[derive(Debug, Default)]
struct CorrRow {
    field_x: f64,
    field_y: f64,
    field_ra: Option<f64>,
    field_dec: Option<f64>,
    index_x: f64,
    index_y: f64,
    index_ra: f64,
    index_dec: f64,
    index_id: Option<u64>,
    field_id: u64,
    match_weight: f64,
    flux: Option<f64>,
}

/// A detection. Names are those of astrometry.net.
struct AxyRow {
    x: f64,
    y: f64,
    flux: Option<f64>,
}

/// The direction of a star.
struct RdlsRow {
    ra: f64,
    dec: f64,
}

/// The pairs of detections and stars, brightest first.
pub(super) fn corr(report: &FrameReport, solution: &Solution) -> Vec<u8> {
    let mut columns: Vec<Column<CorrRow>> = columns! {
        CorrRow:
        field_x, "pix", "", "detection, along the rows";
        field_y, "pix", "", "detection, along the columns";
        field_ra, "deg", "", "direction of the detection";
        field_dec, "deg", "", "direction of the detection";
        index_x, "pix", "", "where the star is expected";
        index_y, "pix", "", "where the star is expected";
        index_ra, "deg", "", "direction of the star";
        index_dec, "deg", "", "direction of the star";
        index_id, "", "", "number of the star in its catalog";
        field_id, "", "", "number of the detection, from 0";
        match_weight, "", "", "probability that the pair is right";
        flux, "", "", "flux of the detection";
    };
    if let Some(flux) = columns.last_mut() {
        flux.name = "FLUX";
    }
    fits_table::file("CORR", &columns, &pairs(report, solution))
}

/// The directions of the identified stars, brightest first.
pub(super) fn rdls(report: &FrameReport) -> Vec<u8> {
    let mut columns: Vec<Column<RdlsRow>> = columns! {
        RdlsRow:
        ra, "deg", "pos.eq.ra", "right ascension (ICRS)";
        dec, "deg", "pos.eq.dec", "declination (ICRS)";
    };
    for (column, name) in columns.iter_mut().zip(["RA", "DEC"]) {
        column.name = name;
    }
    let named = report.stars.iter().filter(|star| star.id.is_some());
    let place = |star: &StarReport| {
        let (ra, dec) = star.ra_deg.zip(star.dec_deg)?;
        Some(RdlsRow { ra, dec })
    };
    let places: Vec<RdlsRow> = named.filter_map(place).collect();
    fits_table::file("RDLS", &columns, &places)
}

/// The places of the detections, brightest first.
pub(super) fn axy(report: &FrameReport) -> Vec<u8> {
    let mut columns: Vec<Column<AxyRow>> = columns! {
        AxyRow:
        x, "pix", "", "detection, along the rows";
        y, "pix", "", "detection, along the columns";
        flux, "", "", "flux of the detection";
    };
    for (column, name) in columns.iter_mut().zip(["X", "Y", "FLUX"]) {
        column.name = name;
    }
    let row = |star: &StarReport| {
        let [x, y] = report.file_pixel(&PixelPoint::new(star.x, star.y));
        let flux = star.flux;
        AxyRow { x, y, flux }
    };
    let rows: Vec<AxyRow> = report.stars.iter().map(row).collect();
    fits_table::file("SOURCES", &columns, &rows)
}

fn pairs(report: &FrameReport, solution: &Solution) -> Vec<CorrRow> {
    let Some(found) = solution.outcome.identification() else {
        return Vec::new();
    };
    let matches = solution.matches_by_source();
    let pair = |(number, star): (usize, &StarReport)| {
        let id = star.id.as_ref()?;
        let (index_ra, index_dec) = star.ra_deg.zip(star.dec_deg)?;
        let source = &solution.sources.get(number)?.position;
        let matched = (*matches.get(number)?)?;
        let predicted = found.pixel_of(&matched.light)?;
        let [field_x, field_y] = report.file_pixel(source);
        let [index_x, index_y] = report.file_pixel(&predicted);
        let seen = found.apparent_direction_of(source);
        let seen = seen.map(|apparent| found.places.astrometric(&apparent).to_ra_dec());
        let (ra_rad, dec_rad) = seen.unzip();
        Some(CorrRow {
            field_x,
            field_y,
            field_ra: ra_rad.map(f64::to_degrees),
            field_dec: dec_rad.map(f64::to_degrees),
            index_x,
            index_y,
            index_ra,
            index_dec,
            index_id: id
                .split_once(' ')
                .and_then(|(_, number)| number.parse().ok()),
            field_id: number as u64,
            match_weight: 1.0 - matched.p_chance,
            flux: star.flux,
        })
    };
    report.stars.iter().enumerate().filter_map(pair).collect()
}
