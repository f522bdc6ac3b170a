//! All parameters of a simulation by name.

use super::camera::camera_of;
use super::scene::{SCENE_KEYS, Scene};
use super::strays::mean_cosmic_rays;
use crate::camera::data_sheet::{IMPERFECTION_KEYS, Key, NumberRange};
use crate::predict::{self, Budget, Scenario, ScenarioError, UnknownParameter, title_of};

/// What is simulated: a scenario and a scene.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Setup {
    /// Camera, sky and exposure.
    pub scenario: Scenario,
    /// What happens during the exposure.
    pub scene: Scene,
}

impl Setup {
    /// This scenario with nothing beside it: the default scene.
    pub fn new(scenario: Scenario) -> Self {
        Self {
            scenario,
            scene: Scene::default(),
        }
    }

    /// Checks the scenario, and that the scene can be simulated.
    ///
    /// # Errors
    /// [`ScenarioError`] for a value outside its limits, a lens that folds the image, a turn beyond
    /// a quarter of a circle, or too many cosmic rays.
    pub fn check(&self) -> Result<(), ScenarioError> {
        Budget::checked(&self.scenario)?;
        let faults = [self.folded_image(), self.far_turn(), self.many_rays()];
        match faults.into_iter().flatten().next() {
            Some(what) => Err(ScenarioError::Contradiction(what)),
            None => Ok(()),
        }
    }

    /// Sets parameters. The result is not checked as a whole.
    ///
    /// # Errors
    /// [`ScenarioError::Contradiction`] for two values of one quantity, [`ScenarioError::Value`] for
    /// one outside its limits; nothing is set then.
    pub fn set_all(&mut self, values: &[(SetupParameter, f64)]) -> Result<(), ScenarioError> {
        for (number, &(parameter, found)) in values.iter().enumerate() {
            let name = parameter.name();
            let others = values[..number].iter().map(|(other, _)| other.name());
            let is_same = |other: &str| parameter.alternatives().any(|name| name == other);
            if let Some(other) = others.into_iter().find(|&other| is_same(other)) {
                let what =
                    format!("{other} and {name} set the same quantity: give only one of them");
                return Err(ScenarioError::Contradiction(what));
            }
            if !parameter.limits().accept(found) {
                let expected = parameter.limits().to_string();
                return Err(ScenarioError::Value {
                    name,
                    found,
                    expected,
                });
            }
        }
        let mut in_order = values.to_vec();
        in_order.sort_by_key(|(parameter, _)| parameter.order());
        for (parameter, value) in in_order {
            parameter.set(self, value);
        }
        Ok(())
    }

    /// Why the lens does not image all of the frame, if so.
    fn folded_image(&self) -> Option<String> {
        /// Largest radial displacement, in units of the distance of the corners, and largest gradient of
        /// the decentring and the stretch, in pixels per pixel.
        const MAX_STEEPNESS: f64 = 0.6;
        let camera = camera_of(&self.scenario.camera);
        let terms_px = self.scenario.camera.imperfections.lens_terms_px();
        let [third, fifth, seventh, _, _, x, y, stretch, skew] = terms_px;
        let radial_px = third.abs() + fifth.abs() + seventh.abs();
        let found_px = radial_px.max(2.0 * libm::hypot(x, y) + libm::hypot(stretch, skew));
        let most_px = MAX_STEEPNESS * camera.radius_px();
        let corners = camera.corners();
        let is_blind = camera.is_pinhole()
            && corners
                .iter()
                .any(|corner| camera.direction_of(corner).is_none());
        if found_px > most_px {
            return Some(format!(
                "the distortion is too large: the radial distortion, or twice the decentering plus the \
                 stretch, is {found_px} pixels, expected at most {most_px:.1} for this detector"
            ));
        }
        is_blind.then(|| {
            "the image folds back before the corners of the frame: the radial distortion is too large, or \
             the optical axis is too far from the center"
                .to_owned()
        })
    }

