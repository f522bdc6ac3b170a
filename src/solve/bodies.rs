//! The Moon and the planets in a frame: a detection that is one of them is not a star.

use super::body_in_frame::BodyInFrame;
use super::outcome::Outcome;
use super::source::Source;
use crate::base::statistics::median_of;
use crate::catalog::Catalog;
use crate::ephemeris::solar_system::{Body, BodyKind, bodies_within};
use crate::identify::{Identification, Priors, SourceIndex, StarMatch};
use std::collections::HashMap;

/// The largest radius of a body's disc: part of it may be in a frame whose corner it is beyond.
const MOON_RADIUS_RAD: f64 = 0.005;

/// Finds the Moon and the planets in an identified frame whose date is known. Stars are not named
/// where they are.
pub(super) fn find_bodies(
    outcome: &mut Outcome,
    sources: &[Source],
    priors: &Priors,
    catalog: &Catalog,
) -> Vec<BodyInFrame> {
    let (Outcome::Identified(found), Some(known)) = (outcome, priors.date) else {
        return Vec::new();
    };
    let (centre, _) = found.icrs_to_camera.boresight_and_up();
    let radius_rad = found.camera.radius_rad() + MOON_RADIUS_RAD;
    let expected = bodies_within(
        &known.date,
        known.time_error(),
        priors.site,
        &centre,
        radius_rad,
    )
    .into_iter()
    .filter_map(|body| BodyInFrame::expected(body, found));
    let expected: Vec<BodyInFrame> = expected.collect();
    if expected.is_empty() {
        return expected;
    }
    let field = IdentifiedSources::new(found, sources, catalog);
    let bodies: Vec<BodyInFrame> = expected
        .into_iter()
        .map(|body| BodyInFrame {
            source: field.source_of(&body),
            ..body
        })
        .collect();
    found.matches.retain(|named| {
        let position = &sources[named.source.get()].position;
        let is_body = |body: &BodyInFrame| {
            body.source == Some(named.source)
                || body.hides(position, found.camera.focal_length_px())
        };
        !bodies.iter().any(is_body)
    });
    bodies
}

/// What is known of the sources of a frame.
struct IdentifiedSources<'a> {
    found: &'a Identification,
    sources: &'a [Source],
    /// V magnitude of the star that a source was identified as.
    named_v_mag: HashMap<SourceIndex, f64>,
    /// V magnitude of a source of flux 1.
    zero_point_mag: Option<f64>,
}

impl<'a> IdentifiedSources<'a> {
    fn new(found: &'a Identification, sources: &'a [Source], catalog: &Catalog) -> Self {
        let v_mag = |star| f64::from(catalog.star(star).v_mag);
        let named = found.matches.iter().map(|m| (m.source, v_mag(m.star)));
        let of_match =
            |m: &StarMatch| Some(v_mag(m.star) - sources[m.source.get()].instrumental_mag()?);
        Self {
            found,
            sources,
            named_v_mag: named.collect(),
            zero_point_mag: median_of(found.matches.iter().filter_map(of_match)),
        }
    }

    /// The source that is this body: the brightest within its gate, where chance would hardly bring
    /// as bright a one there.
    fn source_of(&self, expected: &BodyInFrame) -> Option<SourceIndex> {
        /// The expected number of other such sources in the gate up to which it is the body's.
        const MAX_BY_CHANCE: f64 = 0.05;
        let gate_px = self.gate_px(expected);
        let indices = (0..self.sources.len()).map(SourceIndex::new);
        let suitable: Vec<SourceIndex> = indices
            .filter(|index| self.may_be(&expected.body, *index))
            .collect();
        let within = |index: &SourceIndex| {
            let position = &self.sources[index.get()].position;
            position.distance_to(&expected.position) < gate_px
        };
        // Sources are sorted by brightness.
        let brightest = suitable.iter().copied().find(within)?;
        let others = suitable.iter().filter(|index| !within(index)).count() as f64;
        let camera = &self.found.camera;
        let gate_share =
            std::f64::consts::PI * gate_px * gate_px / (camera.width_px * camera.height_px);
        (others * gate_share < MAX_BY_CHANCE).then_some(brightest)
    }

