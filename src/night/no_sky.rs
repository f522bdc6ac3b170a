//! What is no frame of the night sky among the frames of a night, though it has their size.
//!
//! a frame whose stars are not identified → by its pixels, where the Sun is, and its exposure → [`NoSky`]
//!
//! A frame whose stars are identified is one of the sky, whatever its name.

use super::almanac::is_by_day;
use crate::base::epoch::ObservationDate;
use crate::base::statistics::{SIGMA_PER_MAD, median_of};
use crate::frame::{Frame, Pixels};
use crate::solve::{Outcome, Solution};
use std::path::Path;

/// What a frame shows instead of stars.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum NoSky {
    /// The sky of the day.
    Day,
    /// Trails of stars: many frames in one.
    Startrails,
    /// No light: a dark.
    Dark,
}

impl NoSky {
    /// Code for programs.
    pub const fn code(self) -> &'static str {
        match self {
            Self::Day => "day",
            Self::Startrails => "startrails",
            Self::Dark => "dark",
        }
    }

    /// In words, for one and for several.
    pub const fn text(self) -> [&'static str; 2] {
        match self {
            Self::Day => ["daytime frame", "daytime frames"],
            Self::Startrails => ["picture of star trails", "pictures of star trails"],
            Self::Dark => ["dark", "darks"],
        }
    }

    /// That of a code.
    pub fn of_code(code: &str) -> Option<Self> {
        let all = [Self::Day, Self::Startrails, Self::Dark];
        all.into_iter().find(|kind| kind.code() == code)
    }

    /// What the solved frame in the file `name` is; `None` if it shows the sky of the night, or may.
    pub fn detect(name: &Path, solution: &Solution, frame: &Frame) -> Option<Self> {
        if matches!(solution.outcome, Outcome::Identified(_)) {
            return None;
        }
        let light = LightStatistics::of(frame);
        if light.is_bright() && shows_day(name, solution, frame, &light) {
            Some(Self::Day)
        } else if has_word(name, &["dark", "darks", "bias", "masterdark"]) || light.is_even() {
            Some(Self::Dark)
        } else {
            is_trailed(frame, &light).then_some(Self::Startrails)
        }
    }
}

/// Whether a bright frame without stars is of the day.
fn shows_day(name: &Path, solution: &Solution, frame: &Frame, light: &LightStatistics) -> bool {
    /// Share of saturated pixels that no sky of the night reaches.
    const MAX_SATURATED: f64 = 0.3;
    /// No sky of the night is bright in so short an exposure, in seconds.
    const SHORT_S: f64 = 0.1;
    /// Hours that are of the day wherever local time is told.
    const HOURS: std::ops::Range<u32> = 10..15;
    if light.saturated > MAX_SATURATED
        || frame
            .metadata
            .exposure_s
            .is_some_and(|exposure_s| exposure_s < SHORT_S)
        || has_word(name, &["day", "daytime"])
    {
        return true;
    }
    let Some(known) = solution.date else {
        return false;
    };
    match solution.site {
        Some(site) if known.is_utc() => is_by_day(Some(&known.date), Some(site)),
        _ => hour_of(&known.date).is_some_and(|hour| HOURS.contains(&hour)),
    }
}

fn hour_of(date: &ObservationDate) -> Option<u32> {
    let iso = date.has_time().then(|| date.to_iso())?;
    iso.split_once('T')?.1.get(..2)?.parse().ok()
}

/// Whether the file's name, or its folder's, has one of these words.
fn has_word(name: &Path, words: &[&str]) -> bool {
    let folder = name.parent().and_then(Path::file_name);
    let mut names = [folder, name.file_stem()].into_iter().flatten();
    names.any(|name| {
        let name = name.to_string_lossy().to_lowercase();
        let mut found = name.split(|character: char| !character.is_alphabetic());
        found.any(|word| words.contains(&word))
    })
}

/// How light is spread over a frame, in ADU.
struct LightStatistics {
    median: f64,
    /// Level at which pixels are saturated, where the format has one.
    full: Option<f64>,
    /// Share of the pixels at that level.
    saturated: f64,
    /// Standard deviation of a pixel by differences of neighbors.
    noise: f64,
    /// The darkest of the medians of 8 × 8 parts, and how much brighter the brightest is.
    least: f64,
    range: f64,
    step: f64,
}

/// Parts along each side.
const PARTS: usize = 8;

