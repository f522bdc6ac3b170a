//! `darks`: frames taken without light.

use super::args::{DarksArgs, Format};
use super::output::{csv_table, print, write_whole};
use super::resources::{bar, thread_pool};
use super::values::ExposureOf;
use super::{Exit, Fault, batch, chained, complain, input, overwrite, warn};
use anyhow::Context;
use starpipe::calibration::darks::{
    DarkConfig, DarkStack, Darks, FrameStatistics, FullScaleSource, HotPixelRow,
};
use starpipe::camera::data_sheet::Sensor;
use starpipe::frame::Buffers;
use starpipe::frame::{CALIBRATION_CREATOR, FitsHeader, FitsSamples, Frame, write_fits};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// `starpipe darks`
pub(crate) fn darks(arguments: DarksArgs) -> Result<Exit, Fault> {
    input::check(&arguments.frames)?;
    let (frames, troubles) = input::frames(arguments.frames.clone());
    for trouble in &troubles {
        complain(chained(trouble));
    }
    check_exposures(&arguments.exposure, &frames)?;
    let config = config(&arguments)?;
    let pool = thread_pool(arguments.threads)?;
    let mut stack = DarkStack::new();
    let read = |path: &PathBuf| -> anyhow::Result<_> {
        let frame =
            input::read_frame(path, arguments.page, &mut Buffers::new()).context("reading")?;
        let name = path.display().to_string();
        let exposure_s = exposure_of(path, &arguments.exposure);
        let statistics = FrameStatistics::of(&name, &frame, exposure_s);
        Ok((frame, statistics))
    };
    let unread = for_each_frame(&pool, &frames, read, |(frame, statistics)| {
        Ok(stack.add(&frame, statistics)?)
    })?;
    let failed = unread > 0 || !troubles.is_empty();
    if unread == frames.len() {
        return Ok(Exit::Failure);
    }
    let darks = stack.measure(&config).map_err(anyhow::Error::from)?;
    for warning in &darks.warnings {
        warn(warning);
    }
    if let Some(directory) = &arguments.out {
        let files = files(&darks, directory)?;
        let results: Vec<_> = files.iter().map(|(path, _)| path.clone()).collect();
        overwrite::check_results(&frames, &results)?;
        save(directory, &files)?;
    }
    let text = match arguments.format {
        Format::Text => darks.report().to_text(),
        Format::Json => serde_json::to_string(&darks.report()).context("writing JSON")? + "\n",
        Format::Csv => csv_table(darks.frame_rows())?,
    };
    // Nobody left to read it: nothing is lost.
    let _ = print(&text)?;
    Ok(if failed { Exit::Failure } else { Exit::Success })
}

/// Reads frames on all threads and takes them in their order; tells how many could not be read. What `take` refuses ends it.
pub(super) fn for_each_frame<R: Send>(
    pool: &rayon::ThreadPool,
    frames: &[PathBuf],
    read: impl Fn(&PathBuf) -> anyhow::Result<R> + Sync,
    mut take: impl FnMut(R) -> anyhow::Result<()>,
) -> anyhow::Result<usize> {
    let progress = bar(frames.len() as u64, "frames {wide_bar} {pos}/{len} {eta}");
    let mut unread = 0;
    let mut refused = None;
    let read = |path: &PathBuf, (): &mut ()| read(path);
    batch::for_each_ordered(
        pool,
        frames,
        || (),
        read,
        |_, result| {
            progress.inc(1);
            match result {
                Err(error) => {
                    unread += 1;
                    progress.suspend(|| complain(chained(error.as_ref())));
                    ControlFlow::Continue(())
                }
                Ok(frame) => match take(frame) {
                    Ok(()) => ControlFlow::Continue(()),
                    Err(error) => {
                        refused = Some(error);
                        ControlFlow::Break(())
                    }
                },
            }
        },
    );
    progress.finish_and_clear();
    refused.map_or(Ok(unread), Err)
}

/// Writes `files` into `directory`, all or none.
pub(super) fn save(directory: &Path, files: &[(PathBuf, Vec<u8>)]) -> anyhow::Result<()> {
    std::fs::create_dir_all(directory)
        .with_context(|| format!("making the directory {}", directory.display()))?;
    write_whole(files)
}