    /// How far from its expected position a body's source may be.
    fn gate_px(&self, expected: &BodyInFrame) -> f64 {
        /// Residuals have wide tails, and what is saturated and bloomed has a poor centroid.
        const RESIDUALS: f64 = 3.0;
        const BLOOMED_PX: f64 = 4.0;
        let disc_px = expected.body.radius_rad * self.found.camera.focal_length_px();
        expected.uncertainty_px + disc_px + RESIDUALS * self.found.rms_px + BLOOMED_PX
    }

    /// Whether a source is bright enough for `body`, and not explained by a star.
    fn may_be(&self, body: &Body, index: SourceIndex) -> bool {
        /// Magnitudes by which a planet may be fainter than predicted: tone curves, phases, dust.
        const FAINTER_MAG: f64 = 1.5;
        /// The same for the Moon, of whose light even a linear frame holds a part only.
        const MOON_FAINTER_MAG: f64 = 6.0;
        /// Magnitudes by which it is brighter than a star that is taken for it.
        const STAR_FAINTER_MAG: f64 = 1.0;
        let source = &self.sources[index.get()];
        let is_saturated = source.measured.is_some_and(|m| m.flags.saturated);
        let v_mag = source
            .instrumental_mag()
            .zip(self.zero_point_mag)
            .map(|(mag, zero)| mag + zero);
        let fainter_mag = match body.kind {
            BodyKind::Moon => MOON_FAINTER_MAG,
            _ => FAINTER_MAG,
        };
        let is_bright = is_saturated || v_mag.is_none_or(|found| found < body.v_mag + fainter_mag);
        let star = self.named_v_mag.get(&index);
        is_bright && star.is_none_or(|star| *star > body.v_mag + STAR_FAINTER_MAG)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, Rotation, UnitVector};
    use crate::base::epoch::ObservationDate;
    use crate::camera::CameraModel;
    use crate::catalog::StarIndex;
    use crate::ephemeris::places::StarPlaces;
    use crate::ephemeris::solar_system::TimeError;
    use crate::ephemeris::solar_system::bodies_at;
    use crate::identify::{DateSource, FrameDate};
    use nalgebra::Matrix3;

    const FOCAL_PX: f64 = 4000.0;

    /// A frame with a body in its centre, sources at these offsets from there with these V
    /// magnitudes, and the names of these catalogue stars for them.
    fn frame(
        date: &str,
        kind: BodyKind,
        sources: &[(f64, f64, Option<usize>)],
    ) -> (Outcome, Vec<Source>, Priors) {
        let date: ObservationDate = date.parse().unwrap();
        let site = "52.22,4.42".parse().unwrap();
        let bodies = bodies_at(&date, TimeError::None, Some(site));
        let body = bodies.into_iter().find(|body| body.kind == kind).unwrap();
        let camera = CameraModel::pinhole(1000.0, 800.0, FOCAL_PX, false);
        let centre = camera.centre();
        let icrs_to_camera = Rotation::looking_at(&body.direction, 0.0);
        let in_camera = icrs_to_camera.apply(&body.direction);
        assert!(in_camera.angle_to(&UnitVector::BORESIGHT) < 1e-9);
        let matches = sources.iter().enumerate().filter_map(|(index, source)| {
            Some(StarMatch {
                source: SourceIndex::new(index),
                star: StarIndex::new(source.2?),
                residual_px: 0.1,
                p_chance: 1e-6,
                light: body.direction,
            })
        });
        let found = Identification {
            places: StarPlaces::default(),
            lens_is_known: false,
            camera,
            icrs_to_camera,
            attitude_covariance_rad2: Matrix3::zeros(),
            focal_length_sigma_px: 0.1,
            centre_sigma_px: [0.0; 2],
            excess_sigma_px: 0.0,
            matches: matches.collect(),
            rms_px: 0.3,
            log10_false_alarm: -50.0,
        };
        let source = |(off_px, v_mag, _): &(f64, f64, Option<usize>)| Source {
            position: PixelPoint::new(centre.x + off_px, centre.y),
            measured: None,
            flux: Some(10f64.powf(-0.4 * (v_mag - 15.0))),
        };
        let priors = Priors {
            date: Some(FrameDate::stated(date, DateSource::User)),
            site: Some(site),
            ..Priors::default()
        };
        (
            Outcome::Identified(Box::new(found)),
            sources.iter().map(source).collect(),
            priors,
        )
    }

