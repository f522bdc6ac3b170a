//! The search: triangles of bright observed stars → similar catalogue triangles → hypotheses → further stars decide.
//!
//! Size classes of the index stand for ranges of the focal length. Where the field is so wide that the shape
//! of a triangle depends on the focal length (gnomonic projection), a range is cut into steps small
//! enough for that not to matter.

use super::refine::{Refined, Refiner, Start};
use super::triangle::TriangleShape;
use super::verify::{FalseAlarm, Hypothesis, Pair, Scene, TESTED_STARS};
use super::{Hints, IndexedCatalog, Photometry, StarField};
use crate::base::coords::{Icrs, Rotation, UnitVector};
use crate::camera::{CameraModel, DistortionModel, focal_length_px, frame_centre};
use crate::identify::attitude::POSE_PARAMETERS;
use crate::sky::catalog::sky_grid::{GridStar, chord_of};
use nalgebra::{Matrix3, Vector3};

/// A little more than the fields of view that the sky allows, so that a field of just that width is not missed.
const FOV_SLACK: f64 = 1.05;

/// One sweep over the triangles of the brightest stars.
struct Pass {
    /// Stars that make triangles, the brightest, ...
    stars: usize,
    /// ... and the first that is the faintest of one: triangles of brighter stars were tried in the pass before.
    from: usize,
    /// Relative error of a triangle's sides that lens distortion may make.
    tolerance: f64,
    /// Probability that another observed star agrees with a true hypothesis: some are false, some not in the catalogue.
    true_witness: f64,
}

/// First the likely, then the lens that distorts, then the frame with many false stars, and that with more.
const PASSES: [Pass; 4] = [
    Pass {
        stars: 12,
        from: 2,
        tolerance: 0.0025,
        true_witness: 0.6,
    },
    Pass {
        stars: 10,
        from: 2,
        tolerance: 0.008,
        true_witness: 0.6,
    },
    Pass {
        stars: 22,
        from: 2,
        tolerance: 0.0025,
        true_witness: 0.35,
    },
    Pass {
        stars: 40,
        from: 22,
        tolerance: 0.0025,
        true_witness: 0.35,
    },
];

/// The centroid errors count so many times in a triangle's tolerance.
const CENTROID_SIGMAS: f64 = 2.0;
/// Triangles must be so large, in units of the frame's diagonal.
const MIN_TRIANGLE_SHARE: f64 = 0.12;
/// A hypothesis is dropped when the other stars make it so unlikely (likelihood ratio: e to the −3.5), ...
const DROP_BELOW: f64 = 0.030_197_383_422_318_5;
/// ... looked into when they make it so likely (e to the 7), ...
const TAKE_ABOVE: f64 = 1_096.633_158_428_458_6;
/// ... and when, all of them asked, they speak for it at least so much (e).
const TAKE_AT_END: f64 = std::f64::consts::E;
/// How far a witness may stand from its catalogue star: in distortion tolerances of the frame's diagonal, and in
/// centroid errors extrapolated from the triangle.
const WITNESS_TOLERANCES: f64 = 1.5;
const WITNESS_SIGMAS: f64 = 3.5;
/// When to give up at last, so that a frame in which there is nothing to find takes well under a second. Most fields that can be
/// identified take a few, those with as many false sources as stars and half of the catalogue's missing up to all of these.
pub const MAX_HYPOTHESES: u64 = 400_000;
/// Few stars have few triangles, of which each pass tries the same again: what so many hypotheses of each triangle have not
/// found will hardly be found.
const HYPOTHESES_OF_TRIANGLE: u64 = 250;
/// But so many are always tried.
const LEAST_HYPOTHESES: u64 = 30_000;
/// The same for catalogue triangles of the right shape, of which most are out at once: their size or brightness is not right.
const MAX_CANDIDATES: u64 = 20_000_000;
/// A triangle whose ratios are less certain than this is like so many others that it tells nothing.
const MAX_TOLERANCE: f64 = 0.03;
/// Hypotheses above this are not reported.
pub const LOG10_FALSE_ALARM_LIMIT: f64 = -8.0;
/// One below this ends the search. Between the two it waits for the end of its pass, in case that a better one comes: few
/// and inexact stars may agree with a neighbour of the truth.
const LOG10_SURE: f64 = -14.0;

