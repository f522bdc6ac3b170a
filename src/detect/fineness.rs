//! How fine the cells are in which background and noise are measured.
//!
//! Between the centres of cells the background is taken to be straight. Where it is not, as in a small picture of
//! all the sky, what is left of it in the filtered frame raises the threshold, and finer cells show fainter stars.

use super::background::{FrameBackground, Mesh};
use super::candidates::FoundPeaks;
use super::search::{FrameSearch, Searched};

/// Scatter of a parabola about its chord between the centres of two cells, over its second difference: 1/√720.
const RMS_PER_BEND: f32 = 0.037_267_8;
/// Largest scatter of the background about the mesh in most cells, over the noise of the filtered frame.
const LARGEST_SCATTER: f32 = 0.5;
/// Most cells: this share of them.
const MAX: f32 = 0.75;
/// Finer cells count where they lower the limit to this part of it: at edges they make it worse.
const WORTHWHILE: f64 = 0.95;

/// The side of the cells of a frame, which is found by searching it.
#[derive(Debug)]
pub(super) struct CellSize {
    /// The side, in pixels.
    pub px: usize,
    /// What was found before with coarser cells.
    coarser: Option<Tried>,
}

/// A search with cells of a size, and what it found.
#[derive(Debug)]
struct Tried {
    cell_px: usize,
    /// Flux at which half of the stars are detected, in ADU.
    limit_adu: f64,
    searched: Searched,
    background: FrameBackground,
    /// Of the filtered frame.
    mesh: Mesh,
    found: FoundPeaks,
}

impl CellSize {
    /// Cells of this side to begin with.
    pub fn new(px: usize) -> Self {
        Self { px, coarser: None }
    }

    /// The spot size for which the frame was filtered with coarser cells, in pixels.
    pub fn filter_px(&self) -> Option<f64> {
        self.coarser
            .as_ref()
            .map(|tried| tried.searched.pass.spot_px)
    }

    /// What was found in the frame, where it needs no search after the one on this `background`: that, or what
    /// was found with coarser cells, which is put back. Else sets the cells with which the next is to be done.
    pub fn settle(
        &mut self,
        background: &mut FrameBackground,
        search: &mut FrameSearch,
        searched: Searched,
    ) -> Option<Searched> {
        let limit_adu = searched.pass.limit_adu(background.median_sigma_adu);
        let is_worse = |coarser: &Tried| limit_adu > WORTHWHILE * coarser.limit_adu;
        if let Some(coarser) = self.coarser.take_if(|coarser| is_worse(coarser)) {
            self.px = coarser.cell_px;
            *background = coarser.background;
            search.filtered.mesh = coarser.mesh;
            search.found.set(coarser.found);
            return Some(coarser.searched);
        }
        let finer_px = finer_px(self.px, background, &searched, &mut search.sorted);
        if finer_px == self.px {
            return Some(searched);
        }
        self.coarser = Some(Tried {
            cell_px: self.px,
            limit_adu,
            searched,
            background: background.clone(),
            mesh: search.filtered.mesh.clone(),
            found: search.found.found(),
        });
        self.px = finer_px;
        None
    }
}

/// Least side of a cell for spots of this standard deviation, all in pixels.
pub(crate) fn least_cell_px(spot_sigma_px: f64) -> f64 {
    /// Over the size of a spot: the light of bright stars would be in the background.
    const MIN_PER_SPOT: f64 = 16.0;
    /// With fewer pixels the noise of the background would matter.
    const MIN_PX: f64 = 16.0;
    (MIN_PER_SPOT * spot_sigma_px).max(MIN_PX)
}

/// The side of the cells that the bends of a background with cells of `cell_px` ask for.
fn finer_px(
    cell_px: usize,
    background: &FrameBackground,
    Searched { stars, pass }: &Searched,
    sorted: &mut Vec<f32>,
) -> usize {
    let least_px = least_cell_px(stars.spot_px).ceil() as usize;
    let scatter = |bend: f32| bend * RMS_PER_BEND / pass.matched_gain as f32;
    sorted.clear();
    sorted.extend(background.mesh.bends_over_noise().map(scatter));
    let at = (MAX * sorted.len() as f32) as usize;
    if at >= sorted.len() {
        return cell_px;
    }
    let mut scatter = *sorted.select_nth_unstable_by(at, f32::total_cmp).1;
    let mut finer_px = cell_px;
    while scatter > LARGEST_SCATTER && finer_px / 2 >= least_px {
        finer_px /= 2;
        // A quarter of the second difference.
        scatter /= 4.0;
    }
    finer_px
}

#[cfg(test)]
mod tests {
    use crate::detect::{DetectConfig, Workspace, detect};
    use crate::frame::Frame;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const SIDE: usize = 480;

    /// How many of 200 stars are found on a sky of this level.
    fn found(level: impl Fn(f64, f64) -> f64) -> usize {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut pixels: Vec<f64> = (0..SIDE * SIDE)
            .map(|index| {
                let [x, y] = [index % SIDE, index / SIDE].map(|at| at as f64 / SIDE as f64 - 0.5);
                level(x, y) + 10.0 * random.sample::<f64, _>(StandardNormal)
            })
            .collect();
        for _ in 0..200 {
            let [x, y] = [(); 2].map(|()| random.random_range(8.0..SIDE as f64 - 8.0));
            for row in y as usize - 4..y as usize + 6 {
                for column in x as usize - 4..x as usize + 6 {
                    let r2 = (column as f64 - x).powi(2) + (row as f64 - y).powi(2);
                    pixels[row * SIDE + column] += 80.0 * (-0.5 * r2 / 0.8f64.powi(2)).exp();
                }
            }
        }
        let pixels = pixels.into_iter().map(|pixel| pixel as f32).collect();
        let frame = Frame::new(SIDE, SIDE, pixels).unwrap();
        let found = detect(&frame, &DetectConfig::default(), &mut Workspace::new()).unwrap();
        found.sources.len()
    }

    #[test]
    fn a_sky_that_is_bent_hides_no_stars() {
        let flat = found(|_, _| 600.0);
        let bent = found(|x, y| 600.0 + 1600.0 * (x * x + y * y));
        assert!(flat > 190, "{flat}");
        assert!(bent > 185, "{bent} of {flat}");
    }
}
