//! XML, an event at a time, in little memory whatever is in the file.

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};
use std::borrow::Cow;
use std::io::{self, BufRead, ErrorKind, Read};
use std::sync::Arc;

/// The largest tag, comment or text between tags; the text of a STREAM is read in pieces.
const MAX_EVENT_BYTES: usize = 1 << 20;
/// Elements within one another; VOTables have ten.
const MAX_DEPTH: usize = 64;

/// Reads XML, of which the outermost element is VOTABLE.
pub(super) struct Xml {
    reader: Reader<Source>,
    depth: usize,
}

impl Xml {
    pub(super) fn new(content: Box<dyn BufRead>) -> Self {
        let mut reader = Reader::from_reader(Source {
            content,
            left_bytes: MAX_EVENT_BYTES,
            latin_1: None,
        });
        // Addresses of services are often written with a bare ampersand.
        reader.config_mut().allow_dangling_amp = true;
        Self { reader, depth: 0 }
    }

    /// The next event, which is kept in `buffer`.
    pub(super) fn next<'b>(&mut self, buffer: &'b mut Vec<u8>) -> io::Result<Event<'b>> {
        buffer.clear();
        self.reader.get_mut().left_bytes = MAX_EVENT_BYTES;
        let event = self.reader.read_event_into(buffer);
        let event = event.map_err(|error| self.damage(error))?;
        match &event {
            Event::Decl(declaration) => {
                if let Some(Ok(encoding)) = declaration.encoding() {
                    self.reader.get_mut().set_encoding(&encoding)?;
                }
            }
            Event::Start(tag) | Event::Empty(tag)
                if self.depth == 0 && tag.local_name().as_ref() != "VOTABLE" =>
            {
                return Err(invalid("found XML that is not a VOTable"));
            }
            Event::Start(_) if self.depth == MAX_DEPTH => {
                let message = format!("found more than {MAX_DEPTH} elements within one another");
                return Err(invalid(message));
            }
            Event::Start(_) => self.depth += 1,
            Event::End(_) => self.depth = self.depth.saturating_sub(1),
            Event::Eof if self.depth > 0 => {
                return Err(invalid("the VOTable is cut off: it ends before </VOTABLE>"));
            }
            _ => {}
        }
        Ok(event)
    }

    /// Appends some more of the text after a tag to `text`, without white space. Returns whether
    /// there may be more of it.
    pub(super) fn read_text(&mut self, text: &mut Vec<u8>) -> io::Result<bool> {
        self.reader.get_mut().left_bytes = MAX_EVENT_BYTES;
        let mut stream = self.reader.stream();
        let piece = loop {
            match stream.fill_buf() {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                piece => break piece?,
            }
        };
        let end = memchr::memchr(b'<', piece);
        let length = end.unwrap_or(piece.len());
        let letters = piece[..length].iter();
        text.extend(letters.filter(|byte| !byte.is_ascii_whitespace()));
        stream.consume(length);
        Ok(end.is_none() && length > 0)
    }

    /// Passes over the text after a tag.
    pub(super) fn skip_text(&mut self) -> io::Result<()> {
        let mut text = Vec::new();
        while self.read_text(&mut text)? {
            text.clear();
        }
        Ok(())
    }

    fn damage(&self, error: quick_xml::Error) -> io::Error {
        match error {
            quick_xml::Error::Io(error) => Arc::try_unwrap(error)
                .unwrap_or_else(|error| io::Error::new(error.kind(), error.to_string())),
            error => invalid(format!(
                "damaged XML at byte {}: {error}",
                self.reader.error_position()
            )),
        }
    }
}

/// The error of content that cannot be read.
pub(super) fn invalid(message: impl Into<String>) -> io::Error {
    io::Error::new(ErrorKind::InvalidData, message.into())
}

/// An attribute without the blanks around it; empty if there is none.
pub(super) fn attribute<'t>(tag: &'t BytesStart, name: &str) -> Cow<'t, str> {
    let Ok(Some(attribute)) = tag.try_get_attribute(name) else {
        return Cow::Borrowed("");
    };
    let value = attribute.normalized_value(XmlVersion::Implicit1_0);
    match value.unwrap_or(attribute.value.clone()) {
        Cow::Borrowed(text) => Cow::Borrowed(text.trim()),
        Cow::Owned(text) => Cow::Owned(text.trim().to_owned()),
    }
}

/// The text of an event that is part of the content of an element.
pub(super) fn text_of_event<'e>(event: &'e Event) -> Option<Cow<'e, str>> {
    match event {
        Event::Text(text) => Some(Cow::Borrowed(text)),
        Event::CData(text) => Some(Cow::Borrowed(text)),
        Event::GeneralRef(reference) => Some(match &**reference {
            "amp" => "&".into(),
            "lt" => "<".into(),
            "gt" => ">".into(),
            "quot" => "\"".into(),
            "apos" => "'".into(),
            name => match reference.resolve_char_ref() {
                Ok(Some(letter)) => letter.to_string().into(),
                _ => format!("&{name};").into(),
            },
        }),
        _ => None,
    }
}

/// The content, in UTF-8.
struct Source {
    content: Box<dyn BufRead>,
    /// Bytes that may still be read for this event.
    left_bytes: usize,
    /// Text converted from Latin-1, and how much of it was read; `None` for content in UTF-8.
    latin_1: Option<(String, usize)>,
}

impl Source {
    fn set_encoding(&mut self, encoding: &str) -> io::Result<()> {
        match encoding.to_ascii_lowercase().as_str() {
            "utf-8" | "utf8" | "us-ascii" | "ascii" => {}
            "iso-8859-1" | "latin1" | "latin-1" | "windows-1252" => {
                self.latin_1 = Some((String::new(), 0));
            }
            _ => {
                let message = format!("the VOTable is in {encoding}: convert it to UTF-8");
                return Err(invalid(message));
            }
        }
        Ok(())
    }
}

impl Read for Source {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let piece = self.fill_buf()?;
        let length = piece.len().min(buffer.len());
        buffer[..length].copy_from_slice(&piece[..length]);
        self.consume(length);
        Ok(length)
    }
}

impl BufRead for Source {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.left_bytes == 0 {
            let message = format!("found a tag or text of more than {MAX_EVENT_BYTES} bytes");
            return Err(invalid(message));
        }
        let Some((text, read)) = &mut self.latin_1 else {
            let piece = self.content.fill_buf()?;
            return Ok(&piece[..piece.len().min(self.left_bytes)]);
        };
        if *read == text.len() {
            (*read, *text) = (0, String::new());
            let piece = self.content.fill_buf()?;
            let piece = &piece[..piece.len().min(self.left_bytes)];
            text.extend(piece.iter().map(|&byte| char::from(byte)));
            let length = piece.len();
            self.content.consume(length);
        }
        Ok(&text.as_bytes()[*read..])
    }

    fn consume(&mut self, length: usize) {
        self.left_bytes = self.left_bytes.saturating_sub(length);
        match &mut self.latin_1 {
            Some((_, read)) => *read += length,
            None => self.content.consume(length),
        }
    }
}
