//! From raw arguments to the library's configurations.

use super::Fault;
use super::args::{CalibrationArgs, Centroid, DetectionArgs, HintArgs, LightArgs, OutputArgs};
use super::input::is_stdin;
use super::output::OutputSettings;
use super::overwrite;
use anyhow::Context;
use starpipe::base::coords::UnitVector;
use starpipe::base::units::{RAD_PER_ARCSEC, RAD_PER_DEG};
use starpipe::calibration::{Calibration, Master, read_hot_pixels};
use starpipe::camera::data_sheet::Sensor;
use starpipe::detect::{CentroidMethod, DetectConfig};
use starpipe::frame;
use starpipe::model::sensitivity::Extinction;
use starpipe::photometry::comparison::Description;
use starpipe::pipeline::{DateSource, FrameDate, Knowledge, Scale, ScaleHint};
use starpipe::report::TextOptions;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// How far a scale given may be off where nothing is said of it, in percent.
const DEFAULT_SCALE_ERROR_PERCENT: f64 = 10.0;

impl HintArgs {
    /// What is known of the frames.
    pub(crate) fn resolve(&self) -> Result<Knowledge, Fault> {
        let fov = self.fov.map(|deg| Scale::FieldOfView(deg * RAD_PER_DEG));
        let pixel = self
            .pixel_scale
            .map(|arcsec| Scale::Pixel(arcsec * RAD_PER_ARCSEC));
        let scale = fov.or(pixel);
        if scale.is_none() && self.scale_error.is_some() {
            return Err(Fault::Usage(
                "--scale-error says how far --fov or --pixel-scale may be off; give one of these, too".into(),
            ));
        }
        let tolerance = self.scale_error.unwrap_or(DEFAULT_SCALE_ERROR_PERCENT) / 100.0;
        let near = self.near.zip(self.radius).map(|(direction, radius_deg)| {
            let (ra_rad, dec_rad) = (
                direction.ra_deg * RAD_PER_DEG,
                direction.dec_deg * RAD_PER_DEG,
            );
            (
                UnitVector::from_ra_dec(ra_rad, dec_rad),
                radius_deg * RAD_PER_DEG,
            )
        });
        Ok(Knowledge {
            scale: scale.map(|scale| ScaleHint { scale, tolerance }),
            near,
            date: self.date.map(|date| FrameDate {
                date,
                source: DateSource::Option,
            }),
            site: self.site,
            exposure_s: None,
        })
    }

    /// The same, with the scale of the camera where no other is given.
    pub(crate) fn resolve_with_camera(&self) -> Result<Knowledge, Fault> {
        let sensor = self.sensor()?;
        let knowledge = self.resolve()?;
        Ok(Knowledge {
            scale: knowledge
                .scale
                .or(sensor.as_ref().map(ScaleHint::of_camera)),
            ..knowledge
        })
    }

    /// The camera, where it is described.
    pub(crate) fn sensor(&self) -> anyhow::Result<Option<Sensor>> {
        let read = |path: &PathBuf| Ok(Sensor::read(path)?);
        self.camera.as_ref().map(read).transpose()
    }
}

impl LightArgs {
    /// The camera `sensor`, and what it looked through.
    pub(crate) fn description(&self, sensor: Sensor) -> Description {
        Description {
            sensor,
            zenith_distance_deg: self.zenith_distance,
            extinction: self.extinction.map(Extinction::MagPerAirmass),
        }
    }
}

impl CalibrationArgs {
    /// What is to be taken out of frames, where anything is.
    pub(crate) fn resolve(&self, sensor: Option<&Sensor>) -> anyhow::Result<Option<Calibration>> {
        if self.dark.is_none() && self.flat.is_none() && self.hot_pixels.is_none() {
            return Ok(None);
        }
        let master = |path: &Option<PathBuf>| path.as_deref().map(read_master).transpose();
        let list = self.hot_pixels.as_deref().map(read_hot_pixels).transpose();
        let bias_adu = sensor.map_or(0.0, |sensor| sensor.bias_adu);
        let calibration = Calibration::new(
            master(&self.dark)?,
            master(&self.flat)?,
            list.context("reading the hot pixels")?,
            bias_adu,
        );
        Ok(Some(calibration?))
    }
}

/// A master frame of any kind of file.
pub(crate) fn read_master(path: &Path) -> anyhow::Result<Master> {
    Ok(Master {
        name: path.display().to_string(),
        frame: frame::read(path).context("reading")?,
    })
}

impl DetectionArgs {
    /// How to detect stars; what is not given stays as the library has it.
    pub(crate) fn resolve(&self) -> DetectConfig {
        let mut config = DetectConfig {
            threshold_sigma: self.sigma,
            ..DetectConfig::default()
        };
        if let Some(number) = self.false_alarms {
            config.false_alarms_per_mpx = number;
        }
        if let Some(centroid) = self.centroid {
            config.centroid = match centroid {
                Centroid::GaussianFit => CentroidMethod::GaussianFit,
                Centroid::GreyWeighted => CentroidMethod::GreyWeighted,
            };
        }
        config
    }
}

/// Extensions of the files that `--out` makes of a frame, and of a list of centroids.
pub(crate) const FRAME_RESULTS: &[&str] = &["json", "csv", "png", "wcs"];
pub(crate) const LIST_RESULTS: &[&str] = &["json", "csv", "wcs"];

impl OutputArgs {
    /// Where the results of `inputs` go; `extensions` are those of the files made of each.
    pub(crate) fn resolve(
        self,
        inputs: &[PathBuf],
        extensions: &[&str],
    ) -> Result<OutputSettings, Fault> {
        if let Some(directory) = &self.out {
            overwrite::check(inputs, directory, extensions)?;
        }
        Ok(OutputSettings {
            format: self.format,
            text: TextOptions {
                all_stars: self.all_stars,
            },
            directory: self.out,
        })
    }
}

/// The name under which the results of `input` are written, without its extension.
pub(crate) fn result_stem(input: &Path) -> &OsStr {
    if is_stdin(input) {
        return OsStr::new("stdin");
    }
    input.file_stem().unwrap_or(OsStr::new("frame"))
}

/// The file that holds the results of `input` in one form.
pub(crate) fn output_path(directory: &Path, input: &Path, extension: &str) -> PathBuf {
    let mut name = result_stem(input).to_owned();
    name.push(".");
    name.push(extension);
    directory.join(name)
}
