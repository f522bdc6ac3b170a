//! Moon and planets in simulated frames of ten dates: found, named, and not taken for stars.

use starpipe::base::coords::{Icrs, Rotation, UnitVector};
use starpipe::camera::data_sheet::Preset;
use starpipe::catalog::{Star, StarId};
use starpipe::ephemeris::places::StarPlaces;
use starpipe::ephemeris::solar_system::{Body, BodyKind, TimeError, bodies_at};
use starpipe::identify::{DateSource, FrameDate, IndexedCatalog};
use starpipe::lab::simulate::{Pointing, Scene, Simulator};
use starpipe::predict::Scenario;
use starpipe::{Context, FrameReport, ObservationDate, Solution, Workspace, solve_frame};

/// A date, a planet in front of the stars then, and its place by JPL (DE421; DE405 for the last),
/// in degrees.
const DATES: [(&str, BodyKind, [f64; 2]); 10] = [
    ("1905-03-21T03:15:00Z", BodyKind::Mars, [233.5338, -17.6369]),
    ("1924-08-23T00:00:00Z", BodyKind::Mars, [336.0224, -17.2452]),
    ("1939-11-02T18:40:30Z", BodyKind::Saturn, [26.7367, 8.0820]),
    (
        "1957-10-04T19:28:34Z",
        BodyKind::Venus,
        [231.7400, -20.6517],
    ),
    (
        "1969-07-20T20:17:40Z",
        BodyKind::Jupiter,
        [181.5614, 0.6513],
    ),
    (
        "1986-02-09T11:00:00Z",
        BodyKind::Saturn,
        [247.2998, -19.9119],
    ),
    (
        "2000-01-01T12:00:00Z",
        BodyKind::Uranus,
        [317.4838, -17.0188],
    ),
    (
        "2019-07-29T20:47:26Z",
        BodyKind::Jupiter,
        [253.2180, -22.0928],
    ),
    (
        "2026-08-12T17:30:00Z",
        BodyKind::Mercury,
        [127.2292, 19.6650],
    ),
    ("2099-09-14T17:00:00Z", BodyKind::Mars, [30.3450, 8.1282]),
];

fn direction([ra_deg, dec_deg]: [f64; 2]) -> UnitVector<Icrs> {
    UnitVector::from_ra_dec(ra_deg.to_radians(), dec_deg.to_radians())
}

/// The frame in which the planet is a little off the centre, as a point at the almanac's place,
/// solved with `date` where it is known.
fn solved(
    sky: &IndexedCatalog,
    (date, kind, place): (&str, BodyKind, [f64; 2]),
    known: Option<&str>,
) -> Solution {
    let date: ObservationDate = date.parse().unwrap();
    let v_mag = of(kind, &date).v_mag;
    let mut stars = sky.catalog().stars().to_vec();
    stars.push(Star::new(StarId::Number(1), direction(place), v_mag as f32));
    let scenario = Scenario::of(Preset::Imx174);
    let simulator = Simulator::new(&scenario, &Scene::default(), &stars).unwrap();
    let centre = direction([place[0] + 2.0, place[1] - 1.5]);
    let pointing = Pointing {
        icrs_to_camera: Rotation::looking_at(&centre, 0.3),
        places: StarPlaces::at(&date, None, None),
    };
    let (frame, _) = simulator.frame(&pointing, 7).unwrap();
    let mut context = Context::new(sky);
    context.priors.date =
        known.map(|date| FrameDate::stated(date.parse().unwrap(), DateSource::User));
    solve_frame(&frame, &context, &mut Workspace::new()).unwrap()
}

fn of(kind: BodyKind, date: &ObservationDate) -> Body {
    let bodies = bodies_at(date, TimeError::None, None);
    bodies.into_iter().find(|body| body.kind == kind).unwrap()
}

#[test]
fn planets_of_ten_dates_are_named_and_are_no_stars() {
    let sky = IndexedCatalog::built_in();
    for case @ (date, kind, _) in DATES {
        // A day alone is enough for all but the quickest.
        let day = &date[..10];
        for known in [date, day] {
            if known == day && matches!(kind, BodyKind::Mercury | BodyKind::Venus | BodyKind::Mars)
            {
                continue;
            }
            let solution = solved(&sky, case, Some(known));
            let report = FrameReport::new("a", &solution, sky.catalog());
            assert!(report.is_identified(), "{date}");
            let body = report.bodies.iter().find(|body| body.name == kind.name());
            let body = body.unwrap_or_else(|| panic!("no {} at {known}", kind.name()));
            let star = &report.stars[body.detection.unwrap()];
            assert_eq!((star.name.as_deref(), &star.id), (Some(kind.name()), &None));
            let off_px = (star.x - body.x).hypot(star.y - body.y);
            let allowed_px = if known == day {
                body.uncertainty_px
            } else {
                2.0
            };
            assert!(off_px < allowed_px, "{known}: {off_px} px");
            assert!(
                solution
                    .notes
                    .iter()
                    .any(|note| note.code() == "body_in_frame")
            );
            let named = report.stars.iter().filter(|star| star.id.is_some());
            assert!(named.count() > 20, "{known}");
        }
    }
}

#[test]
fn without_a_date_or_at_another_one_there_is_no_planet() {
    let sky = IndexedCatalog::built_in();
    for known in [None, Some("2010-07-29T20:47:26Z")] {
        let solution = solved(&sky, DATES[7], known);
        assert!(solution.bodies.iter().all(|body| body.source.is_none()));
        let report = FrameReport::new("a", &solution, sky.catalog());
        let named = |star: &starpipe::report::StarReport| star.name.as_deref() == Some("Jupiter");
        assert!(report.is_identified() && !report.stars.iter().any(named));
    }
}
