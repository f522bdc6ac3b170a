//! Places names, the most famous first, where they cover neither another name nor what is marked.

use super::mark::Mark;
use super::names::StarLabel;
use super::options::Rings;
use crate::report::figure::text_width;
use std::f32::consts::TAU;
use std::ptr;

/// Size of the letters, in units of strokes.
pub(super) const SIZE: f32 = 12.5;
/// Height of capitals and digits, as a share of the size.
const CAPITALS: f32 = 0.74;
/// Space around a name.
const MARGIN: f32 = 2.0;
/// Distance of a name from its ring.
const GAP: f32 = 3.0;

/// A name and the start of its baseline, in pixels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Label {
    pub(super) text: String,
    pub(super) at: [f32; 2],
    /// Line from the ring to a name that is not beside it.
    pub(super) line: Option<[[f32; 2]; 2]>,
}

/// Left, top, right and bottom.
type Rectangle = [f32; 4];

impl Mark {
    /// Whether the rectangle covers a part of the ring or its inside.
    fn is_covered_by(&self, [left, top, right, bottom]: &Rectangle) -> bool {
        let dx = self.x - self.x.clamp(*left, *right);
        let dy = self.y - self.y.clamp(*top, *bottom);
        libm::hypotf(dx, dy) < self.radius
    }

    /// Line from the ring to the nearest point of the rectangle.
    fn line_to(&self, [left, top, right, bottom]: &Rectangle) -> [[f32; 2]; 2] {
        let (x, y) = (self.x.clamp(*left, *right), self.y.clamp(*top, *bottom));
        let share = self.radius / libm::hypotf(x - self.x, y - self.y).max(self.radius);
        let from = [self.x + share * (x - self.x), self.y + share * (y - self.y)];
        [from, [x, y]]
    }
}

/// Where names may still be written, and what is marked there.
pub(super) struct Room<'a> {
    /// The marks that are shown.
    shown: Vec<&'a Mark>,
    /// Those that are to have a name, first those that get a place first.
    named: Vec<&'a Mark>,
    rings: Rings,
    taken: Vec<Rectangle>,
    image: [f32; 2],
    unit: f32,
}

impl<'a> Room<'a> {
    /// A picture of `image` pixels with `marks`, of which some are to have names.
    pub(super) fn of(marks: &'a [Mark], rings: Rings, image: [f32; 2], unit: f32) -> Self {
        let named = first_named(marks, rings, image, unit);
        let shown = match rings {
            Rings::None => Vec::new(),
            Rings::Named if !named.is_empty() => named.clone(),
            Rings::Named | Rings::All => marks.iter().collect(),
        };
        Self {
            shown,
            named,
            rings,
            taken: Vec::new(),
            image,
            unit,
        }
    }

    /// A picture of `image` pixels, all of it free.
    #[cfg(feature = "page")]
    pub(super) fn all(image: [f32; 2], unit: f32) -> Self {
        Self::of(&[], Rings::None, image, unit)
    }

    /// The marks that are shown.
    pub(super) fn marked(&self) -> &[&'a Mark] {
        &self.shown
    }

    /// Places the names of the marks. With [`Rings::Named`], a mark whose name finds no room is not shown.
    pub(super) fn place_names(&mut self) -> Vec<Label> {
        let mut labels = Vec::new();
        for mark in self.named.clone() {
            match label_of(mark, self) {
                Some((rectangle, label)) => {
                    self.taken.push(rectangle);
                    labels.push(label);
                }
                None if self.rings == Rings::Named => {
                    self.shown.retain(|other| !ptr::eq(*other, mark));
                }
                None => {}
            }
        }
        labels
    }

    /// A free place beside a circle, for the start of the baseline of `text` in letters of `size` units.
    pub(super) fn beside(
        &mut self,
        text: &str,
        center: [f32; 2],
        radius: f32,
        size: f32,
    ) -> Option<[f32; 2]> {
        let gap = GAP * self.unit;
        let sides = candidates(center, radius + gap, self.extent(text, size), self.unit);
        let place = self.first_free(&sides, &self.shown)?;
        Some(self.take(place))
    }

