//! A row of the table of frames.

use crate::base::coords::{Camera, Icrs, UnitVector};
use crate::base::epoch::ObservationDate;
use crate::base::table::table_row;
use crate::base::units::DEG_PER_RAD;
use crate::report::FrameReport;
use crate::solve::{Outcome, Solution};

table_row! {
    /// A frame, as its report has it; `t_min`, `s_fov` and `s_region` are columns of ObsCore.
    ///
    /// There are no run times: the same frames make the same rows. A text is empty where there is none.
    ///
    /// # Reference
    /// Louys et al. 2017, ObsCore 1.1, IVOA recommendation.
    #[derive(Debug, Clone, PartialEq, Default)]
    FrameRow in "frames" {
        frame: String, "", "meta.id;meta.main", "name of the frame";
        status: String, "", "meta.code.status", "identified, not_identified or unread";
        reason_code: String, "", "meta.code", "code of the reason why the frame is not identified";
        reason: String, "", "meta.note", "reason why the frame is not identified";
        night: String, "", "time.epoch", "date of the evening before the frame, in local mean time if the site is known";
        t_min: Option<f64>, "d", "time.start;obs.exposure", "date of the frame as Modified Julian Date (UTC)";
        exposure_s: Option<f64>, "s", "time.duration;obs.exposure", "exposure";
        camera: String, "", "meta.id;instr", "name of the camera";
        width: Option<u64>, "pix", "", "columns of the frame";
        height: Option<u64>, "pix", "", "rows of the frame";
        row_order: String, "", "meta.code", "order of the rows in the file; y is counted from the top of the picture in either case";
        ra_deg: Option<f64>, "deg", "pos.eq.ra;meta.main", "right ascension of the center (ICRS)";
        dec_deg: Option<f64>, "deg", "pos.eq.dec;meta.main", "declination of the center (ICRS)";
        s_fov: Option<f64>, "deg", "phys.angSize;instr.fov", "diameter of the circumscribed circle of the frame";
        s_region: String, "", "pos.outline;obs.field", "outline of the frame (STC-S, ICRS)";
        up_pa_deg: Option<f64>, "deg", "pos.posAng", "position angle of the picture's up direction";
        qw: Option<f64>, "", "", "quaternion that rotates ICRS vectors into camera axes: w component";
        qx: Option<f64>, "", "", "quaternion that rotates ICRS vectors into camera axes: x component";
        qy: Option<f64>, "", "", "quaternion that rotates ICRS vectors into camera axes: y component";
        qz: Option<f64>, "", "", "quaternion that rotates ICRS vectors into camera axes: z component";
        sigma_x_arcsec: Option<f64>, "arcsec", "stat.error;pos", "standard error of the rotation about the x axis";
        sigma_y_arcsec: Option<f64>, "arcsec", "stat.error;pos", "standard error of the rotation about the y axis";
        sigma_roll_arcsec: Option<f64>, "arcsec", "stat.error;pos.posAng", "standard error of the rotation about the boresight";
        covariance_x_y_arcsec2: Option<f64>, "arcsec**2", "stat.covariance;pos", "covariance of the rotations about the x and y axes";
        covariance_x_roll_arcsec2: Option<f64>, "arcsec**2", "stat.covariance;pos", "covariance of the rotations about the x axis and the boresight";
        covariance_y_roll_arcsec2: Option<f64>, "arcsec**2", "stat.covariance;pos", "covariance of the rotations about the y axis and the boresight";
        fov_x_deg: Option<f64>, "deg", "phys.angSize;instr.fov", "horizontal field of view";
        fov_y_deg: Option<f64>, "deg", "phys.angSize;instr.fov", "vertical field of view";
        focal_length_px: Option<f64>, "pix", "instr.param", "focal length in pixels";
        mirrored: bool, "", "meta.code", "whether an identified frame mirrors the sky";
        detected: Option<u64>, "", "meta.number", "detections";
        matched: Option<u64>, "", "meta.number", "detections with the name of a star";
        rms_px: Option<f64>, "pix", "stat.fit.residual", "RMS residual of the named stars";
        log10_false_alarm: Option<f64>, "", "stat.probability", "log10 of the false-alarm probability";
        background: Option<f64>, "", "instr.background", "median background, in the units of the frame";
        noise: Option<f64>, "", "stat.stdev;instr.background", "noise of a pixel, in the units of the frame";
        zero_point_vmag: Option<f64>, "mag", "phot.mag;arith.zp", "V magnitude of a star with a flux of 1 unit, per second if the exposure is known";
        zero_point_sigma_mag: Option<f64>, "mag", "stat.error;phot.mag;arith.zp", "standard error of the zero point";
        limit50_vmag: Option<f64>, "mag", "phot.mag;em.opt.V;stat.max", "V magnitude at which half of the stars are detected";
        limit50_sigma_mag: Option<f64>, "mag", "stat.error;phot.mag;em.opt.V", "standard error of the limiting magnitude";
        predicted_limit50_vmag: Option<f64>, "mag", "phot.mag;em.opt.V;meta.modelled", "limiting magnitude predicted for the camera";
        limit_difference_mag: Option<f64>, "mag", "phot.mag;arith.diff", "measured minus predicted limiting magnitude";
        faintest_vmag: Option<f64>, "mag", "phot.mag;em.opt.V;stat.max", "V magnitude of the faintest named star";
        sky_mag_arcsec2: Option<f64>, "mag/arcsec**2", "phot.mag.sb;em.opt.V", "sky brightness";
        airmass: Option<f64>, "", "obs.airMass", "airmass of the center";
        notes: String, "", "meta.note", "codes of the notes on the frame";
        star_rows: u64, "", "meta.number", "rows of the frame in the table of stars";
    }
}

