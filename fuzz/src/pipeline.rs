//! The pipeline: any pixels from detection to report and overlay; lists of centroids.

use serde_json::Value;
use starpipe::base::coords::Rotation;
use starpipe::camera::{self, data_sheet::Preset};
use starpipe::centroids::{CentroidList, CentroidListOptions, ListedCentroid};
use starpipe::identify::{DateSource, FrameDate, Photometry, Scale, ScaleSource};
use starpipe::photometry::comparison::ObservingSetup;
use starpipe::report::overlay::{self, OverlayOptions, Shown};
use starpipe::solve::{solve_centroids, solve_frame};
use starpipe::{
    CameraModel, Context, Frame, FrameReport, IndexedCatalog, Interrupt, PixelPoint, ScalePrior,
    Site, Solution, TextOptions, UnitVector, Workspace,
};
use std::cell::RefCell;
use std::f64::consts::TAU;
use std::mem;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

/// Sides of a frame.
const SIDES_PX: std::ops::RangeInclusive<usize> = 3..=200;
/// How often the search for the stars of a list asks whether to end: a millisecond.
const MAX_ASKED: u32 = 50;
/// How far outside the frame a listed centroid may lie: half a pixel of the border's pixel, and 5.
const LISTED_BORDER_PX: f64 = 5.5;
/// Stars of the catalogue that are drawn at most.
const MAX_DRAWN: usize = 60;

/// What comes before the values.
struct Header {
    width_px: usize,
    height_px: usize,
    /// What the values are.
    kind: u8,
    /// What is known beforehand, a bit each.
    known: u8,
    /// How often the work may ask whether to end.
    patience: u8,
}

impl Header {
    fn knows(&self, bit: u32) -> bool {
        self.known >> bit & 1 == 1
    }
}

/// Pixels from bytes: sides, kind of pixels, what is known, when the work ends early; then values.
pub fn pipeline(data: &[u8]) {
    let Some(([width, height, kind, known, patience], values)) = data.split_first_chunk() else {
        return;
    };
    let side =
        |byte: u8| SIDES_PX.start() + usize::from(byte) % (SIDES_PX.end() - SIDES_PX.start() + 1);
    let header = Header {
        width_px: side(*width),
        height_px: side(*height),
        kind: *kind,
        known: *known,
        patience: *patience,
    };
    let Some(frame) = frame_of(&header, values) else {
        return;
    };
    let indexed = sky();
    let context = context_of(&header, indexed);
    let solve = || {
        with_workspace(&interrupt_of(&header), |workspace| {
            solve_frame(&frame, &context, workspace)
        })
    };
    let (first, again) = (solve(), solve());
    let (Ok(solution), Ok(again)) = (&first, &again) else {
        assert_eq!(first.is_ok(), again.is_ok());
        return;
    };
    let report = FrameReport::new("fuzzed", solution, indexed.catalog());
    check(&report, solution, 1.0);
    let again = FrameReport::new("fuzzed", again, indexed.catalog());
    assert_eq!(without_times(&report), without_times(&again));
    let mut options = TextOptions::default();
    options.all_stars = true;
    let text = report.to_text(options);
    assert!(!text.contains("NaN") && !text.contains("inf "), "{text}");
    // The slowest part, and the one that depends least on the pixels.
    if header.knows(6) && header.knows(7) {
        let picture = overlay::draw(
            &Shown::new("fuzzed", &frame),
            solution,
            indexed.catalog(),
            &OverlayOptions::default(),
        );
        assert!(picture.width() > 0);
    }
}

/// Lends the buffers of the last frame: whatever they hold, the result is the same.
fn with_workspace<T>(interrupt: &Interrupt, solve: impl FnOnce(&mut Workspace) -> T) -> T {
    thread_local!(static USED: RefCell<Workspace> = RefCell::default());
    USED.with_borrow_mut(|used| {
        *used = mem::take(used).with_interrupt(interrupt);
        solve(used)
    })
}

/// When the work on a frame ends.
fn interrupt_of(header: &Header) -> Interrupt {
    const ASKED_PER_STEP: u32 = 16;
    interrupt_after(ASKED_PER_STEP * (1 + u32::from(header.patience)))
}

