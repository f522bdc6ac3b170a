use super::*;
use crate::base::size::Size;
use crate::frame::{self, Frame};

fn frame(pixels: &[f32]) -> Frame<'static> {
    Frame::new(3, pixels.len() / 3, pixels.to_vec()).unwrap()
}

fn master(pixels: &[f32]) -> Option<Master> {
    Some(Master {
        name: "master.fits".to_owned(),
        frame: frame(pixels),
    })
}

const DARK: [f32; 12] = [
    10.0, 11.0, 9.0, 10.0, 14.0, 10.0, 10.0, 10.0, 10.0, 10.0, 10.0, 10.0,
];

#[test]
fn the_pattern_goes_and_the_level_stays() {
    let calibration = Calibration::new(master(&DARK), None, None, 0.0).unwrap();
    let mut sky = frame(&DARK.map(|p| p + 100.0));
    calibration.apply(&mut sky).unwrap();
    assert_eq!(*sky.values(), [110.0; 12]);
}

#[test]
fn a_flat_divides_about_the_dark_level() {
    // The mean of a flat does not matter.
    let mut response = [2.0; 12];
    (response[0], response[1]) = (1.0, 3.0);
    let calibration = Calibration::new(master(&DARK), master(&response), None, 0.0).unwrap();
    let mut sky = frame(&DARK);
    for (pixel, response) in sky.values_mut().iter_mut().zip(response) {
        *pixel += 50.0 * response;
    }
    calibration.apply(&mut sky).unwrap();
    assert!(
        sky.values().iter().all(|p| (p - 110.0).abs() < 1e-4),
        "{:?}",
        sky.pixels
    );
    let calibration = Calibration::new(None, master(&response), None, 10.0).unwrap();
    let mut dark = frame(&[10.0; 12]);
    calibration.apply(&mut dark).unwrap();
    assert_eq!(*dark.values(), [10.0; 12]);
}

#[test]
fn saturated_pixels_stay_saturated_and_no_others_become_so() {
    let mut response = [1.0; 12];
    (response[0], response[1]) = (0.5, 1.5);
    let calibration = Calibration::new(None, master(&response), None, 0.0).unwrap();
    let mut sky = frame(&[
        250.0, 255.0, 255.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0,
    ])
    .with_levels(1.0, Some(255.0));
    calibration.apply(&mut sky).unwrap();
    let full = sky.saturation_adu.unwrap();
    let saturated: Vec<bool> = sky.values().iter().map(|p| *p >= full).collect();
    assert_eq!(saturated[..4], [false, true, true, false]);
    assert!((sky.pixels.value(0) - 500.0).abs() < 1e-3 && full > sky.pixels.value(0));
}

#[test]
fn unusable_pixels_have_no_value_and_too_many_are_refused() {
    let mut response = [1.0; 12];
    response[4] = 0.0;
    let calibration = Calibration::new(None, master(&response), None, 0.0).unwrap();
    let mut sky = frame(&[20.0; 12]);
    calibration.apply(&mut sky).unwrap();
    assert!(
        sky.pixels.value(4).is_nan() && sky.values().iter().filter(|p| p.is_nan()).count() == 1
    );
    response[5] = -1.0;
    let refused = Calibration::new(None, master(&response), None, 0.0).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "the flat master.fits: found 2 of 12 pixels without a response (0, negative or no value), expected at most 10 %"
    );
    assert!(Calibration::new(None, master(&[0.0; 12]), None, 0.0).is_err());
    assert!(Calibration::new(None, master(&[-1.0; 12]), None, 0.0).is_err());
    let mut dark = DARK;
    dark[..2].fill(f32::NAN);
    assert!(Calibration::new(master(&dark), None, None, 0.0).is_err());
}

#[test]
fn sizes_that_differ_are_refused_and_the_frame_is_left_alone() {
    let calibration = Calibration::new(master(&DARK), None, None, 0.0).unwrap();
    let mut other = frame(&[1.0; 9]);
    let refused = calibration.apply(&mut other).unwrap_err().to_string();
    assert_eq!(
        refused,
        "the dark master.fits has 3 x 4 pixels: expected 3 x 3, as the frame"
    );
    assert_eq!(*other.values(), [1.0; 9]);
    let refused = Calibration::new(master(&DARK), master(&[1.0; 9]), None, 0.0).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "the flat master.fits has 3 x 3 pixels: expected 3 x 4, as the dark master.fits"
    );
}

#[test]
fn a_dark_of_another_exposure_gets_a_note() {
    let mut dark = master(&DARK).unwrap();
    dark.frame.metadata.exposure_s = Some(10.0);
    let calibration = Calibration::new(Some(dark), None, None, 0.0).unwrap();
    assert_eq!(
        (
            calibration.exposure_mismatch(Some(10.001)),
            calibration.exposure_mismatch(None)
        ),
        (None, None)
    );
    assert!(
        calibration
            .exposure_mismatch(Some(1.0))
            .unwrap()
            .to_string()
            .starts_with("the dark master.fits was exposed for 10 s, but the frame for 1 s")
    );
}

#[test]
fn a_turned_frame_is_calibrated_in_the_rows_of_its_file() {
    const STORED_ROWS: usize = 4;
    let mut response = [1.0; 12];
    response[1] = 0.5;
    for tag in 1..=8 {
        let turned = |pixels: &[f32]| {
            let mut frame = frame(pixels);
            let orientation = frame::Orientation::of_tag(tag).unwrap();
            frame.metadata.orientation = orientation;
            frame.drawn()
        };
        // The masters of an upright camera, and the flat of a turned one.
        let mut flat = master(&response).unwrap();
        flat.frame = turned(&response);
        let calibration = Calibration::new(master(&DARK), Some(flat), None, 0.0).unwrap();
        let sky: Vec<f32> = (0..12).map(|i| i as f32 * response[i] + DARK[i]).collect();
        let mut sky = turned(&sky);
        calibration.apply(&mut sky).unwrap();
        let level: Vec<f32> = (0..12).map(|i| 10.0 + i as f32).collect();
        let expected = turned(&level);
        assert_eq!(sky.stored_size(), Size::new(3, STORED_ROWS));
        // The flat is normalized to a mean of 1.
        let mean = response.iter().sum::<f32>() / 12.0;
        for (found, expected) in sky.values().iter().zip(&*expected.values()) {
            let expected = 10.0 + (expected - 10.0) * mean;
            assert!(
                (found - expected).abs() < 1e-4,
                "{tag}: {found}, {expected}"
            );
        }
        // One of another detector is refused, and the frame stays as it was drawn.
        let other = Master {
            name: "other.fits".to_owned(),
            frame: Frame::new(5, 5, vec![1.0; 25]).unwrap(),
        };
        let refused = Calibration::new(Some(other), None, None, 0.0).unwrap();
        let before = sky.clone();
        assert!(refused.apply(&mut sky).is_err());
        assert_eq!(sky, before);
    }
}
