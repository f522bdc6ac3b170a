//! Formats angles in sexagesimal notation.

/// An angle split into whole units, minutes and seconds, rounded first so that 60 never appears.
struct Sexagesimal {
    whole: u64,
    minutes: u64,
    /// Seconds times 10^decimals.
    scaled_seconds: u64,
}

impl Sexagesimal {
    /// `value` must not be negative.
    fn new(value: f64, decimals: usize) -> Self {
        let scale = 10_u64.pow(decimals as u32);
        let total = (value * 3600.0 * scale as f64).round() as u64;
        let per_minute = 60 * scale;
        Self {
            whole: total / (60 * per_minute),
            minutes: total / per_minute % 60,
            scaled_seconds: total % per_minute,
        }
    }

    fn seconds(&self, decimals: usize) -> String {
        let seconds = self.scaled_seconds as f64 / 10_f64.powi(decimals as i32);
        let width = if decimals == 0 { 2 } else { decimals + 3 };
        format!("{seconds:0width$.decimals$}")
    }
}

/// Right ascension as hours, minutes and seconds: `05h 35m 17.30s`.
pub(crate) fn hours(ra_deg: f64, decimals: usize) -> String {
    let parts = Sexagesimal::new(ra_deg / 15.0, decimals);
    let hours = parts.whole % 24;
    let seconds = parts.seconds(decimals);
    format!("{hours:02}h {:02}m {seconds}s", parts.minutes)
}

/// Declination as degrees, minutes and seconds: `−01° 12′ 44.1″`.
pub(crate) fn degrees(dec_deg: f64, decimals: usize) -> String {
    let parts = Sexagesimal::new(dec_deg.abs(), decimals);
    let sign = if dec_deg < 0.0 { '−' } else { '+' };
    let seconds = parts.seconds(decimals);
    format!("{sign}{:02}° {:02}′ {seconds}″", parts.whole, parts.minutes)
}

/// A small angle in the unit that suits its size, with two significant digits: `3.1″`, `2.4′`,
/// `1.2°`.
pub(crate) fn small(arcsec: f64) -> String {
    let (value, unit) = match arcsec.abs() {
        size if size < 99.5 => (arcsec, '″'),
        size if size < 5970.0 => (arcsec / 60.0, '′'),
        _ => (arcsec / 3600.0, '°'),
    };
    let decimals = super::rounding::decimals_for(value, 3);
    format!("{value:.decimals$}{unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_carries_into_minutes_and_hours() {
        assert_eq!(hours(359.999_999_9, 1), "00h 00m 00.0s");
        assert_eq!(degrees(-29.999_999_9, 0), "−30° 00′ 00″");
        assert_eq!(degrees(0.016_6, 0), "+00° 01′ 00″");
    }

    #[test]
    fn digits_and_signs_are_padded() {
        assert_eq!(hours(83.822_08, 2), "05h 35m 17.30s");
        assert_eq!(degrees(-1.212_25, 1), "−01° 12′ 44.1″");
        assert_eq!(degrees(-0.5, 0), "−00° 30′ 00″");
    }

    #[test]
    fn small_angles_are_in_the_unit_that_suits_them() {
        assert_eq!(small(0.0123), "0.012″");
        assert_eq!(small(3.21), "3.2″");
        assert_eq!(small(144.0), "2.4′");
        assert_eq!(small(7200.0), "2.0°");
    }
}
