//! VOTables, as archives, VizieR and TOPCAT write them.
//!
//! XML → the tab-separated text of [`CatalogTable`](super::CatalogTable), in little memory however
//! long the table is.
//!
//! 1. [`Header`] finds the first table with columns and data: its columns, the epochs of their
//!    coordinate systems, and how its rows are encoded.
//! 2. The text begins with the epochs, in comments like VizieR's, and a line of headings with units.
//! 3. Rows in TABLEDATA, BINARY or BINARY2 become lines, a cell without a value an empty one.
//! 4. The rest is read for an error of the query, or the end of a file that was cut off.
//!
//! # Reference
//! VOTable Format Definition 1.4, IVOA recommendation 2019.

mod binary;
mod cells;
mod detect;
mod fields;
mod header;
#[cfg(test)]
mod tests;
mod xml;

pub(in crate::catalog) use detect::is_votable;

use binary::BinaryRows;
use cells::Line;
use header::{Encoding, Header, QueryStatus};
use quick_xml::events::{BytesStart, Event};
use std::io::{self, BufRead, Read};
use xml::{Xml, attribute, invalid, text_of_event};

/// The text that is made at a time, and a row.
const TEXT_BYTES: usize = 1 << 15;

/// The text of the table in a VOTable.
pub(in crate::catalog) struct VotableText {
    xml: Xml,
    buffer: Vec<u8>,
    state: State,
    status: QueryStatus,
    /// Text, and how much of it was read.
    text: Vec<u8>,
    read: usize,
}

/// What is to be read next.
enum State {
    Header,
    Cells(Header),
    Stream(Header),
    Rows(Header, BinaryRows),
    Rest,
    /// Nothing, or nothing after an error.
    End,
}

impl VotableText {
    /// `content` is that of the VOTable.
    pub(in crate::catalog) fn new(content: Box<dyn BufRead>) -> Self {
        Self {
            xml: Xml::new(content),
            buffer: Vec::new(),
            state: State::Header,
            status: QueryStatus::default(),
            text: Vec::new(),
            read: 0,
        }
    }

    /// Reads on, and returns what is to be read then.
    fn advance(&mut self, state: State) -> io::Result<State> {
        match state {
            State::Header => {
                let header = Header::read(&mut self.xml, &mut self.buffer)?;
                self.write_headings(&header)?;
                Ok(match header.encoding {
                    _ if !header.has_rows => State::Rest,
                    Encoding::TableData => State::Cells(header),
                    Encoding::Binary | Encoding::Binary2 => State::Stream(header),
                })
            }
            State::Cells(header) => self.read_cells(header),
            State::Stream(header) => self.find_stream(header),
            State::Rows(header, rows) => self.read_rows(header, rows),
            State::Rest => self.read_rest(),
            State::End => Ok(State::End),
        }
    }

    fn write_headings(&mut self, header: &Header) -> io::Result<()> {
        let mut line = Line::default();
        for field in &header.fields {
            if let Some(epoch) = field.epoch(&header.systems) {
                let note = format!("#Column\t{}\tEp={epoch:?}\n", field.heading);
                self.text.extend_from_slice(note.as_bytes());
            }
            line.push(field.heading.trim_start_matches('#'))?;
        }
        line.end(&mut self.text);
        Ok(())
    }

    /// Reads some rows of TABLEDATA.
    fn read_cells(&mut self, header: Header) -> io::Result<State> {
        let mut line = Line::default();
        let mut cell = String::new();
        let mut is_in_cell = false;
        loop {
            let event = self.xml.next(&mut self.buffer)?;
            match &event {
                Event::Start(tag) if tag.local_name().as_ref() == "TD" => {
                    cell.clear();
                    is_in_cell = true;
                }
                Event::Empty(tag) if tag.local_name().as_ref() == "TD" => line.push("")?,
                Event::End(tag) => match tag.local_name().as_ref() {
                    "TD" => {
                        line.push_value(&header.fields, &cell)?;
                        is_in_cell = false;
                    }
                    "TR" => {
                        line.end(&mut self.text);
                        if self.text.len() >= TEXT_BYTES {
                            return Ok(State::Cells(header));
                        }
                    }
                    "TABLEDATA" => return Ok(State::Rest),
                    _ => {}
                },
                event if is_in_cell => {
                    let text = text_of_event(event).unwrap_or_default();
                    if cell.len() + text.len() > cells::MAX_ROW_BYTES {
                        return Err(cells::too_large());
                    }
                    cell.push_str(&text);
                }
                _ => {}
            }
        }
    }

    /// Reads as far as the rows of BINARY or BINARY2.
    fn find_stream(&mut self, header: Header) -> io::Result<State> {
        loop {
            let event = self.xml.next(&mut self.buffer)?;
            match &event {
                Event::Start(tag) | Event::Empty(tag) if tag.local_name().as_ref() == "STREAM" => {
                    check_stream(tag)?;
                    if matches!(event, Event::Empty(_)) {
                        return Ok(State::Rest);
                    }
                    let has_null_flags = header.encoding == Encoding::Binary2;
                    let rows = BinaryRows::new(&header.fields, has_null_flags)?;
                    return Ok(State::Rows(header, rows));
                }
                Event::End(tag) if tag.local_name().as_ref().starts_with("BINARY") => {
                    return Ok(State::Rest);
                }
                _ => {}
            }
        }
    }

    /// Reads some rows of BINARY or BINARY2.
    fn read_rows(&mut self, header: Header, mut rows: BinaryRows) -> io::Result<State> {
        let mut line = Line::default();
        while self.text.len() < TEXT_BYTES {
            if !rows.next(&mut self.xml, &header.fields, &mut line)? {
                return self.end_stream();
            }
            line.end(&mut self.text);
        }
        Ok(State::Rows(header, rows))
    }

    fn end_stream(&mut self) -> io::Result<State> {
        match self.xml.next(&mut self.buffer)? {
            Event::End(_) => Ok(State::Rest),
            _ => Err(invalid("found something else than base64 in the STREAM")),
        }
    }

    /// Reads to the end of the file.
    fn read_rest(&mut self) -> io::Result<State> {
        loop {
            let event = self.xml.next(&mut self.buffer)?;
            self.status.see(&event)?;
            match &event {
                Event::Eof => return Ok(State::End),
                Event::Start(tag) if tag.local_name().as_ref() == "STREAM" => {
                    self.xml.skip_text()?;
                }
                _ => {}
            }
        }
    }
}

impl Read for VotableText {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.read == self.text.len() {
            self.text.clear();
            self.read = 0;
            let state = std::mem::replace(&mut self.state, State::End);
            if let State::End = state {
                return Ok(0);
            }
            let next = self.advance(state);
            self.state = next.inspect_err(|_| self.text.clear())?;
        }
        let left = &self.text[self.read..];
        let length = left.len().min(buffer.len());
        buffer[..length].copy_from_slice(&left[..length]);
        self.read += length;
        Ok(length)
    }
}

/// # Errors
/// The rows are not in the text of the STREAM, in base64.
fn check_stream(tag: &BytesStart) -> io::Result<()> {
    if !attribute(tag, "href").is_empty() {
        return Err(invalid(
            "the rows of the VOTable are in another file: save it with its data",
        ));
    }
    match &*attribute(tag, "encoding") {
        "base64" => Ok(()),
        encoding => Err(invalid(format!(
            "the rows of the VOTable are encoded as \"{encoding}\": save it as TABLEDATA, or as \
             BINARY in base64"
        ))),
    }
}
