//! Identification allocates nothing once its workspace has seen a field.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use starpipe::catalog::Catalog;
use starpipe::ephemeris::places::StarPlaces;
use starpipe::identify::{IndexedCatalog, Priors, SearchFailure, StarField, Workspace};
use starpipe::lab::robustness::{SimulatedCentroids, TrialProtocol};

fn allocations(work: impl FnOnce()) -> u64 {
    allocation_counter::measure(work).count_total
}

/// Fields of several widths; the last one has no true stars.
fn fields(sky: &IndexedCatalog) -> Vec<StarField> {
    let draw = |(seed, fov_deg): (u64, f64)| {
        let protocol = TrialProtocol {
            fov_deg,
            mean_stars: 60.0,
            ..TrialProtocol::default()
        };
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut field = SimulatedCentroids::draw(&protocol, sky, &mut random)
            .list
            .star_field(StarPlaces::default());
        // With a known spot, blends are searched for.
        field.spot_sigma_px = Some(1.5);
        field
    };
    let mut fields: Vec<StarField> = (1..).zip([4.0, 10.0, 20.0, 35.0]).map(draw).collect();
    let mut random_dots = fields[0].clone();
    for (number, star) in random_dots.stars.iter_mut().enumerate() {
        star.position.x = (number * 379 % 1021) as f64;
        star.position.y = (number * 733 % 1019) as f64;
    }
    fields.push(random_dots);
    fields
}

#[test]
fn the_counter_counts() {
    assert_eq!(allocations(|| drop(std::hint::black_box(Box::new(7)))), 1);
    assert_eq!(allocations(|| ()), 0);
}

#[test]
fn a_field_in_steady_state_allocates_nothing() {
    let sky = IndexedCatalog::build(Catalog::built_in(), &|_| ());
    let fields = fields(&sky);
    let mut workspace = Workspace::new();
    let mut run = |field: &StarField| match workspace.identify(field, &Priors::default(), &sky) {
        Ok(found) => Some(found.matches.len()),
        Err(reason) => {
            assert!(
                matches!(reason, SearchFailure::NoMatch { .. }),
                "{reason:?}"
            );
            None
        }
    };
    let first: Vec<_> = fields.iter().map(&mut run).collect();
    assert!(
        first[..4]
            .iter()
            .all(|found| found.is_some_and(|stars| stars > 20))
    );
    assert_eq!(first[4], None);
    for (field, expected) in fields.iter().zip(first) {
        let mut found = None;
        let count = allocations(|| found = run(field));
        assert_eq!(found, expected);
        assert_eq!(count, 0);
    }
    let priors = Priors::default();
    for field in &fields[..4] {
        let mut attitude = || workspace.attitude(field, &priors, &sky).is_ok();
        assert!(attitude());
        let mut is_found = false;
        assert_eq!(allocations(|| is_found = attitude()), 0);
        assert!(is_found);
    }
}
