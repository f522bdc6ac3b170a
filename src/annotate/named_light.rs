//! Is the light at a star's place the star's, and was it measured?

use super::annotation::Unmeasured;
use super::view::View;
use crate::base::coords::PixelPoint;
use crate::base::statistics::median_of;
use crate::identify::SourceIndex;
use crate::solve::Source;

/// The detections, and what each is known to be.
pub(super) struct Lights<'a> {
    view: &'a View<'a>,
    /// V magnitude of the star or planet that a detection is.
    named_v_mag: Vec<Option<f32>>,
    /// V magnitude of a detection of flux 1.
    zero_point_mag: Option<f64>,
}

impl<'a> Lights<'a> {
    pub fn new(view: &'a View<'a>) -> Self {
        let sources = &view.solution.sources;
        let mut named_v_mag = vec![None; sources.len()];
        for named in &view.found.matches {
            named_v_mag[named.source.get()] = Some(view.catalog.star(named.star).v_mag);
        }
        let zero_points = sources
            .iter()
            .zip(&named_v_mag)
            .filter_map(|(source, v_mag)| Some(f64::from((*v_mag)?) - source.instrumental_mag()?));
        let zero_point_mag = median_of(zero_points);
        for seen in &view.solution.bodies {
            if let Some(source) = seen.source {
                named_v_mag[source.get()] = Some(seen.body.v_mag as f32);
            }
        }
        Self {
            view,
            named_v_mag,
            zero_point_mag,
        }
    }

    /// The brightest light within `reach_px` of the place of a star of `v_mag`, and what it says of the star.
    /// `None` where there is none that is bright enough, or where it is that of a brighter one, which outshines it.
    pub fn at(
        &self,
        place: &PixelPoint,
        reach_px: f64,
        v_mag: f32,
    ) -> Option<(SourceIndex, Unmeasured)> {
        let sources = &self.view.solution.sources;
        let index = sources.iter().position(|source| {
            let (dx, dy) = (source.position.x - place.x, source.position.y - place.y);
            dx * dx + dy * dy < reach_px * reach_px
        })?;
        let why = match self.named_v_mag[index] {
            Some(other) if other <= v_mag => return None,
            Some(_) => Unmeasured::Blended,
            None => why_unmeasured(&sources[index]),
        };
        let is_bright = self.is_bright_enough(&sources[index], v_mag, why);
        is_bright.then_some((SourceIndex::new(index), why))
    }

    /// Whether light may be that of a star; what was measured of a saturated or extended spot may be little.
    fn is_bright_enough(&self, source: &Source, v_mag: f32, why: Unmeasured) -> bool {
        /// Tone curves, clouds, and low altitudes make stars fainter by up to this.
        const FAINTER_MAG: f64 = 4.0;
        let found = source.instrumental_mag().zip(self.zero_point_mag);
        let found = found.map(|(mag, zero_point_mag)| mag + zero_point_mag);
        let is_partial = matches!(why, Unmeasured::Saturated | Unmeasured::Extended);
        is_partial || found.is_none_or(|found| found < f64::from(v_mag) + FAINTER_MAG)
    }
}

/// What a detection without a name says of the star whose light it is.
fn why_unmeasured(source: &Source) -> Unmeasured {
    let Some(flags) = source.measured.map(|measured| measured.flags) else {
        return Unmeasured::Uncertain;
    };
    match flags {
        _ if flags.saturated => Unmeasured::Saturated,
        _ if !flags.is_star_like() => Unmeasured::Extended,
        _ if flags.blended => Unmeasured::Blended,
        _ if flags.border => Unmeasured::Border,
        _ => Unmeasured::Uncertain,
    }
}
