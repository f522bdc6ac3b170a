//! Simulates what a camera records of the sky, and writes its true stars beside the frame:
//!
//! `cargo run --release --no-default-features --features built-in-catalog --example simulate -- imx174-35mm 84 -1 orion.fits`
//!
//! The arguments are the name of a camera, right ascension and declination of the center in degrees,
//! and a file to write, a TIFF if its name ends in `.tif`. The stars are in a file of that name that
//! ends in `.csv`.

use starpipe::camera::data_sheet::Preset;
use starpipe::ephemeris::places::StarPlaces;
use starpipe::frame::{FitsHeader, FitsSamples, TiffOptions, TiffSamples, write_fits, write_tiff};
use starpipe::lab::simulate::{Pointing, Setup, Simulator, Truth};
use starpipe::predict::Scenario;
use starpipe::{Catalog, Rotation, UnitVector};
use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// The same seed gives the same noise.
const SEED: u64 = 1;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [camera, ra_deg, dec_deg, out] = arguments.as_slice() else {
        let cameras = Preset::ALL.map(Preset::name).join(", ");
        return Err(format!("expected CAMERA RA DEC OUT, with a CAMERA of {cameras}").into());
    };
    let preset = Preset::named(camera).ok_or("there is no such camera")?;
    let (ra_deg, dec_deg): (f64, f64) = (ra_deg.parse()?, dec_deg.parse()?);
    let boresight = UnitVector::from_ra_dec(ra_deg.to_radians(), dec_deg.to_radians());

    // A camera under a dark sky. What else happens is in the scene, such as motion, clouds, or here
    // a satellite on most frames.
    let mut setup = Setup::new(Scenario::of(preset));
    setup.scene.trails = 1.0;
    setup.check()?;
    let catalog = Catalog::built_in();
    let simulator = Simulator::new(&setup.scenario, &setup.scene, catalog.stars())?;
    let pointing = Pointing {
        icrs_to_camera: Rotation::looking_at(&boresight, 0.0),
        // J2000.0, which the programs take for frames without a date.
        places: StarPlaces::default(),
    };
    let (frame, truth) = simulator.frame(&pointing, SEED)?;

    let out = Path::new(out);
    let file = BufWriter::new(File::create(out)?);
    if out.extension().is_some_and(|extension| extension == "tif") {
        write_tiff(file, &frame, &TiffOptions::new(TiffSamples::Unsigned16))?;
    } else {
        let mut header = FitsHeader::default();
        let exposure_s = setup.scenario.conditions.exposure_s;
        header.real("EXPTIME", exposure_s, "[s] exposure");
        write_fits(file, &frame, FitsSamples::Unsigned16, &header)?;
    }
    write_stars(&out.with_extension("csv"), &truth, catalog)?;
    println!("{} stars in {}", truth.stars.len(), out.display());
    Ok(())
}

fn write_stars(path: &Path, truth: &Truth, catalog: &Catalog) -> Result<(), Box<dyn Error>> {
    let mut file = BufWriter::new(File::create(path)?);
    writeln!(file, "id,x,y,vmag,electrons")?;
    for star in &truth.stars {
        // False stars are in no catalog.
        let id = star.catalog.map(|index| catalog.designation(index));
        let id = id.unwrap_or_default();
        let (x, y) = (star.position.x, star.position.y);
        let (v_mag, electrons) = (star.v_mag, star.electrons);
        writeln!(file, "{id},{x:.3},{y:.3},{v_mag:.3},{electrons:.0}")?;
    }
    Ok(file.flush()?)
}
