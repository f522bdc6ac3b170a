//! Places names, brightest stars first, where they cover neither another name nor what is marked.

use super::mark::Mark;
use super::names::StarLabel;
use super::options::Rings;
use crate::report::figure::text_width;
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

/// Where names may still be written.
pub(super) struct Room<'a> {
    marked: Vec<&'a Mark>,
    taken: Vec<Rectangle>,
    image: [f32; 2],
    unit: f32,
}

impl<'a> Room<'a> {
    /// A picture of `image` pixels, all of it free.
    #[cfg(feature = "page")]
    pub(super) fn all(image: [f32; 2], unit: f32) -> Self {
        Self {
            marked: Vec::new(),
            taken: Vec::new(),
            image,
            unit,
        }
    }

    /// The marks that are shown.
    pub(super) fn marked(&self) -> &[&'a Mark] {
        &self.marked
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
        self.take(&sides)
    }

    /// The same around a point, if it is free.
    pub(super) fn around(&mut self, text: &str, [x, y]: [f32; 2], size: f32) -> Option<[f32; 2]> {
        let [width, height] = self.extent(text, size);
        let (right, down) = (
            width / 2.0 + MARGIN * self.unit,
            height / 2.0 + MARGIN * self.unit,
        );
        self.take(&[[x - right, y - down, x + right, y + down]])
    }

    fn extent(&self, text: &str, size: f32) -> [f32; 2] {
        [
            text_width(text, size * self.unit),
            CAPITALS * size * self.unit,
        ]
    }

    fn take(&mut self, candidates: &[Rectangle]) -> Option<[f32; 2]> {
        let is_free =
            |rectangle: &&Rectangle| is_free(rectangle, &self.marked, &self.taken, self.image);
        let rectangle = *candidates.iter().find(is_free)?;
        self.taken.push(rectangle);
        Some(baseline(&rectangle, self.unit))
    }
}

/// Places the names of `marks`, brightest first, on a picture of `image` pixels; returns the marks that are
/// shown with it, and where there is room for more.
pub(super) fn place(
    marks: &[Mark],
    rings: Rings,
    image: [f32; 2],
    unit: f32,
) -> (Vec<Label>, Room<'_>) {
    let named = brightest_named(marks, rings, image, unit);
    let mut shown: Vec<&Mark> = match rings {
        Rings::None => Vec::new(),
        Rings::Named if !named.is_empty() => named.clone(),
        Rings::Named | Rings::All => marks.iter().collect(),
    };
    let mut taken: Vec<Rectangle> = Vec::new();
    let mut labels = Vec::new();
    for mark in named {
        match label_of(mark, &shown, &taken, image, unit) {
            Some((rectangle, label)) => {
                taken.push(rectangle);
                labels.push(label);
            }
            // What is marked has a name.
            None if rings == Rings::Named => shown.retain(|other| !ptr::eq(*other, mark)),
            None => {}
        }
    }
    let room = Room {
        marked: shown,
        taken,
        image,
        unit,
    };
    (labels, room)
}

/// The marks with the brightest stars, brightest first: as many as there is room for names. Stars with a
/// number alone are among them where all are marked, or where few have a name.
fn brightest_named(marks: &[Mark], rings: Rings, image: [f32; 2], unit: f32) -> Vec<&Mark> {
    /// Smallest area per name, in square units: more names are unreadable.
    const AREA_PER_LABEL: f32 = 9000.0;
    /// Fewer names than this are few.
    const ENOUGH_NAMES: usize = 5;
    let v_mag = |mark: &Mark| {
        mark.label
            .as_ref()
            .map_or(f32::INFINITY, |label| label.v_mag)
    };
    let has_name = |mark: &&Mark| mark.label.as_ref().is_some_and(|label| label.has_name);
    let mut named: Vec<&Mark> = marks.iter().filter(|mark| mark.label.is_some()).collect();
    if rings == Rings::Named && named.iter().filter(|mark| has_name(mark)).count() >= ENOUGH_NAMES {
        named.retain(has_name);
    }
    named.sort_by(|a, b| v_mag(a).total_cmp(&v_mag(b)));
    named.truncate((image[0] * image[1] / (AREA_PER_LABEL * unit * unit)).ceil() as usize);
    named
}

/// The name of a mark, and the room that it takes, where there is any.
fn label_of(
    mark: &Mark,
    shown: &[&Mark],
    taken: &[Rectangle],
    image: [f32; 2],
    unit: f32,
) -> Option<(Rectangle, Label)> {
    /// Distance of a name from its ring where there is no room beside it, with a line to the ring.
    const FAR_GAP: f32 = 16.0;
    let StarLabel { text, .. } = mark.label.as_ref()?;
    let size = [text_width(text, SIZE * unit), CAPITALS * SIZE * unit];
    let find = |gap: f32| {
        let away = mark.radius + gap * unit;
        let mut candidates = candidates([mark.x, mark.y], away, size, unit).into_iter();
        candidates.find(|rectangle| is_free(rectangle, shown, taken, image))
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
                v_mag,
                has_name: false,
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
                text: format!("{} {:.1}", NAMES[name], label.v_mag),
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
            let (mut labels, mut room) = place(&marks, rings, image, unit);
            assert!(rings != Rings::Named || labels.len() == room.marked().len());
            for i in 0..40 {
                let at = image.map(|side| random.random_range(0.0..side));
                let text = "M 42".to_owned();
                let found = if i % 2 == 0 {
                    room.beside(&text, at, 5.0, SIZE)
                } else {
                    room.around(&text, at, SIZE)
                };
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
    fn a_name_at_the_border_turns_inward() {
        for (x, y) in [
            (2.0, 2.0),
            (798.0, 2.0),
            (2.0, 598.0),
            (798.0, 598.0),
            (400.0, 598.0),
        ] {
            let (labels, _) = place(&[mark(x, y, 1.0)], Rings::All, IMAGE, 1.0);
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
        let (labels, _) = place(&crowded, Rings::All, IMAGE, 1.0);
        assert_eq!(labels[0].text, "05140095 1.0");
        let alone = [mark(5.0, 5.0, 1.0)];
        let (labels, room) = place(&alone, Rings::Named, [20.0, 20.0], 1.0);
        assert!(room.marked().is_empty() && labels.is_empty());
        let (labels, room) = place(&crowded, Rings::None, IMAGE, 1.0);
        assert!(room.marked().is_empty() && !labels.is_empty());
    }
}
