//! The three forms of a report, compared with their snapshots.

use super::*;
use crate::base::remedy::Remedy;
use crate::ephemeris::places::AttitudeFrame;
use crate::frame::RowOrder;
use crate::identify::DateSource;

fn star(x: f64, id: Option<&str>, name: Option<&str>) -> StarReport {
    StarReport {
        x,
        y: 56.7812,
        sigma_x: Some(0.0123),
        sigma_y: Some(0.0131),
        flux: Some(123_456.0),
        sigma_flux: Some(151.97),
        peak: Some(9_876.5),
        flux_e: None,
        peak_e: None,
        snr: Some(812.4),
        id: id.map(Into::into),
        name: name.map(Into::into),
        hip: name.map(|_| 27_989),
        hd: name.map(|_| 39_801),
        hr: name.map(|_| 2061),
        sao: None,
        vmag: id.map(|_| 0.45),
        ra_deg: Some(88.792_939_2),
        dec_deg: Some(7.407_063_1),
        airmass: None,
        residual_px: id.map(|_| 0.0712),
        residual_blend_px: name.map(|_| 0.0312),
        p_chance: id.map(|_| 3.1e-7),
        flags: vec!["saturated"],
    }
}

fn unidentified() -> FrameReport {
    FrameReport {
        schema: SCHEMA,
        frame: "night/a.tif".into(),
        width: 1024,
        height: 768,
        row_order: Some(RowOrder::TopDown),
        date: None,
        observation: None,
        place_time: None,
        exposure_s: None,
        notes: Vec::new(),
        status: Status::NotIdentified,
        sentence: None,
        constellations: Vec::new(),
        annotations: Vec::new(),
        reason: Some(
            "the 12 detections match no part of the sky; if this is the sky, its field of view and its direction, \
             where known, make it easier"
                .into(),
        ),
        reason_code: Some("no_match"),
        best_log10_false_alarm: Some(-3.5),
        remedies: vec![Remedy::Fov, Remedy::Near],
        attitude: None,
        apparent: None,
        optics: None,
        matched: None,
        magnitude: None,
        photometry: None,
        sky: None,
        prediction: None,
        calibration: None,
        background: BackgroundReport {
            level: Some(1012.25),
            noise: Some(12.3418),
            sky_share: Some(0.8125),
        },
        bodies: Vec::new(),
        trails: None,
        stars: vec![StarReport {
            ra_deg: None,
            dec_deg: None,
            ..star(12.3456, None, None)
        }],
        timing_ms: TimingReport {
            read: 1.25,
            detect: 3.5,
            identify: 0.25,
            pointing: 0.0625,
            naming: 0.125,
            photometry: 0.125,
            total: 5.0,
        },
    }
}

fn prediction() -> PredictionReport {
    PredictionReport {
        camera: "a camera".into(),
        exposure_s: 0.5,
        zenith_distance_deg: 50.1035,
        zenith_distance_known: true,
        airmass: 1.5553,
        limit50_vmag: Some(7.0),
        limit90_vmag: Some(6.74),
        peak_limit50_vmag: Some(6.1),
        stars_expected: Some(41.2),
        zero_point_vmag: Some(16.6),
        zero_point_difference_mag: Some(-0.075),
        zero_point_difference_sigma_mag: Some(0.03),
        sky_camera_mag_arcsec2: Some(20.1),
        sky_mag_arcsec2: Some(20.025),
        sky_sigma_mag: Some(0.03),
        background_e: Some(120.5),
        background_noise_e: Some(12.2),
        sensor_noise_e: Some(5.1),
    }
}

