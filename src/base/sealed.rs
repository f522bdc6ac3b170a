//! JSON objects with a checksum: what was changed since they were written is told.

use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

/// The field before its value.
const FIELD: &str = ",\"checksum\":\"";
/// Digits of the value.
const DIGITS: usize = 16;

/// `object`, the text of a JSON object with a field at least, with `checksum` as its last field. It is that of
/// the text before it, and of `owner`: objects of another owner are told, too.
pub fn sealed(object: &str, owner: &str) -> String {
    let text = object.trim_end();
    let text = text.strip_suffix('}').unwrap_or(text).trim_end();
    format!("{text}{FIELD}{}\"}}", checksum(text, owner))
}

/// Whether `object` is what [`sealed`] has made for `owner`, to the byte.
pub fn is_intact(object: &str, owner: &str) -> bool {
    let body = object.strip_suffix("\"}");
    let parts = body.and_then(|body| body.split_at_checked(body.len().checked_sub(DIGITS)?));
    parts.is_some_and(|(head, found)| {
        let text = head.strip_suffix(FIELD);
        text.is_some_and(|text| found == checksum(text, owner))
    })
}

fn checksum(text: &str, owner: &str) -> String {
    format!(
        "{:016x}",
        xxh3_64_with_seed(text.as_bytes(), xxh3_64(owner.as_bytes()))
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_changed_byte_and_any_other_owner_is_told() {
        let whole = sealed("{\"frame\":\"é.fits\",\"cells\":[1.5,null]}\n", "run");
        assert!(is_intact(&whole, "run") && !is_intact(&whole, "walk"));
        let value: serde_json::Value = serde_json::from_str(&whole).unwrap();
        assert_eq!(value["frame"], "é.fits");
        for at in 0..whole.len() {
            let mut bytes = whole.clone().into_bytes();
            bytes[at] ^= 1;
            let changed = String::from_utf8_lossy(&bytes);
            assert!(!is_intact(&changed, "run"), "{at}: {changed}");
            assert!(at == 0 || !is_intact(whole.get(..at).unwrap_or(""), "run"));
        }
        for other in ["", "}", "\"}", "{}", "é\"}", "{\"frame\":1}"] {
            assert!(!is_intact(other, "run"), "{other}");
        }
    }

    #[test]
    fn indented_objects_are_sealed_as_well() {
        let whole = sealed("{\n  \"a\": 1\n}\n", "");
        assert!(is_intact(&whole, ""));
        assert!(whole.starts_with("{\n  \"a\": 1,\"checksum\":\""));
    }
}
