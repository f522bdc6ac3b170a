//! What a file says of the simulated frame in it: everything.

use super::{Job, Made, Subject};
use starpipe::frame::FitsHeader;
use starpipe::model::sensitivity::Reading;
use starpipe::model::simulate::SetupParameter;
use starpipe::report::wcs;
use std::fmt::Write as _;

/// What is known of a frame.
pub(super) struct Description<'a> {
    pub(super) job: &'a Job<'a>,
    pub(super) made: &'a Made,
}

impl Description<'_> {
    /// All numbers, a line each.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        for line in self.lines() {
            let _ = writeln!(text, "{line}");
        }
        text
    }

    /// The keywords that programs know, the world coordinates as they truly are, and all numbers as history.
    pub(super) fn fits_header(&self) -> FitsHeader {
        let sheet = &self.job.setup.scenario.camera;
        let exposure_s = self.job.setup.scenario.conditions.exposure_s;
        let mut header = FitsHeader::default();
        if let Some(date) = self.job.date {
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
        header.real("XPIXSZ", sheet.pitch_x_um, "[um] distance of columns");
        header.real("YPIXSZ", sheet.pitch_y_um, "[um] distance of rows");
        header.real("FOCALLEN", sheet.focal_length_mm, "[mm] focal length");
        header.real("APTDIA", sheet.aperture_mm, "[mm] diameter of the aperture");
        header.real("EGAIN", sheet.gain_e_per_adu, "[electron/adu]");
        header.real("RDNOISE", sheet.read_noise_e, "[electron]");
        let saturation_adu = self.made.frame.saturation_adu.map_or(0.0, f64::from);
        header.real("SATURATE", saturation_adu, "[adu]");
        header.integer("BITS", i64::from(sheet.bits), "of a grey level");
        if let Some(icrs_to_camera) = &self.made.attitude {
            wcs::add_projection(&mut header, self.job.simulator.camera(), icrs_to_camera);
        }
        for line in self.lines() {
            header.history(&line);
        }
        header
    }

    fn kind(&self) -> &'static str {
        match self.job.subject {
            Subject::Sky(_) | Subject::Stars(_) => "Light Frame",
            Subject::Dark => "Dark Frame",
            Subject::Flat(_) => "Flat Frame",
        }
    }

    fn lines(&self) -> Vec<String> {
        let setup = &self.job.setup;
        let sheet = &setup.scenario.camera;
        let version = env!("CARGO_PKG_VERSION");
        let reading = match setup.scenario.reading {
            Reading::Paper => "paper",
            Reading::Physical => "physical",
        };
        let mut lines = vec![
            format!("Simulated by starpipe {version}: {}", self.kind()),
            format!("camera = {}", sheet.name),
            format!("seed = {}, frame {}", self.job.seed, self.made.number),
            format!("reading = {reading}"),
            format!("spot_form = {}", sheet.imperfections.spot_form.name()),
            format!("mirrored = {}", sheet.imperfections.mirrored),
        ];
        if let Subject::Flat(electrons) = self.job.subject {
            lines.push(format!("flat_e = {electrons}"));
        }
        if let Some(icrs_to_camera) = &self.made.attitude {
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
