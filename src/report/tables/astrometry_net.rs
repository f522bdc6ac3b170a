//! Tables as astrometry.net writes them, for programs that read its results: `.corr`, `.rdls`, `.axy`,
//! `-indx.xyls`, and of `.match` the columns of one number.
//!
//! Pixels count from 1, as in FITS, in the rows of the file.
//!
//! # Reference
//! astrometry.net 0.93, `solve-field`: the files it writes.

use super::fits_table;
use crate::base::table::{Column, columns};
use crate::frame::FitsHeader;
use crate::report::{FrameReport, StarReport, wcs};
use crate::solve::Solution;
use std::f64::consts::LN_10;

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

/// The direction of a star.
struct RdlsRow {
    ra: f64,
    dec: f64,
}

/// A detection.
struct AxyRow {
    x: f64,
    y: f64,
    flux: Option<f64>,
    background: Option<f64>,
}

/// The place of a star.
struct XylsRow {
    x: f64,
    y: f64,
}

/// An identification.
struct MatchRow {
    radius: f64,
    nmatch: u64,
    ndistract: u64,
    nconflict: u64,
    nfield: u64,
    nindex: u64,
    wcs_valid: bool,
    parity: bool,
    logodds: f64,
}

/// The columns with names in capital letters.
fn in_capitals<R>(columns: Vec<Column<R>>, names: &[&'static str]) -> Vec<Column<R>> {
    let renamed = columns.into_iter().zip(names);
    renamed
        .map(|(column, &name)| Column { name, ..column })
        .collect()
}

/// The size of the frame, and of what kind the table is.
fn cards(report: &FrameReport, kind: &str) -> FitsHeader {
    let mut cards = FitsHeader::default();
    cards.text("AN_FILE", kind, "astrometry.net file type");
    cards.integer("IMAGEW", report.width as i64, "columns of the image");
    cards.integer("IMAGEH", report.height as i64, "rows of the image");
    cards
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
    let columns: Vec<Column<RdlsRow>> = columns! {
        RdlsRow:
        ra, "deg", "pos.eq.ra", "right ascension (ICRS)";
        dec, "deg", "pos.eq.dec", "declination (ICRS)";
    };
    let columns = in_capitals(columns, &["RA", "DEC"]);
    let named = report.stars.iter().filter(|star| star.id.is_some());
    let place = |star: &StarReport| {
        let (ra, dec) = star.ra_deg.zip(star.dec_deg)?;
        Some(RdlsRow { ra, dec })
    };
    let places: Vec<RdlsRow> = named.filter_map(place).collect();
    fits_table::file("RDLS", &columns, &places)
}

/// The detections, brightest first.
pub(super) fn axy(report: &FrameReport, solution: &Solution) -> Vec<u8> {
    let columns: Vec<Column<AxyRow>> = columns! {
        AxyRow:
        x, "pix", "", "along the rows";
        y, "pix", "", "along the columns";
        flux, "", "", "flux above the background";
        background, "", "", "level of the sky, its median";
    };
    let columns = in_capitals(columns, &["X", "Y", "FLUX", "BACKGROUND"]);
    let background = solution.background.map(|background| background.level_adu);
    let rows = solution.sources.iter().map(|source| {
        let [x, y] = report.file_pixel(&source.position);
        let flux = source.flux;
        AxyRow {
            x,
            y,
            flux,
            background,
        }
    });
    let rows: Vec<AxyRow> = rows.collect();
    fits_table::file_with(&cards(report, "XYLS"), "SOURCES", &columns, &rows)
}

/// Where the identified stars are expected, brightest first.
pub(super) fn index_xyls(report: &FrameReport, solution: &Solution) -> Vec<u8> {
    let columns: Vec<Column<XylsRow>> = columns! {
        XylsRow:
        x, "pix", "", "along the rows";
        y, "pix", "", "along the columns";
    };
    let columns = in_capitals(columns, &["X", "Y"]);
    let place = |pair: CorrRow| XylsRow {
        x: pair.index_x,
        y: pair.index_y,
    };
    let rows: Vec<XylsRow> = pairs(report, solution).into_iter().map(place).collect();
    fits_table::file_with(&cards(report, "XYLS"), "INDEX", &columns, &rows)
}

/// How good the identification is, in one row; no row where there is none.
pub(super) fn matched(report: &FrameReport, solution: &Solution) -> Vec<u8> {
    let columns: Vec<Column<MatchRow>> = columns! {
        MatchRow:
        radius, "deg", "", "half the diagonal";
        nmatch, "", "", "identified detections";
        ndistract, "", "", "others";
        nconflict, "", "", "none";
        nfield, "", "", "detections";
        nindex, "", "", "stars";
        wcs_valid, "", "", "whether there are coordinates";
        parity, "", "", "whether the image is mirrored";
        logodds, "", "", "natural logarithm of the odds that this is no chance";
    };
    let names = [
        "RADIUS",
        "NMATCH",
        "NDISTRACT",
        "NCONFLICT",
        "NFIELD",
        "NINDEX",
        "WCS_VALID",
        "PARITY",
        "LOGODDS",
    ];
    let columns = in_capitals(columns, &names);
    let rows: Vec<MatchRow> = match_row(report, solution).into_iter().collect();
    fits_table::file_with(&cards(report, "MATCH"), "MATCH", &columns, &rows)
}

fn match_row(report: &FrameReport, solution: &Solution) -> Option<MatchRow> {
    let found = solution.outcome.identification()?;
    let linear = wcs::linear(solution)?;
    let diagonal_px = libm::hypot(report.width as f64, report.height as f64);
    let stars = found.matches.len() as u64;
    let detections = solution.sources.len() as u64;
    Some(MatchRow {
        radius: 0.5 * diagonal_px * linear.scale_deg(),
        nmatch: stars,
        ndistract: detections.saturating_sub(stars),
        nconflict: 0,
        nfield: detections,
        nindex: stars,
        wcs_valid: true,
        parity: linear.is_mirrored(),
        logodds: -LN_10 * found.log10_false_alarm,
    })
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
        let seen = found.direction_of(source);
        let (ra_rad, dec_rad) = seen.map(|seen| seen.to_ra_dec()).unzip();
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
