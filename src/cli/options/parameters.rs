//! An option for each parameter of a scenario, generated from the table of parameters.

use clap::{Arg, ArgMatches, Command, Error, FromArgMatches};
use starpipe::base::format::five_digits as number;
use starpipe::camera::data_sheet::{NumberRange, Response, ResponseError, is_curve};
use starpipe::predict::{Conditions, Parameter, Scenario};
use std::path::PathBuf;

/// The parameters given, in the order in which they have to be set.
#[derive(Debug, Clone)]
pub(crate) struct ParameterOptions(Vec<(Parameter, Given)>);

/// Value of a parameter's option.
#[derive(Debug, Clone, PartialEq)]
enum Given {
    Number(f64),
    /// A CSV file of wavelengths and values.
    Curve(PathBuf),
}

impl ParameterOptions {
    /// Sets the parameters of `scenario`.
    pub(crate) fn apply(&self, scenario: &mut Scenario) -> Result<(), ResponseError> {
        for (parameter, given) in &self.0 {
            match given {
                Given::Number(value) => parameter.set(scenario, *value),
                Given::Curve(path) => {
                    let curve = Response::read(path)?;
                    let sheet = &mut scenario.camera;
                    match parameter.name() {
                        "lens_transmission" => sheet.lens_transmission = curve,
                        _ => sheet.quantum_efficiency = curve,
                    }
                }
            }
        }
        Ok(())
    }

    /// Whether no parameter is given.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The files that are given as values.
    pub(crate) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.0.iter().filter_map(|(_, given)| match given {
            Given::Curve(path) => Some(path),
            Given::Number(_) => None,
        })
    }
}

impl clap::Args for ParameterOptions {
    fn augment_args(command: Command) -> Command {
        command.args(Parameter::all().map(option))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for ParameterOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let given = |parameter: Parameter| {
            let given = matches.get_one::<Given>(parameter.name())?;
            Some((parameter, given.clone()))
        };
        let mut all: Vec<_> = Parameter::all().filter_map(given).collect();
        all.sort_by_key(|(parameter, _)| parameter.order());
        Ok(Self(all))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

fn option(parameter: Parameter) -> Arg {
    let name = parameter.name();
    let (heading, default) = match parameter {
        Parameter::Camera(_) => ("Camera", None),
        Parameter::Conditions(key) => ("Conditions", (key.get)(&Conditions::default())),
    };
    let default = default.map_or_else(String::new, |value| {
        format!(" [default with --camera: {}]", number(value))
    });
    let arg = number_option(name, parameter.about(), parameter.limits(), &default)
        .help_heading(heading)
        .conflicts_with_all(parameter.alternatives())
        .value_parser(move |text: &str| given(parameter, text));
    if is_curve(name) {
        return arg.value_name("NUMBER|FILE.csv");
    }
    match name_in_process(name) {
        Some(option) => arg.long(option).alias(name.replace('_', "-")),
        None => arg,
    }
}

/// The option of `process` for the same, which is the name everywhere.
fn name_in_process(parameter: &str) -> Option<&'static str> {
    match parameter {
        "exposure_s" => Some("exposure"),
        "zenith_distance_deg" => Some("zenith-distance"),
        "extinction_mag_per_airmass" => Some("extinction"),
        _ => None,
    }
}

fn given(parameter: Parameter, text: &str) -> Result<Given, String> {
    if is_curve(parameter.name()) && text.trim().parse::<f64>().is_err() {
        return Ok(Given::Curve(PathBuf::from(text)));
    }
    within_limits(text, parameter.limits()).map(Given::Number)
}

/// An option for a number, without its parser.
pub(super) fn number_option(
    name: &'static str,
    about: &str,
    limits: NumberRange,
    default: &str,
) -> Arg {
    let mut about = about.to_owned();
    about[..1].make_ascii_uppercase();
    Arg::new(name)
        .long(name.replace('_', "-"))
        .value_name("NUMBER")
        .help(format!("{about}: {limits}{default}"))
        .allow_hyphen_values(true)
}

/// Parses a number and checks its limits.
pub(super) fn within_limits(text: &str, limits: NumberRange) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if limits.accept(value) => Ok(value),
        _ => Err(format!("expected {limits}")),
    }
}
