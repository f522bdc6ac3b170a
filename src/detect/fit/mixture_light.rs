//! The light of an effective PSF in a window: from its table, or the sum over its lobes.

use super::light::{GroupLight, SpotLight};
use super::window::Window;
use crate::detect::psf::{
    DrawBuffers, GROUP_PX, LitPart, NarrowProfiles, PixelGroup, ShareGroup, each,
};
use multiversion::multiversion;

/// The pixels of an effective PSF.
#[derive(Debug, Clone, Default)]
pub(super) struct MixtureImage {
    /// Row by row, as the pixels of the window.
    groups: Vec<ShareGroup>,
    profiles: NarrowProfiles,
    /// Those of the table.
    buffers: DrawBuffers,
}

impl MixtureImage {
    /// Draws the PSF of the window, scaled to `spot_px`, at (x, y) in the frame.
    pub fn draw(&mut self, window: &Window, [x_px, y_px]: [f64; 2], spot_px: f64) {
        let psf = &window.psf;
        let width = window.groups();
        self.groups.clear();
        self.groups
            .resize(width * window.height, [[0.0; GROUP_PX]; 4]);
        let scale = spot_px / psf.spot_px;
        let corner = [window.x0, window.y0].map(|at| at as f64);
        let size = window.size();
        if !psf.table.is_empty() {
            let place = [x_px - corner[0], y_px - corner[1]];
            let sizes = [psf.spot_px, scale];
            psf.table
                .draw(place, size, sizes, &mut self.buffers, &mut self.groups);
            return;
        }
        for lobe in &psf.lobes {
            let [dx, dy] = lobe.offset_px;
            let place = [x_px - corner[0] + scale * dx, y_px - corner[1] + scale * dy];
            let part = self.profiles.fill(place, scale * lobe.sigma_px, size);
            // What a larger spot moves, and widens, its lobes by.
            let by_spot = [dx, dy, lobe.sigma_px].map(|part| (part / psf.spot_px) as f32);
            let share = lobe.share as f32;
            add_lobe(
                share,
                by_spot,
                &self.profiles,
                part,
                &mut self.groups,
                width,
            );
        }
    }

    /// The light of a spot of this flux, in units of the noise.
    pub fn light(&self, flux: f32, groups: usize) -> MixtureLight<'_> {
        MixtureLight {
            flux,
            shares: &self.groups,
            groups,
        }
    }
}

/// Adds a lobe to the rows of `width` groups.
#[allow(
    clippy::needless_range_loop,
    reason = "lanes of several arrays read best as indices"
)]
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn add_lobe(
    share: f32,
    by_spot: [f32; 3],
    profiles: &NarrowProfiles,
    part: LitPart,
    into: &mut [ShareGroup],
    width: usize,
) {
    let [to_x, to_y, wider] = by_spot;
    for row in part.rows[0]..part.rows[1] {
        let down = profiles.down(row, &part);
        let [value, slope, growth] =
            [down.value, down.by_center, down.by_sigma].map(|part| share * part);
        for group in part.groups[0]..part.groups[1] {
            let across = profiles.across(group, &part);
            // Copied so that the compiler need not assume aliasing.
            let mut sums = into[row * width + group];
            for lane in 0..GROUP_PX {
                let here = across.value[lane];
                let by_x = across.by_center[lane] * value;
                let by_y = here * slope;
                let by_lobe = across.by_sigma[lane] * value + here * growth;
                sums[0][lane] += here * value;
                sums[1][lane] += by_x;
                sums[2][lane] += by_y;
                sums[3][lane] += by_x * to_x + by_y * to_y + by_lobe * wider;
            }
            into[row * width + group] = sums;
        }
    }
}

/// The light of a spot that has the effective PSF.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MixtureLight<'a> {
    flux: f32,
    shares: &'a [ShareGroup],
    /// Groups in a row.
    groups: usize,
}

/// The same in a group of pixels of a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MixtureGroup {
    flux: f32,
    shares: ShareGroup,
}

impl SpotLight for MixtureLight<'_> {
    type Group = MixtureGroup;

    #[inline(always)]
    fn flux(&self) -> f32 {
        self.flux
    }

    #[inline(always)]
    fn in_group(&self, group: usize, row: usize) -> MixtureGroup {
        MixtureGroup {
            flux: self.flux,
            shares: self.shares[row * self.groups + group],
        }
    }

    #[inline(always)]
    fn shares(&self, group: usize, row: usize) -> PixelGroup {
        self.shares[row * self.groups + group][0]
    }
}

impl GroupLight for MixtureGroup {
    #[inline(always)]
    fn flux(&self) -> f32 {
        self.flux
    }

    #[inline(always)]
    fn gradient(&self, lane: usize) -> [f32; 4] {
        let by = |number: usize| self.flux * self.shares[number][lane];
        [self.shares[0][lane], by(1), by(2), by(3)]
    }

    #[inline(always)]
    fn gradients(&self) -> [PixelGroup; 4] {
        let [shape, by_x, by_y, by_size] = &self.shares;
        let scaled = |by: &PixelGroup| each(by, |by| self.flux * by);
        [*shape, scaled(by_x), scaled(by_y), scaled(by_size)]
    }
}
