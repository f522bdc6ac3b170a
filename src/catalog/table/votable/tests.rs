use super::*;
use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use proptest::prelude::*;
use std::io::Cursor;

const FIELDS: &str = r#"<FIELD name="source_id" ID="SOURCE_ID" datatype="long" ucd="meta.id"/>
<FIELD name="ra" datatype="double" unit="deg" ref="GAIADR3"><DESCRIPTION>Right &lt; ascension</DESCRIPTION></FIELD>
<FIELD name="phot_g_mean_mag" datatype="float" unit="mag"/>
<FIELD name="name" datatype="char" arraysize="*"/>
<FIELD name="seen" datatype="boolean"/>
<FIELD name="visits" datatype="short"><VALUES null="-1"/></FIELD>
<FIELD name="flags" datatype="unsignedByte" arraysize="2"/>"#;

const TEXT: &str = "#Column\tra (deg)\tEp=2016.0\n\
     source_id\tra (deg)\tphot_g_mean_mag (mag)\tname\tseen\tvisits\tflags\n\
     4295806720\t44.99615537864534\t17.641426\tA & B\tT\t7\t1 2\n\
     34361129088\t45.00432028915398\t\t\tF\t\t3 4\n";

const CELLS: &str = "<TABLEDATA>
<TR><TD>4295806720</TD><TD>44.99615537864534</TD><TD>17.641426</TD><TD>A &amp;\tB</TD><TD>T</TD>
<TD>7</TD><TD>1 2</TD></TR>
<TR>\n<TD>34361129088</TD><TD> 45.00432028915398 </TD><TD>NaN</TD><TD/><TD>false</TD><TD>-1</TD>
<TD><![CDATA[3 4]]></TD></TR></TABLEDATA>";

fn votable(fields: &str, data: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<!-- of the archive -->
<VOTABLE version="1.4" xmlns="http://www.ivoa.net/xml/VOTable/v1.3"><RESOURCE type="results">
<INFO name="QUERY_STATUS" value="OK"/><LINK href="http://x/?a=1&b=2"/>
<RESOURCE><COOSYS ID="GAIADR3" epoch="J2016.0" system="ICRS"/>
<COOSYS ID="other" system="galactic"/></RESOURCE><TABLE name="results">{fields}<DATA>{data}</DATA></TABLE>
<INFO name="QUERY_STATUS" value="OVERFLOW"/></RESOURCE>
<RESOURCE type="meta"><TABLE><FIELD name="x" datatype="char"/></TABLE></RESOURCE></VOTABLE>"#
    )
}

/// The rows of `TEXT`, with null flags or without.
fn rows(has_null_flags: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (id, ra, mag, name, seen, visits, flags) in [
        (
            4_295_806_720_i64,
            44.99615537864534_f64,
            17.641426_f32,
            "A &\tB",
            b'T',
            7_i16,
            [1, 2],
        ),
        (
            34_361_129_088,
            45.00432028915398,
            f32::NAN,
            "",
            b'F',
            -1,
            [3, 4],
        ),
    ] {
        if has_null_flags {
            bytes.push(if name.is_empty() { 0b0011_0100 } else { 0 });
        }
        bytes.extend(id.to_be_bytes());
        bytes.extend(ra.to_be_bytes());
        bytes.extend(if has_null_flags && mag.is_nan() {
            [0x41; 4]
        } else {
            mag.to_be_bytes()
        });
        bytes.extend((name.len() as u32).to_be_bytes());
        bytes.extend(name.bytes());
        bytes.push(seen);
        bytes.extend(if has_null_flags && visits == -1 {
            [0, 0]
        } else {
            visits.to_be_bytes()
        });
        bytes.extend(flags);
    }
    bytes
}

fn stream(element: &str, bytes: &[u8]) -> String {
    let text = BASE64.encode(bytes);
    let lines: Vec<&str> = (0..text.len())
        .step_by(76)
        .map(|at| &text[at..text.len().min(at + 76)])
        .collect();
    let text = lines.join("\r\n ");
    format!("<{element}><STREAM encoding=\"base64\">\n{text}\n</STREAM></{element}>")
}

fn binary() -> String {
    votable(FIELDS, &stream("BINARY", &rows(false)))
}

fn text_of(content: impl AsRef<[u8]>) -> io::Result<String> {
    let content = content.as_ref().to_vec();
    let mut text = Vec::new();
    VotableText::new(Box::new(Cursor::new(content))).read_to_end(&mut text)?;
    Ok(String::from_utf8(text).unwrap())
}

