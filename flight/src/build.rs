//! Makes catalogues.
//!
//! Stars → for each of many circles all over the sky its brightest stars → all triangles of these, each once → bytes.
//! The smallest circles lie in the narrowest field of view, the largest ones around the widest. As many of their stars
//! count as the budget has room for.

use crate::Star;
use crate::catalog::{
    CLASSES, DIRECTION_UNIT, HASHED_FROM, HEADER_BYTES, MAGIC, SIDE_UNITS, STAR_BYTES,
    TRIANGLE_BYTES, Triangle, VERSION, cell_count, cell_of, class_of,
};
use alloc::collections::BTreeSet;
use alloc::vec;
use alloc::vec::Vec;
use core::f64::consts::{PI, SQRT_2};
use core::fmt;
use nalgebra::Vector3;
use xxhash_rust::xxh3::xxh3_64;

/// Each circle is this much larger than the one before it.
const CIRCLE_STEP: f64 = 1.5;
/// From one circle to the next, in radii.
const CIRCLE_DISTANCE: f64 = 0.4;
/// Brightest stars of a circle at most.
const MAX_BRIGHTEST: usize = 14;
/// Stars nearer than this are one in the image, as a share of the circle's radius.
const MIN_SIDE: f64 = 0.02;
/// Stars beyond the corners that shift into the frame, in radians.
const BORDER_RAD: f64 = 1e-3;

/// What a catalogue is for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Narrowest and widest field of view, along the shorter side of the frame, in degrees.
    pub fov_deg: [f64; 2],
    /// V magnitude of the faintest star.
    pub v_limit: f64,
    /// Year of the stars' directions.
    pub epoch_year: f64,
    /// Most bytes.
    pub budget_bytes: usize,
}

/// Why a catalogue cannot be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BuildError {
    /// A value of the plan is out of range.
    Plan,
    /// There are more stars than can be numbered, or fewer than a triangle has.
    Stars {
        /// Number of stars.
        count: usize,
    },
    /// The stars and the triangles of the three brightest of each circle need more.
    Budget {
        /// Bytes that they need.
        needed_bytes: usize,
    },
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plan => {
                f.write_str("fields of view are from 1 to 60 degrees, the narrower one first")
            }
            Self::Stars { count } => write!(f, "{count} stars: a catalog has from 4 to 65534"),
            Self::Budget { needed_bytes } => {
                write!(f, "the catalog needs at least {needed_bytes} bytes")
            }
        }
    }
}

impl core::error::Error for BuildError {}

/// Makes a catalogue of those stars that are bright enough.
///
/// # Errors
/// The plan is out of range, the stars are too many or too few, or the budget is too small.
pub fn catalog(stars: &[Star], plan: &Plan) -> Result<Vec<u8>, BuildError> {
    let [narrowest, widest] = plan.fov_deg;
    if !(narrowest >= 1.0 && narrowest <= widest && widest <= 60.0 && plan.v_limit.is_finite()) {
        return Err(BuildError::Plan);
    }
    let mut kept: Vec<Star> = stars
        .iter()
        .filter(|star| star.v_mag <= plan.v_limit)
        .copied()
        .collect();
    if !(4..usize::from(u16::MAX)).contains(&kept.len()) {
        return Err(BuildError::Stars { count: kept.len() });
    }
    kept.sort_by(|a, b| {
        let place = |star: &Star| (cell_of(&star.direction), star.v_mag, star.id);
        place(a)
            .partial_cmp(&place(b))
            .unwrap_or(core::cmp::Ordering::Equal)
    });
    let stars_bytes =
        kept.len() * STAR_BYTES + 4 * (cell_count() + 1) + 4 * (CLASSES + 1) + HEADER_BYTES;
    let circles = Circles::new(&kept, plan);
    let mut best = None;
    for brightest in 3..=MAX_BRIGHTEST {
        let triples = circles.triples(brightest);
        let needed_bytes = stars_bytes + triples.len() * TRIANGLE_BYTES;
        if needed_bytes > plan.budget_bytes {
            if best.is_none() {
                return Err(BuildError::Budget { needed_bytes });
            }
            break;
        }
        best = Some(triples);
    }
    let triples = best.unwrap_or_default();
    let longest = longest_chord(&kept, &triples);
    let triangles = triangles(&kept, &triples, longest);
    Ok(bytes(
        &kept,
        &triangles,
        longest,
        circles.most_in_view,
        plan,
    ))
}

