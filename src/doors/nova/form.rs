//! The forms in which requests are sent: `multipart/form-data` and `application/x-www-form-urlencoded`.
//!
//! Lines may end with a line feed alone, as those of astrometry.net's own client do between parts.
//!
//! # Reference
//! RFC 7578 (2015) with RFC 2046 (1996), sect. 5.1; WHATWG URL Standard, sect. 5.

use memchr::memmem;
use std::borrow::Cow;

/// More parts than any client sends.
const MAX_PARTS: usize = 200;
/// Longest lines of a part before its content.
const MAX_HEAD_BYTES: usize = 16_384;

/// A field of a form, or a file in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part<'a> {
    /// Its name.
    pub name: String,
    /// The name of the file, where it is one. It is not to be trusted.
    pub file_name: Option<String>,
    /// Its content.
    pub content: Cow<'a, [u8]>,
}

impl Part<'_> {
    /// The content as text.
    pub fn text(&self) -> Cow<'_, str> {
        String::from_utf8_lossy(&self.content)
    }
}

/// Why a body is no form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the form is invalid: {0}")]
pub struct FormError(&'static str);

/// Whether this content type is that of a form with files.
pub fn is_multipart(content_type: &str) -> bool {
    content_type
        .trim_start()
        .to_ascii_lowercase()
        .starts_with("multipart/")
}

/// The parts of a form that has this content type.
///
/// # Errors
/// If it is no form, or does not end.
pub fn parts<'a>(content_type: &str, body: &'a [u8]) -> Result<Vec<Part<'a>>, FormError> {
    if !is_multipart(content_type) {
        return Ok(fields(body));
    }
    let boundary = parameters(content_type).find(|(name, _)| name == "boundary");
    let boundary = boundary.map(|(_, boundary)| boundary);
    let boundary = boundary.filter(|boundary| !boundary.is_empty());
    multipart(body, &boundary.ok_or(FormError("it has no boundary"))?)
}

/// The fields of an encoded form, or of the query of an address.
pub fn fields(text: &[u8]) -> Vec<Part<'static>> {
    let all = text.split(|byte| *byte == b'&');
    let stated = all.filter(|field| !field.is_empty()).take(MAX_PARTS);
    let part = |field: &[u8]| {
        let end = memchr::memchr(b'=', field).unwrap_or(field.len());
        let value = field.get(end + 1..).unwrap_or_default();
        Part {
            name: String::from_utf8_lossy(&decoded(&field[..end])).into_owned(),
            file_name: None,
            content: decoded(value).into(),
        }
    };
    stated.map(part).collect()
}

/// Plus signs as blanks, and `%41` as `A`. What is not encoded stays.
fn decoded(text: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text;
    while let [first, after @ ..] = rest {
        let encoded = match (first, after) {
            (b'%', [high, low, ..]) => hex(*high).zip(hex(*low)),
            _ => None,
        };
        let (byte, length) = match (first, encoded) {
            (_, Some((high, low))) => (high << 4 | low, 3),
            (b'+', _) => (b' ', 1),
            (other, _) => (*other, 1),
        };
        bytes.push(byte);
        rest = &rest[length..];
    }
    bytes
}

fn hex(digit: u8) -> Option<u8> {
    let value = char::from(digit).to_digit(16)?;
    u8::try_from(value).ok()
}

fn multipart<'a>(body: &'a [u8], boundary: &str) -> Result<Vec<Part<'a>>, FormError> {
    let mark = format!("--{boundary}").into_bytes();
    let mut starts = memmem::find_iter(body, &mark)
        .filter(|at| *at == 0 || body[at - 1] == b'\n')
        .map(|at| at + mark.len());
    let mut start = starts.next().ok_or(FormError("it has no part"))?;
    let line_end: &[u8] = match body.get(start) {
        Some(b'\n') => b"\n",
        _ => b"\r\n",
    };
    let mut parts = Vec::new();
    while !body[start..].starts_with(b"--") {
        let next = starts.next().ok_or(FormError("it is not complete"))?;
        let part = &body[start..next - mark.len()];
        let part = part.strip_suffix(line_end).unwrap_or(part);
        parts.push(part_of(part)?);
        if parts.len() > MAX_PARTS {
            return Err(FormError("it has too many parts"));
        }
        start = next;
    }
    Ok(parts)
}

