//! Which spot is which star, under an attitude?

use crate::block::{Buffers, LOOKUP_SIDE};
use crate::camera::Lens;
use crate::{Catalog, Sky, Spot, Work};
use bytemuck::{Pod, Zeroable};
use nalgebra::{Matrix3, Vector3};

/// Stars are looked up this much farther out: aberration and proper motion shift them.
const SHIFT_RAD: f64 = 3e-4;
const LIGHT_KM_S: f64 = 299_792.458;

/// A star that is to be seen.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Predicted {
    /// Where it appears (ICRS).
    pub apparent: [f64; 3],
    /// Where the camera sees it.
    pub pixel: [f64; 2],
    pub v_mag: f32,
    /// Its number.
    pub star: u32,
}

/// A spot and its star.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Match {
    /// Direction of the spot in camera axes.
    pub observed: [f64; 3],
    /// Where the star appears (ICRS).
    pub apparent: [f64; 3],
    /// Variance of the spot's place on each axis.
    pub variance_px2: f64,
}

/// Where a star appears to a moving observer.
pub(crate) fn apparent(catalog: &Catalog, star: usize, sky: &Sky) -> Vector3<f64> {
    let star = catalog
        .star(star)
        .direction_after(sky.year - catalog.epoch_year());
    (star + Vector3::from(sky.velocity_km_s) / LIGHT_KM_S).normalize()
}

/// A camera that looks at the stars.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View<'a> {
    pub lens: &'a Lens,
    pub catalog: &'a Catalog<'a>,
    pub sky: &'a Sky,
    pub icrs_to_camera: Matrix3<f64>,
    /// Focal length over that of the configuration.
    pub scale: f64,
}

impl View<'_> {
    /// Where the camera sees a direction.
    pub(crate) fn pixel_of(&self, apparent: &Vector3<f64>, margin_px: f64) -> Option<[f64; 2]> {
        let seen = self.icrs_to_camera * apparent;
        self.lens.pixel_of(
            &Vector3::new(seen.x * self.scale, seen.y * self.scale, seen.z),
            margin_px,
        )
    }

    /// Writes the stars in the frame to `predicted`, the brightest first, and tells how many there are.
    pub(crate) fn predict(&self, predicted: &mut [Predicted], work: &mut Work) -> usize {
        let middle = self.icrs_to_camera.transpose() * self.lens.middle();
        let mut count = 0;
        self.catalog
            .visit_stars(&middle, self.lens.radius_rad + SHIFT_RAD, |number| {
                work.stars += 1;
                let apparent = apparent(self.catalog, number, self.sky);
                let Some((pixel, place)) =
                    self.pixel_of(&apparent, 0.0).zip(predicted.get_mut(count))
                else {
                    return;
                };
                let v_mag = self.catalog.star(number).v_mag as f32;
                *place = Predicted {
                    apparent: apparent.into(),
                    pixel,
                    v_mag,
                    star: number as u32,
                };
                count += 1;
            });
        predicted[..count].sort_unstable_by(|a, b| {
            (a.v_mag, a.star)
                .partial_cmp(&(b.v_mag, b.star))
                .unwrap_or(core::cmp::Ordering::Equal)
        });
        count
    }
}

/// Prepares the search of spots by their places, and their directions.
pub(crate) fn look_up(spots: &[Spot], lens: &Lens, buffers: &mut Buffers) {
    buffers.first.fill(0);
    // Cells begin with the brightest.
    for (number, spot) in spots.iter().enumerate().rev() {
        let place = [spot.x_px, spot.y_px];
        buffers.directions[number] = lens.direction_of(place).into();
        let [column, row] = cell(place, lens);
        let first = &mut buffers.first[row * LOOKUP_SIDE + column];
        buffers.next[number] = *first;
        *first = number as u16 + 1;
    }
}

fn cell([x, y]: [f64; 2], lens: &Lens) -> [usize; 2] {
    let of = |at: f64, side: u32| {
        let place = (at + 0.5) / f64::from(side) * LOOKUP_SIDE as f64;
        (place.max(0.0) as usize).min(LOOKUP_SIDE - 1)
    };
    [of(x, lens.camera.width_px), of(y, lens.camera.height_px)]
}

/// How far a spot may be from its star.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    /// In the middle of the frame, in pixels.
    pub base_px: f64,
    /// What is added for each pixel from the middle.
    pub growth: f64,
    /// What the errors of the spots' places lack, in pixels.
    pub floor_px: f64,
}

impl Reach {
    fn at(&self, pixel: [f64; 2], lens: &Lens) -> f64 {
        let [x, y] = lens.camera.center_px;
        self.base_px + self.growth * libm::hypot(pixel[0] - x, pixel[1] - y)
    }
}

/// What pairing found.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pairing {
    /// Spots with a star.
    pub matches: usize,
    /// Mean probability that a star has a spot by chance.
    pub p_chance: f64,
}

/// Pairs the first `predicted` stars with the spots: each spot once, bright stars first, the nearest spot.
pub(crate) fn pair(
    spots: &[Spot],
    predicted: usize,
    lens: &Lens,
    reach: &Reach,
    buffers: &mut Buffers,
) -> Pairing {
    buffers.taken[..spots.len()].fill(0);
    let area_px2 = f64::from(lens.camera.width_px) * f64::from(lens.camera.height_px);
    let mut pairing = Pairing::default();
    for star in &buffers.predicted[..predicted] {
        let radius_px = reach.at(star.pixel, lens);
        let searched = core::f64::consts::PI * radius_px * radius_px / area_px2;
        pairing.p_chance += (searched * spots.len() as f64).min(1.0);
        let free = |spot: usize| buffers.taken[spot] == 0;
        let Some(spot) = nearest(
            spots,
            star.pixel,
            radius_px,
            lens,
            (buffers.first, buffers.next),
            free,
        ) else {
            continue;
        };
        buffers.taken[spot] = 1;
        let [sigma, floor] = [spots[spot].sigma_px, reach.floor_px];
        let variance_px2 = sigma * sigma + floor * floor;
        buffers.matches[pairing.matches] = Match {
            observed: buffers.directions[spot],
            apparent: star.apparent,
            variance_px2,
        };
        pairing.matches += 1;
    }
    pairing.p_chance /= predicted.max(1) as f64;
    pairing
}

/// The nearest spot within a distance that is free.
fn nearest(
    spots: &[Spot],
    [x, y]: [f64; 2],
    radius_px: f64,
    lens: &Lens,
    (first, next): (&[u16], &[u16]),
    free: impl Fn(usize) -> bool,
) -> Option<usize> {
    let [left, top] = cell([x - radius_px, y - radius_px], lens);
    let [right, bottom] = cell([x + radius_px, y + radius_px], lens);
    let mut best = (radius_px, None);
    for row in top..=bottom {
        for column in left..=right {
            let mut spot = first[row * LOOKUP_SIDE + column];
            while spot > 0 {
                let number = usize::from(spot) - 1;
                let distance_px = libm::hypot(spots[number].x_px - x, spots[number].y_px - y);
                if distance_px < best.0 && free(number) {
                    best = (distance_px, Some(number));
                }
                spot = next[number];
            }
        }
    }
    best.1
}