    fn far_turn(&self) -> Option<String> {
        /// Largest turn of the camera or a satellite during an exposure, in degrees: a longer trail
        /// is no longer realistic.
        const MAX_TURN_DEG: f64 = 90.0;
        let exposure_s = self.scenario.conditions.exposure_s;
        let camera_deg = self.scene.largest_rate_deg_s() * exposure_s;
        let trail_deg = self.scene.trail_rate_deg_s * exposure_s;
        let has_trails = self.scene.trails > 0.0;
        let fault = |what: &str, found_deg: f64| {
            format!(
                "{what} rotates by up to {found_deg}° during the exposure of {exposure_s} s, expected at \
                 most {MAX_TURN_DEG}°"
            )
        };
        if camera_deg > MAX_TURN_DEG {
            return Some(fault("the camera", camera_deg));
        }
        (has_trails && trail_deg > MAX_TURN_DEG).then(|| fault("a satellite", trail_deg))
    }

    fn many_rays(&self) -> Option<String> {
        /// Largest mean number of cosmic rays on a frame.
        const MAX_COSMIC_RAYS: f64 = 1e6;
        let Scenario {
            camera, conditions, ..
        } = &self.scenario;
        let mean = mean_cosmic_rays(&self.scene, camera, conditions.exposure_s);
        (mean > MAX_COSMIC_RAYS).then(|| {
            format!("cosmic_rays_cm2_s gives {mean} cosmic rays per frame, expected at most {MAX_COSMIC_RAYS}")
        })
    }
}

/// A parameter of a [`Setup`].
#[derive(Debug, Clone, Copy)]
pub enum SetupParameter {
    /// A parameter of the scenario, or an imperfection of its camera.
    Scenario(predict::Parameter),
    /// A parameter of the scene.
    Scene(&'static Key<Scene>),
}

impl SetupParameter {
    /// All parameters.
    pub fn all() -> impl Iterator<Item = Self> {
        predict::Parameter::all()
            .map(Self::Scenario)
            .chain(Self::beyond_scenario())
    }

    /// All parameters except those of the scenario.
    pub fn beyond_scenario() -> impl Iterator<Item = Self> {
        let imperfections = IMPERFECTION_KEYS.iter().map(predict::Parameter::Camera);
        imperfections
            .map(Self::Scenario)
            .chain(SCENE_KEYS.iter().map(Self::Scene))
    }

    /// The parameter called `name`.
    ///
    /// # Errors
    /// [`UnknownParameter`] with the most similar name.
    pub fn named(name: &str) -> Result<Self, UnknownParameter> {
        let found = Self::all().find(|parameter| parameter.name() == name);
        found.ok_or_else(|| UnknownParameter::among(name, Self::all().map(Self::name)))
    }

    /// See [`predict::Parameter::alternatives`].
    fn alternatives(self) -> impl Iterator<Item = &'static str> {
        let of_scenario = match self {
            Self::Scenario(parameter) => Some(parameter.alternatives()),
            Self::Scene(_) => None,
        };
        of_scenario.into_iter().flatten()
    }

    /// See [`predict::Parameter::order`].
    fn order(self) -> u8 {
        match self {
            Self::Scenario(parameter) => parameter.order(),
            Self::Scene(_) => u8::MAX,
        }
    }

    /// Title of its axis.
    pub fn title(self) -> String {
        title_of(self.name())
    }

