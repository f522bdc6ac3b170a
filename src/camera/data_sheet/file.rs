//! Reads `camera.toml` strictly, with errors that name line and key.

use super::error::{DataSheetError, line_of};
use super::imperfections::{Imperfections, SpotForm};
use super::key::{Key, NumberRange, nearest_name};
use super::keys::{IMPERFECTION_KEYS, KEYS, is_curve};
use super::lens_table;
use super::response::Response;
use super::sheet::DataSheet;
use super::spot_image::SpotImage;
use crate::base::files;
use crate::base::size::Size;
use crate::camera::{FrameSizeError, KnownLens, Projection, agreed_size};
use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;

/// Maximum size of a data sheet, in bytes.
const MAX_BYTES: u64 = 1 << 20;
/// Optional keys and their default values.
const DEFAULTS: &[(&str, f64)] = &[
    ("bias_adu", 0.0),
    ("band_from_nm", 400.0),
    ("band_to_nm", 900.0),
];

/// Whether the key may be missing and has no default value in [`DEFAULTS`].
fn is_optional(name: &str) -> bool {
    name == "peak_share" || IMPERFECTION_KEYS.iter().any(|key| key.name == name)
}

type Table = BTreeMap<Spanned<String>, Spanned<toml::Value>>;

/// The table of a file that is of a measured lens, and not of the data sheet.
const LENS: &str = "lens";

/// The text of a description, if it is not too long.
fn text_of(path: &Path) -> Result<String, DataSheetError> {
    let failed = |source| DataSheetError::Read {
        path: path.to_owned(),
        source,
    };
    let file = files::open(path).map_err(failed)?;
    let mut text = String::new();
    file.take(MAX_BYTES + 1)
        .read_to_string(&mut text)
        .map_err(failed)?;
    if text.len() as u64 > MAX_BYTES {
        return Err(DataSheetError::TooLarge {
            path: path.to_owned(),
            limit: MAX_BYTES,
        });
    }
    Ok(text)
}

/// What a `camera.toml` describes: the camera by its data sheet, a lens that was measured, or both.
#[derive(Debug, Clone, Default)]
pub struct CameraDescription {
    /// The data sheet.
    pub sheet: Option<DataSheet>,
    /// The lens.
    pub lens: Option<Arc<KnownLens>>,
}

impl CameraDescription {
    /// Reads a `camera.toml`. File names in it are relative to its directory.
    ///
    /// # Errors
    /// [`DataSheetError`] with the file, the line and the key.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, DataSheetError> {
        let path = path.as_ref();
        Self::parse(path, &text_of(path)?)
    }

    /// Parses the text of such a file; `path` is its name.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(path: &Path, text: &str) -> Result<Self, DataSheetError> {
        let lens = lens_table::parse(path, text)?.map(Arc::new);
        let file = SheetFile::parse(path, text)?;
        let is_lens_alone = lens.is_some() && file.table.is_empty();
        let sheet = (!is_lens_alone).then(|| file.data_sheet()).transpose()?;
        Ok(Self { sheet, lens })
    }

    /// Width and height in pixels of a frame of this camera, of which `stated` is known; `None` where
    /// neither tells them.
    ///
    /// # Errors
    /// [`FrameSizeError`] where what is stated, the data sheet and the lens contradict each other.
    pub fn frame_size(
        &self,
        stated: [Option<usize>; 2],
    ) -> Result<[Option<usize>; 2], FrameSizeError> {
        agreed_size(stated, &self.sizes())
    }

    /// The sizes of the camera's frames, by its data sheet and by its lens.
    pub(crate) fn sizes(&self) -> Vec<Size> {
        let of_sheet = self.sheet.as_ref().map(DataSheet::size);
        let of_lens = self.lens.as_deref().map(KnownLens::size);
        of_sheet.into_iter().chain(of_lens).collect()
    }
}

impl From<DataSheet> for CameraDescription {
    fn from(sheet: DataSheet) -> Self {
        Self {
            sheet: Some(sheet),
            lens: None,
        }
    }
}

