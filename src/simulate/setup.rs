//! All numbers of a simulation by name.

use super::scene::{SCENE_KEYS, Scene};
use crate::sensitivity::{self, Scenario, UnknownParameter, title_of};
use crate::sensor::{IMPERFECTION_KEYS, Key, Limits, Sensor};

/// What is simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// Camera, sky and exposure.
    pub scenario: Scenario,
    /// What happens meanwhile.
    pub scene: Scene,
}

/// A parameter of a [`Setup`].
#[derive(Debug, Clone, Copy)]
pub enum Parameter {
    /// One on which the limit depends.
    Scenario(sensitivity::Parameter),
    /// An imperfection of the camera.
    Imperfection(&'static Key<Sensor>),
    /// One of the scene.
    Scene(&'static Key<Scene>),
}

impl Parameter {
    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        sensitivity::Parameter::all()
            .map(Self::Scenario)
            .chain(Self::beyond_scenario())
    }

    /// Those that are none of the scenario.
    pub fn beyond_scenario() -> impl Iterator<Item = Self> {
        let imperfections = IMPERFECTION_KEYS.iter().map(Self::Imperfection);
        imperfections.chain(SCENE_KEYS.iter().map(Self::Scene))
    }

    /// The parameter called `name`.
    ///
    /// # Errors
    /// [`UnknownParameter`] with the nearest name there is.
    pub fn named(name: &str) -> Result<Self, UnknownParameter> {
        let found = Self::all().find(|parameter| parameter.name() == name);
        found.ok_or_else(|| UnknownParameter::among(name, Self::all().map(Self::name)))
    }

    /// What an axis of it is called.
    pub fn title(self) -> String {
        title_of(self.name())
    }

    /// Its name, which ends in its unit.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scenario(parameter) => parameter.name(),
            Self::Imperfection(key) => key.name,
            Self::Scene(key) => key.name,
        }
    }

    /// What it is, in a line.
    pub fn about(self) -> &'static str {
        match self {
            Self::Scenario(parameter) => parameter.about(),
            Self::Imperfection(key) => key.about,
            Self::Scene(key) => key.about,
        }
    }

    /// What values make sense.
    pub fn limits(self) -> Limits {
        match self {
            Self::Scenario(parameter) => parameter.limits(),
            Self::Imperfection(key) => key.limits,
            Self::Scene(key) => key.limits,
        }
    }

    /// Its value, where it has one.
    pub fn get(self, setup: &Setup) -> Option<f64> {
        match self {
            Self::Scenario(parameter) => parameter.get(&setup.scenario),
            Self::Imperfection(key) => (key.get)(&setup.scenario.sensor),
            Self::Scene(key) => (key.get)(&setup.scene),
        }
    }

    /// Gives it a value within the limits.
    pub fn set(self, setup: &mut Setup, value: f64) {
        match self {
            Self::Scenario(parameter) => parameter.set(&mut setup.scenario, value),
            Self::Imperfection(key) => (key.set)(&mut setup.scenario.sensor, value),
            Self::Scene(key) => (key.set)(&mut setup.scene, value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::Preset;

    #[test]
    fn every_parameter_takes_the_value_that_it_has_and_no_two_have_one_name() {
        let mut setup = Setup {
            scenario: Scenario::of(Preset::Experiment2),
            scene: Scene::default(),
        };
        let mut names = Vec::new();
        for parameter in Parameter::all() {
            names.push(parameter.name());
            let Some(value) = parameter.get(&setup) else {
                continue;
            };
            assert!(parameter.limits().accept(value), "{}", parameter.name());
            parameter.set(&mut setup, value);
            let again = parameter.get(&setup).unwrap();
            assert!(
                (again - value).abs() <= 1e-9 * value.abs(),
                "{}",
                parameter.name()
            );
        }
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
