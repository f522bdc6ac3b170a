//! Terrestrial time, in which the bodies move, from UTC.

use super::body::DAYS_PER_JULIAN_YEAR;

/// Year, and terrestrial time minus universal time in seconds: what is measured, and from 2026 what
/// the Earth's mean rotation gives (Morrison, Stephenson, Hohenkerk & Zawilski 2021, Proc. R. Soc. A
/// 477, 20200776). A line between two of them is within 3 s, in which the Moon moves 2″.
const DELTA_T_S: [(f64, f64); 25] = [
    (1850.0, 9.3),
    (1860.0, 9.0),
    (1870.0, 2.4),
    (1880.0, -3.2),
    (1890.0, -3.9),
    (1895.0, -5.0),
    (1900.0, -2.0),
    (1905.0, 4.9),
    (1910.0, 11.1),
    (1915.0, 17.5),
    (1920.0, 21.6),
    (1930.0, 24.4),
    (1940.0, 24.4),
    (1950.0, 28.9),
    (1960.0, 33.1),
    (1970.0, 39.9),
    (1980.0, 50.5),
    (1990.0, 56.9),
    (2000.0, 63.8),
    (2010.0, 66.1),
    (2020.0, 69.4),
    (2030.0, 69.1),
    (2050.0, 71.4),
    (2075.0, 80.4),
    (2100.0, 95.9),
];

/// Days of terrestrial time since J2000.0, `years` Julian years of UTC after it.
pub(super) fn days_since_j2000(years: f64) -> f64 {
    const SECONDS_PER_DAY: f64 = 86_400.0;
    years * DAYS_PER_JULIAN_YEAR + delta_t_s(2000.0 + years) / SECONDS_PER_DAY
}

/// Terrestrial time minus universal time, in seconds.
fn delta_t_s(year: f64) -> f64 {
    let after = DELTA_T_S.partition_point(|(known, _)| *known < year);
    let after = after.clamp(1, DELTA_T_S.len() - 1);
    let ((from, from_s), (to, to_s)) = (DELTA_T_S[after - 1], DELTA_T_S[after]);
    from_s + (to_s - from_s) * (year - from) / (to - from)
}