fn photometry() -> PhotometryReport {
    PhotometryReport {
        zero_point_vmag: Some(16.5253),
        zero_point_sigma_mag: Some(0.0303),
        no_zero_point: None,
        flux_unit: "ADU/s",
        scatter_mag: Some(0.1542),
        zero_point_stars: 38,
        zero_point_mean_vmag: Some(6.91),
        zero_point_bv_mag: Some(0.6),
        color_term: Some(0.2456),
        color_term_sigma: Some(0.0609),
        corner_loss_mag: Some(0.31),
        corner_loss_sigma_mag: Some(0.052),
        linearity: Some(1.045),
        linearity_sigma: Some(0.0632),
        limit50_vmag: Some(8.4989),
        limit50_sigma_mag: Some(0.0407),
        limit50_width_mag: Some(0.3044),
        lost_share: Some(0.006),
        limit50_reason: None,
        completeness: vec![CompletenessReport {
            vmag: 8.25,
            stars: 48,
            detected: 35,
        }],
    }
}

fn optics() -> OpticsReport {
    OpticsReport {
        held: false,
        fov_x_deg: Some(20.012_345),
        fov_y_deg: Some(15.081_234),
        fov_x_sigma_deg: Some(0.003),
        fov_y_sigma_deg: Some(0.002),
        model: "pinhole",
        axis_px: [511.5, 383.5],
        valid_to_deg: None,
        focal_length_px: 2902.1234,
        focal_length_sigma_px: Some(0.3123),
        mirrored: false,
        distortion: None,
    }
}

fn date() -> DateReport {
    DateReport {
        iso: "2019-07-29T20:47:26Z".into(),
        year: 2019.5739,
        source: DateSource::FileName,
        utc_offset_h: Some(0.0),
        utc_offset_source: Some("assumed"),
        uncertainty_h: 14.0,
    }
}

fn constellation() -> ConstellationReport {
    ConstellationReport {
        name: "Orion",
        abbreviation: "Ori",
        share: 0.875,
        figure_share: 0.75,
    }
}

fn annotation() -> AnnotationReport {
    AnnotationReport {
        kind: "star",
        name: "Betelgeuse (58 alp Ori)".into(),
        label: "Betelgeuse".into(),
        x: 123.456,
        y: 56.78,
        uncertainty_px: Some(1.25),
        radius_px: None,
        vmag: Some(0.45),
        id: Some("SKYMAP 05550020".into()),
        detection: Some(0),
        why: Some("saturated"),
    }
}

fn match_report() -> MatchReport {
    MatchReport {
        detected: 3,
        matched: 2,
        rms_px: 0.0712,
        rms_arcsec: 5.06,
        log10_false_alarm: -65.21,
        catalog: None,
    }
}

fn identified() -> FrameReport {
    FrameReport {
        date: Some(date()),
        observation: Some(ObservationReport {
            site: SiteReport {
                lat_deg: 52.22,
                lon_deg: 4.42,
                height_m: 3.0,
            },
            zenith_distance_deg: 50.1234,
            apparent_zenith_distance_deg: Some(50.1035),
            azimuth_deg: 225.1,
            airmass: Some(1.5553),
        }),
        exposure_s: Some(0.5),
        calibration: Some(CalibrationReport {
            dark: Some("master-dark.fits".to_owned()),
            flat: None,
            hot_pixels: Some("hot-pixels.csv".to_owned()),
            mask: None,
        }),
        notes: vec![NoteReport {
            code: "header_value_ignored",
            text: "FOCALLEN is ignored: found 0, expected a focal length from 1 to 100000 mm"
                .into(),
        }],
        status: Status::Identified,
        sentence: Some("Orion, with M 42, the Orion Nebula; 20 by 15 degrees, north is up".into()),
        constellations: vec![constellation()],
        annotations: vec![annotation()],
        reason: None,
        reason_code: None,
        best_log10_false_alarm: None,
        remedies: Vec::new(),
        apparent: Some(ApparentReport {
            aberration: true,
            refraction: false,
            date_assumed: false,
        }),
        attitude: Some(AttitudeReport {
            frame_of: AttitudeFrame::Icrs,
            at: "centre",
            ra_deg: 83.822_083_3,
            dec_deg: -1.212_251_2,
            up_pa_deg: 12.345_678_9,
            quaternion: [0.5, -0.5, 0.5, 0.5],
            sigma_arcsec: AttitudeSigma {
                x: 3.151,
                y: 2.345,
                roll: 31.51,
            },
            covariance_arcsec2: [[9.929, 0.5, -1.25], [0.5, 5.499, 2.0], [-1.25, 2.0, 992.9]],
        }),
        optics: Some(optics()),
        matched: Some(match_report()),
        magnitude: Some(MagnitudeReport {
            faintest_vmag: 7.321,
            faintest_id: "SKYMAP 05350123".into(),
            predicted_limit_vmag: Some(7.0),
            difference_mag: Some(0.321),
            expected_faintest_vmag: Some(7.412),
            expected_faintest_sigma_mag: Some(0.21),
            faintest_difference_mag: Some(-0.091),
            limit_difference_mag: Some(0.052),
            limit_difference_sigma_mag: Some(0.041),
        }),
        photometry: Some(photometry()),
        prediction: Some(prediction()),
        stars: vec![
            star(123.4567, Some("SKYMAP 05550020"), Some("Betelgeuse")),
            star(12.3456, None, None),
            star(512.0, Some("SKYMAP 05350123"), None),
        ],
        ..unidentified()
    }
}

