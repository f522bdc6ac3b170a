use super::*;

fn facts() -> RunFacts {
    RunFacts {
        camera: "by hand".to_owned(),
        width_px: 1000,
        height_px: 500,
        seed: 1,
        scale_known: true,
        false_alarms_per_mpx: 1.0,
    }
}

fn frame(number: u64, status: Answer, errors: [f64; 3]) -> FrameRecord {
    let of_right = |value: f64| (status == Answer::Right).then_some(value);
    let [x, y, roll] = errors;
    FrameRecord {
        frame: number,
        seed: number,
        status,
        stars_above_limit: 5 + 10 * number,
        detected: 12,
        rejected: 1,
        named: 10,
        misnamed: number,
        misnamed_companions: number / 2,
        false_detections: 1,
        blends: 2,
        error_x_arcsec: of_right(x),
        error_y_arcsec: of_right(y),
        error_roll_arcsec: of_right(roll),
        sigma_x_arcsec: of_right(2.0),
        sigma_y_arcsec: of_right(4.0),
        sigma_roll_arcsec: of_right(10.0),
        nees: of_right(x * x / 4.0 + y * y / 16.0 + roll * roll / 100.0),
        focal_error_px: of_right(0.3),
        focal_sigma_px: of_right(0.1),
        rms_px: of_right(0.2),
        faintest_vmag: of_right(7.5),
        expected_faintest_vmag: of_right(7.3),
        expected_faintest_sigma_mag: of_right(0.25),
        predicted_limit_vmag: 7.0,
        measured_limit_vmag: of_right(7.1),
        measured_limit_sigma_mag: of_right(0.05),
        background_adu: Some(101.0),
        true_background_adu: 100.0,
        noise_adu: Some(9.0),
        true_noise_adu: 10.0,
        split: 1,
        zero_point_error_mag: of_right(0.03),
        zero_point_sigma_mag: of_right(0.02),
        linearity: of_right(0.98),
        linearity_sigma: of_right(0.02),
        notes: (number > 0).then(|| "not_linear large_residuals".to_owned()),
        ..FrameRecord::default()
    }
}

/// A star of this magnitude and SNR with an error of `off` bounds of 0.1 px in x, and a stated
/// error of 0.05 px.
fn star(vmag: f64, snr: f64, off: f64) -> StarRecord {
    StarRecord {
        vmag: Some(vmag),
        true_x_px: Some(100.0),
        true_y_px: Some(200.0),
        true_flux_e: Some(1000.0),
        isolated: Some(true),
        saturated: Some(false),
        probability: Some(1.0),
        predicted_snr: Some(snr),
        bound_x_px: Some(0.1),
        bound_y_px: Some(0.1),
        bound_flux_e: Some(50.0),
        detected: true,
        x: Some(100.0 + 0.1 * off),
        y: Some(200.0),
        sigma_x: Some(0.05),
        sigma_y: Some(0.05),
        flux_e: Some(1100.0),
        sigma_flux_e: Some(50.0),
        ..StarRecord::default()
    }
}

#[test]
fn frames_are_counted_by_answer_and_by_stars() {
    let mut all = Accumulator::new(facts(), 7.0);
    for (number, status) in [Answer::Right, Answer::None, Answer::Wrong, Answer::Right]
        .into_iter()
        .enumerate()
    {
        all.add_frame(&frame(number as u64, status, [0.0; 3]));
    }
    let summary = all.finish();
    let found = &summary.identification;
    assert_eq!(
        (found.all.right, found.all.none, found.all.wrong),
        (2, 1, 1)
    );
    assert_eq!(found.all.right_percent, 50.0);
    // Interval of 2 in 4: 6.76 to 93.24 %.
    assert!((found.all.right_low_percent - 6.76).abs() < 0.01);
    let bins: Vec<_> = found
        .by_stars
        .iter()
        .map(|bin| (bin.from_stars, bin.to_stars))
        .collect();
    assert_eq!(bins, [(4, 5), (15, 19), (20, 29), (30, 49)]);
    let detection = &summary.detection;
    assert_eq!(
        (detection.detected, detection.named, detection.misnamed),
        (48, 40, 6)
    );
    assert_eq!((detection.rejected, detection.blends), (4, 8));
    assert_eq!(detection.misnamed_companions, 2);
    // Four on four frames of half a million pixels; the exact interval of 4 is 1.09 to 10.24.
    assert_eq!(detection.false_per_mpx, 2.0);
    assert!((detection.false_low_per_mpx - 1.09 / 2.0).abs() < 0.005);
    assert!((detection.false_high_per_mpx - 10.24 / 2.0).abs() < 0.005);
}

