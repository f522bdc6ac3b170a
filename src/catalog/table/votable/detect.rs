//! Tells VOTables from other files.

/// Whether the file that begins with `head` is a VOTable, or XML whose first element comes later.
pub(in crate::catalog) fn is_votable(head: &[u8]) -> bool {
    let mut rest = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    let mut is_xml = false;
    loop {
        rest = rest.trim_ascii_start();
        let end: &[u8] = match rest {
            [] => return is_xml,
            [b'<', b'?', ..] => b"?>",
            [b'<', b'!', b'-', b'-', ..] => b"-->",
            [b'<', b'!', kind @ ..] => {
                let name = kind.strip_prefix(b"DOCTYPE").unwrap_or_default();
                return begins_with_name(name.trim_ascii_start());
            }
            [b'<', tag @ ..] => return begins_with_name(tag),
            _ => return false,
        };
        is_xml = true;
        match memchr::memmem::find(rest, end) {
            Some(at) => rest = &rest[at + end.len()..],
            None => return true,
        }
    }
}

/// Whether a tag begins with VOTABLE, perhaps after the name of a namespace.
fn begins_with_name(tag: &[u8]) -> bool {
    let is_end = |byte: &u8| byte.is_ascii_whitespace() || b">/[".contains(byte);
    let name = tag.split(is_end).next().unwrap_or_default();
    let name = name.rsplit(|&byte| byte == b':').next();
    name == Some(b"VOTABLE")
}
