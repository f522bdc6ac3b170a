//! Reads the table `[lens]` of `camera.toml`: a lens that was measured.

use super::error::DataSheetError;
use crate::base::format::excerpt;
use crate::base::units::RAD_PER_DEG;
use crate::camera::{CameraModel, Distortion, DistortionModel, KnownLens, Projection};
use nalgebra::DMatrix;
use serde::Deserialize;
use std::path::Path;

/// The table `[lens]` of a file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LensTable {
    width_px: u32,
    height_px: u32,
    mirrored: bool,
    projection: String,
    focal_length_px: f64,
    valid_to_deg: Option<f64>,
    distortion: Option<String>,
    radius_px: Option<f64>,
    #[serde(default)]
    terms_px: Vec<f64>,
    covariance: Vec<Vec<f64>>,
}

/// A file with the table, whatever else is in it.
#[derive(Debug, Deserialize)]
struct LensFile {
    lens: Option<LensTable>,
}

/// Parses the table `[lens]` of the text of a file, if it has one; `path` is its name.
///
/// # Errors
/// [`DataSheetError`] with the file and what is wrong.
pub(super) fn parse(path: &Path, text: &str) -> Result<Option<KnownLens>, DataSheetError> {
    let file: LensFile =
        toml::from_str(text).map_err(|error| DataSheetError::syntax(path, text, &error))?;
    let lens = file.lens.map(|table| {
        table.lens().map_err(|what| DataSheetError::Contradiction {
            path: path.to_owned(),
            what: format!("[lens]: {what}"),
        })
    });
    lens.transpose()
}

impl LensTable {
    fn lens(self) -> Result<KnownLens, String> {
        let projection = Projection::named(&self.projection)
            .ok_or_else(|| format!("unknown projection '{}'", excerpt(&self.projection)))?;
        let [width_px, height_px] = [self.width_px, self.height_px].map(f64::from);
        let is_size = |side: f64| (1.0..=1e6).contains(&side);
        if !is_size(width_px) || !is_size(height_px) {
            return Err(format!(
                "the frame size is {width_px} x {height_px} pixels, expected 1 to 1000000 pixels on each side"
            ));
        }
        let focal_px = self.focal_length_px;
        if !(1.0..=1e9).contains(&focal_px) {
            return Err(format!(
                "focal_length_px is {focal_px}, expected a number from 1 to 1000000000"
            ));
        }
        let mut camera = CameraModel::pinhole(width_px, height_px, focal_px, self.mirrored)
            .with_projection(projection)
            .with_distortion(self.distortion()?);
        if let Some(valid_to_deg) = self.valid_to_deg {
            if !(0.0..=180.0).contains(&valid_to_deg) {
                return Err(format!(
                    "valid_to_deg is {valid_to_deg}, expected an angle from 0 to 180"
                ));
            }
            camera = camera.limited_to(valid_to_deg * RAD_PER_DEG);
        }
        camera.check().map_err(|error| error.to_string())?;
        let side = self.covariance.len();
        if self.covariance.iter().any(|row| row.len() != side) {
            return Err("covariance is not square".to_owned());
        }
        let covariance = DMatrix::from_fn(side, side, |row, column| self.covariance[row][column]);
        KnownLens::new(camera, covariance).ok_or_else(|| {
            "covariance is not a valid covariance matrix of ln(focal_length_px) and terms_px"
                .to_owned()
        })
    }

    fn distortion(&self) -> Result<Option<Distortion>, String> {
        let Some(name) = &self.distortion else {
            return Ok(None);
        };
        let model = DistortionModel::ALL
            .into_iter()
            .find(|model| model.name() == name);
        let model = model.ok_or_else(|| format!("unknown distortion '{}'", excerpt(name)))?;
        let radius_px = self.radius_px.filter(|radius_px| *radius_px >= 1.0);
        let radius_px = radius_px.ok_or("radius_px is missing, or below 1")?;
        let terms = &self.terms_px;
        if terms.len() != model.terms() || terms.iter().any(|term| !term.is_finite()) {
            let (found, expected) = (terms.len(), model.terms());
            return Err(format!(
                "terms_px has {found} numbers, {name} has {expected}"
            ));
        }
        Ok(Some(Distortion::new(model, radius_px, terms)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::PixelPoint;

    fn lens() -> KnownLens {
        let model = DistortionModel::Radial5;
        let distortion = Distortion::new(model, 640.0, &[-12.5, 1.0 / 3.0]);
        let camera = CameraModel::pinhole(1024.0, 768.0, 700.1, true)
            .with_projection(Projection::Equisolid)
            .with_distortion(Some(distortion))
            .limited_to(1.3);
        let mut covariance =
            DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![1e-10, 0.01, 0.04]));
        covariance[(0, 1)] = 1e-7;
        covariance[(1, 0)] = 1e-7;
        KnownLens::new(camera, covariance).unwrap()
    }

    #[test]
    fn what_is_written_is_read() {
        let text = lens().to_toml(&["Of a test.".to_owned()]);
        let read = parse(Path::new("a.toml"), &text).unwrap().unwrap();
        assert_eq!(read.covariance(), lens().covariance());
        let pixel = PixelPoint::new(100.0, 200.0);
        let [a, b] = [&read, &lens()].map(|lens| lens.camera().direction_of(&pixel).unwrap());
        assert!(a.angle_to(&b) < 1e-14);
        assert!((read.camera().max_angle_rad() - 1.3).abs() < 1e-14);
        assert!(
            parse(Path::new("a.toml"), "width_px = 3")
                .unwrap()
                .is_none()
        );
    }

    #[test]
    fn what_is_wrong_is_named() {
        let text = lens().to_toml(&[]);
        for (from, to, expected) in [
            ("equisolid", "equisold", "unknown projection 'equisold'"),
            (
                "radial5",
                "radial7",
                "terms_px has 2 numbers, radial7 has 3",
            ),
            ("[1e-10", "[-1e-10", "covariance is not a valid"),
            ("mirrored = true", "mirrored = 1", "line 4"),
            ("radius_px = 640.0", "radius = 640.0", "unknown field"),
            ("= 700.1", "= 7e8", "the focal length is 7e8 px"),
            ("[-12.5", "[-400.0", "the distortion is not monotonic"),
        ] {
            assert!(text.contains(from), "{from}: {text}");
            let error = parse(Path::new("a.toml"), &text.replace(from, to)).unwrap_err();
            assert!(error.to_string().contains(expected), "{error}");
        }
    }
}