/// The part whose lines begin behind the boundary.
fn part_of(bytes: &[u8]) -> Result<Part<'_>, FormError> {
    let mut part = Part {
        name: String::new(),
        file_name: None,
        content: Cow::Borrowed(&[]),
    };
    let mut at = 0;
    // The first line ends the one of the boundary.
    for number in 0.. {
        let head = &bytes[at..bytes.len().min(MAX_HEAD_BYTES)];
        let length = memchr::memchr(b'\n', head).ok_or(FormError("a part has no content"))?;
        let line = String::from_utf8_lossy(&head[..length]);
        let line = line.trim_end();
        at += length + 1;
        if number > 0 && line.is_empty() {
            break;
        }
        let is_disposition = |name: &str| name.trim().eq_ignore_ascii_case("content-disposition");
        if line
            .split_once(':')
            .is_some_and(|(name, _)| is_disposition(name))
        {
            for (name, value) in parameters(line) {
                match &*name {
                    "name" => part.name = value,
                    "filename" => part.file_name = Some(value),
                    _ => {}
                }
            }
        }
        if at >= MAX_HEAD_BYTES {
            return Err(FormError("the head of a part is too long"));
        }
    }
    part.content = Cow::Borrowed(&bytes[at..]);
    Ok(part)
}

/// The parameters behind the first semicolon of a header: their names in small letters, and their values.
fn parameters(header: &str) -> impl Iterator<Item = (String, String)> {
    let mut rest = header.split_once(';').map_or("", |(_, rest)| rest);
    std::iter::from_fn(move || {
        let (name, behind) = rest.split_once('=')?;
        let name = name.trim_matches([';', ' ', '\t']).to_ascii_lowercase();
        let value;
        (value, rest) = match behind.trim_start().strip_prefix('"') {
            Some(quoted) => unquoted(quoted),
            None => {
                let end = behind.find(';').unwrap_or(behind.len());
                (behind[..end].trim().to_owned(), &behind[end..])
            }
        };
        Some((name, value))
    })
}

/// The text before the closing quotation mark, and what follows it.
fn unquoted(text: &str) -> (String, &str) {
    let mut value = String::new();
    let mut letters = text.char_indices();
    while let Some((at, letter)) = letters.next() {
        match letter {
            '"' => return (value, &text[at + 1..]),
            '\\' if text[at + 1..].starts_with(['"', '\\']) => {
                value.extend(letters.next().map(|(_, escaped)| escaped));
            }
            letter => value.push(letter),
        }
    }
    (value, "")
}

#[cfg(test)]
mod tests {
    use super::*;

    const TYPE: &str = "multipart/form-data; boundary=\"==12==\"";

    fn body(line_end: &str) -> Vec<u8> {
        let lines = [
            "--==12==",
            "Content-Type: text/plain",
            "Content-disposition: form-data; name=\"request-json\"",
            "",
            "{\"a\": 1}",
            "--==12==",
            "Content-Disposition: form-data; filename=\"../a \\\"b\\\".png\"; name=\"file\"",
            "",
            "one\r\n--==1\n\r",
            "--==12==--",
            "",
        ];
        lines.join(line_end).into_bytes()
    }

    #[test]
    fn lines_end_as_clients_end_them() {
        for line_end in ["\n", "\r\n"] {
            let body = body(line_end);
            let parts = parts(TYPE, &body).unwrap();
            assert_eq!(parts.len(), 2);
            assert_eq!(parts[0].name, "request-json");
            assert_eq!(parts[0].text(), "{\"a\": 1}");
            assert_eq!(parts[1].name, "file");
            assert_eq!(parts[1].file_name.as_deref(), Some("../a \"b\".png"));
            // Not a byte of a file is lost.
            assert_eq!(&*parts[1].content, b"one\r\n--==1\n\r");
        }
    }

    #[test]
    fn the_lines_of_astrometry_net_are_mixed() {
        let body = b"--==12==\nContent-disposition: form-data; name=\"file\"; filename=\"a\"\r\n\r\nx\r\n--==12==--\n";
        assert_eq!(&*parts(TYPE, body).unwrap()[0].content, b"x\r");
    }

    #[test]
    fn a_form_that_breaks_off_anywhere_is_refused() {
        let body = body("\r\n");
        // Without the last line, and the two signs before it.
        for length in 0..body.len() - 4 {
            let found = parts(TYPE, &body[..length]);
            assert!(found.is_err(), "{length}: {found:?}");
        }
        assert!(parts("multipart/form-data", &body).is_err());
    }

    #[test]
    fn encoded_fields_are_decoded_and_others_stay() {
        let fields = fields(b"request-json=%7B%22a%22%3A+1%7D&b={\"c\":%zz%4}&&d");
        let found: Vec<_> = fields
            .iter()
            .map(|part| (part.name.as_str(), part.text().into_owned()))
            .collect();
        let expected = [
            ("request-json", "{\"a\": 1}"),
            ("b", "{\"c\":%zz%4}"),
            ("d", ""),
        ];
        assert_eq!(
            found,
            expected.map(|(name, value)| (name, value.to_owned()))
        );
    }
}
