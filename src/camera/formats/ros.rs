//! ROS: `camera_info` YAML, as `camera_calibration_parsers` reads and writes it.
//!
//! # Reference
//! ROS, `sensor_msgs/CameraInfo`.

use super::error::FormatError;
use super::error::TOLERANCE_PX;
use super::opencv::cv_lens;
use super::yaml::write_matrix;
use crate::CameraModel;
use std::fmt::Write as _;

/// The lens as ROS `camera_info`: the numbers of [`opencv_yaml`](super::opencv_yaml), with at most
/// eight coefficients, no rectification, and K as the projection.
///
/// # Errors
/// [`FormatError::TooFarOff`] if a pinhole cannot be written to [`TOLERANCE_PX`], or nothing fits;
/// [`FormatError::Value`] if the name has other characters than letters, digits, `_`, `-`, `.` and `/`.
pub fn ros_camera_info(camera: &CameraModel, camera_name: &str) -> Result<String, FormatError> {
    const MATRIX: [&str; 3] = ["", "", "  "];
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-./".contains(c);
    if camera_name.is_empty() || !camera_name.chars().all(is_plain) {
        return Err(FormatError::Value {
            key: "camera_name",
            found: format!("'{camera_name}'"),
            expected: "letters, digits, '_', '-', '.' and '/'",
        });
    }
    let tolerance_px = if camera.is_pinhole() {
        TOLERANCE_PX
    } else {
        f64::MAX
    };
    let lens = cv_lens(camera, tolerance_px, &[5, 8])?;
    let mut text = String::new();
    // Writing to a text does not fail.
    if let Some(largest_px) = lens.largest_px {
        let _ = writeln!(
            text,
            "# Fitted to the measured lens; largest error on the frame: {largest_px:.4} px."
        );
    }
    let _ = writeln!(text, "image_width: {}", camera.width_px);
    let _ = writeln!(text, "image_height: {}", camera.height_px);
    let _ = writeln!(text, "camera_name: {camera_name}");
    let matrix = lens.camera_matrix();
    write_matrix(&mut text, "camera_matrix", MATRIX, [3, 3], &matrix);
    let _ = writeln!(text, "distortion_model: {}", lens.distortion_model());
    let (key, count) = ("distortion_coefficients", lens.coefficients.len());
    write_matrix(&mut text, key, MATRIX, [1, count], &lens.coefficients);
    let unturned = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    write_matrix(&mut text, "rectification_matrix", MATRIX, [3, 3], &unturned);
    let rows = matrix.as_chunks::<3>().0.iter();
    let projection: Vec<f64> = rows.flat_map(|[a, b, c]| [*a, *b, *c, 0.0]).collect();
    write_matrix(&mut text, "projection_matrix", MATRIX, [3, 4], &projection);
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::super::from_opencv_yaml;
    use super::*;
    use crate::camera::{Distortion, DistortionModel};

    #[test]
    fn the_file_has_the_entries_of_ros_in_their_order() {
        let camera = CameraModel::pinhole(640.0, 480.0, 900.5, false);
        let terms_px = [-20.0, 3.0, 0.0, 4.5, -2.5, 0.5, 0.25];
        let model = DistortionModel::BrownConrady;
        let distortion = Distortion::new(model, camera.radius_px(), &terms_px);
        let camera = camera.with_distortion(Some(distortion));
        let text = ros_camera_info(&camera, "roof").unwrap();
        let keys = text.lines().filter(|line| !line.starts_with(' '));
        let keys: Vec<_> = keys.map(|line| line.split(':').next().unwrap()).collect();
        assert_eq!(
            keys.join(" "),
            "image_width image_height camera_name camera_matrix distortion_model \
             distortion_coefficients rectification_matrix projection_matrix"
        );
        assert!(text.contains(
            "data: [900.5, 0.0, 324.0, 0.0, 0.0, 900.5, 237.0, 0.0, 0.0, 0.0, 1.0, 0.0]"
        ));
        let read = from_opencv_yaml(&text).unwrap();
        assert!((read.focal_length_px() - 900.5).abs() < 1e-12);
        let found = read.distortion().unwrap().coefficients_px();
        for (found, expected) in found.iter().zip(terms_px) {
            assert!((found - expected).abs() < 1e-9);
        }
    }

    #[test]
    fn a_name_that_yaml_would_misread_is_refused() {
        let camera = CameraModel::pinhole(640.0, 480.0, 900.5, false);
        for name in ["", "a: b", "# roof"] {
            assert!(ros_camera_info(&camera, name).is_err(), "{name}");
        }
    }
}
