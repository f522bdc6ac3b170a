//! Sweeps over a parameter of the simulated lists.

use crate::cli::options::values::{
    field_of_view, multiple, not_negative, not_of_form, part, star_count, whole,
};
use starpipe::model::sensitivity::Spacing;
use starpipe::study::robustness::Parameter;
use std::str::FromStr;

/// Values of one parameter, evenly spaced.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sweep {
    pub(crate) parameter: Parameter,
    pub(crate) values: Vec<f64>,
}

/// More values than this are a mistake.
const SWEEP_VALUES_MAX: usize = 1000;

impl FromStr for Sweep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, range) = named_range(text, "NAME=FROM:TO:COUNT")?;
        let known = Parameter::ALL.iter().find(|known| known.name() == name);
        let parameter = *known.ok_or_else(|| {
            let names = Parameter::ALL.map(Parameter::name).join(", ");
            format!("'{name}' is not one of {names}")
        })?;
        let check = match parameter {
            Parameter::FieldOfView => field_of_view,
            Parameter::Stars => star_count,
            Parameter::CentroidError | Parameter::MagError => not_negative,
            Parameter::Missing => part,
            Parameter::FalseStars => multiple,
        };
        let [from, to, count] = range[..] else {
            return Err(not_of_form(text, "NAME=FROM:TO:COUNT"));
        };
        let (from, to, count) = (check(from)?, check(to)?, whole(count)?);
        if !(1..=SWEEP_VALUES_MAX).contains(&count) {
            return Err(format!("the count must be 1 to {SWEEP_VALUES_MAX}"));
        }
        Ok(Self {
            parameter,
            values: Spacing::Linear.values(from, to, count),
        })
    }
}

/// The name and the parts of NAME=PART:PART:...
fn named_range<'a>(text: &'a str, form: &str) -> Result<(&'a str, Vec<&'a str>), String> {
    let (name, range) = text
        .split_once('=')
        .ok_or_else(|| not_of_form(text, form))?;
    Ok((name, range.split(':').collect()))
}