/// Ends the work when it has asked so often whether to end, and so at the same place each time.
fn interrupt_after(most: u32) -> Interrupt {
    let asked = AtomicU32::new(0);
    Interrupt::when(move || asked.fetch_add(1, Ordering::Relaxed) >= most)
}

/// What is known of the frame.
fn context_of(header: &Header, indexed: &'static IndexedCatalog<'static>) -> Context<'static> {
    let mut context = Context::new(indexed);
    context.attitude_only = header.knows(0);
    if header.knows(1) {
        context.priors.scale = Some(ScalePrior {
            scale: Scale::FieldOfView(fov_deg(header.kind).to_radians()),
            tolerance: 0.1,
            source: ScaleSource::User,
        });
    }
    if header.knows(2) {
        context.priors.date = "2024-08-12T22:15:00Z"
            .parse()
            .ok()
            .map(|date| FrameDate::stated(date, DateSource::User));
    }
    if header.knows(3) {
        context.priors.site = Site::new(45.0, 7.0, 300.0).ok();
    }
    if header.knows(4) {
        context.priors.exposure_s = Some(0.5);
    }
    if header.knows(5) {
        let mut camera = ObservingSetup::new(Preset::NanosatTracker.data_sheet());
        camera.zenith_distance_deg = header.knows(3).then_some(40.0);
        context.camera = Some(camera);
    }
    context
}

/// Kinds of pixels.
const KINDS: u8 = 5;

/// A frame, if the bytes describe one.
fn frame_of(header: &Header, values: &[u8]) -> Option<Frame<'static>> {
    let (width, height) = (header.width_px, header.height_px);
    let count = width * height;
    if values.len() < 4 {
        return None;
    }
    let frame = match header.kind % KINDS {
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
        2 => {
            let pixels: Vec<u8> = values.iter().copied().cycle().take(count).collect();
            Frame::from_samples(width, height, &pixels[..]).map(Frame::into_owned)
        }
        // Noise with the values as spots in it.
        3 => {
            let mut pixels = noise(count);
            draw_values(&mut pixels, width, values);
            Frame::new(width, height, pixels)
        }
        // Stars of the catalogue, and the values as spots between them.
        _ => {
            let mut pixels = noise(count);
            let (pointing, others) = values.split_first_chunk()?;
            draw_stars(&mut pixels, header, *pointing);
            draw_values(&mut pixels, width, others);
            Frame::new(width, height, pixels)
        }
    };
    frame.ok()
}

/// A background of 100 with noise, the same each time.
fn noise(count: usize) -> Vec<f32> {
    let mut state = 1_u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        100.0 + (state >> 28) as f32
    };
    (0..count).map(|_| next()).collect()
}

/// A spot for every four bytes: where, how bright, how wide.
fn draw_values(pixels: &mut [f32], width: usize, values: &[u8]) {
    let height = pixels.len() / width;
    for spot in values.as_chunks::<4>().0 {
        let [x, y, bright, wide] = spot.map(f32::from);
        let place = [x / 255.0 * width as f32, y / 255.0 * height as f32];
        draw_spot(pixels, width, place, 20.0 * bright, 0.4 + wide / 100.0);
    }
}

/// The field of view of a drawn sky.
fn fov_deg(kind: u8) -> f64 {
    8.0 + f64::from(kind / KINDS)
}

/// The brightest stars of a field that three 16-bit numbers point at.
fn draw_stars(pixels: &mut [f32], header: &Header, pointing: [u8; 6]) {
    let share =
        |low: usize| f64::from(u16::from_le_bytes([pointing[low], pointing[low + 1]])) / 65536.0;
    let boresight = UnitVector::from_ra_dec(TAU * share(0), (2.0 * share(2) - 1.0).asin());
    let attitude = Rotation::looking_at(&boresight, TAU * share(4));
    let (width_px, height_px) = (header.width_px as f64, header.height_px as f64);
    let focal_px = camera::focal_length_px(width_px, fov_deg(header.kind).to_radians());
    let camera = CameraModel::pinhole(width_px, height_px, focal_px, header.knows(6));
    let stars = sky().catalog().stars().iter();
    let mut seen: Vec<(f64, PixelPoint)> = stars
        .filter_map(|star| {
            let place = camera.pixel_of(&attitude.apply(&star.direction_at(0.0)))?;
            camera
                .contains(&place)
                .then_some((f64::from(star.v_mag), place))
        })
        .collect();
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (v_mag, place) in seen.into_iter().take(MAX_DRAWN) {
        let peak = 10.0 * 10_f64.powf(0.4 * (8.0 - v_mag));
        let place = [place.x as f32, place.y as f32];
        draw_spot(pixels, header.width_px, place, peak as f32, 0.9);
    }
}

