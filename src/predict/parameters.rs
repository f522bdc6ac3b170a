//! The parameters of a scenario by name: those of the camera and of the conditions in one list.

use super::conditions::{Conditions, Extinction, REFERENCE_NM, SkyBrightness};
use super::scenario::Scenario;
use crate::camera::data_sheet::{DataSheet, KEYS, Key, NumberRange, key, nearest_name};

/// The numbers in [`Conditions`]. Of several that state the same quantity in different units, the
/// last one given counts.
pub const CONDITION_KEYS: &[Key<Conditions>] = &[
    key!(exposure_s, NumberRange::Positive, "exposure, in seconds"),
    key!(
        zenith_distance_deg,
        NumberRange::FromToBelow(0.0, 90.0),
        "zenith distance, in degrees"
    ),
    Key {
        name: "sky_mag_arcsec2",
        about: "brightness of the sky, in V magnitudes per square arcsecond",
        limits: NumberRange::Finite,
        get: |conditions| Some(conditions.sky.mag_arcsec2()),
        set: |conditions, mag| conditions.sky = SkyBrightness::MagArcsec2(mag),
    },
    Key {
        name: "sky_luminance_cd_m2",
        about: "brightness of the sky as a luminance, in cd/m²",
        limits: NumberRange::Positive,
        get: |conditions| Some(conditions.sky.luminance_cd_m2()),
        set: |conditions, luminance| conditions.sky = SkyBrightness::LuminanceCdM2(luminance),
    },
    Key {
        name: "sky_illuminance_lx",
        about: "brightness of the sky as the illuminance of level ground, in lx",
        limits: NumberRange::Positive,
        get: |conditions| Some(conditions.sky.illuminance_lx()),
        set: |conditions, illuminance| conditions.sky = SkyBrightness::IlluminanceLx(illuminance),
    },
    Key {
        name: "zenith_transmission",
        about: "transmission of one airmass at 555 nm (extinction law: eq. 3 of the paper)",
        limits: NumberRange::Share,
        get: |conditions| Some(conditions.extinction.zenith_transmission(REFERENCE_NM)),
        set: |conditions, part| conditions.extinction = Extinction::law_through(part),
    },
    Key {
        name: "extinction_mag_per_airmass",
        about: "extinction, in magnitudes per airmass, at every wavelength",
        limits: NumberRange::NotNegative,
        get: |conditions| match conditions.extinction {
            Extinction::MagPerAirmass(mag) => Some(mag),
            Extinction::Law(_) => None,
        },
        set: |conditions, mag| conditions.extinction = Extinction::MagPerAirmass(mag),
    },
    key!(
        star_temperature_k,
        NumberRange::Positive,
        "color temperature of the star, in kelvin (for reading physical)"
    ),
    key!(
        motion_px,
        NumberRange::FromToBelow(0.0, 100.0),
        "motion of a star during the exposure, in pixels"
    ),
    key!(
        snr,
        NumberRange::Positive,
        "signal-to-noise ratio required in the brightest pixel"
    ),
    key!(
        false_alarms_per_mpx,
        NumberRange::Positive,
        "accepted false detections per million pixels"
    ),
];

/// Pixel area, for sweeps: pixels of another size under the same spot.
const PIXEL_AREA: Key<DataSheet> = Key {
    name: "pixel_area_um2",
    about: "area of a pixel, in µm²; keeps its shape, and the spot size in µm",
    limits: NumberRange::Positive,
    get: |sheet| Some(sheet.pitch_x_um * sheet.pitch_y_um),
    set: |sheet, area_um2| {
        let factor = area_um2 / (sheet.pitch_x_um * sheet.pitch_y_um);
        sheet.pitch_x_um *= factor.sqrt();
        sheet.pitch_y_um *= factor.sqrt();
        sheet.spot_sigma_px /= factor.sqrt();
        // μ is proportional to the pixel area, and at most 1.
        sheet.peak_share = sheet.peak_share.map(|share| (share * factor).min(1.0));
    },
};

