//! The numbers of a camera by name: one table for the file, the options and the sweeps.

use super::{DataSheet, IMPERFECTION_KEYS, Preset, Response, SpotForm};
use std::fmt;
use std::fmt::Write as _;

/// What values make sense.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limits {
    /// Above 0.
    Positive,
    /// 0 or above.
    NotNegative,
    /// Above 0, at most 1.
    Share,
    /// A whole number from one to the other.
    Whole(f64, f64),
    /// From the first to the second.
    FromTo(f64, f64),
    /// From the first to below the second.
    FromToBelow(f64, f64),
    /// Any number.
    Finite,
}

impl Limits {
    /// Whether `value` is within them.
    pub fn accept(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Positive => value > 0.0,
                Self::NotNegative => value >= 0.0,
                Self::Share => value > 0.0 && value <= 1.0,
                Self::Whole(from, to) => (from..=to).contains(&value) && value.fract() == 0.0,
                Self::FromTo(from, to) => (from..=to).contains(&value),
                Self::FromToBelow(from, to) => (from..to).contains(&value),
                Self::Finite => true,
            }
    }
}

impl fmt::Display for Limits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Positive => write!(f, "a number above 0"),
            Self::NotNegative => write!(f, "a number from 0 up"),
            Self::Share => write!(f, "a number above 0 and at most 1"),
            Self::Whole(from, to) => write!(f, "a whole number from {from} to {to}"),
            Self::FromTo(from, to) => write!(f, "a number from {from} to {to}"),
            Self::FromToBelow(from, to) => write!(f, "a number from {from} to below {to}"),
            Self::Finite => write!(f, "a number"),
        }
    }
}

/// A number of a `T` that has a name.
pub struct Key<T> {
    /// The name, which ends in the unit.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    /// What values make sense.
    pub limits: Limits,
    /// Its value, where it has one.
    pub get: fn(&T) -> Option<f64>,
    /// Gives it a value within the limits.
    pub set: fn(&mut T, f64),
}

impl<T> Key<T> {
    /// The key called `name` among `keys`.
    pub fn find<'a>(keys: &'a [Self], name: &str) -> Option<&'a Self> {
        keys.iter().find(|key| key.name == name)
    }
}

impl<T> fmt::Debug for Key<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// The name among `names` that is most like `name`, where one is like it at all.
pub fn nearest_name<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    const ALIKE: f64 = 0.75;
    let name = name.to_lowercase().replace('-', "_");
    // A name that begins alike is what was meant when only the unit was forgotten.
    names
        .map(|known| {
            let begins = known.starts_with(&name) || name.starts_with(known);
            let likeness = strsim::jaro_winkler(&name, known);
            (likeness + if begins { 0.5 } else { 0.0 }, known)
        })
        .filter(|(likeness, _)| *likeness > ALIKE)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, known)| known)
}

/// Whether the number called `name` may be a curve by wavelength, and is then its largest value.
pub fn is_curve(name: &str) -> bool {
    ["lens_transmission", "quantum_efficiency"].contains(&name)
}

/// The longest side of a detector that makes sense, in pixels.
const MAX_SIDE_PX: f64 = 100_000.0;
/// Standard deviations of spots that make sense, in pixels: a wider one is no star.
const SPOTS_PX: Limits = Limits::FromToBelow(0.05, 20.0);
/// Wavelengths of which a detector may make anything, in nm.
const WAVELENGTHS_NM: Limits = Limits::FromToBelow(100.0, 10_000.0);

/// The key of the number that a field is, of the whole itself or of what stands in another field of it.
macro_rules! key {
    ($name:ident $(in $within:ident)?, $limits:expr, $about:literal) => {
        $crate::camera::data_sheet::Key {
            name: stringify!($name),
            about: $about,
            limits: $limits,
            get: |whole| Some(whole$(.$within)?.$name as f64),
            set: |whole, value| whole$(.$within)?.$name = value as _,
        }
    };
}
pub(crate) use key;

/// The numbers of a camera. The two that may be curves, [`DataSheet::lens_transmission`] and [`DataSheet::quantum_efficiency`],
/// are their largest values here; a curve that is given another one keeps its form. Of `spot_sigma_px` and `peak_share` the
/// last one given decides what falls on the brightest pixel.
pub const KEYS: &[Key<DataSheet>] = &[
    key!(
        width_px,
        Limits::Whole(3.0, MAX_SIDE_PX),
        "columns of the detector"
    ),
    key!(
        height_px,
        Limits::Whole(3.0, MAX_SIDE_PX),
        "rows of the detector"
    ),
    key!(
        pitch_x_um,
        Limits::Positive,
        "distance between columns, in µm"
    ),
    key!(pitch_y_um, Limits::Positive, "distance between rows, in µm"),
    key!(
        focal_length_mm,
        Limits::Positive,
        "focal length of the lens, in mm"
    ),
    key!(
        aperture_mm,
        Limits::Positive,
        "diameter of the entrance pupil, in mm"
    ),
    Key {
        name: "lens_transmission",
        about: "part of the light that the lens lets through (largest, of a curve)",
        limits: Limits::Share,
        get: |sheet| Some(sheet.lens_transmission.peak()),
        set: |sheet, peak| sheet.lens_transmission = sheet.lens_transmission.with_peak(peak),
    },
    Key {
        name: "quantum_efficiency",
        about: "electrons for each photon on a pixel (largest, of a curve)",
        limits: Limits::Share,
        get: |sheet| Some(sheet.quantum_efficiency.peak()),
        set: |sheet, peak| sheet.quantum_efficiency = sheet.quantum_efficiency.with_peak(peak),
    },
    key!(
        band_from_nm,
        WAVELENGTHS_NM,
        "shortest wavelength that is detected, in nm"
    ),
    key!(
        band_to_nm,
        WAVELENGTHS_NM,
        "longest wavelength that is detected, in nm"
    ),
    key!(
        read_noise_e,
        Limits::NotNegative,
        "noise of reading a pixel, in electrons"
    ),
    key!(
        dark_current_e_s,
        Limits::NotNegative,
        "dark current of a pixel, in electrons a second"
    ),
    key!(
        full_well_e,
        Limits::Positive,
        "charge at which a pixel is full, in electrons"
    ),
    key!(
        gain_e_per_adu,
        Limits::Positive,
        "electrons for a step of the grey level"
    ),
    key!(bits, Limits::Whole(1.0, 32.0), "bits of the grey level"),
    key!(bias_adu, Limits::NotNegative, "grey level without light"),
    Key {
        name: "spot_sigma_px",
        about: "standard deviation of a star's spot, in pixels",
        limits: SPOTS_PX,
        get: |sheet| Some(sheet.spot_sigma_px),
        set: |sheet, sigma_px| {
            sheet.spot_sigma_px = sigma_px;
            // A share that was stated is that of another spot.
            sheet.peak_share = None;
        },
    },
    Key {
        name: "peak_share",
        about: "part of a star's light on its brightest pixel (else from spot_sigma_px)",
        limits: Limits::Share,
        get: |sheet| Some(sheet.peak_share()),
        set: |sheet, share| sheet.peak_share = Some(share),
    },
];

