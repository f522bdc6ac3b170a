//! `run.json`: which run a directory holds, by all that its tables depend on.

use super::error::StoreError;
use crate::base::differences::differences;
use crate::base::files;
use crate::camera::data_sheet::Response;
use crate::catalog::Catalog;
use crate::lab::simulate::SetupParameter;
use crate::lab::validation::ValidationProtocol;
use crate::predict::Reading;
use serde::Serialize;
use serde_json::{Map, Value};
use std::io::{self, ErrorKind, Write};
use std::path::Path;

const FILE: &str = "run.json";
/// Version of the tables and of `run.json`.
const SCHEMA: u32 = 3;
/// Files that a run writes.
const TABLES: [&str; 4] = ["frames.csv", "stars.csv", "frames.parquet", "stars.parquet"];

#[derive(Serialize)]
struct RunIdentity<'a> {
    schema: u32,
    version: &'static str,
    seed: u64,
    scale_known: bool,
    site: Option<[f64; 3]>,
    camera: &'a str,
    reading: Reading,
    spot_form: &'a str,
    projection: &'a str,
    mirrored: bool,
    parameters: Map<String, Value>,
    /// Wavelengths in nm and values, if it is a curve.
    lens_transmission_curve: Option<&'a [(f64, f64)]>,
    quantum_efficiency_curve: Option<&'a [(f64, f64)]>,
    catalog: RunCatalog<'a>,
}

#[derive(Serialize)]
struct RunCatalog<'a> {
    title: &'a str,
    stars: usize,
    checksum: String,
}

/// Makes `directory` that of a run. One that already holds this very run is continued.
///
/// # Errors
/// [`StoreError::OtherRun`], [`StoreError::UnknownRun`], [`StoreError::File`],
/// [`StoreError::Json`].
pub fn claim_directory(
    directory: &Path,
    protocol: &ValidationProtocol,
    catalog: &Catalog,
) -> Result<(), StoreError> {
    std::fs::create_dir_all(directory)
        .map_err(StoreError::file("making the directory", directory))?;
    let path = directory.join(FILE);
    let json_error = |source| StoreError::Json {
        path: path.clone(),
        source,
    };
    let wanted = identity(protocol, catalog).map_err(json_error)?;
    let text = match std::fs::read_to_string(&path) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            refuse_unknown_tables(directory)?;
            return write(&path, &wanted).map_err(StoreError::file("writing", &path));
        }
        read => read.map_err(StoreError::file("reading", &path))?,
    };
    let found: Value = serde_json::from_str(&text).map_err(json_error)?;
    let differences = differences(&found, &wanted);
    if differences.is_empty() {
        return Ok(());
    }
    Err(StoreError::OtherRun {
        directory: directory.to_owned(),
        differences: differences.join(", "),
    })
}

fn write(path: &Path, identity: &Value) -> io::Result<()> {
    let mut file = files::beside(path)?;
    file.write_all(format!("{identity:#}\n").as_bytes())?;
    file.persist(path)?;
    Ok(())
}

fn identity(protocol: &ValidationProtocol, catalog: &Catalog) -> Result<Value, serde_json::Error> {
    let scenario = &protocol.setup.scenario;
    let imperfections = &scenario.camera.imperfections;
    let parameters = SetupParameter::all().filter_map(|parameter| {
        let value = parameter.get(&protocol.setup)?;
        Some((parameter.name().to_owned(), Value::from(value)))
    });
    let identity = RunIdentity {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        seed: protocol.seed,
        scale_known: protocol.scale_known,
        site: protocol
            .site
            .map(|site| [site.lat_deg(), site.lon_deg(), site.height_m()]),
        camera: &scenario.camera.name,
        reading: scenario.reading,
        spot_form: imperfections.spot_form.name(),
        projection: imperfections.projection.name(),
        mirrored: imperfections.mirrored,
        parameters: parameters.collect(),
        lens_transmission_curve: curve(&scenario.camera.lens_transmission),
        quantum_efficiency_curve: curve(&scenario.camera.quantum_efficiency),
        catalog: RunCatalog {
            title: catalog.title(),
            stars: catalog.stars().len(),
            checksum: format!("{:016x}", catalog.checksum()),
        },
    };
    // Written and read, so that numbers have the same digits as those of a file.
    serde_json::from_str(&serde_json::to_string(&identity)?)
}

fn curve(response: &Response) -> Option<&[(f64, f64)]> {
    match response {
        Response::Table(points) => Some(points),
        Response::Constant(_) => None,
    }
}

/// Tables of an unknown run must not be overwritten.
fn refuse_unknown_tables(directory: &Path) -> Result<(), StoreError> {
    match TABLES.iter().find(|name| directory.join(name).exists()) {
        Some(&name) => Err(StoreError::UnknownRun {
            directory: directory.to_owned(),
            name,
        }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;
    use crate::lab::simulate::{Scene, Setup};
    use crate::predict::Scenario;

    #[test]
    fn a_directory_is_of_one_run() {
        let directory = tempfile::tempdir().unwrap();
        let mut protocol = ValidationProtocol {
            site: None,
            setup: Setup {
                scenario: Scenario::of(Preset::NanosatTracker),
                scene: Scene::default(),
            },
            scale_known: true,
            seed: u64::MAX,
        };
        let claim = |protocol: &ValidationProtocol| {
            claim_directory(directory.path(), protocol, Catalog::built_in())
        };
        claim(&protocol).unwrap();
        claim(&protocol).unwrap();
        protocol.seed = 1;
        protocol.setup.scenario.conditions.exposure_s = 0.7;
        let message = claim(&protocol).unwrap_err().to_string();
        assert!(
            message.contains("exposure_s is 0.1 there and 0.7 here, seed is 18446744073709551615 there and 1 here"),
            "{message}"
        );
    }

    #[test]
    fn tables_of_an_unknown_run_are_left_alone() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("stars.csv"), "").unwrap();
        let error = refuse_unknown_tables(directory.path()).unwrap_err();
        assert!(matches!(
            error,
            StoreError::UnknownRun {
                name: "stars.csv",
                ..
            }
        ));
    }
}
