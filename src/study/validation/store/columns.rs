//! The columns of the tables, in their order: name, type and value.

use crate::base::table::{Column, Meaning, column, field};
use crate::study::robustness::Answer;
use crate::study::validation::record::{FrameRecord, Named, RowKind, StarRecord};
use serde::{Serialize, de::DeserializeOwned};

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

macro_rules! row {
    ($record:ty, $table:literal: $($field:ident)*) => {
        impl TableRow for $record {
            const TABLE: &'static str = $table;

            fn columns() -> Vec<Column<Self>> {
                vec![$(column!(Self, $field, Meaning::default())),*]
            }
        }
    };
}

row!(FrameRecord, "frames":
    frame seed ra_deg dec_deg up_pa_deg status reason stars_above_limit detected rejected named misnamed
    misnamed_companions false_detections blends star_rows error_x_arcsec error_y_arcsec error_roll_arcsec sigma_x_arcsec sigma_y_arcsec
    sigma_roll_arcsec nees focal_error_px focal_sigma_px rms_px faintest_vmag expected_faintest_vmag
    expected_faintest_sigma_mag predicted_limit_vmag measured_limit_vmag measured_limit_sigma_mag background_adu
    true_background_adu noise_adu true_noise_adu split zero_point_error_mag zero_point_sigma_mag
    linearity linearity_sigma notes);

row!(StarRecord, "stars":
    frame kind id vmag bv_mag true_x_px true_y_px true_flux_e isolated saturated probability snr bound_x_px bound_y_px
    bound_flux_e detected x_px y_px sigma_x_px sigma_y_px flux_e sigma_flux_e named);

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
