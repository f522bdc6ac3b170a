//! The pipeline: any pixels from detection to report and overlay.

use serde_json::Value;
use starpipe::identify::Photometry;
use starpipe::pipeline::{CentroidList, ListedCentroid, solve_centroids, solve_frame};
use starpipe::report::overlay;
use starpipe::{
    Context, Frame, FrameReport, IndexedCatalog, PixelPoint, Solution, TextOptions, Workspace,
};
use std::sync::OnceLock;

/// Sides of a frame.
const SIDES_PX: std::ops::RangeInclusive<usize> = 3..=200;

/// Pixels from bytes: sides, kind of pixels, then values that are repeated.
pub fn pipeline(data: &[u8]) {
    let Some(frame) = frame_of(data) else { return };
    let indexed = sky();
    let context = Context::new(indexed);
    let mut workspace = Workspace::new();
    let mut solve = || solve_frame(&frame, &context, &mut workspace);
    let (Ok(solution), Ok(again)) = (solve(), solve()) else {
        return;
    };
    let report = FrameReport::new("fuzzed", &solution, indexed.catalog());
    check(&report, &solution);
    let again = FrameReport::new("fuzzed", &again, indexed.catalog());
    assert_eq!(without_times(&report), without_times(&again));
    let text = report.to_text(TextOptions { all_stars: true });
    assert!(!text.contains("NaN") && !text.contains("inf "), "{text}");
    let picture = overlay::draw("fuzzed", &frame, &solution, indexed.catalog());
    assert!(picture.width() > 0);
}

/// A frame, if the bytes describe one.
fn frame_of(data: &[u8]) -> Option<Frame<'static>> {
    let ([width, height, kind], values) = data.split_first_chunk()?;
    let side =
        |byte: u8| SIDES_PX.start() + usize::from(byte) % (SIDES_PX.end() - SIDES_PX.start() + 1);
    let (width, height) = (side(*width), side(*height));
    let count = width * height;
    if values.len() < 4 {
        return None;
    }
    let frame = match kind % 4 {
        // Any float at all.
        0 => {
            let (floats, _) = values.as_chunks();
            let pixels = floats
                .iter()
                .cycle()
                .map(|bytes| f32::from_le_bytes(*bytes));
            Frame::new(width, height, pixels.take(count).collect())
        }
        1 => {
            let (words, _) = values.as_chunks();
            let pixels = words.iter().cycle().map(|bytes| u16::from_le_bytes(*bytes));
            let pixels: Vec<u16> = pixels.take(count).collect();
            Frame::from_samples(width, height, &pixels[..]).map(Frame::into_owned)
        }
        // Noise with the values as spots in it.
        2 => Frame::new(width, height, sky_of(width, height, values)),
        _ => {
            let pixels: Vec<u8> = values.iter().copied().cycle().take(count).collect();
            Frame::from_samples(width, height, &pixels[..]).map(Frame::into_owned)
        }
    };
    frame.ok()
}

/// Noise, and a spot for every four bytes: where, and how bright.
fn sky_of(width: usize, height: usize, values: &[u8]) -> Vec<f32> {
    let mut state = 1_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        100.0 + (state >> 28) as f32
    };
    let mut pixels: Vec<f32> = (0..width * height).map(|_| noise()).collect();
    for spot in values.as_chunks::<4>().0 {
        let [x, y, bright, wide] = spot.map(f32::from);
        let (x, y) = (x / 255.0 * width as f32, y / 255.0 * height as f32);
        let sigma = 0.4 + wide / 100.0;
        for (at, pixel) in pixels.iter_mut().enumerate() {
            let (dx, dy) = ((at % width) as f32 - x, (at / width) as f32 - y);
            *pixel += 20.0 * bright * (-(dx * dx + dy * dy) / (2.0 * sigma * sigma)).exp();
        }
    }
    pixels
}

/// The catalogue that is built in.
fn sky() -> &'static IndexedCatalog<'static> {
    static SKY: OnceLock<IndexedCatalog<'static>> = OnceLock::new();
    SKY.get_or_init(IndexedCatalog::built_in)
}

/// What holds for every report.
fn check(report: &FrameReport, solution: &Solution) {
    let line = report.to_json_line().expect("a report is JSON");
    let value: Value = serde_json::from_str(&line).expect("it is read again");
    let (width, height) = (solution.width as f64, solution.height as f64);
    for star in value["stars"].as_array().expect("a list of stars") {
        let number = |name: &str| star[name].as_f64();
        let (x, y) = (
            number("x").expect("a number"),
            number("y").expect("a number"),
        );
        assert!(
            (-1.0..=width).contains(&x) && (-1.0..=height).contains(&y),
            "{star}"
        );
        for sigma in ["sigma_x", "sigma_y"] {
            assert!(number(sigma).is_none_or(|sigma| sigma > 0.0), "{star}");
        }
        assert!(
            number("p_chance").is_none_or(|p| (0.0..=1.0).contains(&p)),
            "{star}"
        );
    }
    if let Some(attitude) = value["attitude"].as_object() {
        let parts = attitude["quaternion"].as_array().expect("four numbers");
        let squares: f64 = parts
            .iter()
            .filter_map(Value::as_f64)
            .map(|part| part * part)
            .sum();
        assert!((squares - 1.0).abs() < 1e-6, "{line}");
    }
}

/// A report without what differs from run to run.
fn without_times(report: &FrameReport) -> Value {
    let line = report.to_json_line().expect("a report is JSON");
    let mut value: Value = serde_json::from_str(&line).expect("it is read again");
    value["timing_ms"] = Value::Null;
    value
}

/// Identifies a few centroids, whatever comes of it.
pub fn identify_some(indexed: &IndexedCatalog) {
    let centroids = (0..12_u32).map(|n| {
        let place = PixelPoint::new(f64::from(n * 37 % 100) * 5.0, f64::from(n * 61 % 90) * 5.0);
        ListedCentroid::new(place, 2.0 + f64::from(n) / 20.0)
    });
    let list = CentroidList {
        width: 512,
        height: 512,
        photometry: Photometry::Instrumental,
        centroids: centroids.collect(),
    };
    let solution = solve_centroids(&list, &Context::new(indexed), &mut Workspace::new());
    let report = FrameReport::new("centroids", &solution, indexed.catalog());
    check(&report, &solution);
}
