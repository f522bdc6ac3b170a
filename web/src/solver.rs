//! Photographs: the pipeline, and what is made of its result.

use crate::equipment::Equipment;
use crate::{catalogs, options, progress, told};
use serde::Deserialize;
use starpipe::frame::{self, Buffers, Colors, Pages};
use starpipe::report::overlay::{self, OverlayFormat, OverlayOptions, Rings, Shown, SkyLayers};
use starpipe::report::{page, wcs};
use starpipe::solve::{self, Stage};
use starpipe::{Catalog, Context, Frame, FrameReport, IndexedCatalog, Solution, Workspace};
use std::num::NonZeroUsize;
use std::path::Path;
use wasm_bindgen::prelude::*;

/// Width of a preview, in pixels.
const PREVIEW_PX: usize = 1000;

/// A catalog with its index, and buffers.
#[wasm_bindgen]
pub struct Solver {
    catalog: &'static Catalog,
    indexed: IndexedCatalog<'static>,
    is_built: bool,
    /// Whether its answers are provisional.
    is_provisional: bool,
    workspace: Workspace,
}

#[wasm_bindgen]
impl Solver {
    /// The whole catalog with the index in these bytes; without bytes, or with damaged ones, it is
    /// indexed anew.
    ///
    /// # Errors
    /// Before the catalog was given.
    #[wasm_bindgen(constructor)]
    pub fn new(index: Option<Vec<u8>>) -> Result<Self, JsError> {
        let catalog = catalogs::whole()?;
        let kept = index.and_then(|bytes| IndexedCatalog::with_index_bytes(catalog, bytes).ok());
        let is_built = kept.is_none();
        let build = || IndexedCatalog::build(catalog, &|share| progress("index", share));
        Ok(Self {
            catalog,
            indexed: kept.unwrap_or_else(build),
            is_built,
            is_provisional: false,
            workspace: Workspace::new(),
        })
    }

    /// The stars to V = 6.5 with their index, which is built in a fraction of a second: for a provisional
    /// answer, of the pointing alone.
    pub fn of_bright_stars() -> Self {
        let catalog = catalogs::bright();
        Self {
            catalog,
            indexed: IndexedCatalog::build(catalog, &|_| ()),
            is_built: true,
            is_provisional: true,
            workspace: Workspace::new(),
        }
    }

    /// The index, to be kept, if it was built here.
    pub fn built_index(&self) -> Option<Vec<u8>> {
        self.is_built.then(|| self.indexed.index_bytes())
    }

    /// Solves the frame in the file with this content and name.
    ///
    /// # Errors
    /// A file that is no frame, or options that are none.
    pub fn solve(
        &mut self,
        bytes: Vec<u8>,
        name: &str,
        options: &str,
        equipment: &Equipment,
    ) -> Result<Solved, JsError> {
        let (options, image) = options::resolve(options)?;
        let on_stage = |stage: Stage| progress(stage_name(stage), 1.0);
        let camera = equipment.camera.clone();
        let mut context = Context::new(&self.indexed).with_options(&options, camera);
        context.measure_known_sky = true;
        context.attitude_only |= self.is_provisional;
        context.calibration = equipment.calibration.as_ref();
        context.on_stage = Some(&on_stage);
        let path = Path::new(name);
        let read = |buffers: &mut Buffers| {
            let decoded = frame::decode_page_with(&bytes, image, buffers);
            decoded.map_err(|error| error.in_file(path))
        };
        let solved = solve::solve_read(path, read, &context, &mut self.workspace);
        let (solution, frame) = solved.map_err(told)?;
        let report = FrameReport::new(name, &solution, self.catalog);
        Ok(Solved {
            catalog: self.catalog,
            bytes,
            frame,
            solution,
            report,
        })
    }
}

fn stage_name(stage: Stage) -> &'static str {
    match stage {
        Stage::Read => "read",
        Stage::Detect => "detect",
        Stage::Pointing => "pointing",
        Stage::Naming => "naming",
        Stage::Identify => "identify",
        Stage::Photometry => "photometry",
        _ => "other",
    }
}

