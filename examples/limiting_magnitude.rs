//! The limiting magnitude of a star sensor, and which of its parameters is worth improving:
//! `cargo run --example limiting_magnitude`

use starpipe::camera::data_sheet::Preset;
use starpipe::model::sensitivity::{Budget, Detector, Parameter, Rule, Scenario};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut scenario = Scenario::of(Preset::NanosatTracker);
    let space = Parameter::named("extinction_mag_per_airmass")?;
    space.set(&mut scenario, 0.0);
    scenario.check()?;
    let budget = Budget::new(&scenario);
    let detector = Detector::new(Rule::MatchedFilter, &scenario, &budget);
    println!(
        "{}: V {:.2} by its brightest pixel; starpipe finds half of the stars of V {:.2}",
        scenario.camera.name,
        budget.limit_vmag,
        detector.vmag_at(0.5)
    );
    for (name, factor) in [
        ("aperture_mm", 2.0),
        ("exposure_s", 2.0),
        ("read_noise_e", 0.5),
        ("spot_sigma_px", 0.5),
    ] {
        let mut better = scenario.clone();
        let parameter = Parameter::named(name)?;
        let value = parameter.get(&scenario).ok_or("it has a value")?;
        parameter.set(&mut better, factor * value);
        better.check()?;
        let gain = Budget::new(&better).limit_vmag - budget.limit_vmag;
        println!("  {name} × {factor}: {gain:+.2} mag");
    }
    Ok(())
}
