//! Tables read back by hand; `scripts/check-outputs` reads them with astropy.

use super::*;
use crate::base::table::{Column, columns};

#[derive(Default)]
struct Row {
    name: String,
    v: Option<f64>,
    hd: Option<u64>,
    seen: bool,
}

fn sample() -> (Vec<Column<Row>>, Vec<Row>) {
    let columns = columns! {
        Row:
        name, "", "meta.id", "the star's name";
        v, "mag", "phot.mag", "brightness";
        hd, "", "", "number";
        seen, "", "", "whether it was seen";
    };
    let sirius = Row {
        name: "Sirius <&>".to_owned(),
        v: Some(-1.46),
        hd: Some(48_915),
        seen: true,
    };
    let unknown = Row {
        name: "é".to_owned(),
        ..Row::default()
    };
    (columns, vec![sirius, unknown])
}

#[test]
fn a_fits_table_has_its_values_in_big_endian_order() {
    let (columns, rows) = sample();
    let bytes = fits_table::file("STARS", &columns, &rows);
    assert_eq!(bytes.len(), 3 * 2880);
    let data = &bytes[2 * 2880..];
    let row_bytes = 10 + 8 + 8 + 1;
    let expected = [
        &b"Sirius <&>"[..],
        &(-1.46_f64).to_be_bytes(),
        &48_915_i64.to_be_bytes(),
        b"T",
    ];
    assert_eq!(&data[..row_bytes], expected.concat());
    let second = &data[row_bytes..2 * row_bytes];
    assert_eq!(&second[..10], b"?         ");
    assert!(f64::from_be_bytes(second[10..18].try_into().unwrap()).is_nan());
    assert_eq!(second[18..26], i64::MIN.to_be_bytes());
    assert_eq!(second[26], b'F');
    assert!(crate::frame::is_table(&bytes[..2880]));
}

#[test]
fn texts_of_a_votable_are_escaped_and_missing_values_empty() {
    let (columns, rows) = sample();
    let text = votable::document("stars", &columns, &rows);
    assert!(text.contains(
        "<TR><TD>Sirius &lt;&amp;&gt;</TD><TD>-1.46</TD><TD>48915</TD><TD>true</TD></TR>"
    ));
    assert!(text.contains("<TR><TD>é</TD><TD></TD><TD></TD><TD>false</TD></TR>"));
    assert!(is_text_table(text.as_bytes()));
}

#[test]
fn an_ecsv_has_its_columns_described() {
    let (columns, rows) = sample();
    let text = ecsv::document(&columns, &rows);
    assert!(
        text.contains("# - {name: v, unit: mag, datatype: float64, description: 'brightness'}\n")
    );
    assert!(text.contains("description: 'the star''s name'}\n"));
    assert!(text.ends_with("name,v,hd,seen\nSirius <&>,-1.46,48915,true\né,,,false\n"));
    assert!(is_text_table(text.as_bytes()));
}