    /// Name, which ends in the unit.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scenario(parameter) => parameter.name(),
            Self::Scene(key) => key.name,
        }
    }

    /// Description in one line.
    pub fn about(self) -> &'static str {
        match self {
            Self::Scenario(parameter) => parameter.about(),
            Self::Scene(key) => key.about,
        }
    }

    /// Valid values.
    pub fn limits(self) -> NumberRange {
        match self {
            Self::Scenario(parameter) => parameter.limits(),
            Self::Scene(key) => key.limits,
        }
    }

    /// Value, if it has one.
    pub fn get(self, setup: &Setup) -> Option<f64> {
        match self {
            Self::Scenario(parameter) => parameter.get(&setup.scenario),
            Self::Scene(key) => (key.get)(&setup.scene),
        }
    }

    /// Sets a value, which must be within the limits.
    pub fn set(self, setup: &mut Setup, value: f64) {
        match self {
            Self::Scenario(parameter) => parameter.set(&mut setup.scenario, value),
            Self::Scene(key) => (key.set)(&mut setup.scene, value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_set_all_or_none() {
        let named = |name| SetupParameter::named(name).unwrap();
        let before = Setup {
            scenario: Scenario::new(Preset::Experiment1.data_sheet()),
            scene: Scene::default(),
        };
        let mut setup = before.clone();
        let twice = [(named("pitch_x_um"), 5.0), (named("pixel_area_um2"), 9.0)];
        let error = setup.set_all(&twice).unwrap_err().to_string();
        assert!(
            error.starts_with("pitch_x_um and pixel_area_um2 set the same"),
            "{error}"
        );
        let outside = [(named("exposure_s"), 2.0), (named("read_noise_e"), -1.0)];
        assert!(setup.set_all(&outside).is_err());
        assert_eq!(setup, before);
        setup.set_all(&[(named("exposure_s"), 2.0)]).unwrap();
        assert_eq!(setup.scenario.conditions.exposure_s, 2.0);
    }
    use crate::camera::data_sheet::Preset;

    #[test]
    fn what_no_frame_can_be_made_of_is_refused() {
        let refused = |change: fn(&mut Setup)| {
            let mut setup = Setup {
                scenario: Scenario::of(Preset::NanosatTracker),
                scene: Scene::default(),
            };
            assert_eq!(setup.check(), Ok(()));
            change(&mut setup);
            setup.check().map_err(|error| error.to_string())
        };
        let says = |change, what: &str| {
            let message = refused(change).unwrap_err();
            assert!(message.contains(what), "{message}");
        };
        says(|s| s.scene.rate_x_deg_s = 1000.0, "rotates by up to 100°");
        says(|s| s.scene.tumble_deg_s = -1000.0, "rotates by up to 100°");
        says(|s| s.scene.swing_deg = 180.0 * 1e9, "the camera rotates");
        says(
            |s| (s.scene.trails, s.scene.trail_rate_deg_s) = (1.0, 1e12),
            "a satellite rotates",
        );
        assert_eq!(refused(|s| s.scene.trail_rate_deg_s = 1e12), Ok(()));
        says(|s| s.scene.cosmic_rays_cm2_s = 1e9, "cosmic rays");
        let distort = |s: &mut Setup, px| s.scenario.camera.imperfections.distortion_px = px;
        // Half the diagonal is 1620 px: 4/27 of it, 240 px, are the most.
        says(
            |s| s.scenario.camera.imperfections.distortion_px = -241.0,
            "distortion is too large",
        );
        says(
            |s| s.scenario.camera.imperfections.decentring_y_px = 487.0,
            "distortion is too large",
        );
        let mut most = Setup {
            scenario: Scenario::of(Preset::NanosatTracker),
            scene: Scene::default(),
        };
        for px in [-239.0, 700.0] {
            distort(&mut most, px);
            assert_eq!(most.check(), Ok(()));
            // All of the image can be found.
            let camera = camera_of(&most.scenario.camera);
            for i in 0..2592 {
                let there =
                    crate::base::coords::PixelPoint::new(f64::from(i), 1943.0 - f64::from(i) * 0.7);
                let direction = camera.direction_of(&there).unwrap();
                let back = camera.pixel_of(&direction).unwrap();
                assert!(back.distance_to(&there) < 1e-4, "{there:?} {back:?}");
            }
        }
    }

    #[test]
    fn every_parameter_takes_the_value_that_it_has_and_no_two_have_one_name() {
        let mut setup = Setup {
            scenario: Scenario::of(Preset::Experiment2),
            scene: Scene::default(),
        };
        let mut names = Vec::new();
        for parameter in SetupParameter::all() {
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