/// What the search found.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    /// The hypothesis, refined with the brightest stars.
    pub refined: Refined,
    /// log10 of its false-alarm probability.
    pub log10_false_alarm: f64,
}

/// What a search works with, kept from field to field.
#[derive(Debug, Default)]
pub struct Buffers {
    /// Offsets of the brightest stars from the frame's centre, in pixels.
    offsets: Vec<[f64; 2]>,
    /// Refines hypotheses.
    pub refiner: Refiner,
    false_alarm: FalseAlarm,
    /// The stars of the hypothesis that passes.
    pub found: Vec<Pair>,
}

/// The search over one field.
pub struct Search<'a> {
    field: &'a StarField,
    hints: &'a Hints,
    sky: &'a IndexedCatalog<'a>,
    buffers: &'a mut Buffers,
    /// Smallest and largest focal length, in pixels.
    focal_px: (f64, f64),
    diagonal_px: f64,
    hypotheses: u64,
    most_hypotheses: u64,
    candidates: u64,
    best_log10: Option<f64>,
    /// The best hypothesis that passes without being sure.
    unsure: Option<Found>,
}

/// A triangle of observed stars.
#[derive(Clone, Copy)]
struct Trio {
    stars: [usize; 3],
    /// Largest distance of a corner from the frame's centre, in pixels.
    reach_px: f64,
    /// How far its ratios may be from those of its catalogue triangle.
    tolerance: f64,
    /// How far another star may be from its catalogue star.
    witness_px: f64,
    /// How likely another star is to agree, see [`Pass`].
    true_witness: f64,
}

/// A trio, its corners in the order of its shape, and the focal lengths under which it has that shape.
struct Query {
    trio: Trio,
    /// Its longest side, as a chord, at the focal length `middle_px`.
    longest: f64,
    middle_px: f64,
    range_px: (f64, f64),
}

/// A first idea of camera and attitude.
struct Pose {
    sky_to_camera: Matrix3<f64>,
    focal_px: f64,
    mirrored: bool,
}

impl Pose {
    /// Where the star at this offset from the frame's centre stands on the sky.
    fn direction_of(&self, [u, v]: &[f64; 2]) -> UnitVector<Icrs> {
        let u = if self.mirrored { -u } else { *u };
        let camera = Vector3::new(u, *v, self.focal_px).normalize();
        UnitVector::from_unit(self.sky_to_camera.tr_mul(&camera))
    }
}

impl<'a> Search<'a> {
    /// A search over `field`.
    pub fn new(scene: Scene<'a>, hints: &'a Hints, buffers: &'a mut Buffers) -> Self {
        let Scene { field, sky } = scene;
        let centre = frame_centre(field.width_px, field.height_px);
        let most = PASSES.iter().map(|p| p.stars).max().unwrap_or(0);
        let seen = field.brightest(most).iter();
        buffers.offsets.clear();
        buffers
            .offsets
            .extend(seen.map(|s| [s.position.x - centre.x, s.position.y - centre.y]));
        buffers.refiner.around.forget();
        let (narrowest_rad, widest_rad) = sky.fov_range_rad();
        let wide = focal_length_px(field.width_px, widest_rad * FOV_SLACK);
        let narrow = focal_length_px(field.width_px, narrowest_rad / FOV_SLACK);
        let focal_px = match hints.pixel_scale_rad {
            Some((smallest, largest)) => (1.0 / largest, 1.0 / smallest),
            None => (wide, narrow),
        };
        let stars = buffers.offsets.len() as u64;
        let triangles = stars * stars.saturating_sub(1) * stars.saturating_sub(2) / 6;
        let most_hypotheses =
            (HYPOTHESES_OF_TRIANGLE * triangles).clamp(LEAST_HYPOTHESES, MAX_HYPOTHESES);
        Self {
            field,
            hints,
            sky,
            buffers,
            focal_px,
            diagonal_px: field.width_px.hypot(field.height_px),
            hypotheses: 0,
            most_hypotheses,
            candidates: 0,
            best_log10: None,
            unsure: None,
        }
    }

