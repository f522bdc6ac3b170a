//! What frames tell of the tone curve of their camera.

/// What frames of one camera tell of its curve: the logarithm of the likelihood of each that a picture may have.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveEvidence(pub(super) Vec<f64>);

impl CurveEvidence {
    /// That of several frames.
    pub fn of_frames(frames: &[Self]) -> Option<Self> {
        let Self(first) = frames.first()?;
        let alike = || frames.iter().filter(|Self(of)| of.len() == first.len());
        // They show the same stars, and are not independent.
        let weight = 1.0 / (alike().count() as f64).sqrt();
        let together = |curve: usize| weight * alike().map(|Self(of)| of[curve]).sum::<f64>();
        Some(Self((0..first.len()).map(together).collect()))
    }
}
