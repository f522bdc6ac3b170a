//! Built-in cameras.

use super::imperfections::Imperfections;
use super::response::Response;
use super::sheet::DataSheet;

/// A built-in camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Preset {
    /// The camera of experiment 1 of Tong, Li & Wang 2014.
    Experiment1,
    /// The same camera under the conditions of experiment 2.
    Experiment2,
    /// A star tracker for small satellites: an MT9P031 behind 16 mm f/1.2.
    NanosatTracker,
    /// An industrial camera with an IMX174 or IMX249 behind 35 mm f/1.4.
    Imx174,
    /// A cooled ZWO ASI183MM behind 135 mm f/2.
    Asi183,
}

impl Preset {
    /// All presets.
    pub const ALL: [Self; 5] = [
        Self::Experiment1,
        Self::Experiment2,
        Self::NanosatTracker,
        Self::Imx174,
        Self::Asi183,
    ];

    /// The preset called `name`.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == name)
    }

    /// Name in options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Experiment1 => "experiment-1",
            Self::Experiment2 => "experiment-2",
            Self::NanosatTracker => "nanosat-tracker",
            Self::Imx174 => "imx174-35mm",
            Self::Asi183 => "asi183mm-135mm",
        }
    }

    /// Short description.
    pub fn about(self) -> &'static str {
        match self {
            Self::Experiment1 => {
                "shipboard star sensor, 160 mm f/1.6 (Tong, Li & Wang 2014), 0.04 s at the zenith"
            }
            Self::Experiment2 => {
                "shipboard star sensor, 160 mm f/1.6 (Tong, Li & Wang 2014), 0.1 s at a zenith distance of \
                 45°"
            }
            Self::NanosatTracker => {
                "star tracker for small satellites: MT9P031 (2592 × 1944, 2.2 µm), 16 mm f/1.2"
            }
            Self::Imx174 => "industrial camera: Sony IMX174 (1936 × 1216, 5.86 µm), 35 mm f/1.4",
            Self::Asi183 => {
                "cooled camera: ZWO ASI183MM (Sony IMX183, 5496 × 3672, 2.4 µm), 135 mm f/2"
            }
        }
    }

    /// Sources of the figures, and which are assumed.
    pub fn sources(self) -> &'static str {
        match self {
            Self::Experiment1 | Self::Experiment2 => PAPER_SOURCES,
            Self::NanosatTracker => NANOSAT_SOURCES,
            Self::Imx174 => IMX174_SOURCES,
            Self::Asi183 => ASI183_SOURCES,
        }
    }

    /// The data sheet.
    pub fn data_sheet(self) -> DataSheet {
        match self {
            Self::Experiment1 | Self::Experiment2 => paper_camera(),
            Self::NanosatTracker => nanosat_tracker(),
            Self::Imx174 => imx174(),
            Self::Asi183 => asi183(),
        }
    }
}

const PAPER_SOURCES: &str = "\
Tong, Li & Wang, Acta Optica Sinica 34, 1004003 (2014), section 2.2: transmission, aperture,
focal length, pixel pitch, quantum efficiency (table 2), peak share 1/9. The paper states the noise
as 52 dB only; 52.5 electrons reproduce its limits. Assumed: the number of pixels of a half-inch
video detector of that pitch, the spot with that peak share, a full well 52 dB above the noise;
bits, gain and bias.";

/// `experiment-1` and `experiment-2`: section 2.2 of the paper.
fn paper_camera() -> DataSheet {
    let qe = include_bytes!("quantum-efficiency.csv");
    let quantum_efficiency = Response::parse("quantum-efficiency.csv".as_ref(), qe);
    DataSheet {
        name: "Tong, Li & Wang 2014".to_owned(),
        width_px: 752,
        height_px: 582,
        pitch_x_um: 8.6,
        pitch_y_um: 8.3,
        focal_length_mm: 160.0,
        aperture_mm: 100.0,
        lens_transmission: Response::Constant(0.85),
        quantum_efficiency: quantum_efficiency
            .expect("the built-in table is valid, as a test shows"),
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
        spot_image: None,
        imperfections: Imperfections::default(),
    }
}

