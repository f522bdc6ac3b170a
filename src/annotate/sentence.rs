//! What a frame shows, in one sentence.

use super::annotation::{Annotation, AnnotationKind};
use super::constellations::VisibleConstellation;
use super::view::View;
use crate::base::coords::{Icrs, PixelPoint, UnitVector};
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::ephemeris::solar_system::BodyKind;
use nalgebra::Vector3;

/// From these angles from the axis on a frame shows the whole sky, or most of it.
const WHOLE_SKY_DEG: f64 = 78.0;
const MOST_OF_SKY_DEG: f64 = 60.0;
/// Planets that are fainter are not seen.
const VISIBLE_MAG: f64 = 5.0;
/// Deep-sky objects with a name that people know, beside those of Messier's list.
const FAMOUS: [&str; 9] = [
    "Mel 25", "LMC", "SMC", "NGC 104", "NGC 869", "NGC 3372", "NGC 4755", "NGC 5139", "NGC 7000",
];
/// The north pole of the Milky Way (Reid & Brunthaler 2004, ApJ 616, 872: J2000.0).
const GALACTIC_POLE_DEG: [f64; 2] = [192.859_5, 27.128_2];

/// The sentence.
pub(super) fn of(
    view: &View<'_>,
    constellations: &[VisibleConstellation],
    annotations: &[Annotation],
) -> String {
    let reach_deg = view.found.camera.radius_rad() * DEG_PER_RAD;
    let is_round =
        view.found.camera.fov_x_rad().is_none() || view.found.camera.fov_y_rad().is_none();
    if is_round && reach_deg >= MOST_OF_SKY_DEG {
        return whole_sky(view, constellations, annotations);
    }
    let mut text = shown_constellations(constellations);
    text += &companions(annotations);
    format!("{text}; {}, {}", field(view), north(view))
}

/// The most conspicuous constellations in the frame; the one that it lies in, where it shows none of them.
fn shown_constellations(constellations: &[VisibleConstellation]) -> String {
    /// A constellation is shown where this much of its figure is in the frame, or of the light of its stars, …
    const SHOWN: f64 = 0.6;
    const SHOWN_LIGHT: f64 = 0.7;
    /// … and named where its stars give this much of the light of the most conspicuous one's.
    const MIN_LIGHT: f64 = 0.15;
    const MOST: usize = 3;
    let mut shown: Vec<&VisibleConstellation> = constellations
        .iter()
        .filter(|seen| seen.figure_share >= SHOWN || seen.light_share >= SHOWN_LIGHT)
        .collect();
    shown.sort_by(|a, b| b.light.total_cmp(&a.light));
    let most_light = shown.first().map_or(0.0, |first| first.light);
    let largest = constellations.first().map_or("", |largest| largest.name);
    let bright = shown
        .iter()
        .filter(|seen| seen.light >= MIN_LIGHT * most_light);
    let names: Vec<String> = bright.take(MOST).map(|seen| seen.name.to_owned()).collect();
    if names.is_empty() {
        format!("In {largest}")
    } else {
        listed(&names)
    }
}

/// What is in the frame beside constellations: Moon and planets, famous deep-sky objects, radiants.
fn companions(annotations: &[Annotation]) -> String {
    const MOST: usize = 3;
    let mut names: Vec<String> = Vec::new();
    let mut designation = "";
    let mut radiants = Vec::new();
    for shown in annotations {
        let spoken = article(&shown.name);
        match shown.kind {
            AnnotationKind::Body { .. } if is_visible(shown) => names.push(spoken),
            // The Double Cluster has two numbers.
            AnnotationKind::DeepSky {
                designation: number,
            } if is_famous(number, &shown.name) && !names.contains(&spoken) => {
                names.push(spoken);
                designation = number;
            }
            AnnotationKind::Radiant => radiants.push(spoken),
            _ => {}
        }
    }
    names.truncate(MOST);
    names.extend(radiants);
    match names.as_slice() {
        [] => String::new(),
        [only] if designation.starts_with("M ") || designation.starts_with("NGC") => {
            format!(", with {designation}, {only}")
        }
        all => format!(", with {}", listed(all)),
    }
}

fn is_visible(body: &Annotation) -> bool {
    body.v_mag.is_some_and(|v_mag| v_mag < VISIBLE_MAG)
}

fn is_famous(designation: &str, name: &str) -> bool {
    FAMOUS.contains(&designation) || (designation.starts_with("M ") && designation != name)
}