/// Status of a frame that could not be read or searched.
pub(super) const UNREAD: &str = "unread";

impl FrameRow {
    /// The row of a solved frame.
    pub fn new(report: &FrameReport, solution: &Solution) -> Self {
        let is_identified = report.is_identified();
        let status = if is_identified {
            "identified"
        } else {
            "not_identified"
        };
        let date = solution.date.map(|known| known.date);
        let notes: Vec<&str> = report.notes.iter().map(|note| note.code).collect();
        let photometry = report.photometry.as_ref();
        let prediction = report.prediction.as_ref();
        let magnitude = report.magnitude.as_ref();
        Self {
            frame: report.frame.clone(),
            status: status.to_owned(),
            reason_code: report.reason_code.unwrap_or_default().to_owned(),
            reason: report.reason.clone().unwrap_or_default(),
            night: date.map_or(String::new(), |date| night(date, solution)),
            t_min: date.and_then(|date| date.modified_julian_date()),
            exposure_s: report.exposure_s,
            camera: prediction.map_or(String::new(), |stated| stated.camera.clone()),
            width: Some(report.width as u64),
            height: Some(report.height as u64),
            row_order: report.row_order_word().to_owned(),
            background: report.background.level,
            noise: report.background.noise,
            detected: Some(report.stars.len() as u64),
            zero_point_vmag: photometry.and_then(|p| p.zero_point_vmag),
            zero_point_sigma_mag: photometry.and_then(|p| p.zero_point_sigma_mag),
            limit50_vmag: photometry.and_then(|p| p.limit50_vmag),
            limit50_sigma_mag: photometry.and_then(|p| p.limit50_sigma_mag),
            predicted_limit50_vmag: prediction.and_then(|p| p.limit50_vmag),
            limit_difference_mag: magnitude.and_then(|m| m.limit_difference_mag),
            faintest_vmag: magnitude.map(|m| m.faintest_vmag),
            sky_mag_arcsec2: prediction.and_then(|p| p.sky_mag_arcsec2),
            airmass: report.observation.as_ref().and_then(|o| o.airmass),
            notes: notes.join(","),
            star_rows: report.stars.len() as u64,
            ..Self::default()
        }
        .with_pointing(report)
        .with_region(solution)
    }

    /// The row of a frame that could not be read or searched, and why.
    pub fn unread(frame: &str, reason: String) -> Self {
        Self {
            frame: frame.to_owned(),
            status: UNREAD.to_owned(),
            reason_code: UNREAD.to_owned(),
            reason,
            ..Self::default()
        }
    }

