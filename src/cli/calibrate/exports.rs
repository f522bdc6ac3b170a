//! The lens in the files of other programs.

use crate::cli::output::files::NewFile;
use anyhow::{Context as _, anyhow};
use clap::Args;
use starpipe::camera::formats::{
    Pointing, indi_allsky_json, opencv_yaml, platepar, ros_camera_info,
};
use starpipe::identify::lens::LensCalibration;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
#[command(next_help_heading = "Files for other programs")]
pub(super) struct ExportOptions {
    /// Write the lens as camera matrix and distortion of OpenCV, for cv or cv::fisheye
    #[arg(long, value_name = "FILE.yaml")]
    opencv: Option<PathBuf>,
    /// Write the lens as ROS camera_info
    #[arg(long, value_name = "FILE.yaml")]
    ros: Option<PathBuf>,
    /// Write the lens and the pointing of the first frame as an RMS platepar; needs --site and a
    /// date with time of day
    #[arg(long, value_name = "FILE.cal")]
    platepar: Option<PathBuf>,
    /// Write the lens and the pointing of the first frame as settings for indi-allsky
    #[arg(long, value_name = "FILE.json")]
    indi_allsky: Option<PathBuf>,
}

impl ExportOptions {
    /// The files that are asked for.
    pub(super) fn paths(&self) -> impl Iterator<Item = &Path> {
        let paths = [&self.opencv, &self.ros, &self.platepar, &self.indi_allsky];
        paths.into_iter().filter_map(|path| path.as_deref())
    }

    /// The files with their content, or why there is none.
    pub(super) fn files(&self, measured: &LensCalibration) -> Vec<anyhow::Result<NewFile>> {
        let camera = measured.lens.camera();
        let pointing = || {
            let pointings = measured.frames.iter().map(|frame| frame.pointing);
            let known: Option<Pointing> = pointings.flatten().next();
            known.ok_or_else(|| anyhow!("no frame has both a site and a date with time of day"))
        };
        let mut files = Vec::new();
        let mut add = |path: &Option<PathBuf>, text: &dyn Fn() -> anyhow::Result<String>| {
            files.extend(path.as_ref().map(|path| {
                let text = text().with_context(|| format!("writing {}", path.display()))?;
                Ok((path.clone(), text.into_bytes()))
            }));
        };
        add(&self.opencv, &|| Ok(opencv_yaml(camera)?));
        add(&self.ros, &|| Ok(ros_camera_info(camera, "starpipe")?));
        add(&self.platepar, &|| Ok(platepar(camera, &pointing()?)?));
        add(&self.indi_allsky, &|| {
            Ok(indi_allsky_json(camera, &pointing()?)?)
        });
        files
    }
}
