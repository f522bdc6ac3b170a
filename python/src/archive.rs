//! Tables of many frames: what workers need that write them wherever they are kept.

use crate::errors::{exception, guarded, json};
use crate::options::Options;
use crate::pipeline::Pipeline;
use crate::solved::Solved;
use bytes::Bytes;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use starpipe::base::table::{FieldValue, TableRow};
use starpipe::report::{FrameReport, StarRow};
use starpipe::store::{
    self, Configuration, FileHash, FrameRow, Identity, Nights, PartTables, Plan,
};
use std::num::NonZeroUsize;

/// What is stated for all frames.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Stated {
    options: Options,
    /// The content of the camera's description.
    camera: Option<Vec<u8>>,
    /// A number, or `all`.
    page: Option<String>,
}

/// The names of an archive's parts, and what each is of.
#[pyclass(frozen, get_all, module = "starpipe._starpipe")]
pub struct ArchivePlan {
    /// The content of `archive.json`.
    identity: String,
    /// All names, sorted.
    names: Vec<String>,
    /// Name of each part's files, and where its frames begin and end among the names.
    parts: Vec<(String, usize, usize)>,
}

/// Cuts the frames with these names into parts.
#[pyfunction]
#[pyo3(signature = (names, frames_per_part, pipeline, stated))]
pub fn archive_plan(
    names: Vec<String>,
    frames_per_part: NonZeroUsize,
    pipeline: &Pipeline,
    stated: Stated,
) -> PyResult<ArchivePlan> {
    let plan = Plan::new(names, frames_per_part).map_err(exception)?;
    let configuration = Configuration {
        catalog: pipeline.indexed.catalog().into(),
        options: stated.options.resolve()?,
        camera: stated.camera.as_deref().map(FileHash::of),
        page: stated.page,
        ..Configuration::default()
    };
    let identity = Identity::new(&plan, &configuration).map_err(exception)?;
    let mut first = 0;
    let parts = plan.parts().map(|part| {
        let begin = first;
        first += part.names.len();
        (part.file_name(identity.text()), begin, first)
    });
    Ok(ArchivePlan {
        parts: parts.collect(),
        identity: identity.text().to_owned(),
        names: plan.names().to_vec(),
    })
}

/// Where two contents of `archive.json` differ: a text for each value.
#[pyfunction]
pub fn archive_differences(found: &str, wanted: &str) -> PyResult<Vec<String>> {
    let damaged = || PyValueError::new_err("archive.json is damaged");
    let read = |text| Identity::read(text).ok_or_else(damaged);
    Ok(read(found)?.differences(&read(wanted)?))
}

/// The rows of a part.
#[pyclass(module = "starpipe._starpipe")]
pub struct PartRows(Option<PartTables<Vec<u8>>>);

#[pymethods]
impl PartRows {
    #[new]
    fn new() -> PyResult<Self> {
        let tables = PartTables::new([Vec::new(), Vec::new()]);
        Ok(Self(Some(tables.map_err(exception)?)))
    }

    /// Adds a solved frame and its stars; returns its status.
    fn add(&mut self, solved: &Solved) -> PyResult<String> {
        guarded(|| self.add_solved(solved))
    }

    /// Adds a frame that could not be read.
    fn add_unread(&mut self, name: &str, reason: String) -> PyResult<()> {
        let row = FrameRow::unread(name, reason);
        self.tables()?.add(row, []).map_err(exception)
    }

    /// The files of frames and of stars, and of their checksums.
    fn finish<'py>(&mut self, py: Python<'py>) -> PyResult<[Bound<'py, PyBytes>; 3]> {
        let tables = self.0.take().ok_or_else(finished)?;
        let [frames, stars] = tables.finish().map_err(exception)?;
        let checksums = store::checksums(&frames, &stars);
        Ok([&frames[..], &stars, checksums.as_bytes()].map(|file| PyBytes::new(py, file)))
    }
}

impl PartRows {
    fn add_solved(&mut self, solved: &Solved) -> PyResult<String> {
        let catalog = solved.indexed.catalog();
        let report = FrameReport::new(&solved.name, &solved.solution, catalog);
        let frame = FrameRow::new(&report, &solved.solution);
        let status = frame.status.clone();
        let added = self.tables()?.add(frame, StarRow::of_frame(&report));
        added.map_err(exception)?;
        Ok(status)
    }

    fn tables(&mut self) -> PyResult<&mut PartTables<Vec<u8>>> {
        self.0.as_mut().ok_or_else(finished)
    }
}

fn finished() -> PyErr {
    PyValueError::new_err("the part is finished")
}

/// Name, type, unit, UCD and description of each column of stars.
#[pyfunction]
pub fn star_columns() -> Vec<[&'static str; 5]> {
    let columns = StarRow::columns().into_iter();
    let described = columns.map(|column| {
        let meaning = column.meaning;
        let kind = match column.empty {
            FieldValue::Text(_) => "text",
            _ => "number",
        };
        [
            column.name,
            kind,
            meaning.unit,
            meaning.ucd,
            meaning.description,
        ]
    });
    described.collect()
}

/// What each camera saw in each night, as JSON; `parts` are the contents of the tables of frames.
#[pyfunction]
pub fn archive_nights(parts: &Bound<'_, PyAny>) -> PyResult<String> {
    let mut nights = Nights::default();
    for part in parts.try_iter()? {
        let content: Vec<u8> = part?.extract()?;
        nights.add(Bytes::from(content)).map_err(exception)?;
    }
    json(&nights.finish())
}