    /// The same for a name that is to stand around a point, or near it, within the picture. It may cover marks
    /// without a name where there is no other room.
    pub(super) fn near(&mut self, text: &str, middle: [f32; 2], size: f32) -> Option<[f32; 2]> {
        /// Distances from the point, in heights of letters.
        const AWAY: [f32; 9] = [0.0, 1.0, 2.0, 3.0, 4.5, 6.0, 8.0, 10.0, 13.0];
        const DIRECTIONS: u16 = 12;
        let [width, height] = self.extent(text, size);
        let (right, down) = (
            width / 2.0 + MARGIN * self.unit,
            height / 2.0 + MARGIN * self.unit,
        );
        let [right_end, bottom_end] = [self.image[0] - right, self.image[1] - down];
        if right > right_end || down > bottom_end {
            return None;
        }
        let places = AWAY.into_iter().flat_map(|away| {
            let directions = if away == 0.0 { 1 } else { DIRECTIONS };
            (0..directions).map(move |direction| {
                let (sin, cos) = libm::sincosf(f32::from(direction) * TAU / f32::from(DIRECTIONS));
                let away = away * height;
                let x = (middle[0] + away * cos).clamp(right, right_end);
                let y = (middle[1] + away * sin).clamp(down, bottom_end);
                [x - right, y - down, x + right, y + down]
            })
        });
        let places: Vec<Rectangle> = places.collect();
        let free = self.first_free(&places, &self.shown);
        let place = free.or_else(|| self.first_free(&places, &self.named))?;
        Some(self.take(place))
    }

    fn extent(&self, text: &str, size: f32) -> [f32; 2] {
        [
            text_width(text, size * self.unit),
            CAPITALS * size * self.unit,
        ]
    }

    /// The first of these places that covers neither a name nor one of `marks`.
    fn first_free(&self, places: &[Rectangle], marks: &[&Mark]) -> Option<Rectangle> {
        let is_free = |place: &&Rectangle| is_free(place, marks, &self.taken, self.image);
        places.iter().find(is_free).copied()
    }

    /// Takes a place; returns where the baseline begins.
    fn take(&mut self, place: Rectangle) -> [f32; 2] {
        self.taken.push(place);
        baseline(&place, self.unit)
    }
}

/// The marks with the most famous and brightest stars: as many as there is room for names. Stars with a number
/// alone are among them where all are marked, or where few have a name.
fn first_named(marks: &[Mark], rings: Rings, image: [f32; 2], unit: f32) -> Vec<&Mark> {
    /// Smallest area per name, in square units: more names are unreadable.
    const AREA_PER_LABEL: f32 = 9000.0;
    /// Fewer names than this are few.
    const ENOUGH_NAMES: usize = 5;
    let rank = |mark: &Mark| {
        mark.label
            .as_ref()
            .map_or(f32::INFINITY, |label| label.rank)
    };
    let has_name = |mark: &&Mark| mark.label.as_ref().is_some_and(|label| label.has_name);
    let mut named: Vec<&Mark> = marks.iter().filter(|mark| mark.label.is_some()).collect();
    if rings == Rings::Named && named.iter().filter(|mark| has_name(mark)).count() >= ENOUGH_NAMES {
        named.retain(has_name);
    }
    named.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
    named.truncate((image[0] * image[1] / (AREA_PER_LABEL * unit * unit)).ceil() as usize);
    named
}

