//! Unit vectors of stars in eight bytes each: those that a search needs again and again stay in the
//! processor's cache.

use crate::catalog::Star;

/// Bits of a coordinate. Their step is 0.2 arcsec.
const BITS: u32 = 21;
const MASK: u64 = (1 << BITS) - 1;
const STEP: f32 = 2.0 / MASK as f32;

/// The unit vectors of a catalogue's stars, in its order.
#[derive(Debug)]
pub struct PackedVectors(Vec<u64>);

impl PackedVectors {
    /// Packs the directions of `stars`.
    pub fn new(stars: &[Star]) -> Self {
        let pack = |star: &Star| {
            // Not `round`, which is a call for each coordinate where the processor may be old.
            let steps = |x: &f64| ((x + 1.0) / f64::from(STEP) + 0.5) as u64;
            let coordinates = star.direction.as_vector();
            coordinates
                .iter()
                .fold(0, |word, x| word << BITS | steps(x).min(MASK))
        };
        Self(stars.iter().map(pack).collect())
    }

    /// The packed vector of a star.
    #[inline]
    pub fn packed(&self, star: u32) -> u64 {
        self.0[star as usize]
    }

    /// The unit vector of a star.
    #[inline]
    pub fn get(&self, star: u32) -> [f32; 3] {
        let word = self.packed(star);
        [2 * BITS, BITS, 0].map(|shift| (word >> shift & MASK) as f32 * STEP - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::Catalog;

    #[test]
    fn vectors_come_back_to_a_fifth_of_an_arcsecond() {
        let stars = Catalog::built_in().stars();
        let packed = PackedVectors::new(stars);
        for (star, number) in stars.iter().zip(0..) {
            for (of_star, of_packed) in star.direction.as_vector().iter().zip(packed.get(number)) {
                assert!((of_star - f64::from(of_packed)).abs() < 6e-7);
            }
        }
    }
}