/// The brightest stars of circles all over the sky.
struct Circles<'a> {
    stars: &'a [Star],
    /// Numbers of the brightest stars of each circle, the brightest first.
    brightest: Vec<Vec<u16>>,
    /// Most stars in a circle around the widest frame.
    most_in_view: usize,
}

impl<'a> Circles<'a> {
    fn new(stars: &'a [Star], plan: &Plan) -> Self {
        let mut bright: Vec<usize> = (0..stars.len()).collect();
        bright.sort_by(|a, b| stars[*a].v_mag.total_cmp(&stars[*b].v_mag));
        let [narrowest, widest] = plan.fov_deg.map(|fov| 0.5 * fov.to_radians());
        let corner = SQRT_2 * widest;
        let mut circles = Self {
            stars,
            brightest: Vec::new(),
            most_in_view: 0,
        };
        let mut radius = narrowest;
        loop {
            circles.add(&bright, radius);
            if radius >= corner {
                break;
            }
            radius = (radius * CIRCLE_STEP).min(corner);
        }
        circles.most_in_view = most_in_view(stars, corner + BORDER_RAD);
        circles
    }

    fn add(&mut self, bright: &[usize], radius: f64) {
        let nearest = libm::cos(radius);
        for center in centers(radius * CIRCLE_DISTANCE) {
            let inside = bright
                .iter()
                .filter(|star| self.stars[**star].direction.dot(&center) >= nearest);
            let mut apart: Vec<u16> = Vec::with_capacity(MAX_BRIGHTEST);
            for star in inside {
                let direction = &self.stars[*star].direction;
                let is_apart = |other: &u16| {
                    (self.stars[usize::from(*other)].direction - direction).norm()
                        > MIN_SIDE * radius
                };
                if apart.iter().all(is_apart) {
                    apart.push(*star as u16);
                }
                if apart.len() == MAX_BRIGHTEST {
                    break;
                }
            }
            self.brightest.push(apart);
        }
    }

    /// The stars of all triangles of this many of the brightest stars of each circle.
    fn triples(&self, brightest: usize) -> BTreeSet<[u16; 3]> {
        let mut all = BTreeSet::new();
        for circle in &self.brightest {
            let circle = &circle[..circle.len().min(brightest)];
            for third in 2..circle.len() {
                for second in 1..third {
                    for first in 0..second {
                        let mut stars = [circle[first], circle[second], circle[third]];
                        stars.sort_unstable();
                        all.insert(stars);
                    }
                }
            }
        }
        all
    }
}

/// The chord of the longest side, and a little more: what is written is a 32-bit number, and no side may be longer.
fn longest_chord(stars: &[Star], triples: &BTreeSet<[u16; 3]>) -> f32 {
    let chords = triples.iter().flat_map(|triple| sides(stars, *triple));
    (chords.map(|(chord, _)| chord).fold(0.0, f64::max) * (1.0 + 1e-6)) as f32
}

/// The triangles in the order of the catalogue.
fn triangles(stars: &[Star], triples: &BTreeSet<[u16; 3]>, longest: f32) -> Vec<Triangle> {
    let made = triples
        .iter()
        .map(|triple| triangle(stars, *triple, f64::from(longest)));
    let mut triangles: Vec<Triangle> = made.collect();
    triangles.sort_by_key(|triangle| {
        let Triangle { sides, stars } = *triangle;
        (class_of(sides[0]), sides[1], sides, stars)
    });
    triangles
}

/// The sides of a triangle, each with the star opposite to it, the longest first.
fn sides(stars: &[Star], numbers: [u16; 3]) -> [(f64, u16); 3] {
    let direction = |place: usize| stars[usize::from(numbers[place % 3])].direction;
    let mut sides = [0, 1, 2].map(|place| {
        (
            (direction(place + 1) - direction(place + 2)).norm(),
            numbers[place],
        )
    });
    sides.sort_by(|a, b| b.0.total_cmp(&a.0));
    sides
}

