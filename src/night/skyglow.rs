//! The brightness of the zenith in the text format of the skyglow community.
//!
//! # Reference
//! Definition of the community standard for skyglow observations, version 1.0, 2013; supplement to Kyba &
//! Lolkema 2012, A&G 53, 6.17. Written as the programs of Unihedron write it, with 35 header lines.

use super::row::NightRow;
use crate::base::epoch::ObservationDate;
use crate::ephemeris::observer::Site;
use std::fmt::Write as _;

/// What the header says of the station.
#[derive(Debug, Clone, Default)]
pub struct SkyglowStation {
    /// Name of the instrument.
    pub instrument: String,
    /// Who supplies the data.
    pub supplier: String,
    /// Name of the place.
    pub location: String,
    /// Where it is.
    pub site: Option<Site>,
}

/// The text of a file with the frames that have a date and a brightness of the zenith. Lines end with CR
/// LF. Local times are those of UTC; counts and frequency are 0, and so is the temperature, which is not
/// known.
pub fn skyglow(rows: &[NightRow], station: &SkyglowStation) -> String {
    let mut text = header(station);
    let known = rows
        .iter()
        .filter_map(|row| Some((row.observed()?, row.zenith_mag_arcsec2?)));
    for (date, mag) in known {
        if let Some(time) = in_milliseconds(&date) {
            let _ = write!(text, "{time};{time};0.0;0.000;0.000;{mag:.2}\r\n");
        }
    }
    text
}

/// ISO 8601 with three decimals of a second and no zone.
fn in_milliseconds(date: &ObservationDate) -> Option<String> {
    if !date.has_time() {
        return None;
    }
    let iso = date.to_iso();
    let iso = iso.trim_end_matches('Z');
    let (whole, fraction) = iso.split_once('.').unwrap_or((iso, ""));
    Some(format!("{whole}.{:0<3.3}", fraction))
}

/// One line of ASCII, as the format wants it.
fn ascii(text: &str) -> String {
    const MAX: usize = 100;
    let is_kept = |character: &char| character.is_ascii_graphic() || *character == ' ';
    text.chars().filter(is_kept).take(MAX).collect()
}

fn header(station: &SkyglowStation) -> String {
    let position = station.site.map_or(String::new(), |site| {
        format!(
            "{:.6}, {:.6}, {:.0}",
            site.lat_deg(),
            site.lon_deg(),
            site.height_m()
        )
    });
    let lines = [
        "Light Pollution Monitoring Data Format 1.0".to_owned(),
        "URL: http://www.darksky.org/measurements".to_owned(),
        "Number of header lines: 35".to_owned(),
        "This data is released under the following license: ODbL 1.0 \
         http://opendatacommons.org/licenses/odbl/summary/"
            .to_owned(),
        "Device type: Camera".to_owned(),
        format!("Instrument ID: {}", ascii(&station.instrument)),
        format!("Data supplier: {}", ascii(&station.supplier)),
        format!("Location name: {}", ascii(&station.location)),
        format!("Position (lat, lon, elev(m)): {position}"),
        "Local timezone: UTC".to_owned(),
        "Time Synchronization: Computer".to_owned(),
        "Moving / Stationary position: STATIONARY".to_owned(),
        "Moving / Fixed look direction: FIXED".to_owned(),
        "Number of channels: 1".to_owned(),
        "Filters per channel: V (calibrated with the stars of the frame)".to_owned(),
        "Measurement direction per channel: 0., 0.".to_owned(),
        "Field of view (degrees): 20".to_owned(),
        "Number of fields per line: 6".to_owned(),
        "SQM serial number: none".to_owned(),
        "SQM firmware version: none".to_owned(),
        "SQM cover offset value: 0.00".to_owned(),
        "SQM readout test ix: none".to_owned(),
        "SQM readout test rx: none".to_owned(),
        "SQM readout test cx: none".to_owned(),
        format!(
            "Comment: measured by starpipe {} with the stars in each camera frame",
            env!("CARGO_PKG_VERSION")
        ),
        "Comment: temperature, counts and frequency are not known and written as 0".to_owned(),
        "Comment: ".to_owned(),
        "Comment: ".to_owned(),
        "Comment: ".to_owned(),
        "blank line 30".to_owned(),
        "blank line 31".to_owned(),
        "blank line 32".to_owned(),
        "UTC Date & Time, Local Date & Time, Temperature, Counts, Frequency, MSAS".to_owned(),
        "YYYY-MM-DDTHH:mm:ss.fff;YYYY-MM-DDTHH:mm:ss.fff;Celsius;number;Hz;mag/arcsec^2".to_owned(),
        "END OF HEADER".to_owned(),
    ];
    lines.map(|line| format!("# {line}\r\n")).concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_has_35_lines_of_header_and_a_line_for_each_brightness() {
        let row = |date: &str, mag| NightRow {
            date: date.to_owned(),
            zenith_mag_arcsec2: mag,
            ..NightRow::default()
        };
        let rows = [
            row("2026-01-15T20:00:00Z", Some(21.234)),
            row("2026-01-15T20:01:00.25Z", Some(21.0)),
            row("2026-01-15T20:02:00Z", None),
            row("", Some(20.0)),
        ];
        let station = SkyglowStation {
            location: "Tromsø;\n here".to_owned(),
            site: Some("69.65,18.96,100".parse().unwrap()),
            ..SkyglowStation::default()
        };
        let text = skyglow(&rows, &station);
        assert!(text.is_ascii() && !text.replace("\r\n", "").contains(['\n', '\r', '\t']));
        let lines: Vec<&str> = text.split_terminator("\r\n").collect();
        assert!(
            lines[..35]
                .iter()
                .all(|line| line.starts_with("# ") && line.len() <= 150)
        );
        assert_eq!(lines[2], "# Number of header lines: 35");
        assert_eq!(
            lines[8],
            "# Position (lat, lon, elev(m)): 69.650000, 18.960000, 100"
        );
        assert_eq!(
            lines[35..],
            [
                "2026-01-15T20:00:00.000;2026-01-15T20:00:00.000;0.0;0.000;0.000;21.23",
                "2026-01-15T20:01:00.250;2026-01-15T20:01:00.250;0.0;0.000;0.000;21.00",
            ]
        );
    }
}
