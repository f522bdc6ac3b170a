//! What is simulated, as it is typed: a camera, its conditions, and the scene, with an option for every number.

use super::Fault;
use super::args::{ReadingArg, preset};
use super::limit::{ParameterArgs, number, scenario_of};
use anyhow::anyhow;
use clap::{Arg, ArgAction, ArgGroup, ArgMatches, Args, Command, Error, FromArgMatches};
use starpipe::camera::data_sheet::{Preset, SpotForm};
use starpipe::model::sensitivity::ScenarioError;
use starpipe::model::simulate::{Parameter, Scene, Setup};
use std::path::PathBuf;

/// What is simulated.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("simulated").args(["camera", "preset"]).required(true))]
pub(crate) struct SetupArgs {
    /// Camera to simulate, as `starpipe camera new` writes one
    #[arg(long, value_name = "camera.toml")]
    pub(crate) camera: Option<PathBuf>,
    /// A camera that is built in, and its conditions
    #[arg(long, value_name = "NAME", value_parser = preset())]
    pub(crate) preset: Option<Preset>,
    /// Which equations [default: as the paper has them for its experiments, else physical]
    #[arg(long, value_enum)]
    pub(crate) reading: Option<ReadingArg>,
    #[command(flatten)]
    pub(crate) parameters: ParameterArgs,
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
}

impl SetupArgs {
    /// What is asked for, in which every value makes sense.
    pub(crate) fn setup(&self) -> Result<Setup, Fault> {
        let camera = self.camera.as_deref();
        let scenario = scenario_of(camera, self.preset, self.reading, &self.parameters)?;
        let mut setup = Setup {
            scenario,
            scene: Scene::default(),
        };
        self.scene.apply(&mut setup);
        setup.check().map_err(|error| self.at_fault(error))?;
        Ok(setup)
    }
}

impl SetupArgs {
    /// What a file says is a fault of the file, where no option was given besides.
    fn at_fault(&self, error: ScenarioError) -> Fault {
        match &self.camera {
            Some(path) if self.parameters.is_empty() && self.scene.is_empty() => {
                anyhow!(error).context(path.display().to_string()).into()
            }
            _ => Fault::Usage(error.to_string()),
        }
    }
}

/// The numbers given beyond those that the limit depends on.
#[derive(Debug, Clone)]
pub(crate) struct SceneArgs {
    numbers: Vec<(Parameter, f64)>,
    spot_form: Option<SpotForm>,
    mirrored: bool,
}

impl SceneArgs {
    fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    fn apply(&self, setup: &mut Setup) {
        for (parameter, value) in &self.numbers {
            parameter.set(setup, *value);
        }
        let imperfections = &mut setup.scenario.sensor.imperfections;
        imperfections.spot_form = self.spot_form.unwrap_or(imperfections.spot_form);
        imperfections.mirrored |= self.mirrored;
    }
}

const SPOT_FORM: &str = "spot_form";
const MIRRORED: &str = "mirrored";
const CAMERA_HEADING: &str = "Imperfections of the camera";

impl clap::Args for SceneArgs {
    fn augment_args(command: Command) -> Command {
        let forms = SpotForm::ALL.map(SpotForm::name).join("|");
        let spot_form = Arg::new(SPOT_FORM)
            .long("spot-form")
            .value_name(forms.clone())
            .help("Form of a star's spot: integrated or sampled Gaussian, or an even disc [default: the camera's]")
            .help_heading(CAMERA_HEADING)
            .value_parser(move |text: &str| {
                SpotForm::named(text).ok_or_else(|| format!("expected {forms}"))
            });
        let mirrored = Arg::new(MIRRORED)
            .long("mirrored")
            .help("Reverse the image left to right")
            .help_heading(CAMERA_HEADING)
            .action(ArgAction::SetTrue);
        let numbers = Parameter::beyond_scenario().map(option);
        command.args([spot_form, mirrored]).args(numbers)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for SceneArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let given = |parameter: Parameter| {
            let value = matches.get_one::<f64>(parameter.name())?;
            Some((parameter, *value))
        };
        Ok(Self {
            numbers: Parameter::beyond_scenario().filter_map(given).collect(),
            spot_form: matches.get_one::<SpotForm>(SPOT_FORM).copied(),
            mirrored: matches.get_flag(MIRRORED),
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

fn option(parameter: Parameter) -> Arg {
    let name = parameter.name();
    let mut about = parameter.about().to_owned();
    about[..1].make_ascii_uppercase();
    let limits = parameter.limits();
    let (heading, default) = match parameter {
        Parameter::Scene(key) => {
            let default = (key.get)(&Scene::default());
            let default = default.map(|value| format!(" [default: {}]", number(value)));
            ("Scene", default.unwrap_or_default())
        }
        _ => (CAMERA_HEADING, " [default: the camera's]".to_owned()),
    };
    Arg::new(name)
        .long(name.replace('_', "-"))
        .value_name("NUMBER")
        .help(format!("{about}: {limits}{default}"))
        .help_heading(heading)
        .allow_hyphen_values(true)
        .value_parser(move |text: &str| match text.trim().parse::<f64>() {
            Ok(value) if limits.accept(value) => Ok(value),
            _ => Err(format!("expected {limits}")),
        })
}