/// The name of a mark, and the room that it takes, where there is any.
fn label_of(mark: &Mark, room: &Room<'_>) -> Option<(Rectangle, Label)> {
    /// Distance of a name from its ring where there is no room beside it, with a line to the ring.
    const FAR_GAP: f32 = 16.0;
    let StarLabel { text, .. } = mark.label.as_ref()?;
    let (size, unit) = (room.extent(text, SIZE), room.unit);
    let find = |gap: f32| {
        let away = mark.radius + gap * unit;
        let places = candidates([mark.x, mark.y], away, size, unit);
        room.first_free(&places, &room.shown)
    };
    let beside = find(GAP);
    let rectangle = beside.or_else(|| find(FAR_GAP))?;
    let label = Label {
        text: text.clone(),
        at: baseline(&rectangle, unit),
        line: beside.is_none().then(|| mark.line_to(&rectangle)),
    };
    Some((rectangle, label))
}

/// Whether a name there covers neither another name nor what is marked.
fn is_free(rectangle: &Rectangle, shown: &[&Mark], taken: &[Rectangle], image: [f32; 2]) -> bool {
    lies_within(rectangle, image)
        && !taken.iter().any(|other| overlap(rectangle, other))
        && !shown.iter().any(|other| other.is_covered_by(rectangle))
}

/// Where the baseline of the name in a rectangle begins.
fn baseline(rectangle: &Rectangle, unit: f32) -> [f32; 2] {
    let margin = MARGIN * unit;
    [rectangle[0] + margin, rectangle[3] - margin]
}

/// Positions around a point at a distance, best first: beside it, at its corners, above and below.
fn candidates(center: [f32; 2], away: f32, [width, height]: [f32; 2], unit: f32) -> [Rectangle; 8] {
    let corner = away * std::f32::consts::FRAC_1_SQRT_2;
    let margin = MARGIN * unit;
    // The centre of the name: offset of the ring's edge, then in half sizes of the name.
    [
        (away, 0.0, 1.0, 0.0),
        (-away, 0.0, -1.0, 0.0),
        (corner, -corner, 1.0, -1.0),
        (corner, corner, 1.0, 1.0),
        (-corner, -corner, -1.0, -1.0),
        (-corner, corner, -1.0, 1.0),
        (0.0, -away, 0.0, -1.0),
        (0.0, away, 0.0, 1.0),
    ]
    .map(|(dx, dy, right, down)| {
        let x = center[0] + dx + right * width / 2.0;
        let y = center[1] + dy + down * height / 2.0;
        [
            x - width / 2.0 - margin,
            y - height / 2.0 - margin,
            x + width / 2.0 + margin,
            y + height / 2.0 + margin,
        ]
    })
}

fn lies_within(rectangle: &Rectangle, [width, height]: [f32; 2]) -> bool {
    let [left, top, right, bottom] = *rectangle;
    left >= 0.0 && top >= 0.0 && right <= width && bottom <= height
}

fn overlap(a: &Rectangle, b: &Rectangle) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

#[cfg(test)]
mod tests {
    use super::super::mark::MarkKind;
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const IMAGE: [f32; 2] = [800.0, 600.0];

    fn mark(x: f32, y: f32, v_mag: f32) -> Mark {
        Mark {
            x,
            y,
            radius: 6.0,
            kind: MarkKind::Identified,
            label: Some(StarLabel {
                text: format!("05140095 {v_mag:.1}"),
                has_name: false,
                rank: v_mag,
            }),
        }
    }

    fn rectangle(label: &Label, unit: f32) -> Rectangle {
        let ([x, y], size) = (label.at, SIZE * unit);
        [x, y - CAPITALS * size, x + text_width(&label.text, size), y]
    }

    /// A frame with `count` stars, of which some have names.
    fn random_marks(random: &mut ChaCha8Rng, count: usize, image: [f32; 2]) -> Vec<Mark> {
        const NAMES: [&str; 4] = ["α CMi", "Betelgeuse", "05140095", "θ² Ori"];
        let star = |i: usize| {
            let [x, y] = image.map(|side| random.random_range(0.0..side));
            let mut star = mark(x, y, i as f32 * 0.01);
            star.radius = random.random_range(4.0..13.0);
            let name = random.random_range(0..NAMES.len());
            star.label = star.label.map(|label| StarLabel {
                text: format!("{} {:.1}", NAMES[name], label.rank),
                has_name: name != 2,
                ..label
            });
            star
        };
        (0..count).map(star).collect()
    }