/// A name as it is spoken of: `the Orion Nebula`, `the Moon`, but `Jupiter` and `Omega Centauri`.
fn article(name: &str) -> String {
    const FIRST_WORDS: [&str; 6] = [
        "47",
        "Omega Centauri",
        "Centaurus",
        "Virgo",
        "Cetus",
        "Bode’s",
    ];
    let is_planet = BodyKind::ALL
        .iter()
        .any(|kind| *kind != BodyKind::Moon && kind.name() == name);
    let is_alone = is_planet
        || name.contains("’s C")
        || FIRST_WORDS.iter().any(|first| name.starts_with(first));
    if is_alone {
        name.to_owned()
    } else {
        format!("the {name}")
    }
}

/// `a`, `a and b`, `a, b and c`.
fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [others @ .., last] => format!("{} and {last}", others.join(", ")),
    }
}

/// The size of the frame on the sky.
fn field(view: &View<'_>) -> String {
    let camera = &view.found.camera;
    let Some((x_rad, y_rad)) = camera.fov_x_rad().zip(camera.fov_y_rad()) else {
        return format!(
            "{:.0} degrees across",
            2.0 * camera.radius_rad() * DEG_PER_RAD
        );
    };
    let [x_deg, y_deg] = [x_rad, y_rad].map(|rad| rad * DEG_PER_RAD);
    match x_deg.min(y_deg) {
        shorter if shorter >= 10.0 => format!("{x_deg:.0} by {y_deg:.0} degrees"),
        shorter if shorter >= 1.0 => format!("{x_deg:.1} by {y_deg:.1} degrees"),
        _ => format!("{:.0} by {:.0} arcminutes", x_deg * 60.0, y_deg * 60.0),
    }
}

/// Where north is in the picture.
fn north(view: &View<'_>) -> String {
    let (boresight, _) = view.found.icrs_to_camera.boresight_and_up();
    let (_, north) = boresight.east_north();
    let along = view.found.icrs_to_camera.matrix() * north;
    let x = if view.found.camera.mirrored {
        -along.x
    } else {
        along.x
    };
    let mirrored = if view.found.camera.mirrored {
        "; it is mirrored"
    } else {
        ""
    };
    // From up, clockwise; y is down.
    let angle_deg = libm::atan2(x, -along.y) * DEG_PER_RAD;
    format!("{}{mirrored}", direction_of_north(angle_deg))
}

fn direction_of_north(clockwise_deg: f64) -> String {
    const SIDES: [&str; 4] = ["up", "to the right", "down", "to the left"];
    /// Less is not worth a word, in degrees.
    const STRAIGHT_DEG: f64 = 2.0;
    let quarter = (clockwise_deg / 90.0).round();
    let off_deg = clockwise_deg - 90.0 * quarter;
    let side = |quarter: f64| SIDES[quarter.rem_euclid(4.0) as usize];
    if off_deg.abs() < STRAIGHT_DEG {
        return format!("north is {}", side(quarter));
    }
    let aside = side(quarter + off_deg.signum());
    format!(
        "north is {} and {:.0} degrees {aside}",
        side(quarter),
        off_deg.abs()
    )
}

fn whole_sky(
    view: &View<'_>,
    constellations: &[VisibleConstellation],
    annotations: &[Annotation],
) -> String {
    let centre = view.found.camera.axis();
    let distance = |seen: &VisibleConstellation| {
        seen.middle
            .map_or(f64::INFINITY, |middle| middle.distance_to(&centre))
    };
    /// Of the constellations there, the most conspicuous is named: within this share of the radius.
    const NEAR: f64 = 0.35;
    let radius_px = view.found.camera.radius_px();
    let near = constellations
        .iter()
        .filter(|seen| distance(seen) < NEAR * radius_px);
    let is_whole = view.found.camera.radius_rad() * DEG_PER_RAD >= WHOLE_SKY_DEG;
    let mut text = if is_whole {
        "The whole sky"
    } else {
        "Most of the sky"
    }
    .to_owned();
    if let Some(seen) = near.max_by(|a, b| a.light.total_cmp(&b.light)) {
        text += &format!(", {} near the middle", seen.name);
    }
    text += &milky_way(view);
    let bodies: Vec<&str> = annotations
        .iter()
        .filter(|shown| matches!(shown.kind, AnnotationKind::Body { .. }) && is_visible(shown))
        .map(|shown| shown.name.as_str())
        .collect();
    let planets: Vec<String> = bodies
        .iter()
        .filter(|name| **name != BodyKind::Moon.name())
        .map(|name| (*name).to_owned())
        .collect();
    if bodies.contains(&BodyKind::Moon.name()) {
        text += "; the Moon is up";
    }
    if !planets.is_empty() {
        let verb = if planets.len() == 1 { "is" } else { "are" };
        text += &format!("; {} {verb} visible", listed(&planets));
    }
    text
}

