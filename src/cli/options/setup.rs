//! Options for simulated frames: a camera, its conditions, and the scene, with an option for every
//! number.

use super::parameters::{number_option, within_limits};
use super::scenario::{ScenarioOptions, in_file};
use crate::cli::exit::CommandError;
use clap::{Arg, ArgAction, ArgGroup, ArgMatches, Args, Command, Error, FromArgMatches};
use starpipe::base::format::five_digits as number;
use starpipe::camera::Projection;
use starpipe::camera::data_sheet::SpotForm;
use starpipe::lab::simulate::{Scene, Setup, SetupParameter};
use starpipe::predict::{Scenario, ScenarioError};

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("simulated").args(["camera", "preset"]).required(true))]
pub(crate) struct SetupOptions {
    #[command(flatten)]
    scenario: ScenarioOptions,
    #[command(flatten)]
    scene: SceneOptions,
}

impl SetupOptions {
    /// The setup that the options describe, checked.
    pub(crate) fn setup(&self) -> Result<Setup, CommandError> {
        self.applied_to(self.scenario.scenario()?)
    }

    /// As [`setup`](Self::setup), with every built-in camera where none is chosen; each with its
    /// name.
    pub(crate) fn setups(&self) -> Result<Vec<(String, Setup)>, CommandError> {
        let scenarios = self.scenario.scenarios()?.into_iter();
        scenarios
            .map(|(name, scenario)| Ok((name, self.applied_to(scenario)?)))
            .collect()
    }

    fn applied_to(&self, scenario: Scenario) -> Result<Setup, CommandError> {
        let mut setup = Setup::new(scenario);
        self.scene.apply(&mut setup);
        setup.check().map_err(|error| self.cause(error))?;
        Ok(setup)
    }

    /// The error, with the camera's file if no option can be the cause.
    fn cause(&self, error: ScenarioError) -> CommandError {
        match &self.scenario.camera {
            Some(path) if self.scenario.parameters.is_empty() && self.scene.is_empty() => {
                in_file(error, path)
            }
            _ => CommandError::usage(error),
        }
    }
}

/// The options given of the scene and of the camera's imperfections: those beyond the scenario's
/// parameters.
#[derive(Debug, Clone)]
pub(crate) struct SceneOptions {
    numbers: Vec<(SetupParameter, f64)>,
    spot_form: Option<SpotForm>,
    projection: Option<Projection>,
    mirrored: bool,
}

impl SceneOptions {
    fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    fn apply(&self, setup: &mut Setup) {
        for (parameter, value) in &self.numbers {
            parameter.set(setup, *value);
        }
        let imperfections = &mut setup.scenario.camera.imperfections;
        imperfections.spot_form = self.spot_form.unwrap_or(imperfections.spot_form);
        imperfections.projection = self.projection.unwrap_or(imperfections.projection);
        imperfections.mirrored |= self.mirrored;
    }
}

const SPOT_FORM: &str = "spot_form";
const PROJECTION: &str = "projection";
const MIRRORED: &str = "mirrored";
const CAMERA_HEADING: &str = "Imperfections of the camera";

impl clap::Args for SceneOptions {
    fn augment_args(command: Command) -> Command {
        let forms = SpotForm::ALL.map(SpotForm::name).join("|");
        let spot_form = Arg::new(SPOT_FORM)
            .long("spot-form")
            .value_name(forms.clone())
            .help("Form of a star's spot: integrated or sampled Gaussian, or a uniform disc [default: the camera's]")
            .help_heading(CAMERA_HEADING)
            .value_parser(move |text: &str| {
                SpotForm::named(text).ok_or_else(|| format!("expected {forms}"))
            });
        let projections = Projection::ALL.map(Projection::name).join("|");
        let projection = Arg::new(PROJECTION)
            .long(PROJECTION)
            .value_name(projections.clone())
            .help("Projection of the ideal lens closest to the camera's [default: the camera's]")
            .help_heading(CAMERA_HEADING)
            .value_parser(move |text: &str| {
                Projection::named(text).ok_or_else(|| format!("expected {projections}"))
            });
        let mirrored = Arg::new(MIRRORED)
            .long("mirrored")
            .help("Reverse the image from left to right")
            .help_heading(CAMERA_HEADING)
            .action(ArgAction::SetTrue);
        let numbers = SetupParameter::beyond_scenario().map(option);
        command
            .args([spot_form, projection, mirrored])
            .args(numbers)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for SceneOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let given = |parameter: SetupParameter| {
            let value = matches.get_one::<f64>(parameter.name())?;
            Some((parameter, *value))
        };
        Ok(Self {
            numbers: SetupParameter::beyond_scenario()
                .filter_map(given)
                .collect(),
            spot_form: matches.get_one::<SpotForm>(SPOT_FORM).copied(),
            projection: matches.get_one::<Projection>(PROJECTION).copied(),
            mirrored: matches.get_flag(MIRRORED),
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

fn option(parameter: SetupParameter) -> Arg {
    let limits = parameter.limits();
    let (heading, default) = match parameter {
        SetupParameter::Scene(key) => {
            let default = (key.get)(&Scene::default());
            let default = default.map(|value| format!(" [default: {}]", number(value)));
            ("Scene", default.unwrap_or_default())
        }
        _ => (CAMERA_HEADING, " [default: the camera's]".to_owned()),
    };
    number_option(parameter.name(), parameter.about(), limits, &default)
        .help_heading(heading)
        .value_parser(move |text: &str| within_limits(text, limits))
}