impl LightStatistics {
    fn of(frame: &Frame) -> Self {
        let full = frame.saturation_adu.map(f64::from).or(match frame.pixels {
            Pixels::U8(_) => Some(255.0),
            Pixels::U16(_) => Some(65_535.0),
            Pixels::F32(_) => None,
        });
        let medians = (0..PARTS * PARTS).filter_map(|part| part_median(frame, part));
        let mut medians: Vec<f64> = medians.collect();
        medians.sort_unstable_by(f64::total_cmp);
        let least = medians.first().copied().unwrap_or(f64::NAN);
        let range = medians.last().map_or(f64::NAN, |most| most - least);
        let values = || {
            let values = frame.pixels.values().step_by(7).map(f64::from);
            values.filter(|value| !value.is_nan())
        };
        let total = values().count().max(1) as f64;
        let saturated = full.map_or(0, |full| values().filter(|value| *value >= full).count());
        Self {
            median: median_of(medians.iter().copied()).unwrap_or(f64::NAN),
            full,
            saturated: saturated as f64 / total,
            noise: noise(frame),
            least,
            range,
            step: f64::from(frame.step_adu),
        }
    }

    /// A level below which a pixel sees no sky, where a part of the frame is darker than the rest.
    fn unlit_adu(&self) -> f64 {
        const FRACTION: f64 = 0.3;
        const SIGMAS: f64 = 5.0;
        self.least + FRACTION * (self.median - self.least) - SIGMAS * self.noise
    }

    /// Whether it is as bright as exposures by day are.
    fn is_bright(&self) -> bool {
        const FRACTION: f64 = 0.25;
        self.full.is_some_and(|full| self.median > FRACTION * full)
    }

    /// Whether it is dark, and as dark everywhere: there is no sky, no horizon, and no edge of a lens's circle.
    fn is_even(&self) -> bool {
        const OF_NOISE: f64 = 0.2;
        const FRACTION: f64 = 0.1;
        self.full.is_some_and(|full| self.median < FRACTION * full)
            && self.range <= (OF_NOISE * self.noise).max(self.step)
    }
}

/// The median of one of the parts.
fn part_median(frame: &Frame, part: usize) -> Option<f64> {
    const SAMPLES: usize = 2000;
    let [x0, x1] = [part % PARTS, part % PARTS + 1].map(|at| at * frame.width / PARTS);
    let [y0, y1] = [part / PARTS, part / PARTS + 1].map(|at| at * frame.height / PARTS);
    let step = ((x1 - x0) * (y1 - y0) / SAMPLES).max(1) | 1;
    let places = (y0..y1).flat_map(|y| (x0..x1).map(move |x| (x, y)));
    let values = places.step_by(step).map(|(x, y)| f64::from(frame.at(x, y)));
    median_of(values.filter(|value| !value.is_nan()))
}

fn noise(frame: &Frame) -> f64 {
    const SAMPLES: usize = 20_000;
    let step = (frame.width * frame.height / SAMPLES).max(1) | 1;
    let indices = (0..frame.pixels.len().saturating_sub(2)).step_by(step);
    let steps = indices.map(|at| f64::from(frame.pixels.value(at + 2) - frame.pixels.value(at)));
    let middle = median_of(steps.map(f64::abs).filter(|step| !step.is_nan()));
    SIGMA_PER_MAD * middle.unwrap_or(f64::INFINITY) / std::f64::consts::SQRT_2
}

/// Whether most of what is bright and narrow is a line: where the squares of the gradient's components in a
/// window of 15 pixels around it are unequal along its two axes.
///
/// # Reference
/// Bigün & Granlund 1987, Proc. 1st ICCV, 433: coherence of the structure tensor.
fn is_trailed(frame: &Frame, light: &LightStatistics) -> bool {
    const SIGMAS: f64 = 10.0;
    const AROUND: usize = 7;
    const COHERENT: f64 = 0.7;
    const MIN_LINES: usize = 50;
    const FRACTION: f64 = 0.6;
    let limit = (SIGMAS * light.noise.max(0.5 * light.step)) as f32;
    let unlit = light.unlit_adu();
    let (mut lines, mut all) = (0, 0);
    let margin = FROM_RIM.max(AROUND + 1);
    for y in (margin..frame.height.saturating_sub(margin)).step_by(3) {
        for x in margin..frame.width.saturating_sub(margin) {
            let own = frame.at(x, y);
            let is_narrow = |[dx, dy]: [usize; 2]| {
                let sides = [frame.at(x - dx, y - dy), frame.at(x + dx, y + dy)];
                sides.iter().all(|side| own - side > limit)
            };
            if [[5, 0], [0, 5], [4, 4]].into_iter().any(is_narrow)
                && is_peak(frame, x, y)
                && !is_at_rim(frame, [x, y], unlit)
            {
                all += 1;
                lines += usize::from(coherence(frame, [x, y], AROUND) > COHERENT);
            }
        }
    }
    lines >= MIN_LINES && lines as f64 > FRACTION * f64::from(all)
}

/// How far from the rim of the lens's circle lines count, in pixels.
const FROM_RIM: usize = 16;