/// A solved frame.
#[wasm_bindgen]
pub struct Solved {
    catalog: &'static Catalog,
    bytes: Vec<u8>,
    frame: Frame<'static>,
    solution: Solution,
    report: FrameReport,
}

/// The layers of an annotated picture.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Layers {
    all_rings: bool,
    constellations: bool,
    deep_sky: bool,
    equatorial: bool,
    horizontal: bool,
}

#[wasm_bindgen]
impl Solved {
    /// The report, as `starpipe process --format json` prints it.
    ///
    /// # Errors
    /// None that occur.
    pub fn json(&self) -> Result<String, JsError> {
        self.report.to_json_line().map_err(told)
    }

    /// The detections as a table.
    ///
    /// # Errors
    /// None that occur.
    pub fn csv(&self) -> Result<String, JsError> {
        self.report.to_csv(true).map_err(told)
    }

    /// The world coordinates as a FITS header, where the frame is identified.
    pub fn wcs(&self) -> Option<Vec<u8>> {
        wcs::header(&self.report.frame, &self.solution)
    }

    /// The annotated picture as PNG, with the layers that this JSON names.
    ///
    /// # Errors
    /// JSON that is none.
    pub fn overlay(&self, layers: &str) -> Result<Vec<u8>, JsError> {
        let layers: Layers = serde_json::from_str(layers).map_err(told)?;
        let mut options = OverlayOptions::default();
        options.format = OverlayFormat::Png;
        if layers.all_rings {
            options.rings = Rings::All;
        }
        let mut sky = SkyLayers::default();
        sky.constellations = layers.constellations;
        sky.deep_sky = layers.deep_sky;
        sky.equatorial_grid = layers.equatorial;
        sky.horizontal_grid = layers.horizontal;
        options.sky = sky;
        let draw =
            |shown: &Shown<'_>| overlay::encoded(shown, &self.solution, self.catalog, &options);
        self.shown(draw).map_err(told)
    }

    /// The page of `starpipe process --html`.
    ///
    /// # Errors
    /// None that occur.
    pub fn html(&self) -> Result<String, JsError> {
        let options = OverlayOptions::default();
        let draw = |shown: &Shown<'_>| {
            page::html(
                &self.report,
                &self.solution,
                self.catalog,
                Some(shown),
                &options,
            )
        };
        self.shown(draw).map_err(told)
    }

    /// Elements and data of that page, for a page that has its style and script.
    ///
    /// # Errors
    /// None that occur.
    pub fn view(&self) -> Result<Vec<String>, JsError> {
        let options = OverlayOptions::default();
        let draw = |shown: &Shown<'_>| {
            page::view(&self.report, &self.solution, self.catalog, shown, &options)
        };
        let view = self.shown(draw).map_err(told)?;
        Ok(vec![view.html, view.data])
    }

    /// What `draw` makes of the frame in its colors.
    fn shown<T>(&self, draw: impl FnOnce(&Shown<'_>) -> T) -> T {
        let colors = Colors::decode(&self.bytes, &self.frame, &mut Buffers::new());
        let mut shown = Shown::new(&self.report.frame, &self.frame);
        shown.colors = colors.as_ref();
        draw(&shown)
    }
}

/// How many images are in a file.
///
/// # Errors
/// A file without an image.
#[wasm_bindgen]
pub fn image_count(bytes: Vec<u8>) -> Result<usize, JsError> {
    let pages = Pages::from_bytes(bytes, &mut Buffers::new()).map_err(told)?;
    Ok(pages.count())
}

/// The frame in a file that browsers cannot show, as JPEG: its image of this number from 1, or its main one.
///
/// # Errors
/// A file that is no frame.
#[wasm_bindgen]
pub fn preview(bytes: &[u8], name: &str, image: Option<usize>) -> Result<Vec<u8>, JsError> {
    let image = image.and_then(NonZeroUsize::new);
    let decoded = frame::decode_page_with(bytes, image, &mut Buffers::new());
    let frame = decoded.map_err(|error| told(error.in_file(Path::new(name))))?;
    page::preview(&frame, PREVIEW_PX).map_err(told)
}