/// Suffix of a name and its unit. A suffix stands before the shorter ones that it ends in.
const UNITS: &[(&str, &str)] = &[
    ("_mag_per_airmass", "mag / airmass"),
    ("_mag_arcsec2", "V mag / square arcsec"),
    ("_e_per_adu", "e / ADU"),
    ("_per_mpx", "per million pixels"),
    ("_cm2_s", "per cm² and s"),
    ("_deg_s", "°/s"),
    ("_e_um", "e/µm"),
    ("_vmag", "V mag"),
    ("_cd_m2", "cd/m²"),
    ("_um2", "µm²"),
    ("_e_s", "e/s"),
    ("_deg", "°"),
    ("_adu", "ADU"),
    ("_mm", "mm"),
    ("_um", "µm"),
    ("_nm", "nm"),
    ("_px", "px"),
    ("_lx", "lx"),
    ("_e", "e"),
    ("_s", "s"),
    ("_k", "K"),
];

/// Title of an axis of the parameter called `name`: `focal length (mm)`.
pub fn title_of(name: &str) -> String {
    match unit_of(name) {
        "" => quantity_of(name),
        unit => format!("{} ({unit})", quantity_of(name)),
    }
}

fn ending_of(name: &str) -> Option<&'static (&'static str, &'static str)> {
    UNITS.iter().find(|(ending, _)| name.ends_with(ending))
}

fn unit_of(name: &str) -> &'static str {
    ending_of(name).map_or("", |(_, unit)| unit)
}

fn quantity_of(name: &str) -> String {
    let ending = ending_of(name).map_or("", |(ending, _)| ending);
    name.strip_suffix(ending).unwrap_or(name).replace('_', " ")
}

/// A parameter of a [`Scenario`].
#[derive(Debug, Clone, Copy)]
pub enum Parameter {
    /// A parameter of the camera.
    Camera(&'static Key<DataSheet>),
    /// A parameter of the conditions.
    Conditions(&'static Key<Conditions>),
}

/// Parameters that exclude each other: they set the same quantity.
const EXCLUSIVE: &[&[&str]] = &[
    &[
        "sky_mag_arcsec2",
        "sky_luminance_cd_m2",
        "sky_illuminance_lx",
    ],
    &["zenith_transmission", "extinction_mag_per_airmass"],
    &["pixel_area_um2", "pitch_x_um"],
    &["pixel_area_um2", "pitch_y_um"],
];

/// There is no parameter of this name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown parameter '{name}'{}", match .nearest { Some(known) => format!("; did you mean '{known}'?"), None => String::new() })]
pub struct UnknownParameter {
    /// The name.
    pub name: String,
    /// The most similar name.
    pub nearest: Option<&'static str>,
}

impl UnknownParameter {
    /// The error for `name`, with the most similar one of `names`.
    pub fn among(name: &str, names: impl Iterator<Item = &'static str>) -> Self {
        Self {
            name: name.to_owned(),
            nearest: nearest_name(name, names),
        }
    }
}

impl Parameter {
    /// All parameters, the camera's first.
    pub fn all() -> impl Iterator<Item = Self> {
        let sheet = KEYS.iter().chain([&PIXEL_AREA]).map(Self::Camera);
        sheet.chain(CONDITION_KEYS.iter().map(Self::Conditions))
    }

    /// The parameter called `name`.
    ///
    /// # Errors
    /// [`UnknownParameter`] with the most similar name.
    pub fn named(name: &str) -> Result<Self, UnknownParameter> {
        let found = Self::all().find(|parameter| parameter.name() == name);
        found.ok_or_else(|| UnknownParameter::among(name, Self::all().map(Self::name)))
    }

    /// Name, which ends in the unit.
    pub fn name(self) -> &'static str {
        match self {
            Self::Camera(key) => key.name,
            Self::Conditions(key) => key.name,
        }
    }

    /// Description in one line.
    pub fn about(self) -> &'static str {
        match self {
            Self::Camera(key) => key.about,
            Self::Conditions(key) => key.about,
        }
    }

