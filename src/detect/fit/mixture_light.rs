//! The light of an effective PSF in a window: from its table, or the sum over its components.

use super::light::{GroupLight, SpotLight};
use super::window::Window;
use crate::base::size::Size;
use crate::detect::psf::{
    DrawBuffers, GROUP_PX, LIGHT, LIGHT_BY_PLACE, LitPart, LocalPsf, NarrowProfiles, PixelGroup,
    ProfilePart, ShareGroup, each, each_of,
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
    /// Draws the PSF of the window, scaled to `spot_px`, at (x, y) in the frame; of the shares only the
    /// first `PARTS`.
    pub fn draw<const PARTS: usize>(
        &mut self,
        window: &Window,
        [x_px, y_px]: [f64; 2],
        spot_px: f64,
    ) {
        let psf = &window.psf;
        let width = window.groups();
        self.groups.clear();
        self.groups
            .resize(width * window.height, [[0.0; GROUP_PX]; 4]);
        let scale = spot_px / psf.spot_px;
        let place_px = [x_px - window.x0 as f64, y_px - window.y0 as f64];
        let size = window.size();
        if psf.table.is_empty() {
            let window = DrawnSpot {
                place_px,
                scale,
                size,
            };
            draw_components::<PARTS>(psf, &window, &mut self.profiles, &mut self.groups);
        } else {
            let sizes = [psf.spot_px, scale];
            psf.table
                .draw::<PARTS>(place_px, size, sizes, &mut self.buffers, &mut self.groups);
        }
    }

    /// The light of a spot of this flux, in units of the noise.
    pub fn light(&self, flux: f32, groups: usize) -> MixtureLight<'_> {
        MixtureLight {
            flux,
            fractions: &self.groups,
            groups,
        }
    }
}

/// Where a spot is drawn.
#[derive(Debug, Clone, Copy)]
struct DrawnSpot {
    /// The spot in the window, in pixels.
    place_px: [f64; 2],
    /// Its size over that of the PSF.
    scale: f64,
    /// Of the window.
    size: Size,
}

/// Adds the components of a PSF to the pixels of a window.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn draw_components<const PARTS: usize>(
    psf: &LocalPsf,
    window: &DrawnSpot,
    profiles: &mut NarrowProfiles,
    into: &mut [ShareGroup],
) {
    let DrawnSpot {
        place_px: [x_px, y_px],
        scale,
        size,
    } = *window;
    let width = size.width.div_ceil(GROUP_PX);
    for component in &psf.components {
        let [dx, dy] = component.offset_px;
        let place = [x_px + scale * dx, y_px + scale * dy];
        let part = profiles.fill(place, scale * component.sigma_px, size);
        // What a larger spot moves, and widens, its components by.
        let by_spot = [dx, dy, component.sigma_px].map(|part| (part / psf.spot_px) as f32);
        add_component::<PARTS>(component.share as f32, by_spot, profiles, part, into, width);
    }
}

/// Adds a component to the rows of `width` groups.
#[allow(
    clippy::needless_range_loop,
    reason = "lanes of several arrays read best as indices"
)]
#[inline(always)]
fn add_component<const PARTS: usize>(
    share: f32,
    by_spot: [f32; 3],
    profiles: &NarrowProfiles,
    part: LitPart,
    into: &mut [ShareGroup],
    width: usize,
) {
    let [to_x, to_y, wider] = by_spot;
    for group in part.groups[0]..part.groups[1] {
        let ProfilePart {
            value,
            by_center,
            by_sigma,
        } = profiles.across(group, &part);
        let across = each(&value, |value| share * value);
        let by_x = each(&by_center, |by_center| share * by_center);
        let by_size = each_of(&by_center, &by_sigma, |by_center, by_sigma| {
            share * (to_x * by_center + wider * by_sigma)
        });
        for row in part.rows[0]..part.rows[1] {
            let down = profiles.down(row, &part);
            let size_along_y = to_y * down.by_center + wider * down.by_sigma;
            let into = &mut into[row * width + group];
            // Copied so that the compiler need not assume aliasing.
            let mut sums = *into;
            for lane in 0..GROUP_PX {
                sums[0][lane] += across[lane] * down.value;
                if PARTS > LIGHT {
                    sums[1][lane] += by_x[lane] * down.value;
                    sums[2][lane] += across[lane] * down.by_center;
                }
                if PARTS > LIGHT_BY_PLACE {
                    sums[3][lane] += by_size[lane] * down.value + across[lane] * size_along_y;
                }
            }
            *into = sums;
        }
    }
}

/// The light of a spot that has the effective PSF.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MixtureLight<'a> {
    flux: f32,
    fractions: &'a [ShareGroup],
    /// Groups in a row.
    groups: usize,
}

/// The same in a group of pixels of a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MixtureGroup {
    flux: f32,
    fractions: ShareGroup,
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
            fractions: self.fractions[row * self.groups + group],
        }
    }

    #[inline(always)]
    fn fractions(&self, group: usize, row: usize) -> PixelGroup {
        self.fractions[row * self.groups + group][0]
    }
}

impl GroupLight for MixtureGroup {
    #[inline(always)]
    fn flux(&self) -> f32 {
        self.flux
    }

    #[inline(always)]
    fn gradient(&self, lane: usize) -> [f32; 4] {
        let by = |number: usize| self.flux * self.fractions[number][lane];
        [self.fractions[0][lane], by(1), by(2), by(3)]
    }

    #[inline(always)]
    fn gradients(&self) -> [PixelGroup; 4] {
        let [shape, by_x, by_y, by_size] = &self.fractions;
        let scaled = |by: &PixelGroup| each(by, |by| self.flux * by);
        [*shape, scaled(by_x), scaled(by_y), scaled(by_size)]
    }
}
