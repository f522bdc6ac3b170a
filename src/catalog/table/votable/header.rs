//! What is before the rows of a VOTable.

use super::fields::{CoordinateSystem, Field};
use super::xml::{Xml, attribute, invalid, text_of_event};
use quick_xml::events::{BytesStart, Event};
use std::io;

/// How the rows are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    TableData,
    Binary,
    Binary2,
}

/// The first table with columns and data, of which the rows follow.
pub(super) struct Header {
    pub(super) fields: Vec<Field>,
    pub(super) systems: Vec<CoordinateSystem>,
    pub(super) encoding: Encoding,
    /// There are rows.
    pub(super) has_rows: bool,
}

impl Header {
    /// Reads as far as the rows.
    ///
    /// # Errors
    /// There is no table that can be read.
    pub(super) fn read(xml: &mut Xml, buffer: &mut Vec<u8>) -> io::Result<Self> {
        let mut found = Columns::default();
        let mut status = QueryStatus::default();
        loop {
            let event = xml.next(buffer)?;
            status.see(&event)?;
            let mut is_stream = false;
            match &event {
                Event::Start(tag) | Event::Empty(tag) => {
                    let is_empty = matches!(event, Event::Empty(_));
                    if let Some(encoding) = found.start(tag, is_empty)? {
                        return Ok(Self {
                            fields: found.fields,
                            systems: found.systems,
                            encoding,
                            has_rows: !is_empty,
                        });
                    }
                    is_stream = !is_empty && tag.local_name().as_ref() == "STREAM";
                }
                Event::End(tag) => found.end(tag.local_name().as_ref()),
                Event::Eof => return Err(invalid("found no table with columns in the VOTable")),
                event => found.describe(event),
            }
            if is_stream {
                xml.skip_text()?;
            }
        }
    }
}

/// The columns of the table, as far as they were read.
#[derive(Default)]
struct Columns {
    fields: Vec<Field>,
    systems: Vec<CoordinateSystem>,
    /// The event is within a FIELD, and in its DESCRIPTION.
    is_in_field: bool,
    is_in_description: bool,
}

impl Columns {
    /// Reads the beginning of an element. Returns the encoding of the rows where they begin.
    fn start(&mut self, tag: &BytesStart, is_empty: bool) -> io::Result<Option<Encoding>> {
        /// Many more than there are in any table.
        const MAX_FIELDS: usize = 2000;
        match tag.local_name().as_ref() {
            "TABLE" => self.fields.clear(),
            "FIELD" => {
                self.fields.push(Field::new(tag));
                self.is_in_field = !is_empty;
            }
            "COOSYS" => self.systems.push(CoordinateSystem::new(tag)),
            "VALUES" if self.is_in_field => {
                if let Some(field) = self.fields.last_mut() {
                    field.null = attribute(tag, "null").into_owned();
                }
            }
            "DESCRIPTION" if self.is_in_field => self.is_in_description = !is_empty,
            _ if self.fields.is_empty() => {}
            "TABLEDATA" => return Ok(Some(Encoding::TableData)),
            "BINARY" => return Ok(Some(Encoding::Binary)),
            "BINARY2" => return Ok(Some(Encoding::Binary2)),
            name @ ("FITS" | "PARQUET") => {
                return Err(invalid(format!(
                    "the VOTable holds its rows as {name}: save it as TABLEDATA, BINARY or BINARY2"
                )));
            }
            _ => {}
        }
        if self.fields.len() > MAX_FIELDS || self.systems.len() > MAX_FIELDS {
            let message = format!("found more than {MAX_FIELDS} columns in the VOTable");
            return Err(invalid(message));
        }
        Ok(None)
    }

    fn end(&mut self, name: &str) {
        match name {
            "TABLE" => self.fields.clear(),
            "FIELD" => self.is_in_field = false,
            "DESCRIPTION" => self.is_in_description = false,
            _ => {}
        }
    }

    fn describe(&mut self, event: &Event) {
        if self.is_in_description
            && let (Some(field), Some(text)) = (self.fields.last_mut(), text_of_event(event))
        {
            field.describe(&text);
        }
    }
}

/// Looks for the error of a query, which an archive sends as a VOTable.
#[derive(Default)]
pub(super) struct QueryStatus {
    /// What the archive says, while its INFO is read.
    error: Option<String>,
}

impl QueryStatus {
    /// # Errors
    /// The query failed.
    pub(super) fn see(&mut self, event: &Event) -> io::Result<()> {
        const MAX_BYTES: usize = 1000;
        match event {
            Event::Start(tag) | Event::Empty(tag) if tag.local_name().as_ref() == "INFO" => {
                let is_status = attribute(tag, "name") == "QUERY_STATUS";
                if is_status && attribute(tag, "value").eq_ignore_ascii_case("ERROR") {
                    self.error = Some(String::new());
                }
            }
            Event::End(_) => {}
            event => {
                if let (Some(said), Some(text)) = (&mut self.error, text_of_event(event)) {
                    let left = MAX_BYTES.saturating_sub(said.len());
                    said.extend(text.chars().take(left));
                }
            }
        }
        match (event, &self.error) {
            (Event::End(_) | Event::Empty(_), Some(said)) => Err(invalid(format!(
                "the file is an archive's report that the query failed: {}",
                said.split_whitespace().collect::<Vec<_>>().join(" ")
            ))),
            _ => Ok(()),
        }
    }
}
