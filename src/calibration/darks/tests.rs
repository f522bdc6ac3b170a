use super::*;
use crate::frame::Frame;

fn frame(pixels: &[f32]) -> Frame<'static> {
    Frame::new(3, pixels.len() / 3, pixels.to_vec()).unwrap()
}

fn darks(frames: &[(Option<f64>, Frame)], config: &DarkConfig) -> Darks {
    let mut stack = DarkStack::new();
    for (number, (exposure_s, frame)) in frames.iter().enumerate() {
        let name = format!("{number}.fits");
        let statistics = FrameStatistics::measure(&name, frame, *exposure_s);
        stack.add(frame, statistics).unwrap();
    }
    stack.measure(config).unwrap()
}

#[test]
fn the_papers_equations_3_and_4_by_hand() {
    // Means 10 and 13; Σ(g − E)² 12 and 48 over eight degrees of freedom: σ² 1.5 and 6.
    let one = [10.0, 8.0, 12.0, 10.0, 11.0, 9.0, 11.0, 9.0, 10.0];
    let two = [13.0, 9.0, 17.0, 13.0, 15.0, 11.0, 15.0, 11.0, 13.0];
    let config = DarkConfig {
        bits: Some((12, FullScaleSource::Option)),
        ..DarkConfig::default()
    };
    let frames = [one, two].map(|levels| (None, frame(&levels).with_levels(1.0, Some(65535.0))));
    let found = darks(&frames, &config);
    assert_eq!(
        (found.frames[0].mean_adu, found.frames[1].mean_adu),
        (10.0, 13.0)
    );
    assert!((found.frames[0].sigma_adu - 1.5f64.sqrt()).abs() < 1e-12);
    assert!((found.frames[1].sigma_adu - 6f64.sqrt()).abs() < 1e-12);
    assert_eq!(found.mean_adu, 11.5);
    assert!((found.sigma_adu - 3.75f64.sqrt()).abs() < 1e-12);
    let report = found.report();
    assert_eq!(report.full_scale_adu, Some(4096.0));
    assert!((report.relative_mean.unwrap() - 11.5 / 4096.0).abs() < 1e-8);
    assert!((report.relative_sigma.unwrap() - 3.75f64.sqrt() / 4096.0).abs() < 1e-8);
}

#[test]
fn full_scale_is_that_of_the_file_unless_bits_are_given() {
    let sixteen = |step: f32| {
        let levels: Vec<f32> = (0..9).map(|i| step * (100 + i) as f32).collect();
        frame(&levels).with_levels(step, Some(65536.0 - step))
    };
    let full = |bits, frame: Frame| {
        let config = DarkConfig {
            bits,
            ..DarkConfig::default()
        };
        darks(&[(None, frame)], &config).full_scale
    };
    let twelve = Some((12, FullScaleSource::Camera));
    let expected = |levels_adu, source| Some(FullScale { levels_adu, source });
    assert_eq!(
        full(None, sixteen(1.0)),
        expected(65536.0, FullScaleSource::FileFormat)
    );
    assert_eq!(
        full(twelve, sixteen(1.0)),
        expected(4096.0, FullScaleSource::Camera)
    );
    // Twelve bits in the upper part of sixteen.
    assert_eq!(
        full(None, sixteen(16.0)),
        expected(65536.0, FullScaleSource::FileFormat)
    );
    assert_eq!(
        full(twelve, sixteen(16.0)),
        expected(65536.0, FullScaleSource::Camera)
    );
    assert_eq!(full(None, frame(&[0.5; 9])), None);
}

#[test]
fn one_frame_gives_what_it_can_and_reasons_for_the_rest() {
    let levels: Vec<f32> = (0..900).map(|i| 100.0 + (i * 7 % 11) as f32).collect();
    let one = Frame::new(30, 30, levels)
        .unwrap()
        .with_levels(1.0, Some(255.0));
    let found = darks(&[(Some(1.0), one)], &DarkConfig::default());
    let report = found.report();
    assert_eq!(
        (
            report.read_noise_adu,
            report.exposures[0].temporal_noise_adu
        ),
        (None, None)
    );
    let pattern = report.pattern.unwrap();
    assert_eq!(pattern.fixed_pattern_adu, None);
    assert!(pattern.spatial_adu > 1.0);
    assert!(report.dark_current.is_none() && found.noise_adu.is_none());
    let missing: Vec<_> = report.missing.keys().copied().collect();
    assert_eq!(
        missing,
        [
            "dark_current",
            "electrons",
            "fixed_pattern",
            "frame_to_frame",
            "read_noise",
            "temporal_noise"
        ]
    );
}

#[test]
fn sizes_that_differ_and_exposures_without_end_are_refused() {
    let mut stack = DarkStack::new();
    let mut add = |name: &str, pixels: usize, exposure_s| {
        let frame = frame(&vec![1.0; pixels]);
        let statistics = FrameStatistics::measure(name, &frame, Some(exposure_s));
        stack.add(&frame, statistics)
    };
    for exposure in 1..=MAX_EXPOSURES {
        add("a.fits", 9, exposure as f64).unwrap();
        // The same exposure up to rounding.
        add("a.fits", 9, exposure as f64 * 1.0004).unwrap();
    }
    let refused = add("b.fits", 12, 1.0).unwrap_err().to_string();
    assert_eq!(
        refused,
        "b.fits has 3 x 4 pixels, but a.fits has 3 x 3: expected frames of one size"
    );
    let refused = add("c.fits", 9, 99.0).unwrap_err().to_string();
    assert!(
        refused.starts_with("c.fits: too many different exposures: 99 s"),
        "{refused}"
    );
    assert!(matches!(
        DarkStack::new().measure(&DarkConfig::default()),
        Err(DarksError::NoFrames)
    ));
}

#[test]
fn a_brighter_frame_among_its_like_is_named() {
    let dark = |level: f32| {
        let levels: Vec<f32> = (0..10_000)
            .map(|i| level + (i * 7919 % 13) as f32)
            .collect();
        (
            None,
            Frame::new(100, 100, levels)
                .unwrap()
                .with_levels(1.0, Some(4095.0)),
        )
    };
    let frames = [100.0, 100.1, 99.9, 130.0, 100.0].map(dark);
    let found = darks(&frames, &DarkConfig::default());
    assert_eq!(found.warnings.len(), 1, "{:?}", found.warnings);
    assert!(
        found.warnings[0]
            .to_string()
            .starts_with("3.fits does not look like a dark frame: its mean level is 136.00"),
        "{:?}",
        found.warnings
    );
    let found = darks(&[dark(3000.0)], &DarkConfig::default());
    assert!(
        found.warnings[0]
            .to_string()
            .ends_with("its mean level is 73 % of full scale"),
        "{:?}",
        found.warnings
    );
}

#[test]
fn a_noise_that_the_grey_levels_hide_is_not_given() {
    let constant = || (None, frame(&[7.0; 9]).with_levels(1.0, Some(255.0)));
    let found = darks(&[constant(), constant()], &DarkConfig::default());
    assert_eq!(found.read_noise_adu, None);
    assert_eq!(
        found.report().missing["read_noise"],
        "the noise is less than half the step between gray levels"
    );
    assert!(found.hot_pixels.is_empty());
}
