//! The columns of a star: those of the JSON, in every table.

use super::frame_report::{FrameReport, StarReport};
use crate::base::table::{Column, TableRow, columns, csv_of};
use std::io;

/// A detection, with its frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StarRow {
    /// Name of the frame.
    pub frame: String,
    /// Order of the rows in the file; empty for lists of centroids.
    pub row_order: String,
    /// The detection.
    pub star: StarReport,
}

impl TableRow for StarRow {
    const TABLE: &'static str = "stars";

    /// The fields of a star in JSON, and those of its frame. Flags are
    /// separated by blanks; `flux_e` and `peak_e` are filled where a camera is stated. `x` and `y`
    /// count from the top of the picture, whichever `row_order` the file has.
    fn columns() -> Vec<Column<Self>> {
        columns! {
            Self:
            frame, "", "meta.id", "name of the frame";
            star.x, "pix", "pos.cartesian.x;instr.det", "x of the centroid, from 0";
            star.y, "pix", "pos.cartesian.y;instr.det", "y of the centroid, from 0";
            star.sigma_x, "pix", "stat.error;pos.cartesian.x", "standard error of x as the position of the named star";
            star.sigma_y, "pix", "stat.error;pos.cartesian.y", "standard error of y as the position of the named star";
            star.flux, "", "phot.flux", "flux above the background, in the units of the frame";
            star.sigma_flux, "", "stat.error;phot.flux", "standard error of flux";
            star.peak, "", "phot.flux;stat.max", "brightest pixel above the background, in the units of the frame";
            star.snr, "", "stat.snr", "signal-to-noise ratio: flux over its standard error";
            star.id, "", "meta.id;meta.main", "identifier in the catalog";
            star.name, "", "meta.id", "proper name and designation";
            star.hip, "", "meta.id", "number in the Hipparcos Catalogue";
            star.hd, "", "meta.id", "number in the Henry Draper Catalogue";
            star.hr, "", "meta.id", "number in the Bright Star Catalogue";
            star.sao, "", "meta.id", "number in the SAO catalog";
            star.vmag, "mag", "phot.mag;em.opt.V", "Johnson V of the named star";
            star.ra_deg, "deg", "pos.eq.ra;meta.main", "right ascension at the frame's date (ICRS)";
            star.dec_deg, "deg", "pos.eq.dec;meta.main", "declination at the frame's date (ICRS)";
            star.airmass, "", "obs.airMass", "airmass, if site and time are known";
            star.residual_px, "pix", "stat.fit.residual", "distance from the expected position of the named star";
            star.residual_blend_px, "pix", "stat.fit.residual", "distance from the center of light of the named star and those blended with it";
            star.p_chance, "", "stat.probability", "probability that the name is a chance match";
            star.flags, "", "meta.code.qual", "unusual properties of the detection";
            star.flux_e, "electron", "phot.count", "flux in electrons, if a camera is given";
            star.peak_e, "electron", "phot.count;stat.max", "brightest pixel in electrons, if a camera is given";
            row_order, "", "meta.code", "order of the rows in the file";
        }
    }
}

impl StarRow {
    /// The rows of a frame, brightest first.
    pub fn of_frame(report: &FrameReport) -> impl Iterator<Item = Self> {
        let stars = report.stars.iter();
        stars.map(|star| Self {
            frame: report.frame.clone(),
            row_order: report.row_order_word().to_owned(),
            star: star.clone(),
        })
    }
}

impl FrameReport {
    /// The detections as a CSV table, brightest first.
    ///
    /// # Errors
    /// None for reports that [`new`](Self::new) made.
    pub fn to_csv(&self, with_header: bool) -> io::Result<String> {
        let rows: Vec<StarRow> = StarRow::of_frame(self).collect();
        csv_of(&rows, with_header)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;
    use std::collections::BTreeSet;

    fn named_star() -> StarReport {
        StarReport {
            x: 12.5,
            y: 0.25,
            sigma_x: Some(0.02),
            sigma_y: Some(0.03),
            flux: Some(1234.5),
            sigma_flux: Some(12.0),
            peak: Some(300.0),
            flux_e: Some(2469.0),
            peak_e: Some(600.0),
            snr: Some(102.9),
            id: Some("HIP 32349".to_owned()),
            name: Some("Sirius".to_owned()),
            hip: Some(32_349),
            hd: Some(48_915),
            hr: Some(2491),
            sao: Some(151_881),
            vmag: Some(-1.44),
            ra_deg: Some(101.287),
            dec_deg: Some(-16.716),
            airmass: Some(1.52),
            residual_px: Some(0.01),
            residual_blend_px: Some(0.02),
            p_chance: Some(1.2e-9),
            flags: vec!["saturated", "blended"],
        }
    }

    #[test]
    fn a_star_has_the_same_names_and_values_in_json_and_tables() {
        let row = StarRow {
            frame: "night.tif".to_owned(),
            row_order: "top-down".to_owned(),
            star: named_star(),
        };
        let columns = StarRow::columns();
        let json = serde_json::to_value(&row.star).unwrap();
        let fields = json.as_object().unwrap();
        let mut names: BTreeSet<&str> = columns.iter().map(|column| column.name).collect();
        assert_eq!(names.len(), columns.len());
        assert!(names.remove("frame") && names.remove("row_order"));
        assert_eq!(names, fields.keys().map(String::as_str).collect());

        let text = csv_of([&row], true).unwrap();
        let mut table = csv::Reader::from_reader(text.as_bytes());
        let heading = table.headers().unwrap().clone();
        let record = table.records().next().unwrap().unwrap();
        for (name, text) in heading.iter().zip(&record) {
            match fields.get(name) {
                Some(Value::String(value)) => assert_eq!(text, value, "{name}"),
                Some(Value::Array(flags)) => {
                    let flags: Vec<_> = flags.iter().filter_map(Value::as_str).collect();
                    assert_eq!(text, flags.join(" "), "{name}");
                }
                Some(value) => assert_eq!(text.parse().ok(), value.as_f64(), "{name}"),
                None => assert!(["night.tif", "top-down"].contains(&text), "{name}"),
            }
        }
    }
}