    /// The catalogue's star of about this V magnitude.
    fn star(v_mag: f32) -> Option<usize> {
        let stars = Catalog::built_in().stars();
        Some(stars.partition_point(|star| star.v_mag < v_mag))
    }

    fn named(outcome: &Outcome) -> Vec<usize> {
        let matches = &outcome.identification().unwrap().matches;
        matches.iter().map(|m| m.source.get()).collect()
    }

    #[test]
    fn no_star_is_named_on_the_moon() {
        // Its disc has a radius of 4.5 mrad, 18 pixels.
        let sources = [
            (6.0, -9.0, None),
            (60.0, 4.0, star(4.0)),
            (11.0, 5.0, star(5.0)),
            (-16.0, 6.0, star(6.0)),
            (-22.0, 7.0, star(7.0)),
        ];
        let (mut outcome, sources, priors) =
            frame("2019-07-16T23:00:00Z", BodyKind::Moon, &sources);
        let bodies = find_bodies(&mut outcome, &sources, &priors, Catalog::built_in());
        assert_eq!(bodies[0].source, Some(SourceIndex::new(0)));
        assert_eq!(named(&outcome), [1, 4]);
    }

    #[test]
    fn a_planet_loses_a_wrong_name_and_a_star_of_its_brightness_keeps_its_own() {
        let date = "2019-07-29T20:47:26Z";
        let find = |at_planet: Option<usize>, v_mag: f64| {
            let sources = [
                (1.0, v_mag, at_planet),
                (200.0, 4.0, star(4.0)),
                (-150.0, 5.0, star(5.0)),
                (120.0, 6.0, star(6.0)),
            ];
            let (mut outcome, sources, priors) = frame(date, BodyKind::Jupiter, &sources);
            let bodies = find_bodies(&mut outcome, &sources, &priors, Catalog::built_in());
            assert_eq!(bodies.len(), 1);
            (bodies[0].source.is_some(), named(&outcome))
        };
        // Jupiter has V −2.4, Sirius, the first of the catalogue, −1.44.
        assert_eq!(find(star(7.0), -2.4), (true, vec![1, 2, 3]));
        assert_eq!(find(None, -2.4), (true, vec![1, 2, 3]));
        assert_eq!(find(Some(0), -1.44), (false, vec![0, 1, 2, 3]));
        assert_eq!(find(star(7.0), 7.0), (false, vec![0, 1, 2, 3]));
    }

    #[test]
    fn a_place_that_is_too_uncertain_takes_no_name() {
        let sources = [
            (0.0, -9.0, star(8.0)),
            (60.0, 4.0, star(4.0)),
            (11.0, 5.0, star(5.0)),
        ];
        let (mut outcome, sources, mut priors) =
            frame("2019-07-16T12:00:00Z", BodyKind::Moon, &sources);
        let date = "2019-07-16".parse().unwrap();
        priors.date = Some(FrameDate::stated(date, DateSource::FileHeader));
        let bodies = find_bodies(&mut outcome, &sources, &priors, Catalog::built_in());
        // The brightest is still the Moon: nothing else is as bright.
        assert_eq!(bodies[0].source, Some(SourceIndex::new(0)));
        assert!(bodies[0].uncertainty_px > 500.0);
        assert_eq!(named(&outcome), [1, 2]);
    }
}
