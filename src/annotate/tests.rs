//! Tests over a simulated frame of Orion.

use super::annotation::Unmeasured;
use super::*;
use crate::base::coords::{PixelPoint, Rotation, UnitVector};
use crate::base::units::RAD_PER_DEG;
use crate::camera::{CameraModel, focal_length_px};
use crate::catalog::StarIndex;
use crate::detect::DetectionFlags;
use crate::ephemeris::places::StarPlaces;
use crate::identify::{Identification, SourceIndex, StarMatch};
use crate::solve::{Measured, Outcome, Source, sample};
use nalgebra::Matrix3;

const SIZE_PX: [f64; 2] = [1200.0, 900.0];

fn source(position: PixelPoint, v_mag: f32, flags: DetectionFlags) -> Source {
    Source {
        position,
        measured: Some(Measured {
            sigma_px: [0.1; 2],
            peak: 200.0,
            snr: 50.0,
            flags,
        }),
        flux: Some(libm::pow(10.0, 4.0 - 0.4 * f64::from(v_mag))),
    }
}

/// A frame of 30° by 22.8° around the belt of Orion whose stars to V 5 are detected; those for which `is_named`
/// are named, the others are saturated and lie `off_px` to the right of their place.
fn orion(off_px: f64, is_named: impl Fn(&str) -> bool) -> Solution {
    let catalog = Catalog::built_in();
    let centre = UnitVector::from_ra_dec(84.0 * RAD_PER_DEG, -RAD_PER_DEG);
    let focal_px = focal_length_px(SIZE_PX[0], 30.0 * RAD_PER_DEG);
    let mut found = Identification {
        camera: CameraModel::pinhole(SIZE_PX[0], SIZE_PX[1], focal_px, false),
        icrs_to_camera: Rotation::looking_at(&centre, 10.0 * RAD_PER_DEG),
        places: StarPlaces::default(),
        lens_is_known: false,
        attitude_covariance_rad2: Matrix3::identity() * 1e-12,
        focal_length_sigma_px: 0.1,
        centre_sigma_px: [0.0; 2],
        excess_sigma_px: 0.0,
        matches: Vec::new(),
        rms_px: 0.1,
        log10_false_alarm: -100.0,
    };
    let mut sources = Vec::new();
    for star in (0..catalog.brighter_than(5.0)).map(StarIndex::new) {
        let known = catalog.star(star);
        let light = found.places.of(known);
        let Some(place) = found
            .pixel_of(&light)
            .filter(|place| found.camera.contains(place))
        else {
            continue;
        };
        let named = is_named(catalog.proper_name(star).unwrap_or_default());
        let flags = DetectionFlags {
            saturated: !named,
            ..DetectionFlags::default()
        };
        let x = place.x + if named { 0.1 } else { off_px };
        sources.push(source(PixelPoint::new(x, place.y), known.v_mag, flags));
        if named {
            found.matches.push(StarMatch {
                source: SourceIndex::new(sources.len() - 1),
                star,
                light,
                residual_px: 0.1,
                p_chance: 1e-9,
            });
        }
    }
    Solution {
        sources,
        ..sample::solution(1200, 900, Outcome::Identified(Box::new(found)))
    }
}

fn scene(solution: &Solution) -> Scene {
    Scene::of(solution, Catalog::built_in()).expect("it is identified")
}

fn star<'a>(scene: &'a Scene, label: &str) -> Option<&'a Annotation> {
    scene.annotations.iter().find(|shown| shown.label == label)
}

fn why(shown: &Annotation) -> Option<Unmeasured> {
    match shown.kind {
        AnnotationKind::Star { unmeasured, .. } => unmeasured,
        _ => panic!("{shown:?} is not a star"),
    }
}

#[test]
fn a_saturated_star_is_labelled_at_its_place_and_said_not_to_be_measured() {
    let scene = scene(&orion(0.6, |name| name != "Betelgeuse"));
    assert_eq!(why(star(&scene, "Rigel").unwrap()), None);
    let betelgeuse = star(&scene, "Betelgeuse").unwrap();
    assert_eq!(why(betelgeuse), Some(Unmeasured::Saturated));
    assert!(
        (0.6..5.0).contains(&betelgeuse.uncertainty_px),
        "{betelgeuse:?}"
    );
}

#[test]
fn a_star_without_light_at_its_place_has_no_label() {
    let scene = scene(&orion(40.0, |name| name != "Betelgeuse"));
    assert_eq!(star(&scene, "Betelgeuse"), None);
}

#[test]
fn nothing_is_labelled_where_residuals_are_large() {
    let mut solution = orion(0.6, |name| name != "Betelgeuse");
    for source in solution
        .sources
        .iter_mut()
        .filter(|source| source.position.x < 500.0)
    {
        let is_named = source
            .measured
            .is_some_and(|measured| !measured.flags.saturated);
        source.position.y += if is_named { 30.0 } else { 0.0 };
    }
    let betelgeuse = star(
        &scene(&orion(0.6, |name| name != "Betelgeuse")),
        "Betelgeuse",
    )
    .cloned();
    assert!(betelgeuse.unwrap().position.x < 500.0);
    assert_eq!(star(&scene(&solution), "Betelgeuse"), None);
}

#[test]
fn the_sentence_names_the_constellation_and_its_nebula() {
    let scene = scene(&orion(0.0, |_| true));
    assert_eq!(
        scene.sentence,
        "Orion, with M 42, the Orion Nebula; 30 by 23 degrees, north is up and 10 degrees to the right"
    );
    let orion = &scene.constellations[0];
    assert_eq!(orion.abbreviation, "Ori");
    assert!(orion.share > 0.5 && orion.figure_share > 0.7, "{orion:?}");
    let labels: Vec<&str> = scene
        .annotations
        .iter()
        .map(|shown| shown.label.as_str())
        .collect();
    for label in [
        "Orion",
        "M 42",
        "Rigel",
        "Betelgeuse",
        "Mintaka",
        "Alnilam",
        "Alnitak",
        "Saiph",
    ] {
        assert!(labels.contains(&label), "{label}: {labels:?}");
    }
}
