//! A wrong site or time is noticed, and what is proposed would put it right; right ones are not accused.

use crate::common::{Ran, sky, starpipe};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use starpipe::camera::Projection;
use starpipe::centroids::ListedCentroid;
use starpipe::ephemeris::places::StarPlaces;
use starpipe::identify::{DateSource, DateZone, FrameDate, Photometry};
use starpipe::solve::{Change, Contradiction, Note, PlaceTime};
use starpipe::{
    CameraModel, CentroidList, Context, ObservationDate, PixelPoint, Rotation, Site, Solution,
    UnitVector, UtcOffset, Workspace, solve_centroids,
};

const SIDE_PX: f64 = 1000.0;
/// Error of the centroids on each axis.
const SIGMA_PX: f64 = 0.1;
/// North and east, and a night of summer.
const SITE: [f64; 3] = [44.0, 11.0, 300.0];
const DATE: &str = "2023-07-18T22:40:00Z";

fn site([lat_deg, lon_deg, height_m]: [f64; 3]) -> Site {
    Site::new(lat_deg, lon_deg, height_m).unwrap()
}

/// The stars to V 5 that a level all-sky camera sees at SITE and DATE, to 3° above the horizon.
fn all_sky() -> CentroidList {
    let places = StarPlaces::at(&DATE.parse().unwrap(), Some(site(SITE)), None);
    let zenith = *places.zenith().unwrap();
    let noise = Normal::new(0.0, SIGMA_PX).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let lens = CameraModel::pinhole(SIDE_PX, SIDE_PX, SIDE_PX / 3.2, false);
    let lens = lens.with_projection(Projection::Equidistant);
    let attitude = Rotation::looking_at(&zenith, 0.7);
    let stars = sky()
        .catalog()
        .stars()
        .iter()
        .filter(|star| star.v_mag < 5.0);
    let seen = stars.filter_map(|star| {
        let apparent = places.of(star);
        let pixel = lens.pixel_of(&attitude.apply(&apparent))?;
        let is_high = apparent.dot(&zenith) > 0.05;
        let [x, y] = [pixel.x, pixel.y].map(|at| at + noise.sample(&mut random));
        let mut listed = ListedCentroid::new(PixelPoint::new(x, y), f64::from(star.v_mag));
        listed.sigma_px = Some(SIGMA_PX);
        is_high.then_some(listed)
    });
    CentroidList {
        width: Some(SIDE_PX as usize),
        height: Some(SIDE_PX as usize),
        photometry: Photometry::JohnsonV,
        has_brightness: true,
        centroids: seen.collect(),
    }
}

fn solved_list(list: &CentroidList, context: &Context) -> Solution {
    solve_centroids(list, context, &mut Workspace::new()).expect("the size is stated")
}

fn solved(place: [f64; 3], known: FrameDate, offset: Option<UtcOffset>) -> Solution {
    let mut context = Context::new(sky());
    context.priors.site = Some(site(place));
    context.priors.date = Some(known);
    context.utc_offset = offset;
    solved_list(&all_sky(), &context)
}

fn stated(date: &str) -> FrameDate {
    FrameDate::stated(date.parse().unwrap(), DateSource::User)
}

fn contradicted(place: [f64; 3], date: &str) -> PlaceTime {
    let solution = solved(place, stated(date), None);
    assert!(
        solution.outcome.identification().is_some(),
        "{place:?} {date}"
    );
    assert_eq!(solution.observation, None);
    assert_eq!(solution.site, None);
    let found = solution.outcome.identification().unwrap();
    assert!(!found.places.has_refraction());
    let noted = |note: &Note| note.code() == "site_or_time_wrong";
    assert!(solution.notes.iter().any(noted));
    solution.place_time.expect("contradicted")
}

fn proposes(found: &PlaceTime, is: impl Fn(&Change) -> bool) -> bool {
    found.proposals.iter().any(|proposal| is(&proposal.change))
}

#[test]
fn a_right_site_and_time_are_not_accused() {
    let solution = solved(SITE, stated(DATE), None);
    assert_eq!(solution.place_time, None, "{:?}", solution.notes);
    let seen = solution.observation.expect("site and time are known");
    assert!(seen.zenith_distance_rad < 0.01);
    // The height is often not stated, and a time may be off by minutes.
    let rough = solved([43.7, 11.3, 0.0], stated("2023-07-18T22:44:00Z"), None);
    assert_eq!(rough.place_time, None, "{:?}", rough.notes);
}