fn config(arguments: &DarksArgs) -> anyhow::Result<DarkConfig> {
    let sensor = arguments.camera.as_deref().map(Sensor::read).transpose()?;
    let stated = arguments.bits.map(|bits| (bits, FullScaleSource::Option));
    let described = sensor
        .as_ref()
        .map(|sensor| (sensor.bits, FullScaleSource::Camera));
    Ok(DarkConfig {
        bits: stated.or(described),
        gain_e_per_adu: sensor.map(|sensor| sensor.gain_e_per_adu),
        hot_sigma: arguments.hot_sigma,
    })
}

/// Refuses an exposure for frames that are not there.
fn check_exposures(exposures: &[ExposureOf], frames: &[PathBuf]) -> Result<(), Fault> {
    for path in exposures.iter().filter_map(|e| e.path.as_ref()) {
        if !frames.iter().any(|frame| frame.starts_with(path)) {
            return Err(Fault::Usage(format!(
                "--exposure is given for {}, of which no frame is given",
                path.display()
            )));
        }
    }
    Ok(())
}

/// The exposure said of `frame`: that of the longest path that it is in, else that of all frames.
fn exposure_of(frame: &Path, exposures: &[ExposureOf]) -> Option<f64> {
    let applies = exposures.iter().filter(|of| {
        let path = of.path.as_ref();
        path.is_none_or(|path| frame.starts_with(path))
    });
    let depth = |of: &&ExposureOf| of.path.as_ref().map_or(0, |path| path.components().count());
    applies.max_by_key(depth).map(|of| of.exposure_s)
}

/// What is written: their names and contents.
fn files(darks: &Darks, directory: &Path) -> anyhow::Result<Vec<(PathBuf, Vec<u8>)>> {
    let mut files = Vec::new();
    let size = (darks.width, darks.height);
    for group in &darks.groups {
        let name = match group.exposure_s {
            _ if darks.groups.len() == 1 => "master-dark.fits".to_owned(),
            Some(exposure_s) => format!("master-dark-{exposure_s}s.fits"),
            None => "master-dark-unknown.fits".to_owned(),
        };
        let mut header = header("DARK", group.frames);
        if let Some(exposure_s) = group.exposure_s {
            header.real("EXPTIME", exposure_s, "[s] exposure");
        }
        header.real("MEAN", group.level_adu, "[ADU] mean of the frames' means");
        let noise = group.temporal_noise_adu.unwrap_or(f64::NAN);
        header.real("NOISE", noise, "[ADU] of a pixel in one frame");
        header.history(&format!(
            "Mean of each pixel over {} frames, by starpipe darks {}",
            group.frames,
            env!("CARGO_PKG_VERSION")
        ));
        files.push((directory.join(name), image(size, &group.means, &header)?));
    }
    if let Some(noise) = &darks.noise_adu {
        let mut header = header("NOISE", darks.frames.len());
        header.text("BUNIT", "ADU", "");
        header.history("Standard deviation of each pixel over frames of one exposure, pooled over the exposures");
        files.push((directory.join("noise.fits"), image(size, noise, &header)?));
    }
    files.push((directory.join("hot-pixels.csv"), hot_pixels_table(darks)?));
    Ok(files)
}

/// The beginning of the header of every master: it is known by it.
pub(super) fn header(kind: &str, frames: usize) -> FitsHeader {
    let mut header = FitsHeader::default();
    header.text("CREATOR", CALIBRATION_CREATOR, "");
    header.text("IMAGETYP", kind, "");
    header.integer("NCOMBINE", frames as i64, "frames");
    header
}

/// The bytes of an image of floats.
pub(super) fn image(
    (width, height): (usize, usize),
    pixels: &[f32],
    header: &FitsHeader,
) -> anyhow::Result<Vec<u8>> {
    let frame = Frame::new(width, height, pixels.to_vec())?;
    let mut bytes = Vec::new();
    write_fits(&mut bytes, &frame, FitsSamples::Float32, header)?;
    Ok(bytes)
}

fn hot_pixels_table(darks: &Darks) -> anyhow::Result<Vec<u8>> {
    let mut writer = csv::WriterBuilder::new()
        .has_headers(false)
        .from_writer(Vec::new());
    // A heading also where there is no row.
    writer.write_record(HotPixelRow::COLUMNS)?;
    for hot in &darks.hot_pixels {
        writer.serialize(HotPixelRow::from(hot))?;
    }
    writer
        .into_inner()
        .map_err(|error| error.into_error().into())
}
