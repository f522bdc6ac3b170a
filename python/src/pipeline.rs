//! The pipeline: catalogue, camera and buffers that solve frames.

use crate::camera::description;
use crate::catalogs;
use crate::errors::{exception, message, warn};
use crate::input::{Borrowed, Failed, Input};
use crate::interrupt::{on_this_thread, on_threads, useful};
use crate::options::Options;
use crate::solved::Solved;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use starpipe::camera::data_sheet::CameraDescription;
use starpipe::centroids::{CentroidList, ListedCentroid};
use starpipe::detect::DetectError;
use starpipe::frame::{Buffers, RowOrder};
use starpipe::photometry::instrumental_mag;
use starpipe::solve::{self, DeepSky, solve_centroids, solve_frame, solve_guarded, solve_read};
use starpipe::{Context, DetectConfig, IndexedCatalog, Interrupt, PixelPoint, Solution, Workspace};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Solves frames. It may be used by several threads at once.
#[pyclass(frozen, module = "starpipe._starpipe")]
pub struct Pipeline {
    pub indexed: &'static IndexedCatalog<'static>,
    /// For fields that the catalogue is too sparse for.
    deep: Option<&'static DeepSky>,
    camera: Option<CameraDescription>,
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
        let prefix: PathBuf = py.import("sys")?.getattr("prefix")?.extract()?;
        on_threads(py, all, |interrupt| {
            let stated = (catalog, cache_dir);
            let deep = catalogs::deep(&stated, &prefix)?;
            let (catalog, cache_dir) = stated;
            // Deep ones are used beside the built-in one.
            let catalog = catalog.filter(|_| deep.is_none());
            Ok(Self {
                indexed: catalogs::open((catalog, cache_dir), interrupt)?,
                deep,
                camera: camera.as_deref().map(description).transpose()?,
                workspaces: Mutex::default(),
            })
        })
    }

    /// Level without light of the stated camera, in grey levels.
    #[getter]
    fn bias_adu(&self) -> f64 {
        let camera = self.camera.as_ref();
        let sheet = camera.and_then(|camera| camera.sheet.as_ref());
        sheet.map_or(0.0, |sheet| sheet.bias_adu)
    }

    /// Solves a frame. Pixels are those of its rows as stored, or of the picture as drawn.
    fn solve(
        &self,
        py: Python<'_>,
        frame: Input<'_>,
        options: Options,
        threads: NonZeroUsize,
        as_drawn: bool,
    ) -> PyResult<Solved> {
        let input = frame.borrow()?;
        let mut context = self.context(&options)?;
        context.as_stored = !as_drawn;
        context.deep = self.deep;
        let work = |interrupt: &Interrupt| {
            let name = input.name.clone();
            let mut workspace = self.workspace(threads, interrupt);
            let solved = solve_guarded(&name, &mut workspace, |workspace| {
                solve_input(input, context, workspace)
            });
            self.keep(workspace);
            let (solution, row_order) = solved.map_err(|Failed(error)| error)?;
            Ok(self.solved(&name, solution, row_order))
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
        shape: Option<[usize; 2]>,
        brightness: Option<&str>,
        has_errors: bool,
        options: Options,
    ) -> PyResult<Solved> {
        let rows = centroids.as_slice().map_err(exception)?.as_chunks::<4>().0;
        let [height, width] = shape.map_or([None; 2], |shape| shape.map(Some));
        let centroid = |(rank, &[x, y, value, sigma_px]): (usize, &[f64; 4])| {
            let (mag, flux) = match brightness {
                Some("flux") => (instrumental_mag(value), Some(value)),
                Some(_) => (value, None),
                None => (ListedCentroid::mag_of_rank(rank), None),
            };
            let mut listed = ListedCentroid::new(PixelPoint::new(x, y), mag);
            listed.flux = flux;
            listed.sigma_px = has_errors.then_some(sigma_px);
            listed.row = rank as u64 + 1;
            listed
        };
        let list = CentroidList {
            width,
            height,
            photometry: starpipe::identify::Photometry::Instrumental,
            has_brightness: brightness.is_some(),
            centroids: rows.iter().enumerate().map(centroid).collect(),
        };
        let mut context = self.context(&options)?;
        context.deep = self.deep;
        on_this_thread(py, |interrupt| {
            let name = Path::new("centroids");
            let mut workspace = self.workspace(NonZeroUsize::MIN, interrupt);
            let solution = solve_guarded(name, &mut workspace, |workspace| {
                Ok::<_, Failed>(solve_centroids(&list, &context, workspace)?)
            });
            self.keep(workspace);
            let solution = solution.map_err(|Failed(error)| error)?;
            Ok(self.solved(name, solution, None))
        })
    }
}