#[test]
fn a_sign_an_hour_and_a_day_are_put_right() {
    let [lat, lon, height] = SITE;
    let south = contradicted([-lat, lon, height], DATE);
    assert!(matches!(
        south.contradictions[0],
        Contradiction::StarsBelowHorizon { below, .. } if below > 100
    ));
    assert_eq!(south.proposals[0].change, Change::LatitudeSign, "{south}");
    let west = contradicted([lat, -lon, height], DATE);
    assert!(
        proposes(&west, |change| *change == Change::LongitudeSign),
        "{west}"
    );
    let exchanged = contradicted([lon, lat, height], DATE);
    assert!(
        proposes(&exchanged, |change| *change == Change::Exchanged),
        "{exchanged}"
    );
    let local = contradicted(SITE, "2023-07-19T00:40:00Z");
    assert!(
        proposes(&local, |change| *change == Change::Hours(-2.0)),
        "{local}"
    );
    let spring = contradicted(SITE, "2023-04-18T22:40:00Z");
    let is_near = |days: i64| (85..=97).contains(&days);
    assert!(
        proposes(
            &spring,
            |change| matches!(change, Change::Days(days) if is_near(*days))
        ),
        "{spring}"
    );
}

#[test]
fn the_sun_contradicts_a_day() {
    // Half a year later the same stars are up at noon.
    let noon = contradicted(SITE, "2024-01-18T10:40:00Z");
    let is_sun = |found: &Contradiction| found.code() == "sun_is_up";
    assert!(noon.contradictions.iter().any(is_sun), "{noon}");
}

#[test]
fn the_zone_of_a_local_time_is_found_by_the_stars() {
    let shown: ObservationDate = "2023-07-19T00:40:00Z".parse().unwrap();
    let local = FrameDate {
        date: shown,
        source: DateSource::FileName,
        zone: DateZone::Unknown,
    };
    let solution = solved(SITE, local, Some(UtcOffset::Auto));
    let date = solution.date.unwrap();
    assert!(matches!(date.zone, DateZone::ByStars(ahead) if ahead.as_hours() == 2));
    assert_eq!(date.date.to_iso(), DATE);
    assert_eq!(solution.place_time, None);
    let found = solution.outcome.identification().unwrap();
    assert!(found.places.has_refraction());
    // Without the option nothing is bent, and the time is not believed.
    let unknown = solved(SITE, local, None);
    assert!(unknown.place_time.is_some());
}

#[test]
fn a_narrow_frame_that_looks_down_is_noticed() {
    let lens = CameraModel::pinhole(SIDE_PX, SIDE_PX, 2500.0, false);
    let attitude = Rotation::looking_at(&UnitVector::from_ra_dec(4.9, 0.68), 0.5);
    let stars = sky()
        .catalog()
        .stars()
        .iter()
        .filter(|star| star.v_mag < 7.5);
    let seen = stars.filter_map(|star| {
        let pixel = lens.pixel_of(&attitude.apply(&star.direction))?;
        lens.contains(&pixel)
            .then(|| ListedCentroid::new(pixel, f64::from(star.v_mag)))
    });
    let list = CentroidList {
        centroids: seen.collect(),
        ..all_sky()
    };
    let mut context = Context::new(sky());
    context.priors.date = Some(stated(DATE));
    context.priors.site = Some(site(SITE));
    let right = solved_list(&list, &context);
    assert_eq!(right.place_time, None);
    context.priors.site = Some(site([-60.0, 11.0, 0.0]));
    let wrong = solved_list(&list, &context);
    let wrong = wrong.place_time.unwrap();
    assert!(
        proposes(&wrong, |change| *change == Change::LatitudeSign),
        "{wrong}"
    );
}

#[test]
fn an_offset_is_hours_or_auto_and_moves_the_time_in_a_name() {
    let directory = tempfile::tempdir().unwrap();
    let frame = directory.path().join("20190729_224726.png");
    std::fs::copy(crate::common::orion(), &frame).unwrap();
    let date = |more: &[&str]| {
        let mut command = starpipe();
        command.args(["process", "--format=json"]).args(more);
        Ran::new(command.arg(&frame)).reports().remove(0)["date"].clone()
    };
    let local = date(&[]);
    assert_eq!(local["iso"], "2019-07-29T22:47:26Z");
    assert_eq!(local["utc_offset_source"], "assumed");
    assert_eq!(local["uncertainty_h"], 14.0);
    let summer = date(&["--utc-offset=2"]);
    assert_eq!(summer["iso"], "2019-07-29T20:47:26Z");
    assert_eq!(summer["utc_offset_source"], "option");
    assert_eq!(
        (&summer["utc_offset_h"], &summer["uncertainty_h"]),
        (&2.0.into(), &0.0.into())
    );
    // West of Greenwich a clock is behind.
    assert_eq!(
        date(&["--utc-offset", "-3.5"])["iso"],
        "2019-07-30T02:17:26Z"
    );
    let refused = Ran::new(starpipe().args(["process", "--utc-offset=99"]).arg(&frame));
    assert_eq!(refused.status, 2);
    assert!(refused.stderr.contains("-14 to 14"), "{}", refused.stderr);
}