fn error_of(content: impl AsRef<[u8]>) -> String {
    let error = text_of(content).unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::InvalidData);
    error.to_string()
}

#[test]
fn a_table_is_the_same_text_in_any_encoding() {
    for data in [
        CELLS.to_owned(),
        stream("BINARY", &rows(false)),
        stream("BINARY2", &rows(true)),
    ] {
        let content = votable(FIELDS, &data);
        assert_eq!(text_of(&content).unwrap(), TEXT, "{data}");
        assert!(is_votable(&content.as_bytes()[..256]));
        let prefixed = content.replace("</", "</vot:").replace('<', "<vot:");
        let prefixed = prefixed
            .replace("<vot:/vot:", "</vot:")
            .replace("<vot:?", "<?")
            .replace("<vot:!", "<!");
        assert_eq!(text_of(prefixed).unwrap(), TEXT);
    }
}

#[test]
fn vizier_is_read() {
    let content = "\u{feff}<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>\n\
        <!DOCTYPE VOTABLE SYSTEM \"http://us-vo.org/xml/VOTable.dtd\"><VOTABLE>\
        <COOSYS ID=\"J2000\" system=\"eq_FK5\" equinox=\"J2000\"/>\
        <COOSYS ID=\"H_2016.000\" system=\"ICRS\" epoch=\"2016.000\"/>\
        <RESOURCE><TABLE ID=\"none\"><FIELD name=\"a\" datatype=\"int\"/></TABLE>\
        <TABLE><FIELD name=\"_RAJ2000\" datatype=\"char\" arraysize=\"12\" unit=\"&quot;h:m:s&quot;\" ref=\"J2000\"/>\
        <FIELD name=\"RA_ICRS\" datatype=\"double\" unit=\"deg\" ref=\"H_2016.000\"/>\
        <FIELD name=\"RA(ICRS)\" datatype=\"double\"><DESCRIPTION>at Ep=1991.25</DESCRIPTION></FIELD>\
        <FIELD name=\"Plx\" datatype=\"double\"/>\
        <DATA><TABLEDATA><TR><TD>00 1</TD><TD>004.18103104</TD><TD></TD><TD>#\u{e9}</TD></TR><TR/>\
        </TABLEDATA></DATA></TABLE></RESOURCE></VOTABLE>";
    let text = "#Column\tRA_ICRS (deg)\tEp=2016.0\n#Column\tRA_ICRS\tEp=1991.25\n\
        _RAJ2000 (h:m:s)\tRA_ICRS (deg)\tRA_ICRS\tPlx\n00 1\t004.18103104\t\t#\u{e9}\n";
    let latin_1: Vec<u8> = content.chars().skip(1).map(|letter| letter as u8).collect();
    assert_eq!(text_of(latin_1).unwrap(), text);
    assert_eq!(
        text_of(content.replace("ISO-8859-1", "utf-8")).unwrap(),
        text
    );
    assert!(error_of(content.replace("ISO-8859-1", "UTF-16")).contains("UTF-16"));
}

#[test]
fn the_only_coordinate_system_is_that_of_columns_without_a_reference() {
    let other = r#"<COOSYS ID="other" system="galactic"/>"#;
    let fields = r#"<FIELD name="RA"/><FIELD name="RAJ2000"/>"#;
    let content = votable(fields, "<TABLEDATA/>");
    assert_eq!(text_of(&content).unwrap(), "RA\tRAJ2000\n");
    let text = text_of(content.replace(other, "")).unwrap();
    assert_eq!(text, "#Column\tRA\tEp=2016.0\nRA\tRAJ2000\n");
}

#[test]
fn kinds_are_told_by_content() {
    for head in [
        "<VOTABLE>",
        "\u{feff} <v:VOTABLE xmlns:v=\"x\"",
        "<?xml version=\"1.0\"?><!-- long",
        "<?xml version=\"1.0\"?>\n",
        "<?xml version=\"1.0\"?>\n<!DOCTYPE VOTABLE SYSTEM",
    ] {
        assert!(is_votable(head.as_bytes()), "{head}");
    }
    for head in [
        "",
        " ",
        "id,ra,dec",
        "<html>",
        "<!DOCTYPE html>",
        "<?xml?><svg>",
        "<",
        "<VOTABLES>",
    ] {
        assert!(!is_votable(head.as_bytes()), "{head}");
    }
}

