//! Writes databases of areas as those of ASTAP.

use super::patch::DrawnStar;
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::fs;
use std::path::Path;

/// How the sky is divided: the ending of the files, the areas of each ring, and the declination of the southern edge
/// of each ring, in radians.
struct Division {
    ending: &'static str,
    areas: Vec<u32>,
    edges_rad: Vec<f64>,
}

fn mirrored(southern: &[u32]) -> Vec<u32> {
    southern
        .iter()
        .chain(southern.iter().rev())
        .copied()
        .collect()
}

fn of_290() -> Division {
    let areas = mirrored(&[1, 4, 8, 12, 16, 20, 24, 28, 32]);
    // All areas are as large as 1/289 of the sphere, and those of the poles half as large.
    let mut below = 0.0;
    let edges_rad = areas.iter().map(|count| {
        let edge: f64 = below / 289.0 * 2.0 - 1.0;
        below += if *count == 1 { 0.5 } else { f64::from(*count) };
        edge.asin()
    });
    Division {
        ending: "290",
        edges_rad: edges_rad.collect(),
        areas,
    }
}

fn of_1476() -> Division {
    let areas = mirrored(&[
        1, 3, 9, 15, 21, 27, 33, 38, 43, 48, 52, 56, 60, 63, 65, 67, 68, 69,
    ]);
    let height = (90.0f64 / 17.5).to_radians();
    let edge = |ring: usize| match ring {
        0 => -FRAC_PI_2,
        ring => (ring as f64 - 18.0) * height,
    };
    Division {
        ending: "1476",
        edges_rad: (0..36).map(edge).collect(),
        areas,
    }
}

/// Writes a database with these stars into a folder: of 290 areas if `coarse`, else of 1476; with the color of
/// B−V = 0.6 in records of six bytes if `colored`.
pub fn write(folder: &Path, name: &str, stars: &[DrawnStar], coarse: bool, colored: bool) {
    let division = if coarse { of_290() } else { of_1476() };
    let mut files: BTreeMap<(usize, u32), Vec<DrawnStar>> = BTreeMap::new();
    for star in stars {
        let (ra_rad, dec_rad) = star.direction.to_ra_dec();
        let ring = division.edges_rad.partition_point(|edge| *edge <= dec_rad) - 1;
        let place = (ra_rad / TAU * f64::from(division.areas[ring])) as u32;
        files.entry((ring + 1, place + 1)).or_default().push(*star);
    }
    for ((ring, place), stars) in files {
        let path = folder.join(format!("{name}_{ring:02}{place:02}.{}", division.ending));
        fs::write(path, file(&stars, colored)).unwrap();
    }
}

fn file(stars: &[DrawnStar], colored: bool) -> Vec<u8> {
    let text = if colored {
        "Stars of a test, Epoch=2000. Magnitude is V"
    } else {
        "Stars of a test, Epoch=2000. Magnitude is BP"
    };
    let mut bytes = format!("{text:<108}").into_bytes();
    bytes.extend([if colored { 2 } else { 0 }, if colored { 6 } else { 5 }]);
    let mut records: Vec<(i32, i32, [u8; 5])> =
        stars.iter().map(|star| record(star, colored)).collect();
    records.sort();
    let mut marker = None;
    for (tenths, high, record) in records {
        if marker.replace((tenths, high)) != Some((tenths, high)) {
            bytes.extend([0xff, 0xff, 0xff, (high + 128) as u8, (tenths + 16) as u8]);
            bytes.extend(colored.then_some(0));
        }
        bytes.extend(record);
        bytes.extend(colored.then_some(30));
    }
    bytes
}

/// The magnitude in tenths, the upper byte of the declination, and the record of a star.
fn record(star: &DrawnStar, colored: bool) -> (i32, i32, [u8; 5]) {
    /// BP − V that the reader takes for all stars.
    const BP_MINUS_V_MAG: f64 = 0.18;
    let (ra_rad, dec_rad) = star.direction.to_ra_dec();
    let ra = (ra_rad / TAU * f64::from(0xff_ffff)).round() as u32;
    let [a, b, c, _] = if ra == 0xff_ffff { 0 } else { ra }.to_le_bytes();
    let dec = (dec_rad / FRAC_PI_2 * 8_388_607.0).round() as i32;
    let [low, mid, _, _] = dec.to_le_bytes();
    let mag = star.v_mag + if colored { 0.0 } else { BP_MINUS_V_MAG };
    ((mag * 10.0).round() as i32, dec >> 16, [a, b, c, low, mid])
}
