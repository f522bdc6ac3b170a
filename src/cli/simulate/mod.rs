//! `simulate`: frames with known truth, as files.

mod args;
mod files;
mod header;

pub(crate) use args::SimulateArgs;

use super::batch::for_each_ordered;
use super::exit::{CommandError, Exit};
use super::input::centroid_list::{self as centroids, FrameSize};
use super::options::catalog::{read_catalog, thread_pool};
use super::options::format::PageFormat;
use super::output::files::write_whole;
use super::output::stdout::print;
use super::progress::bar;
use anyhow::{Context, anyhow};
use files::Place;
use header::Description;
use indicatif::ProgressBar;
use serde::Serialize;
use starpipe::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use starpipe::base::epoch::ObservationDate;
use starpipe::base::units::DEG_PER_RAD;
use starpipe::frame::{Frame, FrameMetadata};
use starpipe::identify::Photometry;
use starpipe::model::sensitivity::{Budget, Detector, Rule};
use starpipe::model::simulate::{Pointing, Scene, Setup, Simulator, Truth};
use starpipe::sky::catalog::Catalog;
use starpipe::study::validation::draw;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// What the frames are of.
#[derive(Debug, Clone)]
enum Subject {
    /// The sky, seen from a fixed attitude, or from another one in each frame.
    Sky(Option<Rotation<Icrs, Camera>>),
    /// Stars at these places, of these V magnitudes.
    Stars(Vec<(PixelPoint, f64)>),
    /// Nothing: the shutter is closed.
    Dark,
    /// An even light of so many electrons.
    Flat(f64),
}

impl Subject {
    fn of(arguments: &SimulateArgs, setup: &Setup) -> Result<Self, CommandError> {
        let is_unlit = arguments.dark || arguments.flat.is_some();
        if is_unlit && setup.scene != Scene::default() {
            return Err(CommandError::Usage(
                "dark frames and flats are of no sky: expected none of the options of the scene"
                    .into(),
            ));
        }
        if let Some(path) = &arguments.stars {
            let list = star_list(path, setup)?;
            return Ok(Self::Stars(list));
        }
        if arguments.dark {
            return Ok(Self::Dark);
        }
        if let Some(electrons) = arguments.flat {
            return Ok(Self::Flat(electrons));
        }
        let fixed = arguments.ra.zip(arguments.dec).map(|(ra_deg, dec_deg)| {
            let boresight = UnitVector::from_ra_dec(ra_deg.to_radians(), dec_deg.to_radians());
            Rotation::looking_at(&boresight, arguments.roll.to_radians())
        });
        Ok(Self::Sky(fixed))
    }

    /// Whether a table tells what is on its frames.
    const fn has_truth(&self) -> bool {
        matches!(self, Self::Sky(_) | Self::Stars(_))
    }

    /// What the names of its files begin with.
    const fn stem(&self) -> &'static str {
        match self {
            Self::Sky(_) | Self::Stars(_) => "frame",
            Self::Dark => "dark",
            Self::Flat(_) => "flat",
        }
    }
}

/// The stars in a list, which must have V magnitudes.
fn star_list(path: &Path, setup: &Setup) -> anyhow::Result<Vec<(PixelPoint, f64)>> {
    let sheet = &setup.scenario.camera;
    let side = |pixels: usize| u32::try_from(pixels).ok();
    let size = FrameSize {
        width: side(sheet.width_px),
        height: side(sheet.height_px),
    };
    let list = centroids::read(path, size)?;
    if list.photometry != Photometry::JohnsonV {
        let error = anyhow!("found no column vmag, expected V magnitudes of the stars to draw");
        return Err(error.context(format!("reading {}", path.display())));
    }
    let star = |centroid: &starpipe::pipeline::ListedCentroid| (centroid.position, centroid.mag);
    Ok(list.centroids.iter().map(star).collect())
}

/// What is made, again and again.
struct Job<'a> {
    setup: &'a Setup,
    simulator: &'a Simulator<'a>,
    subject: &'a Subject,
    catalog: &'a Catalog,
    date: Option<ObservationDate>,
    seed: u64,
    limit_vmag: f64,
}