#[test]
fn what_cannot_be_read_is_said() {
    let data = |data: &str| votable(FIELDS, data);
    for (content, expected) in [
        ("<?xml?><!-- x --><svg/>".to_owned(), "not a VOTable"),
        ("<VOTABLE></VOTABLE>".to_owned(), "no table with columns"),
        (data("<FITS/>"), "as FITS"),
        (
            data("<BINARY><STREAM href='x.bin'/></BINARY>"),
            "in another file",
        ),
        (
            data("<BINARY><STREAM encoding='gzip'>x</STREAM></BINARY>"),
            "\"gzip\"",
        ),
        (
            data("<BINARY><STREAM encoding='base64'>AA-A</STREAM></BINARY>"),
            "damaged base64",
        ),
        (
            data("<BINARY><STREAM encoding='base64'><!-- x --></STREAM></BINARY>"),
            "something else",
        ),
        (data(&stream("BINARY", &rows(false)[..40])), "within a row"),
        (data(CELLS).replace("</TR>", "</TD>"), "damaged XML"),
        (
            votable(&FIELDS.replace("short", "quad"), &stream("BINARY", &[0])),
            "datatype of visits",
        ),
        (
            votable(
                "<FIELD datatype='int' arraysize='0'/>",
                &stream("BINARY", &[0]),
            ),
            "no bytes",
        ),
        (
            votable(
                "<FIELD datatype='int' arraysize='9e9'/>",
                &stream("BINARY", &[0]),
            ),
            "65536 bytes",
        ),
        (
            "<VOTABLE><INFO name='QUERY_STATUS' value='ERROR'>no &quot;ra&quot; here</INFO>"
                .to_owned(),
            "failed: no \"ra\" here",
        ),
        (data(CELLS).replace("OVERFLOW", "ERROR"), "query failed"),
        (format!("<VOTABLE>{}", "<a>".repeat(1000)), "64 elements"),
        (
            format!("<VOTABLE a='{}'/>", "a".repeat(1 << 21)),
            "1048576 bytes",
        ),
        (
            data(&format!("<TABLEDATA><TR><TD>{}", "a".repeat(1 << 17))),
            "65536 bytes",
        ),
        (
            data(&format!("<TABLEDATA>{}", "<TD>a</TD>".repeat(1 << 16))),
            "65536 bytes",
        ),
    ] {
        let error = error_of(&content);
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_file_that_is_cut_off_is_not_read_as_whole() {
    for content in [votable(FIELDS, CELLS), binary()] {
        for length in 0..content.len() {
            assert!(text_of(&content[..length]).is_err(), "{length}");
        }
    }
}

/// Rows without end.
struct Endless {
    begin: Cursor<Vec<u8>>,
    row: Vec<u8>,
    left: usize,
}

impl Read for Endless {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.begin.read(buffer)? {
            0 if self.left > 0 => {
                self.left -= 1;
                buffer[..self.row.len()].copy_from_slice(&self.row);
                Ok(self.row.len())
            }
            read => Ok(read),
        }
    }
}

#[test]
fn a_long_table_takes_no_more_memory() {
    for data in [CELLS.to_owned(), stream("BINARY", &rows(false).repeat(3))] {
        let content = votable(FIELDS, &data);
        let begin = content
            .find("<TABLEDATA>")
            .map_or_else(|| content.find("base64\">").unwrap() + 8, |at| at + 11);
        let end = content
            .find("</TABLEDATA>")
            .or(content.find("</STREAM>"))
            .unwrap();
        let content = Endless {
            begin: Cursor::new(content[..begin].into()),
            row: content[begin..end].into(),
            left: 50_000,
        };
        let mut text = VotableText::new(Box::new(io::BufReader::new(content)));
        let (mut read, mut piece) = (0, vec![0; 1000]);
        let error = loop {
            match text.read(&mut piece) {
                Ok(length) => read += length,
                Err(error) => break error.to_string(),
            }
            assert!(text.text.capacity() + text.buffer.capacity() < 1 << 18);
        };
        assert!(
            read > 4_000_000 && error.contains("cut off"),
            "{read}: {error}"
        );
    }
}

proptest! {
    #[test]
    fn damage_is_an_error_or_another_text(
        is_binary in any::<bool>(),
        at in 0..1_000_000usize,
        with in prop::collection::vec(any::<u8>(), 0..8),
        removed in 0..40usize,
    ) {
        let content = if is_binary { binary() } else { votable(FIELDS, CELLS) };
        let mut content = content.into_bytes();
        let at = at % content.len();
        let end = content.len().min(at + removed);
        content.splice(at..end, with);
        is_votable(&content[..content.len().min(256)]);
        let _ = text_of(content);
    }

    #[test]
    fn any_rows_are_read_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        for element in ["BINARY", "BINARY2"] {
            let _ = text_of(votable(FIELDS, &stream(element, &bytes)));
        }
    }
}