#[test]
fn errors_of_the_attitude_are_of_right_answers_and_in_units_of_their_own() {
    let mut all = Accumulator::new(facts(), 7.0);
    all.add_frame(&frame(0, Answer::Right, [3.0, 4.0, -10.0]));
    all.add_frame(&frame(1, Answer::Right, [-3.0, -4.0, 30.0]));
    all.add_frame(&frame(2, Answer::Wrong, [1e5; 3]));
    let summary = all.finish();
    let attitude = summary.attitude.unwrap();
    assert_eq!(attitude.frames, 2);
    assert_eq!(
        (attitude.boresight_arcsec.p50, attitude.boresight_arcsec.max),
        (5.0, 5.0)
    );
    assert_eq!(
        (attitude.roll_arcsec.max, attitude.rms_arcsec[0]),
        (30.0, 3.0)
    );
    // 9/4 + 16/16 + 100/100 and 9/4 + 16/16 + 900/100.
    assert_eq!(attitude.nees_mean, (4.25 + 12.25) / 2.0);
    assert_eq!(attitude.nees_sigma, 1.7321);
    let pulls = &summary.pulls;
    assert_eq!((pulls.attitude_x.mean, pulls.attitude_x.sd), (0.0, 2.1213));
    assert_eq!((pulls.roll.mean, pulls.roll.beyond_2_percent), (1.0, 50.0));
    assert_eq!(pulls.focal_length.mean, 3.0);
    assert_eq!((pulls.zero_point.count, pulls.zero_point.mean), (2, 1.5));
    assert_eq!(
        (summary.zero_point.mean, summary.detection.split),
        (0.03, 3)
    );
    assert_eq!(summary.notes.len(), 2);
    assert_eq!(summary.notes["not_linear"], 2);
    let faintest = &summary.faintest;
    assert_eq!(
        (faintest.count, faintest.mean, faintest.expected_sd),
        (2, 0.2, Some(0.25))
    );
    assert_eq!(
        (summary.background.mean, summary.noise_ratio.mean),
        (1.0, 0.9)
    );
    assert_eq!(summary.frame_limit.mean, 0.1);
}

#[test]
fn centroids_are_of_isolated_stars_and_pulls_of_sure_ones() {
    let mut all = Accumulator::new(facts(), 7.0);
    for off in [2.0, -2.0] {
        all.add_star(&star(5.0, 10.0, off));
    }
    let faint = StarRecord {
        probability: Some(0.5),
        ..star(7.0, 5.0, 1.0)
    };
    all.add_star(&faint);
    let left_out = [
        StarRecord {
            isolated: Some(false),
            ..star(5.0, 10.0, 50.0)
        },
        StarRecord {
            saturated: Some(true),
            ..star(5.0, 10.0, 50.0)
        },
        StarRecord {
            kind: RowKind::False,
            ..star(5.0, 10.0, 50.0)
        },
    ];
    left_out.iter().for_each(|row| all.add_star(row));
    let lost = StarRecord {
        detected: false,
        x: None,
        y: None,
        ..faint
    };
    all.add_star(&lost);
    let summary = all.finish();
    let [five, ten] = &summary.centroids.bins[..] else {
        panic!("{:?}", summary.centroids);
    };
    assert_eq!((five.stars, ten.stars), (1, 2));
    // Errors of 0.2 px in x and 0 in y, with bounds of 0.1 px.
    assert!((ten.rms_px - 0.2 / 2f64.sqrt()).abs() < 1e-5);
    let root_of_2 = |ratio: Option<f64>| (ratio.unwrap().powi(2) - 2.0).abs() < 1e-3;
    assert_eq!(ten.bound_px, Some(0.1));
    assert!(root_of_2(ten.ratio) && root_of_2(summary.centroids.ratio));
    assert_eq!((ten.flux_part, ten.flux_ratio), (1.1, Some(2.0)));
    assert_eq!(
        (summary.pulls.x.count, summary.pulls.x.beyond_3_percent),
        (2, 100.0)
    );
    assert_eq!(summary.pulls.flux.mean, 2.0);
    // The saturated star counts in completeness.
    let bins = &summary.completeness.bins;
    let counts: Vec<_> = bins
        .iter()
        .map(|bin| (bin.stars, bin.detected, bin.predicted))
        .collect();
    assert_eq!(counts, [(3, 3, 1.0), (2, 1, 0.5)]);
}

#[test]
fn of_nothing_there_is_a_summary_as_well() {
    let summary = Accumulator::new(facts(), 7.0).finish();
    assert_eq!((summary.frames, summary.attitude.is_none()), (0, true));
    let json = serde_json::to_string(&summary).unwrap();
    assert!(!json.contains("null,null"), "{json}");
    assert!(summary.to_text().starts_with("0 frames"));
}
