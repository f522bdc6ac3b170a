//! The columns of the tables: their names, in order, and what is in them.

use starpipe::study::robustness::Answer;
use starpipe::study::validation::{FrameRecord, Kind, Named, StarRecord};

/// What is in a field of a row.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Cell {
    Whole(Option<i64>),
    Number(Option<f64>),
    Yes(Option<bool>),
    Text(Option<String>),
}

/// A column of a table of `R`.
pub(super) struct Column<R> {
    pub(super) name: &'static str,
    pub(super) of: fn(&R) -> Cell,
    /// The field where there is none of it: of its kind, and empty.
    pub(super) empty: Cell,
    pub(super) is_optional: bool,
}

/// A row of a table.
pub(super) trait Row: Sized + serde::Serialize + serde::de::DeserializeOwned {
    /// The table's name.
    const TABLE: &'static str;

    /// Its columns.
    fn columns() -> Vec<Column<Self>>;
}

/// A type that fields are of.
trait Field {
    const OPTIONAL: bool = false;
    fn cell(&self) -> Cell;
    fn empty() -> Cell;
}

macro_rules! field {
    ($($type:ty => $cell:ident, |$value:ident| $made:expr;)*) => {$(
        impl Field for $type {
            fn cell(&self) -> Cell {
                let $value = self;
                Cell::$cell(Some($made))
            }
            fn empty() -> Cell {
                Cell::$cell(None)
            }
        }
    )*};
}

field! {
    // As the bits are: a seed may have all 64 of them.
    u64 => Whole, |value| value.cast_signed();
    f64 => Number, |value| *value;
    bool => Yes, |value| *value;
    String => Text, |value| value.clone();
    Answer => Text, |value| match value {
        Answer::Right => "right",
        Answer::Wrong => "wrong",
        Answer::None => "none",
    }.to_owned();
    Kind => Text, |value| match value {
        Kind::Star => "star",
        Kind::Blend => "blend",
        Kind::False => "false",
    }.to_owned();
    Named => Text, |value| match value {
        Named::Right => "right",
        Named::Wrong => "wrong",
        Named::No => "no",
    }.to_owned();
}

impl<T: Field> Field for Option<T> {
    const OPTIONAL: bool = true;
    fn cell(&self) -> Cell {
        self.as_ref().map_or_else(T::empty, Field::cell)
    }
    fn empty() -> Cell {
        T::empty()
    }
}

/// What the type of a field says of its column.
fn kind_of<R, F: Field>(_: fn(&R) -> &F) -> (Cell, bool) {
    (F::empty(), F::OPTIONAL)
}

macro_rules! row {
    ($record:ty, $table:literal: $($field:ident)*) => {
        impl Row for $record {
            const TABLE: &'static str = $table;

            fn columns() -> Vec<Column<Self>> {
                vec![$({
                    let (empty, is_optional) = kind_of(|row: &Self| &row.$field);
                    Column {
                        name: stringify!($field),
                        of: |row| row.$field.cell(),
                        empty,
                        is_optional,
                    }
                }),*]
            }
        }
    };
}

row!(FrameRecord, "frames":
    frame seed ra_deg dec_deg up_pa_deg status reason stars_above_limit detected rejected named misnamed
    misnamed_companions false_detections blends star_rows error_x_arcsec error_y_arcsec error_roll_arcsec sigma_x_arcsec sigma_y_arcsec
    sigma_roll_arcsec nees focal_error_px focal_sigma_px rms_px faintest_vmag expected_faintest_vmag
    expected_faintest_sigma_mag predicted_limit_vmag measured_limit_vmag measured_limit_sigma_mag background_adu
    true_background_adu noise_adu true_noise_adu);

row!(StarRecord, "stars":
    frame kind id vmag bv_mag true_x_px true_y_px true_flux_e isolated saturated probability snr bound_x_px bound_y_px
    bound_flux_e detected x_px y_px sigma_x_px sigma_y_px flux_e sigma_flux_e named);

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A row with a field of every kind.
    pub(crate) fn frame_row(frame: u64) -> FrameRecord {
        FrameRecord {
            frame,
            seed: u64::MAX - frame,
            ra_deg: 12.5,
            dec_deg: -3.25,
            up_pa_deg: 170.0,
            status: Answer::Right,
            reason: None,
            stars_above_limit: 40,
            detected: 41,
            rejected: 0,
            named: 39,
            misnamed: 0,
            misnamed_companions: 0,
            false_detections: 1,
            blends: 0,
            star_rows: 1,
            error_x_arcsec: Some(0.5),
            error_y_arcsec: Some(-0.25),
            error_roll_arcsec: Some(3.0),
            sigma_x_arcsec: Some(0.4),
            sigma_y_arcsec: Some(0.4),
            sigma_roll_arcsec: Some(2.0),
            nees: Some(2.5),
            focal_error_px: Some(0.01),
            focal_sigma_px: Some(0.02),
            rms_px: Some(0.1),
            faintest_vmag: Some(8.0),
            expected_faintest_vmag: Some(7.9),
            expected_faintest_sigma_mag: Some(0.2),
            predicted_limit_vmag: 7.0,
            measured_limit_vmag: None,
            measured_limit_sigma_mag: None,
            background_adu: Some(100.5),
            true_background_adu: 100.0,
            noise_adu: Some(5.0),
            true_noise_adu: 5.0,
        }
    }

    /// A false detection.
    pub(crate) fn star_row(frame: u64) -> StarRecord {
        StarRecord {
            frame,
            kind: Kind::False,
            id: None,
            vmag: None,
            bv_mag: None,
            true_x_px: None,
            true_y_px: None,
            true_flux_e: None,
            isolated: None,
            saturated: None,
            probability: None,
            snr: None,
            bound_x_px: None,
            bound_y_px: None,
            bound_flux_e: None,
            detected: false,
            x_px: Some(1.5),
            y_px: Some(2.5),
            sigma_x_px: Some(0.1),
            sigma_y_px: Some(0.1),
            flux_e: Some(100.0),
            sigma_flux_e: Some(20.0),
            named: Named::No,
        }
    }

    /// The fields of a row as they are written.
    fn fields<R: Row>(row: &R) -> Vec<(String, String)> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.serialize(row).unwrap();
        let bytes = writer.into_inner().unwrap();
        let mut reader = csv::Reader::from_reader(&bytes[..]);
        let names = reader.headers().unwrap().clone();
        let record = reader.records().next().unwrap().unwrap();
        let pairs = names.iter().zip(record.iter());
        pairs.map(|(n, v)| (n.to_owned(), v.to_owned())).collect()
    }

    fn check<R: Row>(row: &R) {
        let columns = R::columns();
        let fields = fields(row);
        assert_eq!(fields.len(), columns.len());
        for (column, (name, value)) in columns.iter().zip(fields) {
            assert_eq!(column.name, name);
            let cell = match (column.of)(row) {
                Cell::Whole(value) => value.map(|v| v.cast_unsigned().to_string()),
                Cell::Number(value) => value.map(|v| format!("{v:?}")),
                Cell::Yes(value) => value.map(|v| v.to_string()),
                Cell::Text(value) => value,
            };
            assert_eq!(cell.unwrap_or_default(), value, "{name}");
        }
    }

    #[test]
    fn columns_are_the_fields_of_the_rows_in_their_order() {
        check(&frame_row(3));
        check(&star_row(3));
    }
}
