//! Master darks, the noise of each pixel, and the hot pixels as files.

use crate::cli::output::master::{fits_image, header};
use starpipe::base::size::Size;
use starpipe::base::table::finished;
use starpipe::calibration::darks::{Darks, ExposureGroup, HotPixelRow};

/// Names and contents of the files for `--out`.
pub(super) fn build(darks: &Darks) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let mut files = Vec::new();
    for group in &darks.groups {
        let name = match group.exposure_s {
            _ if darks.groups.len() == 1 => "master-dark.fits".to_owned(),
            Some(exposure_s) => format!("master-dark-{exposure_s}s.fits"),
            None => "master-dark-unknown.fits".to_owned(),
        };
        files.push((name, master_dark(darks, group)?));
    }
    if let Some(noise) = &darks.noise_adu {
        let mut header = header("NOISE", darks.frames.len());
        header.text("BUNIT", "ADU", "");
        header.history("Standard deviation of each pixel over frames of one exposure, pooled over the exposures");
        let image = fits_image(Size::new(darks.width, darks.height), noise, &header)?;
        files.push(("noise.fits".to_owned(), image));
    }
    files.push((
        "hot-pixels.csv".to_owned(),
        hot_pixels_table(darks)?.into_bytes(),
    ));
    Ok(files)
}

/// The master dark of one exposure as a FITS file.
fn master_dark(darks: &Darks, group: &ExposureGroup) -> anyhow::Result<Vec<u8>> {
    let mut header = header("DARK", group.frames);
    if let Some(exposure_s) = group.exposure_s {
        header.real("EXPTIME", exposure_s, "[s] exposure");
    }
    header.real("MEAN", group.level_adu, "[ADU] mean of the frames' means");
    let noise = group.temporal_noise_adu.unwrap_or(f64::NAN);
    header.real("NOISE", noise, "[ADU] noise of a pixel in one frame");
    header.history(&format!(
        "Mean of each pixel over {} frames, by starpipe darks {}",
        group.frames,
        env!("CARGO_PKG_VERSION")
    ));
    fits_image(Size::new(darks.width, darks.height), &group.means, &header)
}

/// The hot pixels as CSV, with a heading even if there are none.
pub(super) fn hot_pixels_table(darks: &Darks) -> anyhow::Result<String> {
    let mut writer = csv::WriterBuilder::new()
        .has_headers(false)
        .from_writer(Vec::new());
    writer.write_record(HotPixelRow::COLUMNS)?;
    for hot in &darks.hot_pixels {
        writer.serialize(HotPixelRow::from(hot))?;
    }
    Ok(finished(writer)?)
}
