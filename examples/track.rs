//! Follows the attitude of a camera from frame to frame: of a satellite that turns, simulated, or of
//! a sequence of files, one every 0.2 s.
//!
//! `cargo run --release --no-default-features --features built-in-catalog --example track`
//!
//! `cargo run --release --no-default-features --features built-in-catalog --example track -- FRAME FRAME ...`

use starpipe::camera::data_sheet::Preset;
use starpipe::ephemeris::places::StarPlaces;
use starpipe::frame::{self, FrameError};
use starpipe::lab::simulate::{Pointing, Setup, Simulator};
use starpipe::nalgebra::Vector3;
use starpipe::predict::Scenario;
use starpipe::{Catalog, Context, Frame, IndexedCatalog, Rotation, Track, Tracker, UnitVector};
use std::error::Error;

type ReadFrame = Result<Frame<'static>, FrameError>;

const INTERVAL_S: f64 = 0.2;
const FRAMES: u32 = 10;
const RATE_DEG_S: [f64; 3] = [0.2, -0.1, 0.5];

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let frames: Box<dyn Iterator<Item = ReadFrame>> = if files.is_empty() {
        Box::new(simulated_frames()?)
    } else {
        Box::new(files.iter().map(frame::read))
    };
    let indexed = IndexedCatalog::built_in();
    let mut tracker = Tracker::new(Context::new(&indexed));
    // The middle of each exposure. Only its difference from frame to frame matters.
    let mut time_s = 0.0;
    for frame in frames {
        print_track(&tracker.process_frame(&frame?, Some(time_s))?);
        time_s += INTERVAL_S;
    }
    Ok(())
}

fn print_track(track: &Track) {
    let time_s = track.time_s.unwrap_or_default();
    print!("{time_s:6.2} s  {:8}", track.mode.code());
    let Some(attitude) = &track.attitude else {
        return println!("  no attitude");
    };
    let (boresight, up_rad) = attitude.icrs_to_camera.boresight_and_up();
    let (ra_rad, dec_rad) = boresight.to_ra_dec();
    let [ra, dec, up] = [ra_rad, dec_rad, up_rad].map(f64::to_degrees);
    let variances_rad2 = attitude.covariance_rad2.diagonal();
    let sigma_arcsec = variances_rad2.map(|variance| variance.sqrt().to_degrees() * 3600.0);
    let [x, y, roll] = sigma_arcsec.into();
    print!("  RA {ra:9.5}°  Dec {dec:8.5}°  up {up:8.4}°  ± {x:.1}″ {y:.1}″ {roll:.1}″");
    // One attitude has no rate.
    if let Some(rate) = &track.rate {
        let [x, y, z] = rate.rad.map(f64::to_degrees).into();
        print!("  rate {x:.4} {y:.4} {z:.4} °/s");
    }
    println!();
}

/// What a star tracker sees from a satellite that turns at a constant rate about its own axes.
fn simulated_frames() -> Result<impl Iterator<Item = ReadFrame>, Box<dyn Error>> {
    let mut setup = Setup::new(Scenario::of(Preset::Imx174));
    setup.scenario.conditions.exposure_s = 0.05;
    let scene = &mut setup.scene;
    [scene.rate_x_deg_s, scene.rate_y_deg_s, scene.rate_z_deg_s] = RATE_DEG_S;
    setup.check()?;
    let stars = Catalog::built_in().stars();
    let simulator = Simulator::new(&setup.scenario, &setup.scene, stars)?;
    let first = Rotation::looking_at(&UnitVector::from_ra_dec(5.4, 0.7), 0.0);
    Ok((0..FRAMES).map(move |number| {
        // The camera turns one way, the sky in its axes the other way.
        let turned_s = f64::from(number) * INTERVAL_S;
        let turn_rad = Vector3::from(RATE_DEG_S).map(f64::to_radians) * turned_s;
        let pointing = Pointing {
            icrs_to_camera: first.then_turn(-turn_rad),
            places: StarPlaces::default(),
        };
        simulator
            .frame(&pointing, u64::from(number))
            .map(|(frame, _truth)| frame)
    }))
}
