//! How often the frame is gone over.

use super::star_field;
use starpipe::detect::{DetectConfig, Detections, Workspace, detect, detect_brightest_into};

/// A tenth more than `passes` over the frame, for rows of cells that are filtered again.
fn is_at_most(visited: usize, passes: f64, frame_px: usize) -> bool {
    visited > 0 && visited as f64 <= 1.1 * passes * frame_px as f64
}

#[test]
fn an_ordinary_frame_is_looked_at_once_and_filtered_at_most_twice() {
    let (sky, _) = star_field(8);
    let frame = sky.expose(6);
    let frame_px = frame.pixels.len();
    let mut workspace = Workspace::new();
    detect(&frame, &DetectConfig::default(), &mut workspace).unwrap();
    let visited = workspace.visited_pixels();
    assert!(
        is_at_most(visited.background, 1.0 / 4.0, frame_px),
        "{visited:?}"
    );
    assert!(is_at_most(visited.unfiltered, 1.0, frame_px), "{visited:?}");
    assert!(is_at_most(visited.filtered, 2.0, frame_px), "{visited:?}");
}

#[test]
fn for_the_brightest_stars_it_is_looked_at_once_and_not_filtered() {
    let (sky, truth) = star_field(8);
    let frame = sky.expose(6);
    let frame_px = frame.pixels.len();
    let (mut workspace, mut found) = (Workspace::new(), Detections::default());
    let config = DetectConfig::default();
    detect_brightest_into(&frame, &config, 100, &mut workspace, &mut found).unwrap();
    assert!(found.sources.len() > truth.len() / 2);
    let visited = workspace.visited_pixels();
    assert!(
        is_at_most(visited.background, 1.0 / 16.0, frame_px),
        "{visited:?}"
    );
    assert!(is_at_most(visited.unfiltered, 1.0, frame_px), "{visited:?}");
    assert_eq!(visited.filtered, 0);
}