fn pretty(report: &FrameReport) -> String {
    serde_json::to_string_pretty(report).unwrap()
}

#[test]
fn an_identified_frame_reads_well() {
    insta::assert_snapshot!(identified().to_text(TextOptions::default()));
}

#[test]
fn a_frame_that_is_not_identified_says_why() {
    insta::assert_snapshot!(unidentified().to_text(TextOptions::default()));
}

#[test]
fn json_has_every_field_of_the_interface() {
    insta::assert_snapshot!(pretty(&identified()));
}

#[test]
fn json_has_nulls_where_a_frame_is_not_identified() {
    insta::assert_snapshot!(pretty(&unidentified()));
}

#[test]
fn the_table_has_a_row_for_every_detection() {
    insta::assert_snapshot!(identified().to_csv(true).unwrap());
}

#[test]
fn json_is_one_line() {
    let line = identified().to_json_line().unwrap();
    assert!(!line.contains('\n') && line.starts_with("{\"schema\":2,"));
}

#[test]
fn a_long_table_is_cut_unless_all_stars_are_wanted() {
    let mut report = identified();
    report.stars = vec![star(1.0, Some("SKYMAP 05550020"), None); STARS_SHOWN + 5];
    let rows = |text: &str| {
        text.lines()
            .filter(|line| line.contains("SKYMAP 05550020"))
            .count()
    };
    let cut = report.to_text(TextOptions::default());
    assert_eq!(rows(&cut), STARS_SHOWN);
    assert!(cut.ends_with("  and 5 fainter; see all_stars\n"), "{cut}");
    let whole = report.to_text(TextOptions {
        all_stars: true,
        ..TextOptions::default()
    });
    assert_eq!(rows(&whole), STARS_SHOWN + 5);
    assert!(!whole.contains("all_stars"));
}

#[test]
fn text_keeps_to_a_terminals_width() {
    for report in [identified(), unidentified()] {
        let text = report.to_text(TextOptions::default());
        let widest = text.lines().map(|line| line.chars().count()).max();
        assert!(widest.is_some_and(|width| width <= 100), "{text}");
    }
}

#[test]
fn the_table_says_how_the_file_stores_its_rows() {
    let mut report = identified();
    let last = |report: &FrameReport| -> Vec<String> {
        let last = |line: &str| line.rsplit(',').next().unwrap().to_owned();
        let table = report.to_csv(false).unwrap();
        table.lines().map(last).collect()
    };
    report.row_order = Some(RowOrder::BottomUp);
    assert_eq!(last(&report), ["bottom-up"; 3]);
    report.row_order = None;
    assert_eq!(last(&report), [""; 3]);
}