/// A Gaussian spot.
fn draw_spot(pixels: &mut [f32], width: usize, [x, y]: [f32; 2], peak: f32, sigma: f32) {
    let height = pixels.len() / width;
    let range = |at: f32, side: usize| {
        let low = (at - 5.0 * sigma).max(0.0) as usize;
        low..side.min((at + 5.0 * sigma).max(0.0) as usize + 1)
    };
    for row in range(y, height) {
        for column in range(x, width) {
            let (dx, dy) = (column as f32 - x, row as f32 - y);
            pixels[row * width + column] +=
                peak * (-(dx * dx + dy * dy) / (2.0 * sigma * sigma)).exp();
        }
    }
}

/// The catalogue that is built in.
fn sky() -> &'static IndexedCatalog<'static> {
    static SKY: OnceLock<IndexedCatalog<'static>> = OnceLock::new();
    SKY.get_or_init(IndexedCatalog::built_in)
}

/// What holds for every report; stars lie at most `border_px` outside the frame.
fn check(report: &FrameReport, solution: &Solution, border_px: f64) {
    let value = json_of(report);
    let (width, height) = (solution.width as f64, solution.height as f64);
    for star in value["stars"].as_array().expect("a list of stars") {
        let number = |name: &str| star[name].as_f64();
        let (x, y) = (
            number("x").expect("a number"),
            number("y").expect("a number"),
        );
        assert!(
            (-border_px..=width - 1.0 + border_px).contains(&x)
                && (-border_px..=height - 1.0 + border_px).contains(&y),
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
        assert!((squares - 1.0).abs() < 1e-6, "{value}");
    }
}

fn json_of(report: &FrameReport) -> Value {
    let line = report.to_json_line().expect("a report is JSON");
    serde_json::from_str(&line).expect("it is read again")
}

/// A report without what differs from run to run.
fn without_times(report: &FrameReport) -> Value {
    let mut value = json_of(report);
    value["timing_ms"] = Value::Null;
    value
}

/// A list of centroids: whether its size and the wanted frame are told, then CSV.
pub fn centroids(data: &[u8]) {
    let Some((told, csv)) = data.split_first() else {
        return;
    };
    let mut options = CentroidListOptions::default();
    options.width = (told & 1 != 0).then_some(640);
    options.height = (told & 2 != 0).then_some(480);
    options.frame = (told & 4 != 0).then(|| "a.png".to_owned());
    let Ok(list) = CentroidList::parse(csv, &options) else {
        return;
    };
    assert!(!list.centroids.is_empty());
    for centroid in &list.usable().0.centroids {
        assert!(centroid.position.x.is_finite() && centroid.position.y.is_finite());
        assert!(centroid.mag.is_finite());
        assert!(centroid.sigma_px.is_none_or(|sigma_px| sigma_px > 0.0));
    }
    identify(&list, sky());
}

/// Identifies a few centroids, whatever comes of it.
pub fn identify_some(indexed: &IndexedCatalog) {
    let centroids = (0..12_u32).map(|n| {
        let place = PixelPoint::new(f64::from(n * 37 % 100) * 5.0, f64::from(n * 61 % 90) * 5.0);
        ListedCentroid::new(place, 2.0 + f64::from(n) / 20.0)
    });
    let list = CentroidList {
        width: Some(512),
        height: Some(512),
        photometry: Photometry::Instrumental,
        has_brightness: true,
        centroids: centroids.collect(),
    };
    identify(&list, indexed);
}

/// Identifies a list, for a while.
fn identify(list: &CentroidList, indexed: &IndexedCatalog) {
    let solution = with_workspace(&interrupt_after(MAX_ASKED), |workspace| {
        solve_centroids(list, &Context::new(indexed), workspace)
    });
    let Ok(solution) = solution else {
        return;
    };
    let report = FrameReport::new("centroids", &solution, indexed.catalog());
    check(&report, &solution, LISTED_BORDER_PX);
}