const NANOSAT_SOURCES: &str = "\
onsemi MT9P031/D, table 1: pixels, pitch, bits; full well 6460 electrons from its maximum
signal-to-noise ratio, 38.1 dB; read noise 2.0 electrons from its dynamic range, 70.1 dB; gain: the
full well over 12 bits. Lens: 16 mm f/1.2. Estimates: dark current (20 electrons/s at 25 degrees C),
bias, spot (1.5 px), lens transmission (0.85), the quantum efficiency of the monochrome version.";

/// `nanosat-tracker`
fn nanosat_tracker() -> DataSheet {
    DataSheet {
        name: "MT9P031, 16 mm f/1.2".to_owned(),
        width_px: 2592,
        height_px: 1944,
        pitch_x_um: 2.2,
        pitch_y_um: 2.2,
        focal_length_mm: 16.0,
        aperture_mm: 13.3,
        lens_transmission: Response::Constant(0.85),
        quantum_efficiency: table(&[
            (350.0, 0.10),
            (400.0, 0.38),
            (450.0, 0.53),
            (500.0, 0.60),
            (550.0, 0.62),
            (600.0, 0.58),
            (650.0, 0.52),
            (700.0, 0.44),
            (750.0, 0.35),
            (800.0, 0.27),
            (850.0, 0.20),
            (900.0, 0.13),
            (950.0, 0.07),
            (1000.0, 0.03),
        ]),
        band_from_nm: 400.0,
        band_to_nm: 1000.0,
        read_noise_e: 2.0,
        dark_current_e_s: 20.0,
        full_well_e: 6460.0,
        gain_e_per_adu: 1.58,
        bits: 12,
        bias_adu: 42.0,
        spot_sigma_px: 1.5,
        peak_share: None,
        spot_image: None,
        imperfections: Imperfections::default(),
    }
}

