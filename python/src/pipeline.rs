//! The pipeline: catalogue, camera and buffers that solve frames.

use crate::camera::data_sheet;
use crate::catalogs;
use crate::errors::exception;
use crate::hints::Hints;
use crate::image::{Image, Source, bad_pixels};
use crate::interrupt::{on_this_thread, on_threads};
use crate::solved::Solved;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use starpipe::calibration::Master;
use starpipe::camera::data_sheet::DataSheet;
use starpipe::frame::Buffers;
use starpipe::model::sensitivity::Extinction;
use starpipe::photometry::comparison::StatedCamera;
use starpipe::photometry::instrumental_mag;
use starpipe::pipeline::{CentroidList, ListedCentroid, solve_centroids, solve_frame, solve_read};
use starpipe::{
    Calibration, Context, DetectConfig, IndexedCatalog, Interrupt, PixelPoint, Solution, Workspace,
};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

/// Solves frames. It may be used by several threads at once.
#[pyclass(frozen, module = "starpipe._starpipe")]
pub struct Pipeline {
    pub indexed: &'static IndexedCatalog<'static>,
    camera: Option<DataSheet>,
    /// Buffers that no thread uses at present.
    workspaces: Mutex<Vec<Workspace>>,
}

#[pymethods]
impl Pipeline {
    #[new]
    #[pyo3(signature = (catalog, camera, cache_dir))]
    fn new(
        py: Python<'_>,
        catalog: Option<PathBuf>,
        camera: Option<PathBuf>,
        cache_dir: Option<PathBuf>,
    ) -> PyResult<Self> {
        let all = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        on_threads(py, all, |interrupt| {
            Ok(Self {
                indexed: catalogs::open((catalog, cache_dir), interrupt)?,
                camera: camera.as_deref().map(data_sheet).transpose()?,
                workspaces: Mutex::default(),
            })
        })
    }

    /// Solves an image; `name` stands for the name of its file.
    #[pyo3(signature = (image, name, mask, hints, dark, flat, sigma, max_stars, attitude_only, threads))]
    fn solve(
        &self,
        py: Python<'_>,
        image: Image<'_>,
        name: Option<PathBuf>,
        mask: Option<PyReadonlyArray2<'_, bool>>,
        hints: Hints,
        dark: Option<Image<'_>>,
        flat: Option<Image<'_>>,
        sigma: Option<f64>,
        max_stars: Option<usize>,
        attitude_only: bool,
        threads: NonZeroUsize,
    ) -> PyResult<Solved> {
        let source = image.source()?;
        let bad = bad_pixels(mask.as_ref())?;
        let dark = dark.as_ref().map(Image::source).transpose()?;
        let flat = flat.as_ref().map(Image::source).transpose()?;
        let context = self.context(&hints, attitude_only)?;
        let detect = detect_config(sigma, max_stars);
        let work = |interrupt: &Interrupt| {
            let calibration = self.calibration(dark, flat)?;
            let context = Context {
                detect,
                calibration: calibration.as_ref(),
                ..context
            };
            let name = name.unwrap_or_else(|| source.name());
            let mut workspace = self.workspace(threads, hints.name_odds, interrupt);
            let solution = solve(&name, (source, bad), &context, &mut workspace);
            self.keep(workspace);
            Ok(self.solved(&name, solution?))
        };
        if threads == NonZeroUsize::MIN {
            on_this_thread(py, work)
        } else {
            on_threads(py, threads, work)
        }
    }

