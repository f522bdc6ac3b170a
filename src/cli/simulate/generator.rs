//! Simulates frames by number.

use super::subject::FrameSubject;
use starpipe::base::coords::{Camera, Icrs, Rotation};
use starpipe::base::epoch::ObservationDate;
use starpipe::catalog::Catalog;
use starpipe::ephemeris::observer::Site;
use starpipe::ephemeris::places::StarPlaces;
use starpipe::frame::{Frame, FrameError, FrameMetadata};
use starpipe::lab::simulate::{Pointing, Setup, Simulator, Truth};
use starpipe::lab::validation::draw;

/// Simulates frames of one subject with one camera.
pub(super) struct Generator<'a> {
    pub(super) setup: &'a Setup,
    pub(super) simulator: &'a Simulator<'a>,
    pub(super) subject: &'a FrameSubject,
    pub(super) catalog: &'a Catalog,
    pub(super) date: Option<ObservationDate>,
    pub(super) site: Option<Site>,
    /// Where the catalogue's stars appear.
    pub(super) places: StarPlaces,
    pub(super) seed: u64,
    pub(super) limit_vmag: f64,
}

/// A simulated frame, and what is known of it.
pub(super) struct GeneratedFrame {
    pub(super) frame: Frame<'static>,
    pub(super) truth: Option<Truth>,
    pub(super) pointing: Option<Pointing>,
    pub(super) number: u64,
    pub(super) seed: u64,
}

impl GeneratedFrame {
    /// The attitude relative to the directions of the catalogue.
    pub(super) fn attitude(&self) -> Option<Rotation<Icrs, Camera>> {
        let pointing = self.pointing.as_ref()?;
        Some(
            pointing
                .places
                .astrometric_attitude(&pointing.icrs_to_camera),
        )
    }
}

impl Generator<'_> {
    /// Simulates the frame with this number.
    pub(super) fn frame(&self, number: u64) -> Result<GeneratedFrame, FrameError> {
        let (seed, drawn) = draw(self.seed, number);
        let simulator = self.simulator;
        let (mut frame, truth, pointing) = match self.subject {
            FrameSubject::Sky(fixed) => {
                let pointing = Pointing {
                    icrs_to_camera: self.places.apparent_attitude(&fixed.unwrap_or(drawn)),
                    places: self.places,
                };
                let (frame, truth) = simulator.frame(&pointing, seed)?;
                (frame, Some(truth), Some(pointing))
            }
            FrameSubject::Stars(stars) => {
                let (frame, truth) = simulator.star_field(stars, seed)?;
                (frame, Some(truth), None)
            }
            FrameSubject::Dark => (simulator.dark(seed)?, None, None),
            FrameSubject::Flat(electrons) => (simulator.evenly_lit(*electrons, seed)?, None, None),
        };
        frame.metadata = self.metadata();
        Ok(GeneratedFrame {
            frame,
            truth,
            pointing,
            number,
            seed,
        })
    }

    /// Metadata as a real camera writes them.
    fn metadata(&self) -> FrameMetadata {
        let sheet = &self.setup.scenario.camera;
        let mut metadata = FrameMetadata::default();
        metadata.date = self.date;
        metadata.site = self.site;
        metadata.exposure_s = Some(self.setup.scenario.conditions.exposure_s);
        metadata.pixel_size_um = Some((sheet.pitch_x_um * sheet.pitch_y_um).sqrt());
        metadata.focal_length_mm = Some(sheet.focal_length_mm);
        metadata
    }
}
