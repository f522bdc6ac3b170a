//! The prominence of peaks: height above the highest saddle towards a higher peak of the region.
//!
//! Each region is flooded from the top down. Where two floods meet, the lower peak has its saddle.
//!
//! # Reference
//! Edelsbrunner, Letscher & Zomorodian 2002, doi 10.1007/s00454-002-2885-2, for prominence as
//! persistence.

use super::disjoint_sets::{self, join, root_of};
use super::labelling::Labelling;
use super::peak::{Peak, highest_first};
use crate::base::interrupt::Interrupted;
use crate::detect::pixels::View;

/// Pixels between two looks for an interrupt: some milliseconds.
const PIXELS_AT_ONCE: usize = 1 << 16;

/// Buffers of the flooding.
#[derive(Debug, Clone, Default)]
pub(super) struct Flooding {
    /// Heights of the pixels of one region, inverted, and their indices: highest first when sorted.
    by_height: Vec<u64>,
    /// Indices of the pixels of one region, highest first.
    members: Vec<u32>,
    /// Disjoint sets of the members' ranks: one for each flood.
    floods: Vec<u32>,
    /// Rank by height of each pixel within its region, where it was needed.
    ranks: Vec<u32>,
}

impl Flooding {
    /// Sets the prominences of a region's peaks; `peak_pixels` holds the pixel of each of all
    /// peaks, in ascending order, and its run.
    ///
    /// # Errors
    /// [`Interrupted`] of work on `view`.
    pub fn set_prominences(
        &mut self,
        (region, view): (usize, &View<'_>),
        labelling: &Labelling,
        peak_pixels: &[[u32; 2]],
        peaks: &mut [Peak],
    ) -> Result<(), Interrupted> {
        self.sort_members(region, labelling);
        let Self {
            members,
            floods,
            ranks,
            ..
        } = self;
        // The root of a flood is its highest pixel, since the lowest rank represents a set.
        disjoint_sets::reset(floods, members.len());
        for (r, &index) in members.iter().enumerate() {
            if r % PIXELS_AT_ONCE == 0 {
                view.check()?;
            }
            let snr = labelling.pixels[index as usize].snr;
            for other in labelling.neighbours(index as usize) {
                let other = ranks[other];
                if other as usize >= r {
                    continue;
                }
                let (a, b) = (root_of(floods, r as u32), root_of(floods, other));
                if a != b {
                    let lower = members[a.max(b) as usize];
                    let peak = peak_pixels.binary_search_by_key(&lower, |&[pixel, _]| pixel);
                    if let Ok(peak) = peak {
                        peaks[peak].prominence = labelling.pixels[lower as usize].snr - snr;
                    }
                    join(floods, a, b);
                }
            }
        }
        Ok(())
    }

    /// Sorts the pixels of a region by height, and ranks them.
    fn sort_members(&mut self, region: usize, labelling: &Labelling) {
        let Self {
            by_height,
            members,
            ranks,
            ..
        } = self;
        let pixels = &labelling.pixels;
        by_height.clear();
        let indices = labelling.pixels_of_region(region);
        by_height.extend(indices.map(|i| highest_first(pixels[i].snr, i)));
        by_height.sort_unstable();
        members.clear();
        members.extend(by_height.iter().map(|&key| key as u32));
        ranks.resize(pixels.len().max(ranks.len()), 0);
        for (rank, &index) in members.iter().enumerate() {
            ranks[index as usize] = rank as u32;
        }
    }
}
