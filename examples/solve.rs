//! Solves photographs of the night sky: where each of them points and how certain that is, how faint
//! it goes, and which of its stars have names.
//!
//! `cargo run --release --no-default-features --features built-in-catalog --example solve -- fixtures/orion/orion.png`
//!
//! Before the files, `--fov DEGREES` states the horizontal field of view, and `--near RA DEC` about
//! where the center is, in degrees.

use starpipe::{
    Catalog, Context, IndexedCatalog, Outcome, Solution, SolveOptions, Workspace, solve_file,
};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut options = SolveOptions::default();
    let mut files = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut number = || -> Result<f64, Box<dyn Error>> {
            Ok(arguments.next().ok_or("a number is missing")?.parse()?)
        };
        match argument.as_str() {
            "--fov" => options.fov_deg = Some(number()?),
            "--near" => options.near_deg = Some([number()?, number()?]),
            _ => files.push(argument),
        }
    }
    // What is made once and serves for every frame. The first run builds the index of the catalog
    // and keeps it in the user's cache.
    let indexed = IndexedCatalog::built_in();
    let context = Context::new(&indexed).with_options(&options, None);
    let mut workspace = Workspace::new();
    for file in &files {
        println!("{file}");
        // A file that cannot be read does not end the run.
        match solve_file(file, None, &context, &mut workspace) {
            Ok(solution) => print_solution(&solution, indexed.catalog()),
            Err(error) => println!("  {error}"),
        }
    }
    Ok(())
}

fn print_solution(solution: &Solution, catalog: &Catalog) {
    let found = match &solution.outcome {
        Outcome::Identified(found) => found,
        // This is no error: clouds, or too few stars.
        Outcome::NotIdentified(reason) => return println!("  not identified: {}", reason.code()),
    };
    let (boresight, up_rad) = found.icrs_to_camera.boresight_and_up();
    let (ra_rad, dec_rad) = boresight.to_ra_dec();
    let arcsec = |rad: f64| rad.to_degrees() * 3600.0;
    // About x, about y, and about the boresight.
    let [x, y, roll] = found.attitude_sigma_rad().map(arcsec);
    println!("  RA {:.5}°", ra_rad.to_degrees());
    println!("  Dec {:.5}°", dec_rad.to_degrees());
    println!("  up at position angle {:.4}°", up_rad.to_degrees());
    println!("  errors about x, y and roll: {x:.2}″, {y:.2}″, {roll:.2}″");
    if let Some(fov_x_rad) = found.camera.fov_x_rad() {
        println!("  field {:.3}° wide", fov_x_rad.to_degrees());
    }
    println!(
        "  chance of a wrong answer 10^{:.0}",
        found.log10_false_alarm
    );

    let completeness = solution.photometry.as_ref().map(|p| &p.completeness);
    if let Some(Ok(limit)) = completeness.map(|completeness| &completeness.limit) {
        let (v_mag, sigma_mag) = (limit.v_mag, limit.sigma_mag);
        println!("  half of the stars are detected at V {v_mag:.2} ± {sigma_mag:.2}");
    }
    for identified in &found.matches {
        if let Some(name) = catalog.proper_name(identified.star) {
            let position = solution.source(identified.source).position;
            let v_mag = catalog.star(identified.star).v_mag;
            println!(
                "  {name}, V {v_mag:.2}, at {:.2}, {:.2}",
                position.x, position.y
            );
        }
    }
}
