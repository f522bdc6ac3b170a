//! Named numbers with a range, for files, options and sweeps.

use std::fmt;

/// Range of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NumberRange {
    /// Above 0.
    Positive,
    /// 0 or above.
    NotNegative,
    /// Above 0, at most 1.
    Share,
    /// A whole number from the first to the second.
    Whole(f64, f64),
    /// From the first to the second.
    FromTo(f64, f64),
    /// From the first to below the second.
    FromToBelow(f64, f64),
    /// Any finite number.
    Finite,
}

impl NumberRange {
    /// Whether `value` is within the range.
    pub fn accept(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Positive => value > 0.0,
                Self::NotNegative => value >= 0.0,
                Self::Share => value > 0.0 && value <= 1.0,
                Self::Whole(from, to) => (from..=to).contains(&value) && value.fract() == 0.0,
                Self::FromTo(from, to) => (from..=to).contains(&value),
                Self::FromToBelow(from, to) => (from..to).contains(&value),
                Self::Finite => true,
            }
    }
}

impl fmt::Display for NumberRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Positive => write!(f, "a number above 0"),
            Self::NotNegative => write!(f, "a number of 0 or more"),
            Self::Share => write!(f, "a number above 0 and at most 1"),
            Self::Whole(from, to) => write!(f, "a whole number from {from} to {to}"),
            Self::FromTo(from, to) => write!(f, "a number from {from} to {to}"),
            Self::FromToBelow(from, to) => write!(f, "a number from {from} to below {to}"),
            Self::Finite => write!(f, "a number"),
        }
    }
}

/// A named number of a `T`.
pub struct Key<T> {
    /// The name, which ends in the unit.
    pub name: &'static str,
    /// Description in one line.
    pub about: &'static str,
    /// Range of the values.
    pub limits: NumberRange,
    /// Returns the value, if there is one.
    pub get: fn(&T) -> Option<f64>,
    /// Sets the value, which must be within the limits.
    pub set: fn(&mut T, f64),
}

impl<T> Key<T> {
    /// Finds the key called `name` among `keys`.
    pub fn find<'a>(keys: &'a [Self], name: &str) -> Option<&'a Self> {
        keys.iter().find(|key| key.name == name)
    }
}

impl<T> fmt::Debug for Key<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// The name among `names` that is most similar to `name`, if any is similar enough.
pub fn nearest_name<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    const MIN_SIMILARITY: f64 = 0.75;
    let name = name.to_lowercase().replace('-', "_");
    // A common beginning weighs more: often only the unit is missing.
    names
        .map(|known| {
            let begins_alike = known.starts_with(&name) || name.starts_with(known);
            let similarity = strsim::jaro_winkler(&name, known);
            (similarity + if begins_alike { 0.5 } else { 0.0 }, known)
        })
        .filter(|(similarity, _)| *similarity > MIN_SIMILARITY)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, known)| known)
}

/// Makes the [`Key`] of a numeric field, of the value itself or of one of its fields.
macro_rules! key {
    ($name:ident $(in $within:ident)?, $limits:expr, $about:literal) => {
        $crate::camera::data_sheet::Key {
            name: stringify!($name),
            about: $about,
            limits: $limits,
            get: |whole| Some(whole$(.$within)?.$name as f64),
            set: |whole, value| whole$(.$within)?.$name = value as _,
        }
    };
}
pub(crate) use key;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_similar_name_is_found() {
        let nearest = |name| {
            nearest_name(
                name,
                ["aperture_mm", "read_noise_e", "focal_length_mm"].into_iter(),
            )
        };
        assert_eq!(nearest("apertur_mm"), Some("aperture_mm"));
        assert_eq!(nearest("read-noise"), Some("read_noise_e"));
        assert_eq!(nearest("focal_lenght_mm"), Some("focal_length_mm"));
        assert_eq!(nearest("zzz"), None);
    }

    #[test]
    fn implausible_values_are_outside_the_limits() {
        assert!(!NumberRange::Positive.accept(0.0) && !NumberRange::Positive.accept(f64::NAN));
        assert!(NumberRange::NotNegative.accept(0.0) && !NumberRange::NotNegative.accept(-1.0));
        assert!(NumberRange::Share.accept(1.0) && !NumberRange::Share.accept(1.1));
        assert!(
            NumberRange::Whole(1.0, 32.0).accept(12.0)
                && !NumberRange::Whole(1.0, 32.0).accept(12.5)
        );
        assert!(!NumberRange::FromToBelow(0.0, 90.0).accept(90.0));
    }
}