/// One frame, and what is known of it.
struct Made {
    frame: Frame,
    truth: Option<Truth>,
    attitude: Option<Rotation<Icrs, Camera>>,
    number: u64,
    seed: u64,
}

/// What is told of a frame.
#[derive(Debug, Serialize)]
struct Told {
    frame: String,
    /// The table of its stars; none of a frame without any.
    truth: Option<String>,
    number: u64,
    seed: u64,
    width: usize,
    height: usize,
    exposure_s: f64,
    date: Option<String>,
    attitude: Option<ToldAttitude>,
    focal_length_px: f64,
    fov_x_deg: f64,
    mirrored: bool,
    predicted_limit_vmag: f64,
    stars_above_limit: Option<usize>,
    background_e: Option<f64>,
    motion_px: Option<[f64; 2]>,
}

#[derive(Debug, Serialize)]
struct ToldAttitude {
    ra_deg: f64,
    dec_deg: f64,
    up_pa_deg: f64,
    quaternion: [f64; 4],
}

/// `starpipe simulate`
pub(crate) fn simulate(arguments: &SimulateArgs) -> Result<Exit, CommandError> {
    let setup = arguments.setup.setup()?;
    let subject = Subject::of(arguments, &setup)?;
    let place = Place::of(arguments, &subject, &setup.scenario.camera)?;
    let pool = thread_pool(arguments.resources.threads)?;
    let catalog = pool.install(|| read_catalog(arguments.resources.catalog.as_deref()))?;
    let simulator = Simulator::new(&setup.scenario, &setup.scene, catalog.stars())
        .context("simulating a frame")?;
    let evened = simulator.uniform_scenario();
    let detector = Detector::new(Rule::MatchedFilter, &evened, &Budget::new(&evened));
    let job = Job {
        setup: &setup,
        simulator: &simulator,
        subject: &subject,
        catalog: &catalog,
        date: arguments.hint_date,
        seed: arguments.seed,
        limit_vmag: detector.vmag_at(0.5),
    };
    place.prepare()?;
    let numbers: Vec<u64> = (0..arguments.count).map(|i| arguments.first + i).collect();
    let progress = bar(
        arguments.count,
        "frames {wide_bar} {pos}/{len} {per_sec} {eta}",
    );
    let told = run(&job, &place, &numbers, &pool, &progress);
    progress.finish_and_clear();
    for told in told? {
        let line = match arguments.format {
            PageFormat::Text => told.to_text(),
            PageFormat::Json => serde_json::to_string(&told).context("writing JSON")?,
        };
        if print(&(line + "\n"))?.is_break() {
            break;
        }
    }
    Ok(Exit::Success)
}

