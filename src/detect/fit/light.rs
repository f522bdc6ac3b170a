//! The light of spots in a window, and its derivatives with respect to the parameters.

use crate::detect::psf::{AxisProfile, GROUP_PX, PixelGroup, ProfilePart};
use multiversion::multiversion;

/// The light of a spot in a window.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SpotLight<'a> {
    /// Flux, in units of the noise.
    pub flux: f32,
    /// Profiles along x and y.
    pub axes: &'a [AxisProfile; 2],
}

/// The light of a spot in a group of pixels of a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GroupLight {
    flux: f32,
    across: ProfilePart<PixelGroup>,
    down: ProfilePart<f32>,
}

impl SpotLight<'_> {
    /// The light in a group of pixels of a row.
    #[inline(always)]
    pub fn in_group(&self, group: usize, row: usize) -> GroupLight {
        let [across, down] = self.axes;
        GroupLight {
            flux: self.flux,
            across: across.group(group),
            down: down.pixel(row),
        }
    }
}

/// The light in a pixel, and the gradient of the model with respect to the parameters of the first
/// `count` spots, in units of the noise.
#[inline(always)]
pub(crate) fn linearise<const S: usize, const N: usize>(
    spots: &[GroupLight; S],
    count: usize,
    lane: usize,
) -> (f32, [f32; N]) {
    let background = 3 * count;
    let mut light = 0.0;
    let mut gradient = [0.0; N];
    gradient[background] = 1.0;
    for (i, spot) in spots.iter().enumerate().take(count) {
        let [shape, by_x, by_y, by_size] =
            spot_gradient(spot.flux, &spot.across.lane(lane), &spot.down);
        light += spot.flux * shape;
        gradient[3 * i] = by_x;
        gradient[3 * i + 1] = by_y;
        gradient[3 * i + 2] = shape;
        gradient[background + 1] += by_size;
    }
    (light, gradient)
}

/// The fraction of a spot's light in a pixel, and the derivatives of the light there with respect
/// to x, y and size.
#[inline(always)]
pub(crate) fn spot_gradient(
    flux: f32,
    across: &ProfilePart<f32>,
    down: &ProfilePart<f32>,
) -> [f32; 4] {
    [
        across.value * down.value,
        flux * across.by_center * down.value,
        flux * across.value * down.by_center,
        flux * (across.by_sigma * down.value + across.value * down.by_sigma),
    ]
}

/// Adds `sign` times the light of a spot to the pixels of a window.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn add_light(spot: &SpotLight, sign: f32, groups: usize, data: &mut [PixelGroup]) {
    let [across, down] = spot.axes;
    for group in 0..groups {
        let value = across.group(group).value;
        for (row, pixels) in data.iter_mut().skip(group).step_by(groups).enumerate() {
            let light = sign * spot.flux * down.pixel(row).value;
            for lane in 0..GROUP_PX {
                pixels[lane] += value[lane] * light;
            }
        }
    }
}