impl DataSheet {
    /// Reads a `camera.toml`. File names in it are relative to its directory.
    ///
    /// # Errors
    /// [`DataSheetError`] with the file, the line and the key.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, DataSheetError> {
        let path = path.as_ref();
        Self::parse(path, &text_of(path)?)
    }

    /// Parses the text of such a file; `path` is its name.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(path: &Path, text: &str) -> Result<Self, DataSheetError> {
        SheetFile::parse(path, text)?.data_sheet()
    }

    /// The first contradiction between values, if any.
    pub fn contradiction(&self) -> Option<String> {
        let (from, to) = (self.band_from_nm, self.band_to_nm);
        if from >= to {
            return Some(format!(
                "band_from_nm must be below band_to_nm: found {from} and {to}"
            ));
        }
        if let Some(uncovered) = self.uncovered(from, to) {
            return Some(format!("{uncovered} (band_from_nm, band_to_nm)"));
        }
        if self.imperfections.spot_form == SpotForm::File && self.spot_image.is_none() {
            return Some("spot_form is \"file\", but spot_file is missing".to_owned());
        }
        (self.bias_adu >= self.full_scale_adu()).then(|| {
            let (bias, bits) = (self.bias_adu, self.bits);
            format!("bias_adu is {bias}, beyond the full scale of {bits} bits")
        })
    }

    /// A message if a curve does not cover the band between two wavelengths in nm.
    pub fn uncovered(&self, from_nm: f64, to_nm: f64) -> Option<String> {
        let curves = [
            ("lens_transmission", &self.lens_transmission),
            ("quantum_efficiency", &self.quantum_efficiency),
        ];
        curves.into_iter().find_map(|(name, curve)| {
            let (first, last) = curve.range_nm()?;
            (first > from_nm || last < to_nm).then(|| {
                format!(
                    "{name} is known from {first} to {last} nm, which does not cover the band from {from_nm} to {to_nm} nm"
                )
            })
        })
    }
}

/// A parsed TOML file, without a lens.
struct SheetFile<'a> {
    path: &'a Path,
    text: &'a str,
    table: Table,
}

impl<'a> SheetFile<'a> {
    fn parse(path: &'a Path, text: &'a str) -> Result<Self, DataSheetError> {
        let parsed = toml::from_str(text);
        let mut table: Table =
            parsed.map_err(|error| DataSheetError::syntax(path, text, &error))?;
        table.retain(|key, _| key.get_ref() != LENS);
        Ok(Self { path, text, table })
    }

    fn data_sheet(&self) -> Result<DataSheet, DataSheetError> {
        self.check_names()?;
        let mut sheet = DataSheet {
            name: self.name()?,
            width_px: 0,
            height_px: 0,
            pitch_x_um: 0.0,
            pitch_y_um: 0.0,
            focal_length_mm: 0.0,
            aperture_mm: 0.0,
            lens_transmission: self.response("lens_transmission")?,
            quantum_efficiency: self.response("quantum_efficiency")?,
            band_from_nm: 0.0,
            band_to_nm: 0.0,
            read_noise_e: 0.0,
            dark_current_e_s: 0.0,
            full_well_e: 0.0,
            gain_e_per_adu: 0.0,
            bits: 0,
            bias_adu: 0.0,
            spot_sigma_px: 0.0,
            peak_share: None,
            spot_image: self.spot_image()?,
            imperfections: Imperfections {
                spot_form: self.spot_form()?,
                projection: self.projection()?,
                mirrored: self.mirrored()?,
                ..Imperfections::default()
            },
        };
        let keys = KEYS.iter().chain(IMPERFECTION_KEYS);
        for key in keys.filter(|key| !is_curve(key.name)) {
            if let Some(value) = self.number(key)? {
                (key.set)(&mut sheet, value);
            }
        }
        match sheet.contradiction() {
            None => Ok(sheet),
            Some(what) => Err(DataSheetError::Contradiction {
                path: self.path.to_owned(),
                what,
            }),
        }
    }

    fn check_names(&self) -> Result<(), DataSheetError> {
        let numbers = || KEYS.iter().chain(IMPERFECTION_KEYS).map(|key| key.name);
        let names = || {
            ["name", "spot_form", "spot_file", "projection", "mirrored"]
                .into_iter()
                .chain(numbers())
        };
        for key in self.table.keys() {
            let name = key.get_ref().as_str();
            if !names().any(|known| known == name) {
                return Err(DataSheetError::UnknownKey {
                    path: self.path.to_owned(),
                    line: line_of(self.text, Some(key.span())),
                    key: name.to_owned(),
                    nearest: nearest_name(name, names()).map(Into::into),
                });
            }
        }
        Ok(())
    }

