//! Time of `detect` without reading: the real 16-bit frames in `../shared/frames` if present, and
//! synthetic frames, by stage, size and depth. One thread unless stated; buffers are reused, as in
//! a long run over many frames.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use starpipe::detect::{BackgroundMap, DetectConfig, Detections, Workspace, detect, detect_into};
use starpipe::frame::{self, Frame};
use std::hint::black_box;
use std::num::NonZeroUsize;
use std::path::Path;

/// Stars of σ = 1 px, 60 per 1024 x 768 pixels, with peaks from 5.5 times the noise up.
///
/// `bits`: 8 or 16 for whole grey levels, 0 for unrounded ones.
fn synthetic_frame(width: usize, height: usize, bits: u32) -> Frame<'static> {
    const STARS: usize = 60;
    const BRIGHTNESSES: i32 = 60;
    let noise = if bits == 8 { 3.0 } else { 11.0 };
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let mut pixels: Vec<f32> = (0..width * height)
        .map(|_| 9.0 * noise + noise * rng.sample::<f32, _>(StandardNormal))
        .collect();
    let stars = (STARS * width * height / (1024 * 768)) as i32;
    for i in 0..stars {
        let (x, y) = (
            rng.random_range(8.0..(width - 8) as f32),
            rng.random_range(8.0..(height - 8) as f32),
        );
        let peak = 60.0 / 11.0 * noise * 1.1f32.powi(i % BRIGHTNESSES);
        for row in y as usize - 6..y as usize + 7 {
            for column in x as usize - 6..x as usize + 7 {
                let distance2 = (column as f32 - x).powi(2) + (row as f32 - y).powi(2);
                pixels[row * width + column] += peak * (-0.5 * distance2).exp();
            }
        }
    }
    let (step, full) = match bits {
        0 => (0.0, 65535.0),
        _ => (1.0, (2f32.powi(bits as i32)) - 1.0),
    };
    if bits > 0 {
        for pixel in &mut pixels {
            *pixel = pixel.round().clamp(0.0, full);
        }
    }
    Frame::new(width, height, pixels)
        .expect("the size is right")
        .with_levels(step, Some(full))
}

/// Time against size and depth.
fn bench_sizes(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("detect/size");
    group.sample_size(10);
    let config = DetectConfig::default();
    for (width, height) in [
        (640, 480),
        (1024, 768),
        (2048, 1536),
        (4096, 3072),
        (5472, 3648),
        (8192, 6144),
    ] {
        for bits in [8, 16] {
            let frame = synthetic_frame(width, height, bits);
            let mut workspace = Workspace::new();
            let mut found = Detections::default();
            group.throughput(Throughput::Elements((width * height) as u64));
            group.bench_function(format!("{width}x{height}, {bits} bits"), |bencher| {
                bencher.iter(|| {
                    let frame = black_box(&frame);
                    detect_into(frame, &config, &mut workspace, &mut found)
                });
            });
        }
    }
    group.finish();
}

/// The same large frame on one thread and on two.
fn bench_threads(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("detect/threads");
    group.sample_size(10);
    let frame = synthetic_frame(5472, 3648, 16);
    group.throughput(Throughput::Elements(frame.pixels.len() as u64));
    for threads in [NonZeroUsize::MIN, NonZeroUsize::MIN.saturating_add(1)] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads.get())
            .build()
            .expect("threads can be started");
        let config = DetectConfig::default();
        let mut workspace = Workspace::new().on_threads(threads);
        let mut found = Detections::default();
        group.bench_function(format!("20 Mpx on {threads}"), |bencher| {
            pool.install(|| {
                bencher.iter(|| detect_into(&frame, &config, &mut workspace, &mut found));
            });
        });
    }
    group.finish();
}

/// Stages: background alone; everything except the stars' fits (a single star is fitted);
/// everything.
fn bench_stages(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("detect/stage");
    let frame = synthetic_frame(1024, 768, 16);
    group.throughput(Throughput::Elements(frame.pixels.len() as u64));
    group.bench_function("background", |bencher| {
        bencher.iter(|| black_box(BackgroundMap::measure(black_box(&frame), 64)));
    });
    for (name, max_detections) in [("all but the fits", 1), ("all", 20_000)] {
        let mut config = DetectConfig::default();
        config.max_detections = max_detections;
        let mut workspace = Workspace::new();
        let mut found = Detections::default();
        group.bench_function(name, |bencher| {
            bencher.iter(|| detect_into(black_box(&frame), &config, &mut workspace, &mut found));
        });
    }
    group.finish();
}

fn bench_frame(criterion: &mut Criterion, name: &str, frame: &Frame) {
    let mut group = criterion.benchmark_group("detect");
    group.throughput(Throughput::Elements(frame.pixels.len() as u64));
    let config = DetectConfig::default();
    let mut workspace = Workspace::new();
    group.bench_function(name, |bencher| {
        bencher.iter(|| black_box(detect(black_box(frame), &config, &mut workspace)));
    });
    let mut known_spot = config.clone();
    known_spot.spot_sigma_px = detect(frame, &config, &mut workspace)
        .ok()
        .map(|d| d.spot_sigma_px);
    group.bench_function(format!("{name}, spot known"), |bencher| {
        bencher.iter(|| black_box(detect(black_box(frame), &known_spot, &mut workspace)));
    });
    group.finish();
}

fn benches(criterion: &mut Criterion) {
    bench_frame(criterion, "synthetic", &synthetic_frame(1024, 768, 0));
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/frames");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        eprintln!("skipped the real frames: no folder {}", folder.display());
        return;
    };
    let mut paths: Vec<_> = entries.flatten().map(|e| e.path()).collect();
    paths.sort();
    for path in paths
        .iter()
        .filter(|p| p.extension().is_some_and(|e| e == "tiff"))
    {
        match frame::read(path) {
            Ok(frame) => {
                let name = path
                    .file_stem()
                    .unwrap_or_default()
                    .to_string_lossy()
                    .into_owned();
                bench_frame(criterion, &name, &frame);
            }
            Err(error) => eprintln!("skipped: {error}"),
        }
    }
}

criterion_group!(
    detect_benches,
    benches,
    bench_stages,
    bench_sizes,
    bench_threads
);
criterion_main!(detect_benches);