impl Pipeline {
    pub fn context(&self, options: &Options) -> PyResult<Context<'static>> {
        let context = Context::new(self.indexed);
        Ok(context.with_options(&options.resolve()?, self.camera.clone()))
    }

    /// Buffers of an earlier frame where there are any.
    fn workspace(&self, threads: NonZeroUsize, interrupt: &Interrupt) -> Workspace {
        // In a child process the lock may be held by a thread that does not exist there.
        let kept = self.workspaces.try_lock();
        let kept = kept.ok().and_then(|mut kept| kept.pop());
        let mut workspace = kept.unwrap_or_default();
        workspace.detect = workspace.detect.on_threads(useful(threads));
        workspace.with_interrupt(interrupt)
    }

    fn keep(&self, workspace: Workspace) {
        if let Ok(mut kept) = self.workspaces.try_lock() {
            kept.push(workspace);
        }
    }

    /// A solved frame; errors of deep catalogues are told.
    fn solved(&self, name: &Path, solution: Solution, row_order: Option<RowOrder>) -> Solved {
        for error in self.deep.map(DeepSky::take_errors).unwrap_or_default() {
            warn(&format!("{}; it was not used", message(&error)));
        }
        Solved {
            name: name.display().to_string(),
            solution,
            row_order,
            indexed: self.indexed,
        }
    }
}

/// Solves an input; returns the order of its rows, too, if it is a file.
fn solve_input(
    input: Borrowed,
    context: Context,
    workspace: &mut Workspace,
) -> Result<(Solution, Option<RowOrder>), Failed> {
    let Borrowed {
        name,
        source,
        bad,
        masters,
        ..
    } = input;
    let is_file = source.is_file();
    if masters.is_empty() {
        if !is_file {
            let frame = source.frame(&name, bad, &mut workspace.frames)?;
            let solution = solve_frame(&frame, &context, workspace);
            return Ok((solution.map_err(detect_error(&name))?, None));
        }
        let mut row_order = None;
        let read = |buffers: &mut Buffers| {
            let frame = source.frame(&name, bad, buffers)?;
            row_order = Some(frame.metadata.row_order);
            Ok(frame.into_owned())
        };
        let (solution, frame) = solve_read(&name, read, &context, workspace)?;
        workspace.frames.recycle(frame);
        return Ok((solution, row_order));
    }
    workspace.begin(&context);
    let frame = source
        .frame(&name, bad, &mut workspace.frames)?
        .into_owned();
    let row_order = is_file.then_some(frame.metadata.row_order);
    let calibration = masters.calibration(row_order, &mut workspace.frames);
    let calibration = calibration.map_err(Failed)?;
    let mut context = context;
    context.calibration = calibration.as_ref();
    let (solution, _) = solve_read(&name, |_| Ok(frame), &context, workspace)?;
    Ok((solution, row_order))
}

fn detect_error(name: &Path) -> impl FnOnce(DetectError) -> solve::Error {
    let path = name.to_owned();
    |source| solve::Error::Detect { path, source }
}

/// The library's defaults with what is given.
pub fn detect_config(sigma: Option<f64>, max_stars: Option<usize>) -> DetectConfig {
    let mut config = DetectConfig::default();
    config.threshold_sigma = sigma;
    config.max_detections = max_stars.unwrap_or(DetectConfig::DEFAULT_MAX_DETECTIONS);
    config
}