    fn get(&self, name: &str) -> Option<&Spanned<toml::Value>> {
        let found = self.table.iter().find(|(key, _)| key.get_ref() == name);
        found.map(|(_, value)| value)
    }

    fn invalid(&self, key: &str, value: &Spanned<toml::Value>, expected: String) -> DataSheetError {
        let found = self.text.get(value.span()).unwrap_or_default();
        let mut found: String = found.chars().take(40).collect();
        if found.is_empty() {
            found = "empty".to_owned();
        }
        DataSheetError::Value {
            path: self.path.to_owned(),
            line: line_of(self.text, Some(value.span())),
            key: key.to_owned(),
            found,
            expected,
        }
    }

    fn name(&self) -> Result<String, DataSheetError> {
        match self.get("name") {
            None => Ok(self.path.file_stem().map_or_else(
                || "camera".to_owned(),
                |stem| stem.to_string_lossy().into_owned(),
            )),
            Some(value) => match value.get_ref() {
                toml::Value::String(name) => Ok(name.clone()),
                _ => Err(self.invalid("name", value, "a quoted string".to_owned())),
            },
        }
    }

    fn spot_form(&self) -> Result<SpotForm, DataSheetError> {
        let Some(value) = self.get("spot_form") else {
            let has_file = self.get("spot_file").is_some();
            return Ok(if has_file {
                SpotForm::File
            } else {
                SpotForm::default()
            });
        };
        let form = value.get_ref().as_str().and_then(SpotForm::named);
        form.ok_or_else(|| {
            let names = SpotForm::ALL.map(|form| format!("\"{}\"", form.name()));
            self.invalid("spot_form", value, format!("one of {}", names.join(", ")))
        })
    }

    fn projection(&self) -> Result<Projection, DataSheetError> {
        const KEY: &str = "projection";
        let Some(value) = self.get(KEY) else {
            return Ok(Projection::Pinhole);
        };
        let projection = value.get_ref().as_str().and_then(Projection::named);
        projection.ok_or_else(|| {
            let names = Projection::ALL.map(|projection| format!("\"{}\"", projection.name()));
            self.invalid(KEY, value, format!("one of {}", names.join(", ")))
        })
    }

    fn spot_image(&self) -> Result<Option<Arc<SpotImage>>, DataSheetError> {
        const KEY: &str = "spot_file";
        let Some(value) = self.get(KEY) else {
            return Ok(None);
        };
        let Some(file) = value.get_ref().as_str() else {
            return Err(self.invalid(KEY, value, "the name of a CSV file".to_owned()));
        };
        let directory = self.path.parent().unwrap_or(Path::new(""));
        let image = SpotImage::read(directory.join(file));
        let image = image.map_err(|source| DataSheetError::Spot {
            path: self.path.to_owned(),
            line: line_of(self.text, Some(value.span())),
            source: Box::new(source),
        })?;
        Ok(Some(Arc::new(image)))
    }

    fn mirrored(&self) -> Result<bool, DataSheetError> {
        let Some(value) = self.get("mirrored") else {
            return Ok(false);
        };
        let mirrored = value.get_ref().as_bool();
        mirrored.ok_or_else(|| self.invalid("mirrored", value, "true or false".to_owned()))
    }

    /// The value of a key, or its default; `None` if it is optional without a default.
    fn number(&self, key: &Key<DataSheet>) -> Result<Option<f64>, DataSheetError> {
        let Some(value) = self.get(key.name) else {
            let default = DEFAULTS.iter().find(|(name, _)| *name == key.name);
            return match default {
                Some((_, value)) => Ok(Some(*value)),
                None if is_optional(key.name) => Ok(None),
                None => Err(self.missing(key.name)),
            };
        };
        as_number(value.get_ref())
            .filter(|number| key.limits.accept(*number))
            .map(Some)
            .ok_or_else(|| self.invalid(key.name, value, key.limits.to_string()))
    }

    fn missing(&self, name: &str) -> DataSheetError {
        let key = KEYS.iter().find(|key| key.name == name);
        DataSheetError::Missing {
            path: self.path.to_owned(),
            key: key.map_or("a key", |key| key.name),
            about: key.map_or("", |key| key.about),
        }
    }

