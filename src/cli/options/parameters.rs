//! An option for every parameter of a scenario, made from the table of parameters.

use clap::{Arg, ArgMatches, Command, Error, FromArgMatches};
use starpipe::base::format::five_digits as number;
use starpipe::camera::data_sheet::{Response, ResponseError, is_curve};
use starpipe::model::sensitivity::{Conditions, Parameter, Scenario};
use std::path::PathBuf;

/// Parameters that say the same: at most one of each is given.
const SAME: &[&[&str]] = &[
    &[
        "sky_mag_arcsec2",
        "sky_luminance_cd_m2",
        "sky_illuminance_lx",
    ],
    &["zenith_transmission", "extinction_mag_per_airmass"],
    &["pixel_area_um2", "pitch_x_um"],
    &["pixel_area_um2", "pitch_y_um"],
];

/// The parameters given, in the order in which they are to be set.
#[derive(Debug, Clone)]
pub(crate) struct ParameterOptions(Vec<(Parameter, Given)>);

/// What an option of a parameter may be given.
#[derive(Debug, Clone, PartialEq)]
enum Given {
    Number(f64),
    /// A CSV file of wavelengths and values.
    Curve(PathBuf),
}

impl ParameterOptions {
    /// Gives `scenario` what was given.
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

    /// Whether nothing was given.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The files among what was given.
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
        // Pixels of another size first: what is in pixels is in these.
        all.sort_by_key(|(parameter, _)| parameter.name() != "pixel_area_um2");
        Ok(Self(all))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

fn option(parameter: Parameter) -> Arg {
    let name = parameter.name();
    let others = SAME.iter().filter(|same| same.contains(&name));
    let others = others.flat_map(|same| same.iter().filter(|other| **other != name));
    let mut about = parameter.about().to_owned();
    about[..1].make_ascii_uppercase();
    let default = match parameter {
        Parameter::Camera(_) => None,
        Parameter::Conditions(key) => (key.get)(&Conditions::default()),
    };
    let default = default.map_or_else(String::new, |value| {
        format!(" [default with --camera: {}]", number(value))
    });
    let arg = Arg::new(name).long(name.replace('_', "-"));
    // As `process` has it.
    let arg = match name {
        "exposure_s" => arg.visible_alias("exposure"),
        _ => arg,
    };
    arg.value_name(if is_curve(name) {
        "NUMBER|FILE.csv"
    } else {
        "NUMBER"
    })
    .help(format!("{about}: {}{default}", parameter.limits()))
    .help_heading(match parameter {
        Parameter::Camera(_) => "Camera",
        Parameter::Conditions(_) => "Conditions",
    })
    .allow_hyphen_values(true)
    .conflicts_with_all(others.copied())
    .value_parser(move |text: &str| given(parameter, text))
}

fn given(parameter: Parameter, text: &str) -> Result<Given, String> {
    let limits = parameter.limits();
    match text.trim().parse::<f64>() {
        Ok(value) if limits.accept(value) => Ok(Given::Number(value)),
        Err(_) if is_curve(parameter.name()) => Ok(Given::Curve(PathBuf::from(text))),
        _ => Err(format!("expected {limits}")),
    }
}
