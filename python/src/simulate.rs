//! Simulated frames.

use crate::camera::Stated;
use crate::catalogs;
use crate::errors::{exception, json};
use crate::interrupt::on_threads;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use starpipe::base::coords::{Camera, Icrs, Rotation};
use starpipe::base::units::RAD_PER_DEG;
use starpipe::ephemeris::places::StarPlaces;
use starpipe::frame::{FitsHeader, RowOrder};
use starpipe::identify::SkyView;
use starpipe::lab::simulate::{Pointing, Simulator, truth_table};
use starpipe::lab::validation::draw;
use starpipe::predict::{Budget, Detector, Rule};
use starpipe::report::wcs;
use starpipe::{ObservationDate, UnitVector};
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// What a simulated frame shows.
#[derive(FromPyObject)]
pub enum Subject {
    /// Right ascension, declination and roll in degrees.
    Sky([f64; 3]),
    /// Electrons on each pixel.
    Flat(f64),
    /// `"random"` or `"dark"`.
    Named(String),
}

/// A simulated frame.
#[pyclass(frozen, get_all, module = "starpipe._starpipe")]
pub struct Simulated {
    shape: [usize; 2],
    bits: u32,
    /// Grey levels, row by row.
    pixels: Py<PyArray1<f32>>,
    /// The table of what is on it, as JSON.
    truth: Option<String>,
    quaternion: Option<[f64; 4]>,
    wcs_header: Option<Vec<u8>>,
    /// V magnitude at which half of the stars are found.
    limit_vmag: Option<f64>,
    exposure_s: f64,
}

/// Simulates the frame with this number.
#[pyfunction]
#[pyo3(signature = (stated, subject, catalog, date, seed, number))]
pub fn simulate(
    py: Python<'_>,
    stated: Stated,
    subject: Subject,
    catalog: Option<PathBuf>,
    date: Option<String>,
    seed: u64,
    number: u64,
) -> PyResult<Simulated> {
    let setup = stated.setup()?;
    let date = date.as_deref().map(str::parse::<ObservationDate>);
    let date = date.transpose().map_err(exception)?;
    let (mut frame, sky) = on_threads(py, NonZeroUsize::MIN, |interrupt| {
        let catalog = catalogs::read(catalog, interrupt)?;
        let simulator = Simulator::new(&setup.scenario, &setup.scene, catalog.stars());
        let simulator = simulator.map_err(exception)?;
        let (seed, drawn) = draw(seed, number);
        let attitude = match subject {
            Subject::Sky(pointing) => attitude(pointing),
            Subject::Named(name) if name == "random" => drawn,
            Subject::Named(_) => return Ok((simulator.dark(seed).map_err(exception)?, None)),
            Subject::Flat(electrons) => {
                let frame = simulator.evenly_lit(electrons, seed);
                return Ok((frame.map_err(exception)?, None));
            }
        };
        let places = date.map_or_else(StarPlaces::default, |date| {
            StarPlaces::at(&date, None, None)
        });
        let pointing = Pointing {
            icrs_to_camera: places.apparent_attitude(&attitude),
            places,
        };
        let (frame, truth) = simulator.frame(&pointing, seed).map_err(exception)?;
        let camera = simulator.camera();
        let rows = truth_table(&truth, camera, catalog, Some(&pointing));
        let mut header = FitsHeader::default();
        let view = SkyView {
            camera,
            icrs_to_camera: &pointing.icrs_to_camera,
            places,
        };
        wcs::add_projection(&mut header, &view, RowOrder::TopDown);
        let sky = Sky {
            truth: json(&rows)?,
            quaternion: attitude.to_quaternion(),
            wcs_header: header.to_bytes(),
            limit_vmag: limit_vmag(&simulator),
        };
        Ok((frame, Some(sky)))
    })?;
    let shape = [frame.height, frame.width];
    let pixels = std::mem::take(frame.values_mut());
    let (truth, quaternion, wcs_header, limit_vmag) = match sky {
        Some(sky) => (
            Some(sky.truth),
            Some(sky.quaternion),
            Some(sky.wcs_header),
            sky.limit_vmag,
        ),
        None => (None, None, None, None),
    };
    Ok(Simulated {
        shape,
        bits: setup.scenario.camera.bits,
        pixels: pixels.into_pyarray(py).unbind(),
        truth,
        quaternion,
        wcs_header,
        limit_vmag,
        exposure_s: setup.scenario.conditions.exposure_s,
    })
}

/// What is known of a frame of the sky.
struct Sky {
    truth: String,
    quaternion: [f64; 4],
    wcs_header: Vec<u8>,
    limit_vmag: Option<f64>,
}

fn attitude([ra, dec, roll]: [f64; 3]) -> Rotation<Icrs, Camera> {
    let boresight = UnitVector::from_ra_dec(ra * RAD_PER_DEG, dec * RAD_PER_DEG);
    Rotation::looking_at(&boresight, roll * RAD_PER_DEG)
}

fn limit_vmag(simulator: &Simulator) -> Option<f64> {
    let scenario = simulator.uniform_scenario();
    let detector = Detector::new(Rule::MatchedFilter, &scenario, &Budget::new(&scenario));
    Some(detector.vmag_at(0.5)).filter(|limit| limit.is_finite())
}
