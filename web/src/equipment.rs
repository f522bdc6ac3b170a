//! The camera that took the pictures, and the frames that calibrate them.

use crate::told;
use starpipe::calibration::{Calibration, Master};
use starpipe::camera::data_sheet::CameraDescription;
use starpipe::frame;
use std::path::Path;
use wasm_bindgen::prelude::*;

/// A file that the visitor chose.
#[wasm_bindgen]
pub struct GivenFile {
    name: String,
    bytes: Vec<u8>,
}

#[wasm_bindgen]
impl GivenFile {
    /// The file with this name and content.
    #[wasm_bindgen(constructor)]
    pub fn new(name: String, bytes: Vec<u8>) -> Self {
        Self { name, bytes }
    }

    fn master(self) -> Result<Master, JsError> {
        let frame = frame::decode(&self.bytes)
            .map_err(|error| told(error.in_file(Path::new(&self.name))))?;
        let name = self.name;
        Ok(Master { name, frame })
    }

    fn description(self) -> Result<CameraDescription, JsError> {
        let text = String::from_utf8(self.bytes)
            .map_err(|_| JsError::new(&format!("{}: not a text file", self.name)))?;
        CameraDescription::parse(Path::new(&self.name), &text).map_err(told)
    }
}

/// What `starpipe process --camera --dark --flat` are given.
#[wasm_bindgen]
#[derive(Default)]
pub struct Equipment {
    pub(crate) camera: Option<CameraDescription>,
    pub(crate) calibration: Option<Calibration>,
}

#[wasm_bindgen]
impl Equipment {
    /// Reads the files; none has to be given.
    ///
    /// # Errors
    /// Files that are not what they should be.
    #[wasm_bindgen(constructor)]
    pub fn new(
        camera: Option<GivenFile>,
        dark: Option<GivenFile>,
        flat: Option<GivenFile>,
    ) -> Result<Self, JsError> {
        let camera = camera.map(GivenFile::description).transpose()?;
        let [dark, flat] = [dark, flat].map(|file| file.map(GivenFile::master).transpose());
        let (dark, flat) = (dark?, flat?);
        let sheet = camera.as_ref().and_then(|camera| camera.sheet.as_ref());
        let bias_adu = sheet.map_or(0.0, |sheet| sheet.bias_adu);
        let calibration = (dark.is_some() || flat.is_some())
            .then(|| Calibration::new(dark, flat, None, bias_adu))
            .transpose()
            .map_err(told)?;
        Ok(Self {
            camera,
            calibration,
        })
    }
}
