//! The parameters of a simulated frame, for the header of its file.

use super::generator::{GeneratedFrame, Generator};
use super::subject::FrameSubject;
use starpipe::frame::{FitsHeader, RowOrder};
use starpipe::identify::SkyView;
use starpipe::lab::simulate::SetupParameter;
use starpipe::predict::Reading;
use starpipe::report::wcs;

/// Describes a frame.
pub(super) struct Description<'a> {
    pub(super) generator: &'a Generator<'a>,
    pub(super) simulated: &'a GeneratedFrame,
}

impl Description<'_> {
    /// All parameters, one on each line.
    pub(super) fn text(&self) -> String {
        self.lines().join("\n") + "\n"
    }

    /// Common keywords, the true world coordinates, and all parameters as history.
    pub(super) fn fits_header(&self) -> FitsHeader {
        let sheet = &self.generator.setup.scenario.camera;
        let exposure_s = self.generator.setup.scenario.conditions.exposure_s;
        let mut header = FitsHeader::default();
        if let Some(date) = self.generator.date {
            let utc = date.to_iso();
            header.text(
                "DATE-OBS",
                utc.trim_end_matches('Z'),
                "UTC, middle of the exposure",
            );
            header.text("TIMESYS", "UTC", "");
        }
        header.text("INSTRUME", &sheet.name, "simulated camera");
        header.text("IMAGETYP", self.kind(), "");
        header.real("EXPTIME", exposure_s, "[s] exposure");
        header.real("XPIXSZ", sheet.pitch_x_um, "[um] pixel pitch along x");
        header.real("YPIXSZ", sheet.pitch_y_um, "[um] pixel pitch along y");
        header.real("FOCALLEN", sheet.focal_length_mm, "[mm] focal length");
        header.real("APTDIA", sheet.aperture_mm, "[mm] diameter of the aperture");
        header.real("EGAIN", sheet.gain_e_per_adu, "[electron/adu]");
        header.real("RDNOISE", sheet.read_noise_e, "[electron]");
        let saturation_adu = self.simulated.frame.saturation_adu.map_or(0.0, f64::from);
        header.real("SATURATE", saturation_adu, "[adu]");
        header.integer("BITS", i64::from(sheet.bits), "bit depth");
        if let Some(pointing) = &self.simulated.pointing {
            let view = SkyView {
                camera: self.generator.simulator.camera(),
                icrs_to_camera: &pointing.icrs_to_camera,
                places: pointing.places,
            };
            wcs::add_projection(&mut header, &view, RowOrder::TopDown);
        }
        for line in self.lines() {
            header.history(&line);
        }
        header
    }

    fn kind(&self) -> &'static str {
        match self.generator.subject {
            FrameSubject::Sky(_) | FrameSubject::Stars(_) => "Light Frame",
            FrameSubject::Dark => "Dark Frame",
            FrameSubject::Flat(_) => "Flat Frame",
        }
    }

    fn lines(&self) -> Vec<String> {
        let setup = &self.generator.setup;
        let sheet = &setup.scenario.camera;
        let version = env!("CARGO_PKG_VERSION");
        let reading = match setup.scenario.reading {
            Reading::Paper => "paper",
            Reading::Physical => "physical",
        };
        let mut lines = vec![
            format!("Simulated by starpipe {version}: {}", self.kind()),
            format!("camera = {}", sheet.name),
            format!(
                "seed = {}, frame {}",
                self.generator.seed, self.simulated.number
            ),
            format!("reading = {reading}"),
            format!("spot_form = {}", sheet.imperfections.spot_form.name()),
            format!("projection = {}", sheet.imperfections.projection.name()),
            format!("mirrored = {}", sheet.imperfections.mirrored),
        ];
        if let FrameSubject::Flat(electrons) = self.generator.subject {
            lines.push(format!("flat_e = {electrons}"));
        }
        if let Some(icrs_to_camera) = self.simulated.attitude() {
            let [w, x, y, z] = icrs_to_camera.to_quaternion();
            lines.push(format!("quaternion = {w:.9} {x:.9} {y:.9} {z:.9}"));
        }
        let number = |parameter: SetupParameter| {
            let value = parameter.get(setup)?;
            Some(format!("{} = {value}", parameter.name()))
        };
        lines.extend(SetupParameter::all().filter_map(number));
        lines
    }
}
