//! The columns of the tables, in their order: name, type and value.

use crate::base::table::{Column, columns, field};
use crate::study::robustness::Answer;
use crate::study::validation::record::{FrameRecord, Named, RowKind, StarRecord};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A row of a table.
pub trait TableRow: Sized + Serialize + DeserializeOwned {
    /// The table's name.
    const TABLE: &'static str;

    /// Its columns.
    fn columns() -> Vec<Column<Self>>;
}

field! {
    Answer => Text, |value| match value {
        Answer::Right => "right",
        Answer::Wrong => "wrong",
        Answer::None => "none",
    }.to_owned();
    RowKind => Text, |value| match value {
        RowKind::Star => "star",
        RowKind::Blend => "blend",
        RowKind::False => "false",
    }.to_owned();
    Named => Text, |value| match value {
        Named::Right => "right",
        Named::Wrong => "wrong",
        Named::No => "no",
    }.to_owned();
}

impl TableRow for FrameRecord {
    const TABLE: &'static str = "frames";

    fn columns() -> Vec<Column<Self>> {
        columns! {
            Self:
            frame, "", "meta.id;meta.main", "number of the frame, from 0";
            seed, "", "", "seed of the random numbers in its pixels";
            ra_deg, "deg", "pos.eq.ra;meta.main", "true right ascension of the centre (ICRS)";
            dec_deg, "deg", "pos.eq.dec;meta.main", "true declination of the centre (ICRS)";
            up_pa_deg, "deg", "pos.posAng", "true position angle of the picture's up direction";
            status, "", "meta.code.status", "right, wrong or none";
            reason, "", "meta.code", "why it is not identified, as a code";
            stars_above_limit, "", "meta.number", "true stars brighter than the predicted limit";
            detected, "", "meta.number", "detections that look like stars";
            rejected, "", "meta.number", "detections rejected as hot pixels, trails or extended light";
            named, "", "meta.number", "detections with the name of a star";
            misnamed, "", "meta.number", "named detections that are another star, or none";
            misnamed_companions, "", "meta.number", "misnamed detections whose name is that of another star at the same position";
            false_detections, "", "meta.number", "detections without the light of any star";
            blends, "", "meta.number", "detections with the light of several stars, none of which gives more than half";
            star_rows, "", "meta.number", "rows of the frame in the table of stars";
            error_x_arcsec, "arcsec", "stat.error", "rotation about the x axis from the true to the measured attitude";
            error_y_arcsec, "arcsec", "stat.error", "the same about the y axis";
            error_roll_arcsec, "arcsec", "stat.error", "the same about the boresight";
            sigma_x_arcsec, "arcsec", "stat.stdev", "standard error of the rotation about the x axis";
            sigma_y_arcsec, "arcsec", "stat.stdev", "standard error of the rotation about the y axis";
            sigma_roll_arcsec, "arcsec", "stat.stdev", "standard error of the rotation about the boresight";
            nees, "", "stat.fit.chi2", "squared attitude error in units of its covariance, 3 on average if that is right";
            focal_error_px, "pix", "stat.error", "measured minus true focal length";
            focal_sigma_px, "pix", "stat.stdev", "standard error of the focal length";
            rms_px, "pix", "stat.fit.residual", "RMS residual of the named stars";
            faintest_vmag, "mag", "phot.mag;em.opt.V", "V magnitude of the faintest named star";
            expected_faintest_vmag, "mag", "phot.mag;em.opt.V", "expected V magnitude of the faintest detected star";
            expected_faintest_sigma_mag, "mag", "stat.stdev", "standard deviation of that magnitude by chance";
            predicted_limit_vmag, "mag", "phot.mag;em.opt.V", "predicted V magnitude at which half of the stars are detected";
            measured_limit_vmag, "mag", "phot.mag;em.opt.V", "the same, measured on the frame";
            measured_limit_sigma_mag, "mag", "stat.stdev", "standard error of the measured limit";
            background_adu, "adu", "instr.background", "measured median background";
            true_background_adu, "adu", "instr.background", "true background";
            noise_adu, "adu", "instr.det.noise", "measured noise of a pixel";
            true_noise_adu, "adu", "instr.det.noise", "true noise of a pixel";
            split, "", "meta.number", "true stars that were detected as several";
            zero_point_error_mag, "mag", "stat.error", "measured minus true photometric zero point";
            zero_point_sigma_mag, "mag", "stat.stdev", "standard error of the zero point";
            linearity, "", "stat.fit.param", "instrumental magnitudes per magnitude of V; 1 is true";
            linearity_sigma, "", "stat.stdev", "standard error of the linearity";
            notes, "", "meta.note", "codes of what is odd about the frame";
        }
    }
}

