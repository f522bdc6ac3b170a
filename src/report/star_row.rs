//! A row of the table of stars.

use crate::base::table::{Column, columns};
use crate::report::{FrameReport, StarReport};

/// A detection, as the report of its frame has it.
#[derive(Debug, Clone, PartialEq, Default)]
#[expect(missing_docs, reason = "`columns` has unit and description of each")]
pub struct StarRow {
    pub frame: String,
    pub id: String,
    pub name: String,
    pub x_centroid: f64,
    pub y_centroid: f64,
    pub x_centroid_err: Option<f64>,
    pub y_centroid_err: Option<f64>,
    pub flux: Option<f64>,
    pub flux_err: Option<f64>,
    pub peak: Option<f64>,
    pub snr: Option<f64>,
    pub flags: String,
    pub ra: Option<f64>,
    pub dec: Option<f64>,
    pub vmag: Option<f64>,
    pub residual: Option<f64>,
    pub p_chance: Option<f64>,
}

impl StarRow {
    /// The rows of a frame, brightest first.
    pub fn of_frame(report: &FrameReport) -> impl Iterator<Item = Self> {
        let stars = report.stars.iter();
        stars.map(|star| Self::new(&report.frame, star))
    }

    fn new(frame: &str, star: &StarReport) -> Self {
        Self {
            frame: frame.to_owned(),
            id: star.id.clone().unwrap_or_default(),
            name: star.name.clone().unwrap_or_default(),
            x_centroid: star.x,
            y_centroid: star.y,
            x_centroid_err: star.sigma_x,
            y_centroid_err: star.sigma_y,
            flux: star.flux,
            flux_err: star.flux.zip(star.snr).map(|(flux, snr)| flux / snr),
            peak: star.peak,
            snr: star.snr,
            flags: star.flags.join(","),
            ra: star.ra_deg,
            dec: star.dec_deg,
            vmag: star.vmag,
            residual: star.residual_px,
            p_chance: star.p_chance,
        }
    }

    /// The columns of the table `stars`.
    pub fn columns() -> Vec<Column<Self>> {
        columns! {
            Self:
            frame, "", "meta.id", "name of the frame";
            id, "", "meta.id;meta.main", "identifier in the catalogue";
            name, "", "meta.id", "proper name and designation";
            x_centroid, "pix", "pos.cartesian.x;instr.det", "centroid along the rows, from 0";
            y_centroid, "pix", "pos.cartesian.y;instr.det", "centroid along the columns, from 0";
            x_centroid_err, "pix", "stat.error;pos.cartesian.x", "standard error of x_centroid";
            y_centroid_err, "pix", "stat.error;pos.cartesian.y", "standard error of y_centroid";
            flux, "", "phot.flux", "flux above the background, in units of the frame";
            flux_err, "", "stat.error;phot.flux", "standard error of flux";
            peak, "", "phot.flux;stat.max", "brightest pixel above the background";
            snr, "", "stat.snr", "flux over its standard error";
            flags, "", "meta.code.qual", "what is odd about the detection";
            ra, "deg", "pos.eq.ra;meta.main", "right ascension at the frame's date (ICRS)";
            dec, "deg", "pos.eq.dec;meta.main", "declination at the frame's date (ICRS)";
            vmag, "mag", "phot.mag;em.opt.V", "Johnson V of the named star";
            residual, "pix", "stat.fit.residual", "distance from the named star";
            p_chance, "", "stat.probability", "probability that the name is chance";
        }
    }
}