    /// Unit as printed; empty for a dimensionless number.
    pub fn unit(self) -> &'static str {
        unit_of(self.name())
    }

    /// Name without the unit, in words: `focal length`.
    pub fn quantity(self) -> String {
        quantity_of(self.name())
    }

    /// Title of its axis: `focal length (mm)`.
    pub fn title(self) -> String {
        title_of(self.name())
    }

    /// Valid values.
    pub fn limits(self) -> NumberRange {
        match self {
            Self::Camera(key) => key.limits,
            Self::Conditions(key) => key.limits,
        }
    }

    /// Value, if it has one.
    pub fn get(self, scenario: &Scenario) -> Option<f64> {
        match self {
            Self::Camera(key) => (key.get)(&scenario.camera),
            Self::Conditions(key) => (key.get)(&scenario.conditions),
        }
    }

    /// Names of the parameters that set the same quantity: only one of them may be given.
    pub fn alternatives(self) -> impl Iterator<Item = &'static str> {
        let name = self.name();
        let groups = EXCLUSIVE.iter().filter(move |group| group.contains(&name));
        groups.flat_map(move |group| group.iter().copied().filter(move |other| *other != name))
    }

    /// Of several parameters those of lower order are set first.
    pub fn order(self) -> u8 {
        // Other values are in pixels of that size.
        u8::from(self.name() != "pixel_area_um2")
    }

    /// Sets a value, which must be within the limits.
    pub fn set(self, scenario: &mut Scenario, value: f64) {
        match self {
            Self::Camera(key) => (key.set)(&mut scenario.camera, value),
            Self::Conditions(key) => (key.set)(&mut scenario.conditions, value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;

    #[test]
    fn every_parameter_takes_the_value_that_it_has() {
        for parameter in Parameter::all() {
            let mut scenario = Scenario::of(Preset::Experiment2);
            let Some(value) = parameter.get(&scenario) else {
                continue;
            };
            parameter.set(&mut scenario, value);
            let again = parameter.get(&scenario).unwrap();
            assert!(
                (again - value).abs() <= 1e-9 * value.abs(),
                "{}",
                parameter.name()
            );
            assert!(parameter.limits().accept(value), "{}", parameter.name());
        }
    }

    #[test]
    fn names_are_unique_and_an_unknown_one_meets_its_neighbor() {
        let mut names: Vec<_> = Parameter::all().map(Parameter::name).collect();
        names.sort_unstable();
        let count = names.len();
        names.dedup();
        assert_eq!(names.len(), count);
        let error = Parameter::named("aperture").unwrap_err();
        assert_eq!(
            error.to_string(),
            "unknown parameter 'aperture'; did you mean 'aperture_mm'?"
        );
    }

    #[test]
    fn a_title_has_the_unit_that_the_name_ends_in() {
        for (name, title) in [
            ("aperture_mm", "aperture (mm)"),
            ("dark_current_e_s", "dark current (e/s)"),
            ("gain_e_per_adu", "gain (e / ADU)"),
            ("sky_mag_arcsec2", "sky (V mag / square arcsec)"),
            ("pixel_area_um2", "pixel area (µm²)"),
            ("quantum_efficiency", "quantum efficiency"),
            ("snr", "snr"),
        ] {
            assert_eq!(Parameter::named(name).unwrap().title(), title);
        }
    }

    #[test]
    fn a_larger_pixel_holds_more_of_the_same_spot() {
        let mut scenario = Scenario::of(Preset::Experiment1);
        let area = Parameter::named("pixel_area_um2").unwrap();
        area.set(&mut scenario, 4.0 * 8.6 * 8.3);
        let sheet = &scenario.camera;
        assert!(
            (sheet.pitch_x_um - 17.2).abs() < 1e-9 && (sheet.spot_sigma_px - 0.58).abs() < 1e-9
        );
        assert!((sheet.peak_share() - 4.0 / 9.0).abs() < 1e-9);
    }
}