    #[test]
    fn names_hide_neither_each_other_nor_what_is_marked_in_200_frames() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut placed = 0;
        for frame in 0..200 {
            let image = [0, 1].map(|_| random.random_range(300.0..2500.0));
            let unit = random.random_range(1.0..2.0);
            let count = random.random_range(1..700);
            let marks = random_marks(&mut random, count, image);
            let rings = [Rings::Named, Rings::All, Rings::None][frame % 3];
            let mut room = Room::of(&marks, rings, image, unit);
            let mut labels = room.place_names();
            assert!(rings != Rings::Named || labels.len() == room.marked().len());
            for i in 0..40 {
                let at = image.map(|side| random.random_range(0.0..side));
                let text = "M 42".to_owned();
                let found = room.beside(&text, at, 5.0 * (i % 2) as f32, SIZE);
                labels.extend(found.map(|at| Label {
                    text,
                    at,
                    line: None,
                }));
            }
            let shown = room.marked();
            placed += labels.len();
            for (i, label) in labels.iter().enumerate() {
                let own = rectangle(label, unit);
                assert!(lies_within(&own, image));
                let mut before = labels[..i].iter();
                assert!(before.all(|other| !overlap(&own, &rectangle(other, unit))));
                let hidden = shown.iter().find(|m| m.is_covered_by(&own));
                assert!(hidden.is_none(), "frame {frame}: {label:?}");
            }
        }
        assert!(placed > 5000, "{placed}");
    }

    #[test]
    fn a_name_near_a_point_stays_in_the_picture_and_off_named_stars() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let marks = random_marks(&mut random, 300, IMAGE);
        let mut room = Room::of(&marks, Rings::All, IMAGE, 1.0);
        let mut placed: Vec<Rectangle> = Vec::new();
        for _ in 0..40 {
            // Also beyond the border.
            let middle = IMAGE.map(|side| random.random_range(-20.0..side + 20.0));
            let Some([x, y]) = room.near("Cassiopeia", middle, 14.0) else {
                continue;
            };
            let own = [
                x,
                y - CAPITALS * 14.0,
                x + text_width("Cassiopeia", 14.0),
                y,
            ];
            assert!(lies_within(&own, IMAGE));
            assert!(placed.iter().all(|other| !overlap(other, &own)));
            assert!(room.named.iter().all(|named| !named.is_covered_by(&own)));
            placed.push(own);
        }
        assert!(placed.len() > 10, "{}", placed.len());
    }

    #[test]
    fn a_name_at_the_border_turns_inward() {
        for (x, y) in [
            (2.0, 2.0),
            (798.0, 2.0),
            (2.0, 598.0),
            (798.0, 598.0),
            (400.0, 598.0),
        ] {
            let alone = [mark(x, y, 1.0)];
            let labels = Room::of(&alone, Rings::All, IMAGE, 1.0).place_names();
            assert_eq!(labels.len(), 1, "({x}, {y})");
            assert!(lies_within(&rectangle(&labels[0], 1.0), IMAGE));
        }
    }

    #[test]
    fn the_brightest_star_has_the_first_choice() {
        let crowded = [
            mark(100.0, 100.0, 5.0),
            mark(101.0, 100.0, 1.0),
            mark(102.0, 100.0, 3.0),
        ];
        let labels = Room::of(&crowded, Rings::All, IMAGE, 1.0).place_names();
        assert_eq!(labels[0].text, "05140095 1.0");
        let alone = [mark(5.0, 5.0, 1.0)];
        let mut room = Room::of(&alone, Rings::Named, [20.0, 20.0], 1.0);
        let labels = room.place_names();
        assert!(room.marked().is_empty() && labels.is_empty());
        let mut room = Room::of(&crowded, Rings::None, IMAGE, 1.0);
        let labels = room.place_names();
        assert!(room.marked().is_empty() && !labels.is_empty());
    }
}
