//! Time of `detect`, reading not counted: the real 16-bit frames in `../shared/frames` where they
//! are, and a synthetic frame. One thread, buffers reused, as in a long run over many frames.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use starpipe::detect::{DetectConfig, Workspace, detect};
use starpipe::frame::{self, Frame};
use std::hint::black_box;
use std::path::Path;

/// 1024 x 768 with 60 stars of σ = 1 px over noise of 11 ADU.
fn synthetic_frame() -> Frame {
    const WIDTH: usize = 1024;
    const HEIGHT: usize = 768;
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let mut pixels: Vec<f32> = (0..WIDTH * HEIGHT)
        .map(|_| 100.0 + 11.0 * rng.sample::<f32, _>(StandardNormal))
        .collect();
    for i in 0..60u32 {
        let (x, y) = (
            rng.random_range(8.0..1016.0f32),
            rng.random_range(8.0..760.0f32),
        );
        let peak = 60.0 * 1.1f32.powi(i as i32);
        for row in y as usize - 6..y as usize + 7 {
            for column in x as usize - 6..x as usize + 7 {
                let distance2 = (column as f32 - x).powi(2) + (row as f32 - y).powi(2);
                pixels[row * WIDTH + column] += peak * (-0.5 * distance2).exp();
            }
        }
    }
    Frame::new(WIDTH, HEIGHT, pixels)
        .expect("the size is right")
        .with_levels(0.0, Some(65535.0))
}

fn bench_frame(criterion: &mut Criterion, name: &str, frame: &Frame) {
    let mut group = criterion.benchmark_group("detect");
    group.throughput(Throughput::Elements(frame.pixels.len() as u64));
    let config = DetectConfig::default();
    let mut workspace = Workspace::new();
    group.bench_function(name, |bencher| {
        bencher.iter(|| black_box(detect(black_box(frame), &config, &mut workspace)));
    });
    let known_spot = DetectConfig {
        spot_sigma_px: detect(frame, &config, &mut workspace)
            .ok()
            .map(|d| d.spot_sigma_px),
        ..config
    };
    group.bench_function(format!("{name}, spot known"), |bencher| {
        bencher.iter(|| black_box(detect(black_box(frame), &known_spot, &mut workspace)));
    });
    group.finish();
}

fn benches(criterion: &mut Criterion) {
    bench_frame(criterion, "synthetic", &synthetic_frame());
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

criterion_group!(detect_benches, benches);
criterion_main!(detect_benches);
