//! Catalogues of other programs, of which parts are read.

use super::scratch::with_file;
use starpipe::Interrupt;
use starpipe::base::coords::UnitVector;
use starpipe::base::units::RAD_PER_DEG;
use starpipe::catalog::Star;
use starpipe::catalog::deep::{DeepCatalog, DeepContents, Region};

/// Names of files, by whose endings their kinds are told.
const NAMES: [&str; 8] = [
    "pieces.fits",
    "deep.fits",
    "d05_0101.290",
    "d80_0101.1476",
    "w08_0101.001",
    "gaia.csv",
    "gaia.vot",
    "gaia.parquet",
];
/// Stars in a square degree that are wanted at most.
const PER_SQ_DEG: f64 = 10.0;

/// The first byte is the kind of the file, the rest its content.
pub fn deep(data: &[u8]) {
    let Some((kind, bytes)) = data.split_first() else {
        return;
    };
    let kind = usize::from(*kind) % NAMES.len();
    let whole = match kind {
        0 => blocks_of(bytes),
        _ => bytes.to_vec(),
    };
    with_file(NAMES[kind], &whole, |path| {
        let Ok(found) = DeepCatalog::find(path) else {
            return;
        };
        for catalog in found {
            check_contents(&catalog.contents());
            for region in regions() {
                if let Ok(stars) = catalog.stars_in(region, &Interrupt::default()) {
                    check_stars(&stars, &region);
                    assert!(stars.len() <= whole.len());
                }
            }
        }
    });
}

/// A FITS file of pieces, a length of two bytes before each: headers and tables without what fills their blocks, which
/// is most of such a file.
fn blocks_of(mut bytes: &[u8]) -> Vec<u8> {
    const BLOCK_BYTES: usize = 2880;
    let mut file = Vec::new();
    while let Some((length, rest)) = bytes.split_first_chunk() {
        let length = usize::from(u16::from_le_bytes(*length)).min(rest.len());
        let (piece, rest) = rest.split_at(length);
        file.extend(piece);
        file.resize(file.len().next_multiple_of(BLOCK_BYTES), b' ');
        bytes = rest;
    }
    file
}

/// A small part of the sky, and all of it.
fn regions() -> [Region; 2] {
    let part = Region {
        centre: UnitVector::from_ra_dec(83.0 * RAD_PER_DEG, 22.0 * RAD_PER_DEG),
        radius_rad: 1.0 * RAD_PER_DEG,
        per_sq_deg: PER_SQ_DEG,
    };
    let whole = Region {
        per_sq_deg: PER_SQ_DEG,
        ..Region::WHOLE_SKY
    };
    [part, whole]
}

fn check_contents(contents: &DeepContents) {
    assert!((0.0..=1.0).contains(&contents.share_of_sky));
    assert!(contents.per_sq_deg().is_finite());
    assert!(!contents.narrowest_fov_deg().is_nan());
    assert!(contents.epoch_year.is_none_or(f64::is_finite));
}

fn check_stars(stars: &[Star], region: &Region) {
    for star in stars {
        assert!(star.v_mag.is_finite());
        assert!(star.bv_mag.is_none_or(f32::is_finite));
        let length = star.direction.dot(&star.direction);
        assert!((length - 1.0).abs() < 1e-9, "{length}");
        assert!(region.contains(&star.direction));
    }
    assert!(
        stars
            .windows(2)
            .all(|pair| pair[0].v_mag <= pair[1].v_mag + 0.002)
    );
}