const IMX174_SOURCES: &str = "\
Pixels, pitch and bits: Sony IMX174 and IMX249, which have the same pixel. Full well 32691
electrons, read noise 6.83 electrons, gain 8.0 electrons/ADU: EMVA 1288 figures published for
cameras with the IMX174; the 45.1 dB and 73 dB of the IMX249 in the mvBlueFOX3 manual agree. Lens:
35 mm f/1.4. Estimates: dark current (0.7 electrons/s at 25 degrees C), bias, spot (0.7 px), lens
transmission (0.87), the quantum efficiency except for its peak of 0.77 at 525 nm (to 0.06, from the
manufacturer's curve).";

/// `imx174-35mm`
fn imx174() -> DataSheet {
    DataSheet {
        name: "IMX174, 35 mm f/1.4".to_owned(),
        width_px: 1936,
        height_px: 1216,
        pitch_x_um: 5.86,
        pitch_y_um: 5.86,
        focal_length_mm: 35.0,
        aperture_mm: 25.0,
        lens_transmission: Response::Constant(0.87),
        quantum_efficiency: table(&[
            (350.0, 0.20),
            (400.0, 0.50),
            (450.0, 0.66),
            (500.0, 0.76),
            (525.0, 0.77),
            (550.0, 0.76),
            (600.0, 0.70),
            (650.0, 0.61),
            (700.0, 0.50),
            (750.0, 0.39),
            (800.0, 0.30),
            (850.0, 0.21),
            (900.0, 0.14),
            (950.0, 0.08),
            (1000.0, 0.04),
        ]),
        band_from_nm: 400.0,
        band_to_nm: 1000.0,
        read_noise_e: 6.83,
        dark_current_e_s: 0.7,
        full_well_e: 32_691.0,
        gain_e_per_adu: 8.0,
        bits: 12,
        bias_adu: 10.0,
        spot_sigma_px: 0.7,
        peak_share: None,
        spot_image: None,
        imperfections: Imperfections::default(),
    }
}

const ASI183_SOURCES: &str = "\
ZWO's ASI183MM manual and graphs, at unity gain: pixels, pitch, bits, read noise 2.2 electrons, 1.0
electrons/ADU and thus a full well of 4095 electrons, dark current 0.003 electrons/s at -20 degrees
C, quantum efficiency read off the graph (350 and 400 nm extrapolated). Lens: 135 mm f/2. Estimates:
bias, spot (1.2 px), lens transmission (0.88).";

/// `asi183mm-135mm`
fn asi183() -> DataSheet {
    DataSheet {
        name: "ASI183MM, 135 mm f/2".to_owned(),
        width_px: 5496,
        height_px: 3672,
        pitch_x_um: 2.4,
        pitch_y_um: 2.4,
        focal_length_mm: 135.0,
        aperture_mm: 67.5,
        lens_transmission: Response::Constant(0.88),
        quantum_efficiency: table(&[
            (350.0, 0.40),
            (400.0, 0.595),
            (425.0, 0.686),
            (450.0, 0.732),
            (475.0, 0.776),
            (500.0, 0.820),
            (525.0, 0.837),
            (550.0, 0.838),
            (575.0, 0.834),
            (600.0, 0.781),
            (625.0, 0.739),
            (650.0, 0.677),
            (675.0, 0.648),
            (700.0, 0.611),
            (725.0, 0.540),
            (750.0, 0.505),
            (775.0, 0.456),
            (800.0, 0.388),
            (825.0, 0.346),
            (850.0, 0.325),
            (875.0, 0.272),
            (900.0, 0.210),
            (925.0, 0.175),
            (950.0, 0.135),
            (975.0, 0.104),
            (1000.0, 0.078),
        ]),
        band_from_nm: 400.0,
        band_to_nm: 1000.0,
        read_noise_e: 2.2,
        dark_current_e_s: 0.003,
        full_well_e: 4095.0,
        gain_e_per_adu: 1.0,
        bits: 12,
        bias_adu: 10.0,
        spot_sigma_px: 1.2,
        peak_share: None,
        spot_image: None,
        imperfections: Imperfections::default(),
    }
}

fn table(points: &[(f64, f64)]) -> Response {
    Response::Table(points.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::KEYS;

    #[test]
    fn every_preset_is_valid() {
        for preset in Preset::ALL {
            let (name, sheet) = (preset.name(), preset.data_sheet());
            assert_eq!(Preset::named(name), Some(preset));
            assert_eq!(sheet.contradiction(), None, "{name}");
            for key in KEYS {
                let value = (key.get)(&sheet).unwrap();
                assert!(key.limits.accept(value), "{name}: {} {value}", key.name);
            }
            // The full well is near full scale: bits and gain match it.
            let steps = sheet.full_well_e / sheet.gain_e_per_adu;
            assert!(
                (0.9..1.1).contains(&(steps / sheet.full_scale_adu())),
                "{name}: {steps}"
            );
        }
        assert_eq!(Preset::named("experiment-3"), None);
    }

    #[test]
    fn figures_in_decibels_are_those_of_the_data_sheets() {
        // Maximum signal-to-noise ratio: shot noise at full well. Dynamic range: full well over
        // read noise.
        let snr_db = |sheet: &DataSheet| 10.0 * sheet.full_well_e.log10();
        let range_db = |sheet: &DataSheet| 20.0 * (sheet.full_well_e / sheet.read_noise_e).log10();
        let mt9p031 = Preset::NanosatTracker.data_sheet();
        assert!((snr_db(&mt9p031) - 38.1).abs() < 0.05 && (range_db(&mt9p031) - 70.1).abs() < 0.15);
        let imx174 = Preset::Imx174.data_sheet();
        assert!((snr_db(&imx174) - 45.1).abs() < 0.06 && (range_db(&imx174) - 73.0).abs() < 0.7);
    }
}
