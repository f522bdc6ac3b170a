//! Tables of Gaia as its archive and VizieR write them, for tests.

use super::patch::{DrawnStar, Patch};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use parquet::data_type::{DoubleType, FloatType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::Arc;

/// The forms of a table.
#[derive(Debug, Clone, Copy)]
pub enum Form {
    /// CSV of the archive.
    Csv,
    /// TSV of VizieR, with notes, units and dashes.
    VizierTsv,
    /// VOTable with a row of text for each star.
    TableData,
    /// VOTable with binary rows.
    Binary,
    /// The same with flags for what is missing.
    Binary2,
    /// Parquet.
    Parquet,
}

impl Form {
    pub const ALL: [Self; 6] = [
        Self::Csv,
        Self::VizierTsv,
        Self::TableData,
        Self::Binary,
        Self::Binary2,
        Self::Parquet,
    ];

    /// The name of a file of this form.
    pub const fn file_name(self) -> &'static str {
        match self {
            Self::Csv => "gaia.csv",
            Self::VizierTsv => "gaia.tsv",
            Self::TableData | Self::Binary | Self::Binary2 => "gaia.vot",
            Self::Parquet => "gaia.parquet",
        }
    }

    /// Writes the stars into a file.
    pub fn write(self, path: &Path, patch: &Patch) {
        let rows: Vec<Row> = patch.stars.iter().zip(1..).map(Row::of).collect();
        match self {
            Self::Csv => fs::write(path, csv(&rows)).unwrap(),
            Self::VizierTsv => fs::write(path, vizier_tsv(&rows)).unwrap(),
            Self::TableData | Self::Binary | Self::Binary2 => {
                fs::write(path, self.votable(&rows)).unwrap();
            }
            Self::Parquet => write_parquet(path, &rows),
        }
    }

    fn votable(self, rows: &[Row]) -> String {
        let fields: String = COLUMNS
            .iter()
            .map(|(name, kind, unit)| {
                format!("<FIELD name=\"{name}\" datatype=\"{kind}\" unit=\"{unit}\"/>\n")
            })
            .collect();
        let data = match self {
            Self::Binary => format!(
                "<BINARY><STREAM encoding=\"base64\">\n{}</STREAM></BINARY>",
                binary(rows, false)
            ),
            Self::Binary2 => format!(
                "<BINARY2><STREAM encoding='base64'>{}</STREAM></BINARY2>",
                binary(rows, true)
            ),
            _ => {
                let cells = |row: &Row| {
                    let cells = row.texts().map(|text| format!("<TD>{text}</TD>"));
                    format!("<TR>{}</TR>\n", cells.concat())
                };
                format!(
                    "<TABLEDATA>\n{}</TABLEDATA>",
                    rows.iter().map(cells).collect::<String>()
                )
            }
        };
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
             <VOTABLE version=\"1.4\" xmlns=\"http://www.ivoa.net/xml/VOTable/v1.3\">\n\
             <RESOURCE type=\"results\"><INFO name=\"QUERY_STATUS\" value=\"OK\"/>\n\
             <COOSYS ID=\"GAIADR3\" epoch=\"J2016.0\" system=\"ICRS\"/>\n\
             <TABLE>\n{fields}<DATA>{data}</DATA></TABLE></RESOURCE></VOTABLE>\n"
        )
    }
}

/// Names, types of VOTable and units.
const COLUMNS: [(&str, &str, &str); 8] = [
    ("source_id", "long", ""),
    ("ra", "double", "deg"),
    ("dec", "double", "deg"),
    ("pmra", "double", "mas.yr**-1"),
    ("pmdec", "double", "mas.yr**-1"),
    ("ref_epoch", "double", "yr"),
    ("phot_g_mean_mag", "float", "mag"),
    ("bp_rp", "float", "mag"),
];

/// A star at the epoch of Gaia.
struct Row {
    source_id: i64,
    ra_deg: f64,
    dec_deg: f64,
    pm_ra: f64,
    pm_dec: f64,
    g_mag: f32,
    /// One of ten has none.
    bp_rp: Option<f32>,
}

const EPOCH: f64 = 2016.0;

impl Row {
    fn of((star, number): (&DrawnStar, i64)) -> Self {
        let share = |factor: f64| (factor * number as f64).fract();
        let [pm_ra, pm_dec] = [60.0, 40.0].map(|most| most * (share(0.618_033_988_7) - 0.5));
        let (ra_rad, dec_rad) = star.direction.to_ra_dec();
        let years = EPOCH - 2000.0;
        let moved_deg = |mas: f64| mas * years / 3.6e6;
        let color = 0.4 + 1.2 * share(0.754_877_666_2);
        let bp_rp = (number % 10 != 0).then_some(color as f32);
        // Without a color the one of most stars is assumed.
        let color = if bp_rp.is_some() { color } else { 0.9 };
        let g_minus_v = -0.02704 + color * (0.01424 + color * (-0.2156 + color * 0.01426));
        Self {
            source_id: (1 << 60) + number,
            ra_deg: ra_rad.to_degrees() + moved_deg(pm_ra) / dec_rad.cos(),
            dec_deg: dec_rad.to_degrees() + moved_deg(pm_dec),
            pm_ra,
            pm_dec,
            g_mag: (star.v_mag + g_minus_v) as f32,
            bp_rp,
        }
    }

