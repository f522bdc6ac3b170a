//! `run.json`: which run a directory holds, by all that its tables depend on.

use super::ValidationProtocol;
use crate::camera::data_sheet::Response;
use crate::catalog::Catalog;
use crate::lab::simulate::SetupParameter;
use crate::predict::Reading;
use crate::store::{CatalogIdentity, Identity, RunFiles, StoreError, claim};
use serde::Serialize;
use serde_json::{Map, Value};
use std::path::Path;

const FILES: RunFiles = RunFiles {
    identity: "run.json",
    results: &["frames.csv", "stars.csv", "frames.parquet", "stars.parquet"],
};
/// Version of the tables and of `run.json`.
const SCHEMA: u32 = 3;

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
    catalog: CatalogIdentity,
}

/// Makes `directory` that of a run. One that already holds this very run is continued.
///
/// # Errors
/// As for [`claim`].
pub fn claim_directory(
    directory: &Path,
    protocol: &ValidationProtocol,
    catalog: &Catalog,
) -> Result<(), StoreError> {
    // A damaged `run.json` is refused: nothing in the tables tells whose they are.
    claim(directory, FILES, &identity(protocol, catalog)?, || false)?;
    Ok(())
}

fn identity(protocol: &ValidationProtocol, catalog: &Catalog) -> Result<Identity, StoreError> {
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
        catalog: catalog.into(),
    };
    Identity::unsealed(&identity)
}

fn curve(response: &Response) -> Option<&[(f64, f64)]> {
    match response {
        Response::Table(points) => Some(points),
        Response::Constant(_) => None,
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
            message.contains("exposure_s was 0.1, now 0.7, seed was 18446744073709551615, now 1"),
            "{message}"
        );
    }
}
