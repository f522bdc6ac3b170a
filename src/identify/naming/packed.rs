//! Candidates packed so that several are computed at once.

/// Number of candidates that are computed together.
pub const LANES: usize = 8;

/// One number for each of several candidates.
pub type Lanes = [f64; LANES];

/// [`LANES`] candidates. Lanes of the last ones may be empty: their odds are 0, and their stars those
/// after the last.
#[derive(Debug, Clone, Copy)]
pub struct Packed {
    /// Positions in the lists of observed and of predicted stars.
    pub observed: [u32; LANES],
    pub predicted: [u32; LANES],
    /// Magnitude of the observed star, and V magnitude of the candidate's light.
    pub mag: Lanes,
    pub v_mag: Lanes,
    /// 1 where the observed star is saturated, else 0.
    pub saturated: Lanes,
    /// Density of the distance of a true pair, per square pixel.
    pub position_density: Lanes,
    /// Odds that another star of the candidate's blend was seen.
    pub rivals: Lanes,
    /// Odds that it is a true pair.
    pub odds: Lanes,
    /// Probability that it is not.
    pub p_chance: Lanes,
}

impl Packed {
    /// The positions of observed and predicted star of each lane.
    #[inline(always)]
    pub fn places(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let places = self.observed.into_iter().zip(self.predicted);
        places.map(|(observed, predicted)| (observed as usize, predicted as usize))
    }
}