    fn with_pointing(self, report: &FrameReport) -> Self {
        let (Some(attitude), Some(optics), Some(matched)) =
            (&report.attitude, &report.optics, &report.matched)
        else {
            return self;
        };
        let [qw, qx, qy, qz] = attitude.quaternion.map(Some);
        let sigma = &attitude.sigma_arcsec;
        let [covariance_x, covariance_y, _] = attitude.covariance_arcsec2;
        Self {
            ra_deg: Some(attitude.ra_deg),
            dec_deg: Some(attitude.dec_deg),
            up_pa_deg: Some(attitude.up_pa_deg),
            qw,
            qx,
            qy,
            qz,
            sigma_x_arcsec: Some(sigma.x),
            sigma_y_arcsec: Some(sigma.y),
            sigma_roll_arcsec: Some(sigma.roll),
            covariance_x_y_arcsec2: Some(covariance_x[1]),
            covariance_x_roll_arcsec2: Some(covariance_x[2]),
            covariance_y_roll_arcsec2: Some(covariance_y[2]),
            fov_x_deg: optics.fov_x_deg,
            fov_y_deg: optics.fov_y_deg,
            focal_length_px: Some(optics.focal_length_px),
            mirrored: optics.mirrored,
            matched: Some(matched.matched as u64),
            rms_px: Some(matched.rms_px),
            log10_false_alarm: Some(matched.log10_false_alarm),
            ..self
        }
    }

    /// Sets the frame's outline on the sky, and the diameter of the circle around it.
    fn with_region(self, solution: &Solution) -> Self {
        let Outcome::Identified(found) = &solution.outcome else {
            return self;
        };
        let (camera, sky) = (&found.camera, found.icrs_to_camera.inverse());
        let direction = |seen: &UnitVector<Camera>| found.places.astrometric(&sky.apply(seen));
        let [top_left, top_right, bottom_left, bottom_right] = camera.corners();
        let outline = [top_left, top_right, bottom_right, bottom_left];
        let corners = outline.map(|pixel| camera.direction_of(&pixel));
        let diameter_deg = 2.0 * camera.radius_rad() * DEG_PER_RAD;
        Self {
            s_fov: Some((diameter_deg * 1e5).round() / 1e5),
            s_region: match corners {
                [Some(a), Some(b), Some(c), Some(d)] => {
                    polygon(&[a, b, c, d].map(|corner| direction(&corner)))
                }
                // The corners of an all-sky frame see nothing.
                _ => circle(&direction(&UnitVector::BORESIGHT), 0.5 * diameter_deg),
            },
            ..self
        }
    }
}

/// An outline in STC-S.
fn polygon(corners: &[UnitVector<Icrs>]) -> String {
    let mut text = "POLYGON ICRS".to_owned();
    for corner in corners {
        let (ra_rad, dec_rad) = corner.to_ra_dec();
        for angle_rad in [ra_rad, dec_rad] {
            text += &format!(" {:.5}", angle_rad * DEG_PER_RAD);
        }
    }
    text
}

fn circle(centre: &UnitVector<Icrs>, radius_deg: f64) -> String {
    let (ra_rad, dec_rad) = centre.to_ra_dec();
    let [ra_deg, dec_deg] = [ra_rad, dec_rad].map(|angle_rad| angle_rad * DEG_PER_RAD);
    format!("CIRCLE ICRS {ra_deg:.5} {dec_deg:.5} {radius_deg:.5}")
}

/// The date of the evening before: from noon to noon, in local mean time where the site is known.
fn night(date: ObservationDate, solution: &Solution) -> String {
    const HALF_A_DAY: f64 = 0.5;
    let Some(days) = date.modified_julian_date() else {
        return date.to_iso();
    };
    let lon_deg = solution.site.map_or(0.0, |site| site.lon_deg());
    let evening = (days + lon_deg / 360.0 - HALF_A_DAY).floor();
    ObservationDate::from_modified_julian_date(evening).map_or_else(
        || date.to_iso(),
        |evening| evening.to_iso()[..10].to_owned(),
    )
}
