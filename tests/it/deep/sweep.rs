//! Narrow fields whose direction is not known, in a deep catalogue of the whole sky.

use super::areas;
use super::fields::{field, is_identified, scale};
use super::patch::{DrawnStar, Patch};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use starpipe::base::coords::UnitVector;
use starpipe::catalog::deep::DeepCatalog;
use starpipe::solve::{DeepProgress, DeepSky};
use std::f64::consts::TAU;

/// Eight million stars make an index of twelve parts.
#[test]
#[ignore = "takes minutes and 3 GB"]
fn fields_of_a_third_of_a_degree_are_found_in_twelve_parts_of_the_sky() {
    const STARS: usize = 9_000_000;
    let mut random = ChaCha8Rng::seed_from_u64(12);
    let mut star = || DrawnStar {
        direction: UnitVector::from_ra_dec(
            TAU * random.random::<f64>(),
            (2.0 * random.random::<f64>() - 1.0).asin(),
        ),
        v_mag: 15.0 + random.random::<f64>().max(1e-9).ln() / 2.2_f64.ln(),
    };
    let mut stars: Vec<DrawnStar> = (0..STARS).map(|_| star()).collect();
    stars.sort_by(|a, b| a.v_mag.total_cmp(&b.v_mag));
    let folder = tempfile::tempdir().unwrap();
    areas::write(folder.path(), "d05", &stars, false, false);
    let cache = tempfile::tempdir().unwrap();
    let deep = DeepSky::new(
        DeepCatalog::find(folder.path()).unwrap(),
        Some(cache.path().to_owned()),
    );
    let deep = deep.with_progress(Box::new(|done| {
        if let DeepProgress::Begins(work) = done {
            eprintln!("{work}");
        }
    }));
    let mut found = 0;
    for number in 0..10 {
        let centre = stars[random.random_range(0..STARS)].direction;
        let near = stars
            .iter()
            .filter(|star| star.direction.angle_to(&centre) < 0.05);
        let patch = Patch {
            centre,
            stars: near.copied().collect(),
        };
        let begun = std::time::Instant::now();
        let field = field(&patch, 0.3, &mut random);
        found += usize::from(is_identified(&field, &deep, scale(&field, 0.05)));
        eprintln!(
            "field {number}: {found} found, {:.1} s",
            begun.elapsed().as_secs_f64()
        );
    }
    assert!(deep.take_errors().is_empty());
    assert!(found >= 9, "{found}");
}
