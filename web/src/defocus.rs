//! How far to defocus a camera.

use crate::stated::Stated;
use crate::{json, progress, told};
use serde::Deserialize;
use starpipe::Interrupt;
use starpipe::lab::spot_radius::{Caller, DefocusPlan, DefocusReport, Noise};
use std::sync::atomic::{AtomicUsize, Ordering};
use wasm_bindgen::prelude::*;

/// A study: of a camera, or the paper's own without one.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Study {
    camera: Option<Stated>,
    vmag: Vec<f64>,
    required_error_px: Vec<f64>,
    count: Option<usize>,
}

/// The error of centroids over the radius of the spot, as `starpipe defocus --format json` prints it.
///
/// # Errors
/// As [`limit`](crate::limit), and stars that are too faint.
#[wasm_bindgen]
pub fn defocus(study: &str) -> Result<String, JsError> {
    let study: Study = serde_json::from_str(study).map_err(told)?;
    let plan = match &study.camera {
        Some(stated) => {
            let scenario = stated.scenario()?;
            let noise = Noise::of_camera(&scenario).map_err(told)?;
            DefocusPlan::of_camera(scenario, noise, &study.vmag).map_err(told)?
        }
        None => DefocusPlan::of_paper(Noise::of_paper()),
    };
    let mut plan = match study.count {
        Some(count) => plan.with_trials(count.max(1)),
        None => plan,
    };
    plan.required_px = study.required_error_px;
    let (all, done) = (plan.point_count() as f64, AtomicUsize::new(0));
    let caller = Caller {
        done: &|| progress("defocus", done.fetch_add(1, Ordering::Relaxed) as f64 / all),
        interrupt: &Interrupt::default(),
    };
    let studies = plan.run(&caller).map_err(told)?;
    json(&DefocusReport::new(&plan, &studies))
}