    /// What refines hypotheses, and the stars that agreed with the last.
    pub fn refiner(&mut self) -> &mut Refiner {
        &mut self.buffers.refiner
    }

    /// The lowest false-alarm probability (log10) of the hypotheses that came as far as to have one.
    pub fn best_log10_false_alarm(&self) -> Option<f64> {
        self.best_log10
    }

    /// Goes through the triangles until a hypothesis passes.
    pub fn run(&mut self) -> Option<Found> {
        PASSES
            .iter()
            .find_map(|pass| self.sweep(pass).or_else(|| self.unsure.take()))
    }

    /// Triangles in the order of their faintest star, then of the second.
    fn sweep(&mut self, pass: &Pass) -> Option<Found> {
        let stars = pass.stars.min(self.buffers.offsets.len());
        for faintest in pass.from..stars {
            for middle in 1..faintest {
                for brightest in 0..middle {
                    if self.is_exhausted() {
                        return None;
                    }
                    let trio = self.trio([brightest, middle, faintest], pass);
                    if let Some(found) = trio.and_then(|trio| self.try_trio(&trio)) {
                        return Some(found);
                    }
                }
            }
        }
        None
    }

    fn is_exhausted(&self) -> bool {
        self.hypotheses > self.most_hypotheses || self.candidates > MAX_CANDIDATES
    }

    fn trio(&self, stars: [usize; 3], pass: &Pass) -> Option<Trio> {
        let [a, b, c] = stars.map(|s| self.buffers.offsets[s]);
        let side = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
        let longest_px = side(a, b).max(side(b, c)).max(side(c, a));
        if longest_px < MIN_TRIANGLE_SHARE * self.diagonal_px {
            return None;
        }
        let sigma_px = stars
            .iter()
            .map(|&s| self.field.stars[s].sigma_px)
            .fold(0.0, f64::max);
        let centroid_tolerance = CENTROID_SIGMAS * sigma_px / longest_px;
        let tolerance = pass.tolerance.hypot(centroid_tolerance);
        if tolerance > MAX_TOLERANCE {
            return None;
        }
        let leverage = 1.0 + 0.5 * self.diagonal_px / longest_px;
        let distortion_px = WITNESS_TOLERANCES * pass.tolerance * self.diagonal_px;
        Some(Trio {
            stars,
            reach_px: [a, b, c]
                .iter()
                .map(|p| p[0].hypot(p[1]))
                .fold(0.0, f64::max),
            tolerance,
            true_witness: pass.true_witness,
            witness_px: distortion_px.hypot(WITNESS_SIGMAS * leverage * sigma_px),
        })
    }

    fn try_trio(&mut self, trio: &Trio) -> Option<Found> {
        (0..self.sky.triangles.classes.len()).find_map(|class| self.try_class(trio, class))
    }

    fn try_class(&mut self, trio: &Trio, number: usize) -> Option<Found> {
        let class = &self.sky.triangles.classes[number];
        let low_px = self.focal_of_chord(trio, class.high)?.max(self.focal_px.0);
        let high_px = self.focal_of_chord(trio, class.low)?.min(self.focal_px.1);
        if low_px >= high_px {
            return None;
        }
        // Half a step changes the shape by half the tolerance at the most.
        let stretch = (trio.reach_px / low_px).powi(2);
        let step = (trio.tolerance / stretch).max(1e-3);
        let steps = ((high_px / low_px).ln() / step).ceil().max(1.0);
        let factor = (high_px / low_px).powf(1.0 / steps);
        (0..steps as i32).find_map(|i| {
            let from_px = low_px * factor.powi(i);
            self.try_focal(trio, number, (from_px, from_px * factor))
        })
    }

    /// Unit vectors of the trio in a camera with this focal length, not mirrored.
    fn vectors(&self, trio: &Trio, focal_px: f64) -> [Vector3<f64>; 3] {
        trio.stars.map(|s| {
            let [u, v] = self.buffers.offsets[s];
            Vector3::new(u, v, focal_px).normalize()
        })
    }

