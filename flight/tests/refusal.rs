//! What is no sky, or too little of it, has no attitude; and no search does more than it may.
#![allow(
    clippy::disallowed_methods,
    reason = "tests may differ in the last bit"
)]

mod sky;

use rand::Rng;
use sky::rng;
use starpipe_flight::{
    Budget, Catalog, Config, Error, Image, Sky, Spot, Status, Tracker, Work, build,
};

fn catalog() -> Vec<u8> {
    let plan = build::Plan {
        fov_deg: [12.0, 20.0],
        v_limit: 6.0,
        epoch_year: 2000.0,
        budget_bytes: 2_000_000,
    };
    build::catalog(&sky::stars(), &plan).unwrap()
}

fn spot(x_px: f64, y_px: f64) -> Spot {
    Spot {
        x_px,
        y_px,
        sigma_px: 0.05,
        flux_adu: 1000.0,
        snr: 30.0,
    }
}

fn within(work: &Work, most: &Work) -> bool {
    work.pixels <= most.pixels
        && work.peaks <= most.peaks
        && work.windows <= most.windows
        && work.iterations <= most.iterations
        && work.triangles <= most.triangles
        && work.candidates <= most.candidates
        && work.attitudes <= most.attitudes
        && work.stars <= most.stars
}

#[test]
fn chance_and_lattices_are_not_identified_within_the_budget() {
    let bytes = catalog();
    let config = Config {
        scale_error: 2e-3,
        ..sky::config(16.0)
    };
    let read = Catalog::new(&bytes).unwrap();
    let mut block = vec![0; Tracker::words(&config, &read).unwrap()];
    let mut tracker = Tracker::new(&mut block, config, read).unwrap();
    let budget = Budget {
        triangles: 500,
        candidates: 20_000,
        attitudes: 200,
    };
    let [_, most, _] = tracker.most_work(&budget);
    let mut rng = rng(3);
    let mut spent = 0;
    for number in 0..400 {
        let count = rng.random_range(4..=64);
        let step = rng.random_range(20.0..120.0);
        let mut spots: Vec<Spot> = Vec::new();
        for place in 0..count {
            let (column, row) = (place % 8, place / 8);
            spots.push(match number % 2 {
                0 => spot(rng.random_range(0.0..1024.0), rng.random_range(0.0..1024.0)),
                _ => spot(
                    40.0 + step * f64::from(column),
                    40.0 + step * f64::from(row),
                ),
            });
        }
        let found = tracker.lost(&spots, &Sky::default(), &budget);
        assert_ne!(found.status, Status::FOUND, "{number}: {found:?}");
        spent += u32::from(found.status == Status::BUDGET_SPENT);
        assert!(within(tracker.work(), &most), "{:?}", tracker.work());
    }
    assert!(spent > 0);
}

#[test]
fn too_few_spots_and_places_that_are_none_are_told() {
    let bytes = catalog();
    let config = sky::config(16.0);
    let read = Catalog::new(&bytes).unwrap();
    let mut block = vec![0; Tracker::words(&config, &read).unwrap()];
    let mut tracker = Tracker::new(&mut block, config, read).unwrap();
    let mut spots = [
        spot(1.0, 2.0),
        spot(100.0, 20.0),
        spot(300.0, 700.0),
        spot(900.0, 100.0),
    ];
    for count in 0..4 {
        let found = tracker.lost(&spots[..count], &Sky::default(), &Budget::default());
        assert_eq!(found.status, Status::TOO_FEW_STARS);
    }
    spots[2].x_px = f64::NAN;
    let found = tracker.lost(&spots, &Sky::default(), &Budget::default());
    assert_eq!(found.status, Status::TOO_FEW_STARS);
}

#[test]
fn noise_and_full_frames_are_detected_within_the_bound() {
    let bytes = catalog();
    let config = sky::config(16.0);
    let read = Catalog::new(&bytes).unwrap();
    let mut block = vec![0; Tracker::words(&config, &read).unwrap()];
    let mut tracker = Tracker::new(&mut block, config, read).unwrap();
    let [most, ..] = tracker.most_work(&Budget::default());
    let mut rng = rng(5);
    for kind in 0..5_u16 {
        let level = |number: usize, rng: &mut rand_chacha::ChaCha8Rng| match kind {
            0 => 0,
            1 => u16::MAX,
            2 => rng.random(),
            3 => {
                if number.is_multiple_of(2) && (number / 1024).is_multiple_of(2) {
                    4000
                } else {
                    10
                }
            }
            _ => (number % 7919) as u16,
        };
        let pixels: Vec<u16> = (0..1024 * 1024)
            .map(|number| level(number, &mut rng))
            .collect();
        let image = Image::of_16_bits(&pixels, [1024, 1024], 1024).unwrap();
        let mut spots = [Spot::default(); 64];
        let count = tracker.detect(&image, &mut spots).unwrap();
        assert!(
            count <= 64 && within(tracker.work(), &most),
            "{kind}: {:?}",
            tracker.work()
        );
        let places = spots[..count]
            .iter()
            .all(|spot| spot.x_px.is_finite() && spot.y_px.is_finite());
        assert!(places, "{kind}");
    }
}

#[test]
fn damage_and_memory_that_is_too_small_are_told() {
    let mut bytes = catalog();
    let config = sky::config(16.0);
    let read = Catalog::new(&bytes).unwrap();
    let words = Tracker::words(&config, &read).unwrap();
    let mut block = vec![0; words - 1];
    assert_eq!(
        Tracker::new(&mut block, config, read).unwrap_err(),
        Error::Memory
    );
    let narrow = sky::config(5.0);
    assert_eq!(Tracker::words(&narrow, &read).unwrap_err(), Error::Config);
    for at in [24, 60, bytes.len() / 2, bytes.len() - 1] {
        bytes[at] ^= 1;
        assert_eq!(
            Catalog::new(&bytes).unwrap_err(),
            Error::CatalogHash,
            "{at}"
        );
        bytes[at] ^= 1;
    }
    for length in [0, 7, 55, 56, 1000, bytes.len() - 1] {
        assert_eq!(
            Catalog::new(&bytes[..length]).unwrap_err(),
            Error::Catalog,
            "{length}"
        );
    }
}

#[test]
fn the_same_catalog_is_made_twice() {
    let bytes = catalog();
    assert!(bytes == catalog());
    assert!(bytes.len() <= 2_000_000);
    let read = Catalog::new(&bytes).unwrap();
    assert_eq!(read.fov_deg(), [12.0, 20.0]);
    // At an odd address, as flash memory may have it.
    let mut moved = vec![0_u8];
    moved.extend(&bytes);
    let other = Catalog::new(&moved[1..]).unwrap();
    assert_eq!(other.star(17), read.star(17));
    let small = build::Plan {
        fov_deg: [12.0, 20.0],
        v_limit: 6.0,
        epoch_year: 2000.0,
        budget_bytes: 100_000,
    };
    let refused = build::catalog(&sky::stars(), &small).unwrap_err();
    assert!(
        matches!(refused, build::BuildError::Budget { needed_bytes } if needed_bytes > 100_000)
    );
}
