//! Where two JSON objects differ.

use serde_json::{Map, Value};

/// What differs between what was found and what is wanted: a text for each value.
pub(crate) fn differences(found: &Value, wanted: &Value) -> Vec<String> {
    let mut texts = Vec::new();
    compare("", found, wanted, &mut texts);
    texts
}

fn compare(name: &str, found: &Value, wanted: &Value, into: &mut Vec<String>) {
    let (Value::Object(found), Value::Object(wanted)) = (found, wanted) else {
        if found != wanted {
            into.push(format!("{name} was {found}, now {wanted}"));
        }
        return;
    };
    let mut keys: Vec<&String> = found.keys().chain(wanted.keys()).collect();
    keys.sort();
    keys.dedup();
    for key in keys {
        let of = |object: &Map<String, Value>| object.get(key).cloned().unwrap_or(Value::Null);
        compare(key, &of(found), &of(wanted), into);
    }
}
