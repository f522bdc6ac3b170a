//! Writes a commented `camera.toml`.

use super::imperfections::SpotForm;
use super::keys::{IMPERFECTION_KEYS, KEYS};
use super::preset::Preset;
use super::response::Response;
use super::sheet::DataSheet;
use crate::camera::Projection;
use std::fmt::Write as _;

/// Writes a `camera.toml` with the values of `preset` and a comment on each.
pub fn template(preset: Preset) -> String {
    let sheet = preset.data_sheet();
    let mut text = format!("# Camera description for starpipe: {}\n", preset.about());
    for line in preset.sources().lines() {
        let _ = writeln!(text, "# {line}");
    }
    let _ = writeln!(text, "\nname = {:?}", sheet.name);
    for key in KEYS {
        let value = match key.name {
            "lens_transmission" => response_value(&sheet.lens_transmission),
            "quantum_efficiency" => response_value(&sheet.quantum_efficiency),
            "peak_share" => match sheet.peak_share {
                Some(share) => share.to_string(),
                None => continue,
            },
            _ => (key.get)(&sheet).map_or_else(String::new, |value| value.to_string()),
        };
        let _ = writeln!(text, "\n# {}\n{} = {value}", key.about, key.name);
    }
    text + &imperfections(&sheet)
}

/// The optional keys, commented out, with their default values.
fn imperfections(sheet: &DataSheet) -> String {
    let mut text =
        "\n# Optional properties. They affect simulated frames; vignetting also affects predictions.\n"
            .to_owned();
    let forms = SpotForm::ALL.map(|form| format!("{:?}", form.name()));
    let projections = Projection::ALL.map(|projection| format!("{:?}", projection.name()));
    let imperfections = &sheet.imperfections;
    let _ = writeln!(
        text,
        "\n# form of a star's spot: {}\n# spot_form = {:?}\n\n# projection of the ideal lens: {}\n# projection = {:?}\n\n# whether the image is reversed left to right\n# mirrored = {}",
        forms.join(", "),
        imperfections.spot_form.name(),
        projections.join(", "),
        imperfections.projection.name(),
        imperfections.mirrored
    );
    for key in IMPERFECTION_KEYS {
        let value = (key.get)(sheet).map_or_else(String::new, |value| value.to_string());
        let _ = writeln!(text, "\n# {}\n# {} = {value}", key.about, key.name);
    }
    text
}

/// A response as in the file: a number or a list of points.
fn response_value(response: &Response) -> String {
    match response {
        Response::Constant(value) => value.to_string(),
        Response::Table(points) => {
            let points: Vec<String> = points
                .iter()
                .map(|(nm, value)| format!("    [{nm}, {value}],\n"))
                .collect();
            format!(
                "[ # wavelength in nm, value; or the name of a CSV file: \"curve.csv\"\n{}]",
                points.concat()
            )
        }
    }
}