/// Makes and writes all frames; what is told of each, in their order.
fn run(
    job: &Job,
    place: &Place,
    numbers: &[u64],
    pool: &rayon::ThreadPool,
    progress: &ProgressBar,
) -> anyhow::Result<Vec<Told>> {
    let mut all = Ok(Vec::with_capacity(numbers.len()));
    let work = |number: &u64, (): &mut ()| job.write(*number, place);
    for_each_ordered(
        pool,
        numbers,
        || (),
        work,
        |_, told| {
            progress.inc(1);
            match (told, &mut all) {
                (Ok(told), Ok(list)) => list.push(told),
                (Err(error), _) => all = Err(error),
                _ => (),
            }
            if all.is_err() {
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        },
    );
    all
}

impl Job<'_> {
    /// Makes the frame with this number and writes it, with its truth.
    fn write(&self, number: u64, place: &Place) -> anyhow::Result<Told> {
        let mut made = self.make(number).context("simulating a frame")?;
        made.frame.metadata = self.metadata();
        let description = Description {
            job: self,
            made: &made,
        };
        let path = place.image(number);
        let mut files = vec![(path.clone(), place.encoded(&made.frame, &description)?)];
        let table = made.truth.as_ref().map(|truth| {
            let table = files::truth_table(truth, self, made.attitude.as_ref());
            (path.with_extension("csv"), table)
        });
        let mut truth_path = None;
        if let Some((path, table)) = table {
            truth_path = Some(path.display().to_string());
            files.push((path, table?));
        }
        write_whole(&files)?;
        Ok(self.told(&made, &path, truth_path))
    }

    fn make(&self, number: u64) -> Result<Made, starpipe::frame::FrameError> {
        let (seed, drawn) = draw(self.seed, number);
        let simulator = self.simulator;
        let (frame, truth, attitude) = match self.subject {
            Subject::Sky(fixed) => {
                let icrs_to_camera = fixed.unwrap_or(drawn);
                let pointing = Pointing {
                    icrs_to_camera,
                    years_since_j2000: self.years_since_j2000(),
                };
                let (frame, truth) = simulator.frame(&pointing, seed)?;
                (frame, Some(truth), Some(icrs_to_camera))
            }
            Subject::Stars(stars) => {
                let (frame, truth) = simulator.star_field(stars, seed)?;
                (frame, Some(truth), None)
            }
            Subject::Dark => (simulator.dark(seed)?, None, None),
            Subject::Flat(electrons) => (simulator.evenly_lit(*electrons, seed)?, None, None),
        };
        Ok(Made {
            frame,
            truth,
            attitude,
            number,
            seed,
        })
    }

    fn years_since_j2000(&self) -> f64 {
        self.date.map_or(0.0, |date| date.years_since_j2000())
    }

    /// What the file says of the frame, as a camera's would.
    fn metadata(&self) -> FrameMetadata {
        let sheet = &self.setup.scenario.camera;
        FrameMetadata {
            date: self.date,
            exposure_s: Some(self.setup.scenario.conditions.exposure_s),
            pixel_size_um: Some((sheet.pitch_x_um * sheet.pitch_y_um).sqrt()),
            focal_length_mm: Some(sheet.focal_length_mm),
            ..FrameMetadata::default()
        }
    }

    fn told(&self, made: &Made, path: &Path, truth_path: Option<String>) -> Told {
        let truth = made.truth.as_ref();
        let camera = self.simulator.camera();
        let light = self.simulator.light();
        let is_bright = |star: &&starpipe::model::simulate::TrueStar| {
            light.vmag_of(star.electrons) <= self.limit_vmag
        };
        Told {
            frame: path.display().to_string(),
            truth: truth_path,
            number: made.number,
            seed: made.seed,
            width: made.frame.width,
            height: made.frame.height,
            exposure_s: self.setup.scenario.conditions.exposure_s,
            date: self.date.map(|date| date.to_iso()),
            attitude: made.attitude.as_ref().map(ToldAttitude::of),
            focal_length_px: camera.focal_length_px,
            fov_x_deg: camera.fov_x_rad() * DEG_PER_RAD,
            mirrored: camera.mirrored,
            predicted_limit_vmag: self.limit_vmag,
            stars_above_limit: truth.map(|truth| truth.stars.iter().filter(is_bright).count()),
            background_e: truth.map(|truth| truth.background_e),
            motion_px: truth.map(|truth| truth.motion_px),
        }
    }
}

impl ToldAttitude {
    fn of(icrs_to_camera: &Rotation<Icrs, Camera>) -> Self {
        let (boresight, up_pa_rad) = icrs_to_camera.boresight_and_up();
        let (ra_rad, dec_rad) = boresight.to_ra_dec();
        Self {
            ra_deg: ra_rad * DEG_PER_RAD,
            dec_deg: dec_rad * DEG_PER_RAD,
            up_pa_deg: up_pa_rad * DEG_PER_RAD,
            quaternion: icrs_to_camera.to_quaternion(),
        }
    }
}

impl Told {
    fn to_text(&self) -> String {
        let mut text = self.frame.clone();
        if let Some(attitude) = &self.attitude {
            text += &format!(
                "  RA {:.4}° Dec {:+.4}°, up at {:.3}°",
                attitude.ra_deg, attitude.dec_deg, attitude.up_pa_deg
            );
        }
        if let Some(stars) = self.stars_above_limit {
            text += &format!(
                ", {stars} stars with the light of V {:.2} or more",
                self.predicted_limit_vmag
            );
        }
        text
    }
}

/// Where a file of this name would be written.
fn named(directory: &Path, stem: &str, number: u64, extension: &str) -> PathBuf {
    directory.join(format!("{stem}-{number:05}.{extension}"))
}