/// Whether one of the places around is darker than the sky: the sky's bright rim at the horizon is a line, too.
fn is_at_rim(frame: &Frame, [x, y]: [usize; 2], unlit_adu: f64) -> bool {
    let around = [
        [x - FROM_RIM, y],
        [x + FROM_RIM, y],
        [x, y - FROM_RIM],
        [x, y + FROM_RIM],
    ];
    around
        .iter()
        .any(|[x, y]| f64::from(frame.at(*x, *y)) < unlit_adu)
}

/// Whether no neighbor is brighter along one of the axes.
fn is_peak(frame: &Frame, x: usize, y: usize) -> bool {
    let own = frame.at(x, y);
    let along = |before: f32, after: f32| own >= before && own > after;
    along(frame.at(x - 1, y), frame.at(x + 1, y)) || along(frame.at(x, y - 1), frame.at(x, y + 1))
}

/// From 0, round or without a direction, to 1, a line.
fn coherence(frame: &Frame, [x, y]: [usize; 2], around: usize) -> f64 {
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for v in y - around..=y + around {
        for u in x - around..=x + around {
            let dx = f64::from(frame.at(u + 1, v) - frame.at(u - 1, v));
            let dy = f64::from(frame.at(u, v + 1) - frame.at(u, v - 1));
            xx += dx * dx;
            xy += dx * dy;
            yy += dy * dy;
        }
    }
    let total = xx + yy;
    if total > 0.0 {
        libm::hypot(xx - yy, 2.0 * xy) / total
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of 8 bits.
    fn frame(value: impl Fn(f64, f64) -> f64) -> Frame<'static> {
        const SIDE: usize = 240;
        let mut state = 7_u64;
        let mut pixel = |at: usize| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let noise = (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5;
            let place = [at % SIDE, at / SIDE].map(|part| part as f64);
            (value(place[0], place[1]) + 6.0 * noise).clamp(0.0, 255.0) as u8
        };
        let pixels: Vec<u8> = (0..SIDE * SIDE).map(&mut pixel).collect();
        Frame::from_samples(SIDE, SIDE, &pixels[..])
            .unwrap()
            .into_owned()
    }

    fn circle(x: f64, y: f64, inside: f64) -> f64 {
        let is_inside = libm::hypot(x - 120.0, y - 120.0) < 115.0;
        if is_inside { inside } else { 5.0 }
    }

    /// Stars every 20 pixels.
    fn stars(x: f64, y: f64) -> f64 {
        let [dx, dy] = [x, y].map(|at| (at % 20.0) - 10.0);
        circle(x, y, 40.0) + 150.0 * libm::exp(-(dx * dx + dy * dy) / 3.0)
    }

    /// Arcs about a point, each of a star.
    fn trails(x: f64, y: f64) -> f64 {
        let radius = libm::hypot(x - 120.0, y - 60.0) % 14.0 - 7.0;
        circle(x, y, 40.0) + 150.0 * libm::exp(-radius * radius / 3.0)
    }

    #[test]
    fn stars_are_told_from_their_trails() {
        let has_trails = |frame: &Frame| is_trailed(frame, &LightStatistics::of(frame));
        assert!(!has_trails(&frame(stars)));
        assert!(has_trails(&frame(trails)));
        assert!(!has_trails(&frame(|x, y| circle(x, y, 60.0))));
        // A clouded sky with a bright rim, as above the horizon.
        let rim = |x: f64, y: f64| {
            let inward = 115.0 - libm::hypot(x - 120.0, y - 120.0);
            circle(x, y, 40.0 + 150.0 * libm::exp(-inward / 3.0))
        };
        assert!(!has_trails(&frame(rim)));
        assert!(!has_trails(&frame(|_, _| 10.0)));
    }

    #[test]
    fn a_dark_is_even_and_a_clouded_sky_is_not() {
        assert!(LightStatistics::of(&frame(|_, _| 10.0)).is_even());
        let hot = |x: f64, y: f64| {
            if (x * 7.0 + y) % 97.0 == 0.0 {
                200.0
            } else {
                10.0
            }
        };
        assert!(LightStatistics::of(&frame(hot)).is_even());
        for sky in [
            frame(|x, y| circle(x, y, 60.0)),
            frame(|x, _| 20.0 + x / 20.0),
        ] {
            assert!(!LightStatistics::of(&sky).is_even());
        }
    }

    #[test]
    fn only_bright_frames_are_of_the_day() {
        assert!(LightStatistics::of(&frame(|x, y| circle(x, y, 160.0))).is_bright());
        assert!(!LightStatistics::of(&frame(stars)).is_bright());
        let white = LightStatistics::of(&frame(|_, _| 260.0));
        assert!(white.saturated > 0.9 && white.is_bright());
    }

    #[test]
    fn words_of_names_are_whole() {
        let says = |name: &str| has_word(Path::new(name), &["dark", "darks"]);
        assert!(says("darks/7.png") && says("a/dark_001.fits") && says("Dark.png"));
        assert!(!says("darksky.png") && !says("dark/a/7.png"));
    }
}
