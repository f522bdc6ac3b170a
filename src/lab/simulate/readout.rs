//! From expected electrons to ADU.

use super::pattern::DetectorPattern;
use super::poisson::{PoissonTable, poisson};
use crate::camera::data_sheet::DataSheet;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Draws whole electrons for the expected ones. `uniform` is the distribution for the mean that
/// most pixels have.
pub(super) fn collect(
    electrons: &mut [f64],
    uniform: Option<&PoissonTable>,
    random: &mut ChaCha8Rng,
) {
    for pixel in electrons {
        *pixel = match uniform {
            Some(table) if table.mean() == *pixel => table.sample(random),
            _ => poisson(*pixel, random),
        };
    }
}

/// Blooming and read-out of the collected charge.
#[derive(Debug, Clone)]
pub(super) struct Readout {
    width: usize,
    full_well_e: f64,
    read_noise_e: f64,
    gain_e_per_adu: f64,
    bias_adu: f64,
    full_scale_adu: f64,
    blooming: f64,
}

impl Readout {
    pub(super) fn from_sheet(sheet: &DataSheet) -> Self {
        Self {
            width: sheet.width_px,
            full_well_e: sheet.full_well_e,
            read_noise_e: sheet.read_noise_e,
            gain_e_per_adu: sheet.gain_e_per_adu,
            bias_adu: sheet.bias_adu,
            full_scale_adu: sheet.full_scale_adu(),
            blooming: sheet.imperfections.blooming,
        }
    }

    /// ADU values of pixels with these collected electrons.
    pub(super) fn grey_levels(
        &self,
        collected_e: &mut [f64],
        pattern: &DetectorPattern,
        random: &mut ChaCha8Rng,
    ) -> Vec<f32> {
        self.bloom(collected_e);
        let mut level = |(i, &charge_e): (usize, &f64)| {
            let noise: f64 = StandardNormal.sample(random);
            let read_e = charge_e.min(self.full_well_e) + self.read_noise_e * noise;
            let offset = pattern
                .offset_adu
                .as_ref()
                .map_or(0.0, |offset| f64::from(offset[i]));
            let level_adu = self.bias_adu + offset + read_e / self.gain_e_per_adu;
            level_adu.round().clamp(0.0, self.full_scale_adu) as f32
        };
        collected_e.iter().enumerate().map(&mut level).collect()
    }

    /// Moves the excess charge of overfull pixels up and down their columns, to pixels with free
    /// capacity.
    fn bloom(&self, collected_e: &mut [f64]) {
        if self.blooming == 0.0 {
            return;
        }
        for at in 0..collected_e.len() {
            let excess_e = (collected_e[at] - self.full_well_e) * self.blooming;
            if excess_e > 0.0 {
                collected_e[at] = self.full_well_e;
                self.flow(collected_e, excess_e / 2.0, at, |at| {
                    at.checked_sub(self.width)
                });
                self.flow(collected_e, excess_e / 2.0, at, |at| Some(at + self.width));
            }
        }
    }

    /// Adds `excess_e` to the pixels that `next` leads to, until it is used up or the column ends.
    fn flow(
        &self,
        collected_e: &mut [f64],
        mut excess_e: f64,
        from: usize,
        next: impl Fn(usize) -> Option<usize>,
    ) {
        let mut at = from;
        while let Some(pixel) = next(at).and_then(|there| collected_e.get_mut(there)) {
            let room_e = (self.full_well_e - *pixel).max(0.0);
            *pixel += room_e.min(excess_e);
            excess_e -= room_e;
            if excess_e <= 0.0 {
                return;
            }
            at = next(at).unwrap_or(at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;
    use rand::SeedableRng;

    fn levels(sheet: &DataSheet, electrons: &[f64]) -> (f32, Vec<f32>) {
        let readout = Readout::from_sheet(sheet);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut collected = electrons.to_vec();
        let levels = readout.grey_levels(&mut collected, &DetectorPattern::default(), &mut random);
        (sheet.saturation_adu() as f32, levels)
    }

    #[test]
    fn a_full_pixel_and_the_end_of_the_scale_saturate() {
        let mut sheet = Preset::Experiment1.data_sheet();
        let (saturation, full) = levels(&sheet, &[1e6; 10_000]);
        let below = full.iter().filter(|level| **level < saturation).count();
        assert!(below < 5 && saturation < 4095.0, "{below}");
        sheet.full_well_e = 1e7;
        let (saturation, clipped) = levels(&sheet, &[1e6; 10_000]);
        assert_eq!(saturation, 4095.0);
        assert!(clipped.iter().all(|level| *level == 4095.0));
    }

    #[test]
    fn what_does_not_fit_flows_along_the_column_and_none_is_lost() {
        let mut sheet = Preset::Experiment1.data_sheet();
        (sheet.width_px, sheet.height_px) = (5, 9);
        sheet.full_well_e = 100.0;
        sheet.imperfections.blooming = 1.0;
        let mut electrons = vec![10.0; 45];
        electrons[4 * 5 + 2] = 400.0;
        electrons[5 * 5 + 2] = 130.0;
        let before: f64 = electrons.iter().sum();
        Readout::from_sheet(&sheet).bloom(&mut electrons);
        assert!((electrons.iter().sum::<f64>() - before).abs() < 1e-9);
        let column: Vec<f64> = (0..9).map(|y| electrons[y * 5 + 2]).collect();
        assert_eq!(column[4], 100.0);
        assert!(
            column.iter().all(|e| *e <= 100.0) && column[2] > 60.0,
            "{column:?}"
        );
        assert!((0..45).filter(|i| i % 5 != 2).all(|i| electrons[i] == 10.0));
        // With an anti-blooming drain the excess does not flow.
        sheet.imperfections.blooming = 0.0;
        let mut drained = vec![400.0; 45];
        Readout::from_sheet(&sheet).bloom(&mut drained);
        assert!(drained.iter().all(|e| *e == 400.0));
    }
}