    /// Identifies centroids: rows of x, y, brightness and standard error in pixels. `brightness` says
    /// what they have: `flux`, `mag`, or none of them.
    fn identify(
        &self,
        py: Python<'_>,
        centroids: PyReadonlyArray2<'_, f64>,
        shape: [usize; 2],
        brightness: Option<&str>,
        has_errors: bool,
        hints: Hints,
        attitude_only: bool,
    ) -> PyResult<Solved> {
        let rows = centroids.as_slice().map_err(exception)?.as_chunks::<4>().0;
        let [height, width] = shape;
        let centroid = |(rank, &[x, y, value, sigma_px]): (usize, &[f64; 4])| {
            let (mag, flux) = match brightness {
                Some("flux") => (instrumental_mag(value), Some(value)),
                Some(_) => (value, None),
                None => (ListedCentroid::mag_of_rank(rank), None),
            };
            ListedCentroid {
                flux,
                sigma_px: has_errors.then_some(sigma_px),
                row: rank as u64 + 1,
                ..ListedCentroid::new(PixelPoint::new(x, y), mag)
            }
        };
        let list = CentroidList {
            width,
            height,
            photometry: starpipe::identify::Photometry::Instrumental,
            has_brightness: brightness.is_some(),
            centroids: rows.iter().enumerate().map(centroid).collect(),
        };
        let context = self.context(&hints, attitude_only)?;
        on_this_thread(py, |interrupt| {
            let mut workspace = self.workspace(NonZeroUsize::MIN, hints.name_odds, interrupt);
            let solution = solve_centroids(&list, &context, &mut workspace);
            self.keep(workspace);
            Ok(self.solved(Path::new("centroids"), solution))
        })
    }
}

impl Pipeline {
    fn context(&self, hints: &Hints, attitude_only: bool) -> PyResult<Context<'static>> {
        Ok(Context {
            priors: hints.priors()?,
            camera: self.camera.clone().map(|sheet| StatedCamera {
                sheet,
                zenith_distance_deg: hints.zenith_distance_deg,
                extinction: hints.extinction.map(Extinction::MagPerAirmass),
            }),
            attitude_only,
            time_limit: hints
                .time_limit_s
                .and_then(|limit| Duration::try_from_secs_f64(limit).ok()),
            ..Context::new(self.indexed)
        })
    }

    fn calibration(
        &self,
        dark: Option<Source>,
        flat: Option<Source>,
    ) -> PyResult<Option<Calibration>> {
        if dark.is_none() && flat.is_none() {
            return Ok(None);
        }
        let master = |source: Source| {
            let name = source.name();
            let frame = source.frame(&name, None, &mut Buffers::new());
            let frame = frame.map_err(exception)?.into_owned();
            let name = name.display().to_string();
            Ok::<_, PyErr>(Master { name, frame })
        };
        let (dark, flat) = (dark.map(master).transpose()?, flat.map(master).transpose()?);
        let bias_adu = self.camera.as_ref().map_or(0.0, |sheet| sheet.bias_adu);
        let calibration = Calibration::new(dark, flat, None, bias_adu);
        calibration.map(Some).map_err(exception)
    }

    /// Buffers of an earlier frame where there are any.
    fn workspace(&self, threads: NonZeroUsize, name_odds: f64, interrupt: &Interrupt) -> Workspace {
        // In a child process the lock may be held by a thread that does not exist there.
        let kept = self.workspaces.try_lock();
        let kept = kept.ok().and_then(|mut kept| kept.pop());
        let mut workspace = kept.unwrap_or_default();
        workspace.detect = workspace.detect.on_threads(threads);
        workspace.identify = workspace.identify.with_name_odds(name_odds);
        workspace.until(interrupt)
    }

    fn keep(&self, workspace: Workspace) {
        if let Ok(mut kept) = self.workspaces.try_lock() {
            kept.push(workspace);
        }
    }

    fn solved(&self, name: &Path, solution: Solution) -> Solved {
        Solved {
            name: name.display().to_string(),
            solution,
            indexed: self.indexed,
        }
    }
}

/// The library's defaults with what is given.
pub fn detect_config(sigma: Option<f64>, max_stars: Option<usize>) -> DetectConfig {
    DetectConfig {
        threshold_sigma: sigma,
        max_detections: max_stars.unwrap_or(DetectConfig::DEFAULT_MAX_DETECTIONS),
        ..DetectConfig::default()
    }
}

fn solve(
    name: &Path,
    (source, bad): (Source, Option<&[bool]>),
    context: &Context,
    workspace: &mut Workspace,
) -> PyResult<Solution> {
    if matches!(source, Source::Array(_)) && context.calibration.is_none() {
        let frame = source
            .frame(name, bad, &mut workspace.frames)
            .map_err(exception)?;
        return solve_frame(&frame, context, workspace).map_err(exception);
    }
    let read = |buffers: &mut Buffers| Ok(source.frame(name, bad, buffers)?.into_owned());
    let (solution, frame) = solve_read(name, read, context, workspace).map_err(exception)?;
    workspace.frames.recycle(frame);
    Ok(solution)
}
