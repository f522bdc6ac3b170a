//! A camera and its observing conditions.

use super::parameters::ParameterOptions;
use crate::cli::exit::CommandError;
use anyhow::anyhow;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use starpipe::camera::data_sheet::{DataSheet, Preset};
use starpipe::predict::{Reading, Scenario, ScenarioError};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(crate) struct ScenarioOptions {
    /// Description of the camera, see `starpipe camera new`
    #[arg(long, value_name = "camera.toml", conflicts_with = "preset")]
    pub(crate) camera: Option<PathBuf>,
    /// A built-in camera with its observing conditions
    #[arg(long, value_name = "NAME", value_parser = preset())]
    pub(crate) preset: Option<Preset>,
    /// Which form of the equations [default: paper for experiment-1 and experiment-2, else physical]
    #[arg(long, value_enum)]
    pub(crate) reading: Option<ReadingArg>,
    #[command(flatten)]
    pub(crate) parameters: ParameterOptions,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ReadingArg {
    /// Equations (1) to (12) of Tong, Li & Wang 2014 as their authors used them
    Paper,
    /// The same equations with physical errors corrected
    Physical,
}

impl ScenarioOptions {
    /// The files that are to be read.
    pub(crate) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.camera.iter().chain(self.parameters.files())
    }

    /// The scenario that the options describe, checked.
    pub(crate) fn scenario(&self) -> Result<Scenario, CommandError> {
        let scenario = match self.camera.as_deref() {
            Some(path) => of_camera(path)?,
            None => Scenario::of(self.preset.unwrap_or(Preset::Experiment1)),
        };
        self.applied_to(scenario)
    }

    /// As [`scenario`](Self::scenario), of every built-in camera where none is chosen; each with its
    /// name.
    pub(crate) fn scenarios(&self) -> Result<Vec<(String, Scenario)>, CommandError> {
        let of_preset = |preset: Preset| {
            let scenario = self.applied_to(Scenario::of(preset))?;
            Ok((preset.name().to_owned(), scenario))
        };
        match (&self.camera, self.preset) {
            (Some(_), _) => {
                let scenario = self.scenario()?;
                Ok(vec![(scenario.camera.name.clone(), scenario)])
            }
            (None, Some(preset)) => Ok(vec![of_preset(preset)?]),
            (None, None) => Preset::ALL.into_iter().map(of_preset).collect(),
        }
    }

    fn applied_to(&self, mut scenario: Scenario) -> Result<Scenario, CommandError> {
        match self.reading {
            None => (),
            Some(ReadingArg::Paper) => scenario.reading = Reading::Paper,
            Some(ReadingArg::Physical) => scenario.reading = Reading::Physical,
        }
        self.parameters.apply(&mut scenario)?;
        match (scenario.check(), self.parameters.files().next()) {
            (Ok(()), _) => Ok(scenario),
            // The error is in the curve's file rather than in the options.
            (Err(error), Some(path)) => Err(in_file(error, path)),
            (Err(error), None) => Err(CommandError::usage(error)),
        }
    }
}

/// The camera in a file under the default conditions.
fn of_camera(path: &Path) -> Result<Scenario, CommandError> {
    let scenario = Scenario::new(DataSheet::read(path)?);
    let checked = scenario.check().map_err(|error| in_file(error, path));
    checked.map(|()| scenario)
}

/// The error, with the file that caused it.
pub(crate) fn in_file(error: ScenarioError, path: &Path) -> CommandError {
    anyhow!(error).context(path.display().to_string()).into()
}

/// Parses the name of a built-in camera.
pub(crate) fn preset() -> impl TypedValueParser<Value = Preset> {
    let names = Preset::ALL.map(|preset| PossibleValue::new(preset.name()).help(preset.about()));
    PossibleValuesParser::new(names).try_map(|name| Preset::named(&name).ok_or("no such preset"))
}