impl TableRow for StarRecord {
    const TABLE: &'static str = "stars";

    fn columns() -> Vec<Column<Self>> {
        columns! {
            Self:
            frame, "", "meta.id", "number of the frame";
            kind, "", "meta.code.class", "star, blend or false";
            id, "", "meta.id;meta.main", "identifier in the catalogue";
            vmag, "mag", "phot.mag;em.opt.V", "true Johnson V";
            bv_mag, "mag", "phot.color;em.opt.B;em.opt.V", "true B-V";
            true_x_px, "pix", "pos.cartesian.x;instr.det", "true place along the rows, from 0";
            true_y_px, "pix", "pos.cartesian.y;instr.det", "true place along the columns, from 0";
            true_flux_e, "electron", "phot.count", "expected electrons";
            isolated, "", "meta.code", "entirely on the frame, and away from the light of other stars";
            saturated, "", "meta.code.qual", "the brightest pixel may be saturated";
            probability, "", "stat.probability", "predicted probability of detection";
            predicted_snr, "", "stat.snr", "signal-to-noise ratio of the matched filter there, without the star's own shot noise";
            bound_x_px, "pix", "stat.error;pos.cartesian.x", "Cramer-Rao bound of sigma_x";
            bound_y_px, "pix", "stat.error;pos.cartesian.y", "Cramer-Rao bound of sigma_y";
            bound_flux_e, "electron", "stat.error;phot.count", "Cramer-Rao bound of sigma_flux_e";
            detected, "", "meta.code", "a detection has more than half of its light from this star";
            x, "pix", "pos.cartesian.x;instr.det", "centroid along the rows, from 0";
            y, "pix", "pos.cartesian.y;instr.det", "centroid along the columns, from 0";
            sigma_x, "pix", "stat.error;pos.cartesian.x", "standard error of x";
            sigma_y, "pix", "stat.error;pos.cartesian.y", "standard error of y";
            flux_e, "electron", "phot.count", "measured flux";
            sigma_flux_e, "electron", "stat.error;phot.count", "standard error of flux_e";
            named, "", "meta.code", "right, wrong or no";
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{frame_row, star_row};
    use super::*;
    use crate::base::table::FieldValue;

    /// The fields of a row as they are written.
    fn fields<R: TableRow>(row: &R) -> Vec<(String, String)> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.serialize(row).unwrap();
        let bytes = writer.into_inner().unwrap();
        let mut reader = csv::Reader::from_reader(&bytes[..]);
        let names = reader.headers().unwrap().clone();
        let record = reader.records().next().unwrap().unwrap();
        let pairs = names.iter().zip(record.iter());
        pairs.map(|(n, v)| (n.to_owned(), v.to_owned())).collect()
    }

    fn check<R: TableRow>(row: &R) {
        let columns = R::columns();
        let fields = fields(row);
        assert_eq!(fields.len(), columns.len());
        for (column, (name, value)) in columns.iter().zip(fields) {
            assert_eq!(column.name, name);
            let found = match (column.value)(row) {
                FieldValue::Integer(value) => value.map(|v| v.cast_unsigned().to_string()),
                FieldValue::Number(value) => value.map(|v| format!("{v:?}")),
                FieldValue::Bool(value) => value.map(|v| v.to_string()),
                FieldValue::Text(value) => value,
            };
            assert_eq!(found.unwrap_or_default(), value, "{name}");
        }
    }

    #[test]
    fn columns_are_the_fields_of_the_rows_in_their_order() {
        check(&frame_row(3));
        check(&star_row(3));
    }
}