    /// The focal length at which the trio's longest side is `chord`.
    fn focal_of_chord(&self, trio: &Trio, chord: f64) -> Option<f64> {
        let longest = |focal_px: f64| {
            let [a, b, c] = self.vectors(trio, focal_px);
            (a - b).norm().max((b - c).norm()).max((c - a).norm())
        };
        let mut focal_px = self.diagonal_px;
        for _ in 0..8 {
            let ratio = longest(focal_px) / chord;
            focal_px *= ratio;
            if (ratio - 1.0).abs() < 1e-3 {
                break;
            }
        }
        focal_px.is_finite().then_some(focal_px)
    }

    fn try_focal(&mut self, trio: &Trio, class: usize, range_px: (f64, f64)) -> Option<Found> {
        let middle_px = (range_px.0 * range_px.1).sqrt();
        let vectors = self.vectors(trio, middle_px);
        let shape = TriangleShape::new([&vectors[0], &vectors[1], &vectors[2]])?;
        let query = Query {
            trio: Trio {
                stars: shape.order.map(|i| trio.stars[i]),
                ..*trio
            },
            longest: shape.longest,
            middle_px,
            range_px,
        };
        let mut found = None;
        let sky = self.sky;
        sky.for_each_similar((class, shape.ratios, trio.tolerance), |corners| {
            self.candidates += 1;
            if found.is_none() && !self.is_exhausted() {
                found = self.try_triangle(&query, corners);
            }
        });
        found
    }

    /// One hypothesis: these three stars are those three.
    fn try_triangle(&mut self, query: &Query, corners: &[u32; 3]) -> Option<Found> {
        let trio = &query.trio;
        let stars = corners.map(|c| self.sky.grid.star(c));
        let zero_point = self.zero_point(std::array::from_fn(|i| {
            f64::from(stars[i].v_mag) - self.field.stars[trio.stars[i]].mag
        }))?;
        let sky = stars.map(GridStar::vector);
        let focal_px = query.middle_px * query.longest / (sky[0] - sky[1]).norm();
        let slack = 1.0 + 2.0 * trio.tolerance;
        if focal_px < query.range_px.0 / slack || focal_px > query.range_px.1 * slack {
            return None;
        }
        let mut seen = self.vectors(trio, focal_px);
        if let Some((near, radius_rad)) = &self.hints.near {
            let reach_rad = (self.diagonal_px / focal_px).atan() + radius_rad;
            if near.as_vector().dot(&sky[0]) < reach_rad.min(std::f64::consts::PI).cos() {
                return None;
            }
        }
        let mirrored = triple(&seen) * triple(&sky) < 0.0;
        if mirrored {
            seen.iter_mut().for_each(|v| v.x = -v.x);
        }
        let pose = Pose {
            sky_to_camera: two_star_rotation(&seen, &sky)?,
            focal_px,
            mirrored,
        };
        self.hypotheses += 1;
        if !self.witnesses_agree(trio, &pose, zero_point) {
            return None;
        }
        let (width_px, height_px) = (self.field.width_px, self.field.height_px);
        let hypothesis = Hypothesis {
            camera: CameraModel::pinhole(width_px, height_px, focal_px, mirrored),
            icrs_to_camera: Rotation::from_matrix(pose.sky_to_camera),
            parameters: POSE_PARAMETERS,
            zero_point_mag: zero_point,
        };
        self.decide(&hypothesis, trio)
    }

    /// The median zero point of the triangle's stars, if all three agree.
    fn zero_point(&self, of_stars: [f64; 3]) -> Option<f64> {
        let [a, b, c] = of_stars;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let spread = self.field.photometry.tolerance_mag();
        let consistent = match self.field.photometry {
            Photometry::Instrumental => high - low <= spread,
            Photometry::JohnsonV => low >= -spread && high <= spread,
        };
        let zero_point = match self.field.photometry {
            Photometry::Instrumental => a + b + c - low - high,
            Photometry::JohnsonV => 0.0,
        };
        consistent.then_some(zero_point)
    }

