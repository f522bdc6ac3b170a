//! A tracked frame allocates nothing in steady state.

use super::sequence::{EXPOSURE_S, INTERVAL_S, attitude, frame};
use nalgebra::Vector3;
use starpipe::Context;
use starpipe::frame::Frame;
use starpipe::identify::IndexedCatalog;
use starpipe::track::{Mode, Tracker};

#[test]
fn a_tracked_frame_allocates_nothing_in_steady_state() {
    const FRAMES: u32 = 40;
    let indexed = IndexedCatalog::built_in();
    // Round stars, and smeared ones.
    for rate_deg_s in [Vector3::new(0.05, 0.02, 0.1), Vector3::new(0.8, 1.0, 1.5)] {
        let make = |i: u32| frame(attitude(rate_deg_s, i), rate_deg_s, u64::from(i));
        let frames: Vec<Frame<'static>> = (0..FRAMES).map(make).collect();
        let mut context = Context::new(&indexed);
        context.priors.exposure_s = Some(EXPOSURE_S);
        let mut tracker = Tracker::new(context);
        for (index, frame) in (0..FRAMES).zip(&frames) {
            let time_s = Some(INTERVAL_S * f64::from(index));
            let mut mode = Mode::Lost;
            let counted = allocation_counter::measure(|| {
                mode = tracker.process_frame(frame, time_s).unwrap().mode;
            });
            if index == 0 {
                assert!(counted.count_total > 0, "the counter does not count");
            }
            // The first frames are solved in full; buffers grow with the first tracked ones.
            if index >= 20 {
                assert_eq!(mode, Mode::Tracked, "{index}");
                assert_eq!(counted.count_total, 0, "{index}: {counted:?}");
            }
        }
    }
}
