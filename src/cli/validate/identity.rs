//! Which run a directory holds: all that its tables follow from.

use crate::cli::exit::CommandError;
use crate::cli::output::files::write_whole;
use anyhow::Context;
use serde::Serialize;
use serde_json::{Map, Value};
use starpipe::camera::data_sheet::Response;
use starpipe::model::sensitivity::Reading;
use starpipe::model::simulate::Parameter;
use starpipe::sky::catalog::Catalog;
use starpipe::study::validation::Protocol;
use std::io::ErrorKind;
use std::path::Path;

/// The file that tells.
const FILE: &str = "run.json";
/// Version of the tables and of this file.
const SCHEMA: u32 = 1;

#[derive(Serialize)]
struct Identity<'a> {
    schema: u32,
    version: &'static str,
    seed: u64,
    scale_known: bool,
    camera: &'a str,
    reading: Reading,
    spot_form: &'a str,
    mirrored: bool,
    parameters: Map<String, Value>,
    /// Wavelengths in nm and values, of curves.
    lens_transmission_curve: Option<&'a [(f64, f64)]>,
    quantum_efficiency_curve: Option<&'a [(f64, f64)]>,
    catalog: CatalogIdentity<'a>,
}

#[derive(Serialize)]
struct CatalogIdentity<'a> {
    title: &'a str,
    stars: usize,
    checksum: String,
}

/// Makes `directory` that of this run, or goes on with it where it already is.
pub(super) fn claim(
    directory: &Path,
    protocol: &Protocol,
    catalog: &Catalog,
) -> Result<(), CommandError> {
    std::fs::create_dir_all(directory)
        .with_context(|| format!("making the directory {}", directory.display()))?;
    let path = directory.join(FILE);
    let wanted = identity(protocol, catalog)?;
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == ErrorKind::NotFound => {
            refuse_foreign_tables(directory)?;
            let text = serde_json::to_string_pretty(&wanted).context("writing JSON")? + "\n";
            return Ok(write_whole(&[(path, text.into_bytes())])?);
        }
        Err(error) => {
            return Err(anyhow::Error::from(error)
                .context(format!("reading {}", path.display()))
                .into());
        }
    };
    let found: Value =
        serde_json::from_str(&text).with_context(|| format!("reading {}", path.display()))?;
    let mut differences = Vec::new();
    compare("", &found, &wanted, &mut differences);
    if differences.is_empty() {
        return Ok(());
    }
    Err(CommandError::Usage(format!(
        "{} holds another run: {}; choose another directory for --out",
        directory.display(),
        differences.join(", ")
    )))
}

fn identity(protocol: &Protocol, catalog: &Catalog) -> anyhow::Result<Value> {
    let scenario = &protocol.setup.scenario;
    let imperfections = &scenario.camera.imperfections;
    let parameters = Parameter::all().filter_map(|parameter| {
        let value = parameter.get(&protocol.setup)?;
        Some((parameter.name().to_owned(), Value::from(value)))
    });
    let identity = Identity {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        seed: protocol.seed,
        scale_known: protocol.scale_known,
        camera: &scenario.camera.name,
        reading: scenario.reading,
        spot_form: imperfections.spot_form.name(),
        mirrored: imperfections.mirrored,
        parameters: parameters.collect(),
        lens_transmission_curve: curve(&scenario.camera.lens_transmission),
        quantum_efficiency_curve: curve(&scenario.camera.quantum_efficiency),
        catalog: CatalogIdentity {
            title: catalog.title(),
            stars: catalog.stars().len(),
            checksum: format!("{:016x}", catalog.checksum()),
        },
    };
    // As it is read again: numbers have the same digits then.
    let text = serde_json::to_string(&identity).context("writing JSON")?;
    serde_json::from_str(&text).context("writing JSON")
}

fn curve(response: &Response) -> Option<&[(f64, f64)]> {
    match response {
        Response::Table(points) => Some(points),
        Response::Constant(_) => None,
    }
}

/// Tables without a run that they are of are not starpipe's to write over.
fn refuse_foreign_tables(directory: &Path) -> Result<(), CommandError> {
    for name in ["frames.csv", "stars.csv", "frames.parquet", "stars.parquet"] {
        if directory.join(name).exists() {
            return Err(CommandError::Usage(format!(
                "{} has {name} and no {FILE}, which would tell what run it is of; choose another directory for --out",
                directory.display()
            )));
        }
    }
    Ok(())
}

/// Lists where two objects differ.
fn compare(name: &str, found: &Value, wanted: &Value, into: &mut Vec<String>) {
    let (Value::Object(found), Value::Object(wanted)) = (found, wanted) else {
        if found != wanted {
            into.push(format!("{name} is {found} there and {wanted} here"));
        }
        return;
    };
    let mut keys: Vec<&String> = found.keys().chain(wanted.keys()).collect();
    keys.sort();
    keys.dedup();
    for key in keys {
        let of = |object: &Map<String, Value>| object.get(key).cloned().unwrap_or(Value::Null);
        compare(key, &of(found), &of(wanted), into);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use starpipe::camera::data_sheet::Preset;
    use starpipe::model::sensitivity::Scenario;
    use starpipe::model::simulate::{Scene, Setup};

    #[test]
    fn a_directory_is_of_one_run() {
        let directory = tempfile::tempdir().unwrap();
        let catalog = Catalog::built_in();
        let mut protocol = Protocol {
            setup: Setup {
                scenario: Scenario::of(Preset::NanosatTracker),
                scene: Scene::default(),
            },
            scale_known: true,
            seed: u64::MAX,
        };
        let claimed = |protocol: &Protocol| match claim(directory.path(), protocol, catalog) {
            Ok(()) => String::new(),
            Err(CommandError::Usage(message)) => message,
            Err(CommandError::Failed(error)) => panic!("{error:#}"),
        };
        assert_eq!(claimed(&protocol), "");
        assert_eq!(claimed(&protocol), "");
        protocol.seed = 1;
        protocol.setup.scenario.conditions.exposure_s = 0.7;
        let message = claimed(&protocol);
        assert!(
            message.contains("exposure_s is 0.1 there and 0.7 here, seed is 18446744073709551615 there and 1 here"),
            "{message}"
        );
    }
}
