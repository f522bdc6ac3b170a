//! Sweeps over a parameter of the simulated lists.

use crate::cli::options::values::{
    field_of_view, multiple, not_negative, not_of_form, part, star_count, whole,
};
use starpipe::lab::robustness::VariedParameter;
use starpipe::predict::Spacing;
use std::str::FromStr;

/// Largest number of values.
const MAX_VALUES: usize = 1000;
const FORM: &str = "NAME=FROM:TO:COUNT";

/// Evenly spaced values of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RobustnessSweep {
    pub(super) parameter: VariedParameter,
    pub(super) values: Vec<f64>,
}

impl FromStr for RobustnessSweep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some((name, range)) = text.split_once('=') else {
            return Err(not_of_form(text, FORM));
        };
        let parameter = named(name)?;
        let [from, to, count] = range.split(':').collect::<Vec<_>>()[..] else {
            return Err(not_of_form(text, FORM));
        };
        let parse = parser(parameter);
        let (from, to, count) = (parse(from)?, parse(to)?, whole(count)?);
        if !(1..=MAX_VALUES).contains(&count) {
            return Err(format!("the count must be 1 to {MAX_VALUES}"));
        }
        Ok(Self {
            parameter,
            values: Spacing::Linear.values(from, to, count),
        })
    }
}

fn named(name: &str) -> Result<VariedParameter, String> {
    let known = VariedParameter::ALL
        .iter()
        .find(|known| known.name() == name);
    known.copied().ok_or_else(|| {
        let names = VariedParameter::ALL.map(VariedParameter::name).join(", ");
        format!("'{name}' is not one of {names}")
    })
}

/// The parser of the parameter's values, as for its own option.
fn parser(parameter: VariedParameter) -> fn(&str) -> Result<f64, String> {
    match parameter {
        VariedParameter::FieldOfView => field_of_view,
        VariedParameter::Stars => star_count,
        VariedParameter::CentroidError | VariedParameter::MagError => not_negative,
        VariedParameter::Missing => part,
        VariedParameter::FalseStars => multiple,
    }
}