    fn response(&self, name: &str) -> Result<Response, DataSheetError> {
        let value = self.get(name).ok_or_else(|| self.missing(name))?;
        let line = line_of(self.text, Some(value.span()));
        let table = |source| DataSheetError::Response {
            path: self.path.to_owned(),
            line,
            key: name.to_owned(),
            source: Box::new(source),
        };
        match value.get_ref() {
            toml::Value::String(file) => {
                let directory = self.path.parent().unwrap_or(Path::new(""));
                Response::read(directory.join(file)).map_err(table)
            }
            toml::Value::Array(points) => {
                let text = csv_of(points).ok_or_else(|| {
                    let expected = "pairs of wavelength in nm and value";
                    self.invalid(name, value, expected.to_owned())
                })?;
                Response::parse(self.path, text.as_bytes()).map_err(table)
            }
            other => as_number(other)
                .filter(|number| NumberRange::Share.accept(*number))
                .map(Response::Constant)
                .ok_or_else(|| {
                    let expected = "a number above 0 and at most 1, or the name of a CSV file";
                    self.invalid(name, value, expected.to_owned())
                }),
        }
    }
}

fn as_number(value: &toml::Value) -> Option<f64> {
    value
        .as_float()
        .or_else(|| value.as_integer().map(|whole| whole as f64))
}

/// Points listed in the file itself, as the text of a CSV table.
fn csv_of(points: &[toml::Value]) -> Option<String> {
    let mut text = "wavelength_nm,value\n".to_owned();
    for point in points {
        let [nm, value] = point.as_array()?.as_slice() else {
            return None;
        };
        text += &format!("{},{}\n", as_number(nm)?, as_number(value)?);
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::super::{Preset, template};
    use super::*;

    fn parsed(text: &str) -> Result<DataSheet, DataSheetError> {
        DataSheet::parse("camera.toml".as_ref(), text)
    }

    fn with(key: &str, line: &str) -> String {
        let text = template(Preset::Experiment1);
        let kept = text.lines().map(|old| match old.split(" = ").next() {
            Some(name) if name == key => line,
            _ => old,
        });
        kept.collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn a_template_is_read_back_as_it_was() {
        for preset in Preset::ALL {
            assert_eq!(parsed(&template(preset)).unwrap(), preset.data_sheet());
        }
    }

    #[test]
    fn an_error_names_line_key_value_and_what_was_expected() {
        for (key, line, expected) in [
            (
                "aperture_mm",
                "aperture_mm = -5",
                "aperture_mm is -5, expected a number above 0",
            ),
            (
                "aperture_mm",
                "",
                "aperture_mm is missing: diameter of the entrance pupil, in mm",
            ),
            (
                "aperture_mm",
                "apertur_mm = 5",
                "unknown key 'apertur_mm'; did you mean 'aperture_mm'?",
            ),
            (
                "bits",
                "bits = 12.5",
                "bits is 12.5, expected a whole number from 1 to 32",
            ),
            (
                "read_noise_e",
                "read_noise_e = nan",
                "read_noise_e is nan, expected a number of 0 or more",
            ),
            (
                "read_noise_e",
                "read_noise_e = \"five\"",
                "is \"five\", expected",
            ),
            (
                "lens_transmission",
                "lens_transmission = 1.5",
                "lens_transmission is 1.5, expected",
            ),
            (
                "lens_transmission",
                "lens_transmission = [[400, 0.5], [390, 0.6]]",
                "wavelengths must rise",
            ),
            (
                "lens_transmission",
                "lens_transmission = [[400, 0.5], [500, 0.6]]",
                "does not cover the band",
            ),
            (
                "lens_transmission",
                "lens_transmission = [1, 2]",
                "expected pairs of wavelength",
            ),
            (
                "band_from_nm",
                "band_from_nm = 2000",
                "band_from_nm must be below band_to_nm",
            ),
            (
                "bias_adu",
                "bias_adu = 1e6",
                "beyond the full scale of 12 bits",
            ),
            ("name", "name = 5", "name is 5, expected a quoted string"),
        ] {
            let error = parsed(&with(key, line)).unwrap_err();
            let error = format!(
                "{error}: {:?}",
                std::error::Error::source(&error).map(ToString::to_string)
            );
            assert!(
                error.starts_with("camera.toml") && error.contains(expected),
                "{error}"
            );
        }
        let error = parsed("a = [").unwrap_err().to_string();
        assert!(error.starts_with("camera.toml, line 1: "), "{error}");
    }
}