    /// Asks the brightest other stars, one after the other, whether a catalogue star of about their
    /// brightness stands where they are, until it is clear whether the hypothesis is worth a closer look
    /// (Wald 1945, Ann. Math. Stat. 16, 117: the sequential probability ratio test).
    fn witnesses_agree(&self, trio: &Trio, pose: &Pose, zero_point: f64) -> bool {
        let radius_rad = trio.witness_px / pose.focal_px;
        let chord = chord_of(radius_rad);
        let tolerance_mag = self.field.photometry.tolerance_mag();
        let mut ratio = 1.0;
        for (index, offset) in self.buffers.offsets.iter().enumerate() {
            if trio.stars.contains(&index) {
                continue;
            }
            let direction = pose.direction_of(offset);
            let v_mag = self.field.stars[index].mag + zero_point;
            let (bright, faint) = (v_mag - tolerance_mag, v_mag + tolerance_mag);
            let magnitudes = bright as f32..=faint as f32;
            let seen = self.sky.grid.is_any_within(&direction, chord, magnitudes);
            let chance = self
                .sky
                .chance_within(radius_rad, bright, faint)
                .min(trio.true_witness);
            ratio *= if seen {
                trio.true_witness / chance
            } else {
                (1.0 - trio.true_witness) / (1.0 - chance)
            };
            if !(DROP_BELOW..TAKE_ABOVE).contains(&ratio) {
                return ratio > 1.0;
            }
        }
        ratio > TAKE_AT_END
    }

    /// Fits the hypothesis to all the stars that agree and computes its false-alarm probability. Returns it if it is sure.
    fn decide(&mut self, hypothesis: &Hypothesis, trio: &Trio) -> Option<Found> {
        let start = Start {
            hypothesis,
            radius_px: trio.witness_px,
            sceptical: true,
            stars: TESTED_STARS,
            richest: DistortionModel::Radial,
        };
        let refined = self.buffers.refiner.refine(self.scene(), &start)?;
        let log10 = self.log10_false_alarm(&refined.hypothesis())?;
        let is_best = self.best_log10.is_none_or(|best| log10 < best);
        if is_best {
            self.best_log10 = Some(log10);
        }
        let found = Found {
            refined,
            log10_false_alarm: log10,
        };
        let is_sure = log10 <= LOG10_SURE;
        let passes = is_best && log10 <= LOG10_FALSE_ALARM_LIMIT;
        if is_sure || passes {
            let Buffers { refiner, found, .. } = self.buffers;
            std::mem::swap(&mut refiner.pairs, found);
        }
        if is_sure {
            return Some(found);
        }
        if passes {
            self.unsure = Some(found);
        }
        None
    }

    fn scene(&self) -> Scene<'a> {
        Scene {
            field: self.field,
            sky: self.sky,
        }
    }

    /// log10 of the false-alarm probability of `hypothesis`, `None` where it contradicts the hints.
    pub fn log10_false_alarm(&mut self, hypothesis: &Hypothesis) -> Option<f64> {
        let focal_px = hypothesis.camera.focal_length_px;
        let slack = 1.0 + 2.0 * PASSES[1].tolerance;
        if focal_px < self.focal_px.0 / slack || focal_px > self.focal_px.1 * slack {
            return None;
        }
        if let Some((near, radius_rad)) = &self.hints.near {
            let (boresight, _) = hypothesis.icrs_to_camera.boresight_and_up();
            if boresight.angle_to(near) > *radius_rad {
                return None;
            }
        }
        let (scene, hypotheses) = (self.scene(), self.hypotheses);
        let Buffers {
            refiner,
            false_alarm,
            ..
        } = self.buffers;
        Some(false_alarm.log10(hypothesis, scene, &mut refiner.around, hypotheses))
    }
}

fn triple([a, b, c]: &[Vector3<f64>; 3]) -> f64 {
    a.cross(b).dot(c)
}

/// The rotation that brings A and B on the sky to where the camera saw them (TRIAD with the middle of AB first).
fn two_star_rotation(seen: &[Vector3<f64>; 3], sky: &[Vector3<f64>; 3]) -> Option<Matrix3<f64>> {
    let frame = |a: &Vector3<f64>, b: &Vector3<f64>| {
        let first = (a + b).try_normalize(1e-12)?;
        let third = a.cross(b).try_normalize(1e-15)?;
        Some(Matrix3::from_columns(&[first, third.cross(&first), third]))
    };
    let camera = frame(&seen[0], &seen[1])?;
    Some(camera * frame(&sky[0], &sky[1])?.transpose())
}
