//! What went before and the number of threads do not matter.

use super::{found_in, star_field, white_noise};
use starpipe::detect::{DetectConfig, Workspace, detect};

#[test]
fn the_result_does_not_depend_on_what_the_workspace_did_before() {
    let (sky, _) = star_field(8);
    let frame = sky.expose(6);
    let config = DetectConfig::default();
    let fresh = found_in(&frame, &config);
    let mut workspace = Workspace::new();
    detect(&white_noise(700, 300, 3.0, 1), &config, &mut workspace).unwrap();
    assert_eq!(detect(&frame, &config, &mut workspace).unwrap(), fresh);
}

#[test]
fn the_result_is_the_same_on_any_number_of_threads() {
    let (sky, _) = star_field(8);
    let frame = sky.expose(6);
    let config = DetectConfig::default();
    let alone = found_in(&frame, &config);
    assert!(alone.sources.len() > 50);
    for threads in [2, 3, 7, 100] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let mut workspace = Workspace::new().on_threads(threads.try_into().unwrap());
        let found = pool.install(|| detect(&frame, &config, &mut workspace).unwrap());
        assert_eq!(found, alone, "{threads} threads");
    }
}
