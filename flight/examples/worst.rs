//! Which lists of spots cost the search most, and is one of them identified that is no sky? Random lists of several
//! kinds, and then lists that are changed step by step to cost more.
//!
//!     cargo run --release --features build --example worst -- RANDOM SOUGHT

#![allow(
    clippy::disallowed_methods,
    reason = "an example may differ in the last bit"
)]

#[path = "../tests/sky/mod.rs"]
mod sky;

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use starpipe_flight::{Attitude, Budget, Catalog, Sky, Spot, Status, Tracker, Work, build};

const KINDS: [&str; 5] = ["even", "lattice", "clusters", "rows", "sky and false stars"];
/// Steps of a search for a list that costs more.
const STEPS: usize = 100;

fn main() {
    let counts: Vec<usize> = std::env::args()
        .skip(1)
        .map(|text| text.parse().expect("a number"))
        .collect();
    let [random, sought] = counts[..] else {
        panic!("RANDOM SOUGHT");
    };
    let stars = sky::stars();
    let plan = build::Plan {
        fov_deg: [12.0, 20.0],
        v_limit: 6.0,
        epoch_year: 2000.0,
        budget_bytes: 2_000_000,
    };
    let bytes = build::catalog(&stars, &plan).expect("a catalogue");
    let catalog = Catalog::new(&bytes).expect("what was made is read");
    let config = starpipe_flight::Config {
        scale_error: 1e-3,
        ..sky::config(16.0)
    };
    let mut block = vec![0; Tracker::words(&config, &catalog).expect("a configuration")];
    let mut trials = Trials {
        tracker: Tracker::new(&mut block, config, catalog).expect("a tracker"),
        stars: &stars,
        most: Work::default(),
        false_alarms: 0,
    };
    for (kind, name) in KINDS.iter().enumerate() {
        (trials.most, trials.false_alarms) = (Work::default(), 0);
        let mut identified = 0;
        for number in 0..random / KINDS.len() {
            let mut rng = sky::rng((kind * random + number) as u64);
            let spots = trials.spots(kind, &mut rng);
            identified += usize::from(trials.search(&spots, kind == 4).status == Status::FOUND);
        }
        println!(
            "{name}: {} random, {identified} identified, {} of no sky; {:?}",
            random / KINDS.len(),
            trials.false_alarms,
            trials.most
        );
    }
    (trials.most, trials.false_alarms) = (Work::default(), 0);
    for number in 0..sought.div_ceil(STEPS) {
        trials.seek(&mut sky::rng(u64::MAX - number as u64));
    }
    println!(
        "sought: {sought} lists, {} identified; {:?}",
        trials.false_alarms, trials.most
    );
    println!(
        "bound: {:?}",
        trials.tracker.most_work(&Budget::default())[1]
    );
}

struct Trials<'a> {
    tracker: Tracker<'a>,
    stars: &'a [starpipe_flight::Star],
    most: Work,
    false_alarms: usize,
}

impl Trials<'_> {
    fn search(&mut self, spots: &[Spot], is_sky: bool) -> Attitude {
        let budget = Budget::default();
        let sky = Sky {
            year: 2000.0,
            ..Sky::default()
        };
        let found = self.tracker.lost(spots, &sky, &budget);
        self.false_alarms += usize::from(found.status == Status::FOUND && !is_sky);
        let (work, bound) = (*self.tracker.work(), self.tracker.most_work(&budget)[1]);
        assert!(
            work.triangles <= bound.triangles
                && work.candidates <= bound.candidates
                && work.attitudes <= bound.attitudes
        );
        assert!(work.stars <= bound.stars && work.iterations <= bound.iterations);
        let most = &mut self.most;
        most.triangles = most.triangles.max(work.triangles);
        most.candidates = most.candidates.max(work.candidates);
        most.attitudes = most.attitudes.max(work.attitudes);
        most.stars = most.stars.max(work.stars);
        most.iterations = most.iterations.max(work.iterations);
        found
    }

    fn spots(&self, kind: usize, rng: &mut ChaCha8Rng) -> Vec<Spot> {
        let count = rng.random_range(4..=64);
        let (step, slope) = (rng.random_range(15.0..125.0), rng.random_range(0.0..0.3));
        let middles = [(); 3].map(|()| [(); 2].map(|()| rng.random_range(100.0..900.0)));
        let mut place = |number: usize| -> [f64; 2] {
            let (column, row) = ((number % 8) as f64, (number / 8) as f64);
            match kind {
                1 => [20.0 + step * column + slope * row, 20.0 + step * row],
                2 => middles[number % 3].map(|middle| middle + rng.random_range(-80.0..80.0)),
                3 => [rng.random_range(0.0..1023.0), 10.0 + step * row],
                _ => [(); 2].map(|()| rng.random_range(0.0..1023.0)),
            }
        };
        let mut spots: Vec<Spot> = (0..count).map(&mut place).map(spot).collect();
        if kind == 4 {
            let config = sky::config(16.0);
            let scene = sky::Scene {
                config: &config,
                stars: self.stars,
                attitude: sky::any_attitude(rng),
                rate_rad_s: nalgebra::Vector3::zeros(),
                velocity_km_s: nalgebra::Vector3::zeros(),
                years: 0.0,
            };
            let seen = self.stars.iter().filter_map(|star| scene.seen(star, 0.0));
            let inside = seen.filter(|place| place.iter().all(|at| (0.0..1023.0).contains(at)));
            // False stars are as bright as the true ones, and some of these are lost.
            spots.extend(inside.filter(|_| rng.random_bool(0.6)).map(spot));
            for last in (1..spots.len()).rev() {
                spots.swap(last, rng.random_range(0..=last));
            }
            spots.truncate(64);
        }
        spots
    }

    /// Changes a list step by step, and keeps what costs more.
    fn seek(&mut self, rng: &mut ChaCha8Rng) {
        let kind = rng.random_range(0..4);
        let mut spots = self.spots(kind, rng);
        let mut cost = 0;
        for _ in 0..STEPS {
            let mut changed = spots.clone();
            let number = rng.random_range(0..changed.len());
            changed[number] = spot([(); 2].map(|()| rng.random_range(0.0..1023.0)));
            self.search(&changed, false);
            let work = self.tracker.work();
            let now = work.candidates + 1000 * work.attitudes;
            if now > cost {
                (spots, cost) = (changed, now);
            }
        }
    }
}

fn spot([x_px, y_px]: [f64; 2]) -> Spot {
    Spot {
        x_px,
        y_px,
        sigma_px: 0.05,
        flux_adu: 1000.0,
        snr: 30.0,
    }
}
