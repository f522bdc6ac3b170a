//! Time of identification, whole and in its two parts, with nothing known and with the field of view
//! known to a factor of two, of reading, and of a whole frame (detection and identification), on the real 16-bit frames in
//! `../shared/frames` if present; and of the start of a new process. One thread; buffers are
//! reused, as in a long run over many frames.

use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, Criterion, criterion_group, criterion_main};
use starpipe::catalog::Catalog;
use starpipe::catalog::sky_grid::SkyGrid;
use starpipe::detect::{self, DetectConfig, detect};
use starpipe::ephemeris::places::StarPlaces;
use starpipe::frame::{self, Frame};
use starpipe::identify::{self, IndexedCatalog, Priors, ScalePrior, StarField, identify};
use starpipe::solve::{Context, Workspace, solve_frame, star_field};
use std::f64::consts::SQRT_2;
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

/// The frame, its stars, and a prior of its scale with a total range of a factor of two.
fn prepare(path: &Path, indexed: &IndexedCatalog) -> Option<(Frame<'static>, StarField, Priors)> {
    let frame = frame::read(path).ok()?;
    let detections = detect(
        &frame,
        &DetectConfig::default(),
        &mut detect::Workspace::new(),
    )
    .ok()?;
    let field = star_field(&frame, &detections, StarPlaces::default());
    let identification = identify(&field, &Priors::default(), indexed).ok()?;
    let scale_rad = 1.0 / identification.camera.focal_length_px();
    let priors = Priors {
        scale: Some(ScalePrior::between(scale_rad / SQRT_2, scale_rad * SQRT_2)),
        ..Priors::default()
    };
    Some((frame, field, priors))
}

/// Pointing alone, with its attitude, and naming after pointing.
fn bench_parts(
    group: &mut BenchmarkGroup<WallTime>,
    name: &str,
    field: &StarField,
    priors: &Priors,
    indexed: &IndexedCatalog,
) {
    let mut workspace = identify::Workspace::new();
    group.bench_function(format!("{name}, attitude only"), |bencher| {
        bencher.iter(|| {
            black_box(
                workspace
                    .attitude(black_box(field), priors, indexed)
                    .is_ok(),
            )
        });
    });
    group.bench_function(format!("{name}, naming"), |bencher| {
        bencher.iter_custom(|rounds| {
            let mut taken = Duration::ZERO;
            for _ in 0..rounds {
                let pointing = workspace.find_pointing(black_box(field), priors, indexed);
                let start = Instant::now();
                black_box(
                    pointing
                        .and_then(identify::PointedField::name_stars)
                        .is_ok(),
                );
                taken += start.elapsed();
            }
            taken
        });
    });
}

fn bench_frames(criterion: &mut Criterion, cache: &Path) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/frames");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        eprintln!("no ../shared/frames: real frames are not benchmarked");
        return;
    };
    let mut paths: Vec<_> = entries.flatten().map(|e| e.path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "tiff"));
    paths.sort();
    let indexed = IndexedCatalog::open(Catalog::built_in(), Some(cache), &|_| ());
    let prepared: Vec<_> = paths.iter().filter_map(|p| prepare(p, &indexed)).collect();
    for (path, (_, field, priors)) in paths.iter().zip(&prepared) {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let mut group = criterion.benchmark_group("identify");
        for (known, priors) in [
            ("nothing known", &Priors::default()),
            ("factor of two", priors),
        ] {
            let mut workspace = identify::Workspace::new();
            group.bench_function(format!("{name}, {known}"), |bencher| {
                bencher.iter(|| {
                    let found = workspace.identify(black_box(field), priors, &indexed);
                    black_box(found.is_ok())
                });
            });
            bench_parts(
                &mut group,
                &format!("{name}, {known}"),
                field,
                priors,
                &indexed,
            );
        }
    }
    let mut buffers = frame::Buffers::new();
    for path in &paths {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        criterion.bench_function(&format!("read/{name}"), |bencher| {
            bencher.iter(|| {
                if let Ok(frame) = frame::read_page_with(black_box(path), None, &mut buffers) {
                    buffers.recycle(black_box(frame));
                }
            });
        });
    }
    let context = Context::new(&indexed);
    let mut workspace = Workspace::new();
    for (path, (frame, ..)) in paths.iter().zip(&prepared) {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        criterion.bench_function(&format!("whole/{name}"), |bencher| {
            bencher.iter(|| black_box(solve_frame(black_box(frame), &context, &mut workspace)));
        });
    }
}

fn bench_start(criterion: &mut Criterion, cache: &Path) {
    let catalog = Catalog::built_in();
    let mut group = criterion.benchmark_group("start");
    group.sample_size(20);
    group.bench_function("catalogue", |bencher| {
        let compact = catalog.to_compact();
        bencher.iter(|| black_box(Catalog::from_compact(black_box(&compact))));
    });
    group.bench_function("grid", |bencher| {
        bencher.iter(|| black_box(SkyGrid::new(catalog.stars())));
    });
    group.bench_function("grid and index from the cache", |bencher| {
        bencher.iter_batched(
            || (),
            |()| black_box(IndexedCatalog::open(catalog, Some(cache), &|_| ())),
            BatchSize::PerIteration,
        );
    });
}

fn benches(criterion: &mut Criterion) {
    let cache = tempfile::tempdir().expect("a place for temporary files");
    bench_frames(criterion, cache.path());
    bench_start(criterion, cache.path());
}

criterion_group!(group, benches);
criterion_main!(group);
