//! A camera and its conditions.

use super::parameters::ParameterOptions;
use crate::cli::exit::CommandError;
use anyhow::{Context, anyhow};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use starpipe::camera::data_sheet::{DataSheet, Preset};
use starpipe::model::sensitivity::{Reading, Scenario, ScenarioError};
use std::path::{Path, PathBuf};

/// A camera and its conditions.
#[derive(Debug, Args)]
pub(crate) struct ScenarioOptions {
    /// Camera, as `starpipe camera new` writes one
    #[arg(long, value_name = "camera.toml", conflicts_with = "preset")]
    pub(crate) camera: Option<PathBuf>,
    /// A camera that is built in, and its conditions
    #[arg(long, value_name = "NAME", value_parser = preset())]
    pub(crate) preset: Option<Preset>,
    /// Which equations [default: as the paper has them for its experiments, else physical]
    #[arg(long, value_enum)]
    pub(crate) reading: Option<ReadingArg>,
    #[command(flatten)]
    pub(crate) parameters: ParameterOptions,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ReadingArg {
    /// Equations (1) to (12) of Tong, Li & Wang 2014 as their authors used them
    Paper,
    /// The same budget with the physics put right
    Physical,
}

impl ScenarioOptions {
    /// The files that are read.
    pub(crate) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.camera.iter().chain(self.parameters.files())
    }

    /// The scenario that is asked for, in which every value makes sense.
    pub(crate) fn scenario(&self) -> Result<Scenario, CommandError> {
        let mut scenario = match self.camera.as_deref() {
            Some(path) => described(path)?,
            None => Scenario::of(self.preset.unwrap_or(Preset::Experiment1)),
        };
        match self.reading {
            None => (),
            Some(ReadingArg::Paper) => scenario.reading = Reading::Paper,
            Some(ReadingArg::Physical) => scenario.reading = Reading::Physical,
        }
        self.parameters
            .apply(&mut scenario)
            .map_err(anyhow::Error::from)?;
        scenario
            .check()
            .map_err(|error| match self.parameters.files().next() {
                // A curve that goes with nothing else is a fault of its file.
                Some(path) => anyhow!(error).context(path.display().to_string()).into(),
                None => usage(&error),
            })?;
        Ok(scenario)
    }
}

/// The camera in a file under the default conditions.
fn described(path: &Path) -> anyhow::Result<Scenario> {
    let scenario = Scenario::new(DataSheet::read(path)?);
    // What a file says is a fault of the file, not of the options.
    scenario
        .check()
        .with_context(|| path.display().to_string())?;
    Ok(scenario)
}

pub(crate) fn usage(error: &ScenarioError) -> CommandError {
    CommandError::Usage(error.to_string())
}

/// A preset by its name.
pub(crate) fn preset() -> impl TypedValueParser<Value = Preset> {
    let names = Preset::ALL.map(|preset| PossibleValue::new(preset.name()).help(preset.about()));
    PossibleValuesParser::new(names).try_map(|name| Preset::named(&name).ok_or("no such preset"))
}
