//! What does the data sheet of a camera say? Pixels, lens and detector.
//!
//! `camera.toml` → [`DataSheet`]. Lengths are in mm and µm, charges in electrons, times in seconds.
//!
//! - [`DataSheet::read`] reads a file with the keys in [`KEYS`]; [`template`](fn@template) writes
//!   one with comments.
//! - [`Preset`] lists the built-in cameras.
//! - [`Response`] is a transmission or an efficiency: a number, or a CSV file with wavelength in
//!   nanometres and value, which is interpolated.
//! - [`Imperfections`] affect simulated frames, but not the limiting magnitude of the centre:
//!   vignetting, distortion, differences between pixels.
//!
//! Caveats: one spot for the whole field; no stray light.

mod error;
mod file;
mod imperfections;
mod key;
mod keys;
mod lens_table;
mod preset;
mod response;
mod sheet;
mod spot_image;
mod template;

pub use error::DataSheetError;
pub use file::CameraDescription;
pub use imperfections::lens_transmission;
pub use imperfections::{Imperfections, SpotForm};
pub(crate) use key::key;
pub use key::{Key, NumberRange, nearest_name};
pub use keys::{IMPERFECTION_KEYS, KEYS, is_curve};
pub use preset::Preset;
pub use response::Response;
pub use response::ResponseError;
pub use sheet::DataSheet;
pub use spot_image::SpotImage;
pub use spot_image::SpotImageError;
pub use template::template;
