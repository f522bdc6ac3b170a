//! Cameras that are ready.

use super::{Response, Sensor};

/// A camera whose description is built in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preset {
    /// The camera of experiment 1 of Tong, Li & Wang 2014.
    Experiment1,
    /// That of their experiment 2: the same one.
    Experiment2,
}

impl Preset {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Experiment1, Self::Experiment2];

    /// The name of its option.
    pub fn name(self) -> &'static str {
        match self {
            Self::Experiment1 => "experiment-1",
            Self::Experiment2 => "experiment-2",
        }
    }

    /// The camera in a few words.
    pub fn about(self) -> &'static str {
        match self {
            Self::Experiment1 | Self::Experiment2 => {
                "shipboard star sensor, 100 mm aperture, f = 160 mm (Tong, Li & Wang 2014)"
            }
        }
    }

    /// Where the figures are from, and which are assumed.
    pub fn sources(self) -> &'static str {
        match self {
            Self::Experiment1 | Self::Experiment2 => PAPER_SOURCES,
        }
    }

    /// The camera.
    pub fn sensor(self) -> Sensor {
        match self {
            Self::Experiment1 | Self::Experiment2 => papers_camera(),
        }
    }
}

const PAPER_SOURCES: &str = "\
Tong, Li & Wang, Acta Optica Sinica 34, 1004003 (2014), section 2.2: transmission, aperture, focal length, pixel pitch,
quantum efficiency (table 2), peak share 1/9. The paper has the noise of the sensor as 52 dB only: 52.5 electrons give its
limits. Not in the paper: the number of pixels is that of a half-inch video detector of that pitch, the spot is the one
with that peak share, full well is 52 dB above the noise; bits, gain and bias are assumed.";

/// Section 2.2 of the paper.
fn papers_camera() -> Sensor {
    let qe = include_str!("quantum-efficiency.csv");
    let quantum_efficiency = Response::parse("quantum-efficiency.csv".as_ref(), qe);
    Sensor {
        name: "Tong, Li & Wang 2014".to_owned(),
        width_px: 752,
        height_px: 582,
        pitch_x_um: 8.6,
        pitch_y_um: 8.3,
        focal_length_mm: 160.0,
        aperture_mm: 100.0,
        lens_transmission: Response::Constant(0.85),
        quantum_efficiency: quantum_efficiency
            .expect("the built-in table is sound, as a test shows"),
        band_from_nm: 360.0,
        band_to_nm: 780.0,
        read_noise_e: 52.5,
        dark_current_e_s: 0.0,
        full_well_e: 21_000.0,
        gain_e_per_adu: 5.5,
        bits: 12,
        bias_adu: 128.0,
        spot_sigma_px: 1.16,
        peak_share: Some(1.0 / 9.0),
    }
}