    fn texts(&self) -> [String; 8] {
        [
            self.source_id.to_string(),
            self.ra_deg.to_string(),
            self.dec_deg.to_string(),
            self.pm_ra.to_string(),
            self.pm_dec.to_string(),
            EPOCH.to_string(),
            self.g_mag.to_string(),
            self.bp_rp.map_or(String::new(), |color| color.to_string()),
        ]
    }

    fn doubles(&self) -> [f64; 5] {
        [self.ra_deg, self.dec_deg, self.pm_ra, self.pm_dec, EPOCH]
    }
}

fn csv(rows: &[Row]) -> String {
    let mut text = COLUMNS.map(|(name, ..)| name).join(",") + "\n";
    for row in rows {
        text += &(row.texts().join(",") + "\n");
    }
    text
}

fn vizier_tsv(rows: &[Row]) -> String {
    let mut text = "#RESOURCE=yCat_1355\n#Name: I/355/gaiadr3\n\
        #Column\tRA_ICRS\t(F15.11)\tRight ascension (ICRS) at Ep=2016.0\t[ucd=pos.eq.ra]\n\
        #Column\tDE_ICRS\t(F15.11)\tDeclination (ICRS) at Ep=2016.0\t[ucd=pos.eq.dec]\n\n\
        RA_ICRS\tDE_ICRS\tSource\tpmRA\tpmDE\tGmag\tBPmag\tRPmag\n\
        deg\tdeg\t \tmas/yr\tmas/yr\tmag\tmag\tmag\n\
        ---------------\t---------------\t-------------------\t---------\t---------\t---------\t---------\t---------\n"
        .to_owned();
    for row in rows {
        let [bp, rp] = match row.bp_rp {
            Some(color) => [0.4, -0.6].map(|share| format!("{:.6}", row.g_mag + share * color)),
            None => [" ".repeat(9), " ".repeat(9)],
        };
        let Row {
            source_id,
            ra_deg,
            dec_deg,
            pm_ra,
            pm_dec,
            g_mag,
            ..
        } = row;
        writeln!(
            text,
            "{ra_deg:015.11}\t{dec_deg:+015.11}\t{source_id}\t{pm_ra:9.3}\t{pm_dec:9.3}\t{g_mag:9.6}\t{bp}\t{rp}"
        )
        .unwrap();
    }
    text
}

/// Rows in base64, in lines.
fn binary(rows: &[Row], has_flags: bool) -> String {
    let mut bytes = Vec::new();
    for row in rows {
        if has_flags {
            bytes.push(u8::from(row.bp_rp.is_none()));
        }
        bytes.extend(row.source_id.to_be_bytes());
        row.doubles()
            .iter()
            .for_each(|value| bytes.extend(value.to_be_bytes()));
        bytes.extend(row.g_mag.to_be_bytes());
        bytes.extend(row.bp_rp.unwrap_or(f32::NAN).to_be_bytes());
    }
    let text = BASE64_STANDARD.encode(bytes);
    let lines = text
        .as_bytes()
        .chunks(64)
        .map(|line| String::from_utf8_lossy(line));
    lines.map(|line| format!("{line}\n")).collect()
}

fn write_parquet(path: &Path, rows: &[Row]) {
    const ROWS_IN_GROUP: usize = 2000;
    let schema = "message gaia {
        required int64 source_id; required double ra; required double dec; optional double pmra;
        optional double pmdec; required double ref_epoch; required float phot_g_mean_mag; optional float bp_rp;
    }";
    let schema = Arc::new(parse_message_type(schema).unwrap());
    let properties = Arc::new(WriterProperties::builder().build());
    let file = fs::File::create(path).unwrap();
    let mut writer = SerializedFileWriter::new(file, schema, properties).unwrap();
    for rows in rows.chunks(ROWS_IN_GROUP) {
        let mut group = writer.next_row_group().unwrap();
        write_group(&mut group, rows);
        group.close().unwrap();
    }
    writer.close().unwrap();
}

fn write_group(group: &mut SerializedRowGroupWriter<'_, fs::File>, rows: &[Row]) {
    let mut number = 0;
    while let Some(mut column) = group.next_column().unwrap() {
        let levels: Vec<i16> = match number {
            3 | 4 => vec![1; rows.len()],
            7 => rows
                .iter()
                .map(|row| i16::from(row.bp_rp.is_some()))
                .collect(),
            _ => Vec::new(),
        };
        let levels = (!levels.is_empty()).then_some(&levels[..]);
        match number {
            0 => {
                let ids: Vec<i64> = rows.iter().map(|row| row.source_id).collect();
                column
                    .typed::<Int64Type>()
                    .write_batch(&ids, levels, None)
                    .unwrap();
            }
            1..6 => {
                let values: Vec<f64> = rows.iter().map(|row| row.doubles()[number - 1]).collect();
                column
                    .typed::<DoubleType>()
                    .write_batch(&values, levels, None)
                    .unwrap();
            }
            _ => {
                let value = |row: &Row| {
                    if number == 6 {
                        Some(row.g_mag)
                    } else {
                        row.bp_rp
                    }
                };
                let values: Vec<f32> = rows.iter().filter_map(value).collect();
                column
                    .typed::<FloatType>()
                    .write_batch(&values, levels, None)
                    .unwrap();
            }
        }
        column.close().unwrap();
        number += 1;
    }
}