fn triangle(stars: &[Star], numbers: [u16; 3], longest: f64) -> Triangle {
    let sides = sides(stars, numbers);
    Triangle {
        sides: sides.map(|(chord, _)| (chord / longest * SIDE_UNITS + 0.5) as u16),
        stars: sides.map(|(_, star)| star),
    }
}

/// Directions all over the sky, about this far apart: on a spiral from pole to pole.
fn centers(distance: f64) -> Vec<Vector3<f64>> {
    let golden = PI * (3.0 - libm::sqrt(5.0));
    let count = libm::ceil(4.0 * PI / (distance * distance)) as usize;
    let center = |number: usize| {
        let z = 1.0 - (2.0 * number as f64 + 1.0) / count as f64;
        let across = libm::sqrt(1.0 - z * z);
        let (sin, cos) = libm::sincos(golden * number as f64);
        Vector3::new(across * cos, across * sin, z)
    };
    (0..count).map(center).collect()
}

/// Most stars in a circle: around centres so near that a slightly larger circle holds each.
fn most_in_view(stars: &[Star], radius: f64) -> usize {
    let distance = 0.1 * radius;
    let nearest = libm::cos(radius + distance);
    let inside = |center: &Vector3<f64>| {
        stars
            .iter()
            .filter(|star| star.direction.dot(center) >= nearest)
            .count()
    };
    centers(distance).iter().map(inside).max().unwrap_or(0)
}

fn bytes(
    stars: &[Star],
    triangles: &[Triangle],
    longest: f32,
    most_in_view: usize,
    plan: &Plan,
) -> Vec<u8> {
    let mut content = Vec::new();
    for value in [
        plan.fov_deg[0],
        plan.fov_deg[1],
        plan.v_limit,
        plan.epoch_year,
    ] {
        content.extend((value as f32).to_le_bytes());
    }
    for count in [stars.len(), triangles.len(), most_in_view] {
        content.extend((count as u32).to_le_bytes());
    }
    content.extend(longest.to_le_bytes());
    let cells = stars.iter().map(|star| cell_of(&star.direction));
    content.extend(starts(cells, cell_count()));
    stars
        .iter()
        .for_each(|star| content.extend(star_bytes(star)));
    let classes = triangles.iter().map(|triangle| class_of(triangle.sides[0]));
    content.extend(starts(classes, CLASSES));
    for triangle in triangles {
        let parts = triangle.sides.iter().chain(&triangle.stars);
        parts.for_each(|part| content.extend(part.to_le_bytes()));
    }
    let mut bytes = Vec::with_capacity(HASHED_FROM + content.len());
    bytes.extend(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(((HASHED_FROM + content.len()) as u32).to_le_bytes());
    bytes.extend(xxh3_64(&content).to_le_bytes());
    bytes.extend(content);
    bytes
}

/// The number of the first member of each group, and of all, of members that are sorted by group.
fn starts(groups: impl Iterator<Item = usize>, count: usize) -> Vec<u8> {
    let mut starts = vec![0_u32; count + 1];
    groups.for_each(|group| starts[group + 1] += 1);
    let mut sum = 0;
    let numbers = starts.into_iter().map(|members| {
        sum += members;
        sum
    });
    numbers.flat_map(u32::to_le_bytes).collect()
}

fn star_bytes(star: &Star) -> Vec<u8> {
    let part = |value: f64| (libm::round(value / DIRECTION_UNIT) as i32).to_le_bytes();
    let direction = star.direction.iter().flat_map(|value| part(*value));
    let motion = star.motion_mas.iter().flat_map(|value| value.to_le_bytes());
    let v_mag = (libm::round(star.v_mag * 1000.0) as i16).to_le_bytes();
    direction
        .chain(motion)
        .chain(v_mag)
        .chain(star.id.to_le_bytes())
        .collect()
}