/// The course of the Milky Way, by the points of the compass where the horizon is known, else in the picture.
fn milky_way(view: &View<'_>) -> String {
    const STEP_DEG: f64 = 5.0;
    let [ra_rad, dec_rad] = GALACTIC_POLE_DEG.map(|deg| deg * RAD_PER_DEG);
    let pole = *UnitVector::<Icrs>::from_ra_dec(ra_rad, dec_rad).as_vector();
    let aside = pole.cross(&Vector3::z()).normalize();
    let across = pole.cross(&aside);
    let points = (0..(360.0 / STEP_DEG) as u32).map(|step| {
        let (sin, cos) = libm::sincos(f64::from(step) * STEP_DEG * RAD_PER_DEG);
        UnitVector::<Icrs>::from_vector(aside * cos + across * sin)
    });
    let seen: Vec<(UnitVector<Icrs>, PixelPoint)> = points
        .filter_map(|point| {
            let place = view.found.pixel_of(&point)?;
            view.found.camera.contains(&place).then_some((point, place))
        })
        .collect();
    let Some([from, to]) = farthest_apart(&seen) else {
        return String::new();
    };
    let names = match view.found.places.horizon() {
        Some(horizon) => [from, to].map(|(direction, _)| {
            let local = horizon.apply(direction);
            let [east, north] = [local.as_vector().x, local.as_vector().y];
            compass(libm::atan2(east, north) * DEG_PER_RAD)
        }),
        None => [from, to].map(|(_, place)| side_of_picture(&view.found.camera.axis(), place)),
    };
    if names[0] == names[1] {
        return String::new();
    }
    format!(", Milky Way from {} to {}", names[0], names[1])
}

/// The two that are farthest apart in the picture.
fn farthest_apart<T>(seen: &[(T, PixelPoint)]) -> Option<[&(T, PixelPoint); 2]> {
    let pairs = seen.iter().flat_map(|a| seen.iter().map(move |b| [a, b]));
    let apart = |[a, b]: &[&(T, PixelPoint); 2]| a.1.distance_to(&b.1);
    pairs.max_by(|a, b| apart(a).total_cmp(&apart(b)))
}

/// The point of the compass of an azimuth.
fn compass(azimuth_deg: f64) -> &'static str {
    const POINTS: [&str; 8] = [
        "north",
        "northeast",
        "east",
        "southeast",
        "south",
        "southwest",
        "west",
        "northwest",
    ];
    POINTS[(azimuth_deg / 45.0).round().rem_euclid(8.0) as usize]
}

/// Where a place is in the picture, seen from its middle.
fn side_of_picture(centre: &PixelPoint, place: &PixelPoint) -> &'static str {
    const SIDES: [&str; 8] = [
        "top",
        "top right",
        "right",
        "bottom right",
        "bottom",
        "bottom left",
        "left",
        "top left",
    ];
    let clockwise_deg = libm::atan2(place.x - centre.x, centre.y - place.y) * DEG_PER_RAD;
    SIDES[(clockwise_deg / 45.0).round().rem_euclid(8.0) as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn north_is_said_by_the_nearest_side_and_what_is_left() {
        for (clockwise_deg, expected) in [
            (0.4, "north is up"),
            (-12.0, "north is up and 12 degrees to the left"),
            (12.0, "north is up and 12 degrees to the right"),
            (57.0, "north is to the right and 33 degrees up"),
            (-100.0, "north is to the left and 10 degrees down"),
            (179.0, "north is down"),
            (-170.0, "north is down and 10 degrees to the left"),
        ] {
            assert_eq!(
                direction_of_north(clockwise_deg),
                expected,
                "{clockwise_deg}"
            );
        }
    }

    #[test]
    fn names_are_listed_as_people_do() {
        let names = ["a", "b", "c"].map(str::to_owned);
        assert_eq!(listed(&names[..1]), "a");
        assert_eq!(listed(&names[..2]), "a and b");
        assert_eq!(listed(&names), "a, b and c");
    }

    #[test]
    fn sides_and_points_of_the_compass_go_clockwise() {
        let centre = PixelPoint::new(100.0, 100.0);
        for (x, y, side) in [
            (100.0, 0.0, "top"),
            (200.0, 0.0, "top right"),
            (0.0, 100.0, "left"),
        ] {
            assert_eq!(side_of_picture(&centre, &PixelPoint::new(x, y)), side);
        }
        assert_eq!(
            [0.0, 91.0, -44.0].map(compass),
            ["north", "east", "northwest"]
        );
    }
}