/// A `camera.toml` with the values of `preset` and a comment at each.
pub fn template(preset: Preset) -> String {
    let sheet = preset.data_sheet();
    let mut text = format!("# A camera for starpipe: {}\n", preset.about());
    for line in preset.sources().lines() {
        let _ = writeln!(text, "# {line}");
    }
    let _ = writeln!(text, "\nname = {:?}", sheet.name);
    for key in KEYS {
        let value = match key.name {
            "lens_transmission" => response_value(&sheet.lens_transmission),
            "quantum_efficiency" => response_value(&sheet.quantum_efficiency),
            "peak_share" => match sheet.peak_share {
                Some(share) => share.to_string(),
                None => continue,
            },
            _ => (key.get)(&sheet).map_or_else(String::new, |value| value.to_string()),
        };
        let _ = writeln!(text, "\n# {}\n{} = {value}", key.about, key.name);
    }
    text + &imperfections(&sheet)
}

/// What a file need not say: as comments, with what then holds.
fn imperfections(sheet: &DataSheet) -> String {
    let mut text =
        "\n# Of the rest, which simulated frames show, each may be left out:\n".to_owned();
    let forms = SpotForm::ALL.map(|form| format!("{:?}", form.name()));
    let imperfections = &sheet.imperfections;
    let _ = writeln!(
        text,
        "\n# form of a star's spot: {}\n# spot_form = {:?}\n\n# whether the image is reversed left to right\n# mirrored = {}",
        forms.join(", "),
        imperfections.spot_form.name(),
        imperfections.mirrored
    );
    for key in IMPERFECTION_KEYS {
        let value = (key.get)(sheet).map_or_else(String::new, |value| value.to_string());
        let _ = writeln!(text, "\n# {}\n# {} = {value}", key.about, key.name);
    }
    text
}

/// A response as the file takes it: a number, or points in place of a file's name.
fn response_value(response: &Response) -> String {
    match response {
        Response::Constant(value) => value.to_string(),
        Response::Table(points) => {
            let points: Vec<String> = points
                .iter()
                .map(|(nm, value)| format!("    [{nm}, {value}],\n"))
                .collect();
            format!(
                "[ # wavelength in nm, value; or the name of a CSV file: \"curve.csv\"\n{}]",
                points.concat()
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_that_was_meant_is_found() {
        let nearest = |name| nearest_name(name, KEYS.iter().map(|key| key.name));
        assert_eq!(nearest("apertur_mm"), Some("aperture_mm"));
        assert_eq!(nearest("read-noise"), Some("read_noise_e"));
        assert_eq!(nearest("focal_lenght_mm"), Some("focal_length_mm"));
        assert_eq!(nearest("zzz"), None);
    }

    #[test]
    fn another_spot_has_another_share_on_its_brightest_pixel() {
        let mut sheet = Preset::Experiment1.data_sheet();
        let set =
            |sheet: &mut DataSheet, name, value| (Key::find(KEYS, name).unwrap().set)(sheet, value);
        set(&mut sheet, "spot_sigma_px", 0.5);
        // erf(1/√2)² = 0.682689².
        assert!((sheet.peak_share() - 0.466_065).abs() < 1e-6);
        set(&mut sheet, "peak_share", 0.25);
        assert_eq!((sheet.spot_sigma_px, sheet.peak_share()), (0.5, 0.25));
    }

    #[test]
    fn a_band_without_an_end_is_outside_the_limits() {
        for name in ["band_from_nm", "band_to_nm"] {
            let limits = Key::find(KEYS, name).unwrap().limits;
            assert!(limits.accept(400.0) && !limits.accept(1e300), "{name}");
        }
    }

    #[test]
    fn values_without_sense_are_outside_the_limits() {
        assert!(!Limits::Positive.accept(0.0) && !Limits::Positive.accept(f64::NAN));
        assert!(Limits::NotNegative.accept(0.0) && !Limits::NotNegative.accept(-1.0));
        assert!(Limits::Share.accept(1.0) && !Limits::Share.accept(1.1));
        assert!(Limits::Whole(1.0, 32.0).accept(12.0) && !Limits::Whole(1.0, 32.0).accept(12.5));
        assert!(!Limits::FromToBelow(0.0, 90.0).accept(90.0));
    }
}
