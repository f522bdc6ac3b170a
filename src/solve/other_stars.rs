//! Other stars of a frame: those at half and a quarter of its resolution, and the brightest in single pixels.
//!
//! Structure swamps the stars (city lights, foliage, nebulae, noise of compression). There is less of it in a
//! coarser frame; and it is wider than they are, so that in single pixels they may stand out.

use super::pointing_buffers::TRIED_STARS;
use super::star_field::star_field;
use crate::base::coords::PixelPoint;
use crate::detect::{
    self, DetectConfig, Detections, detect, look_for_brightest, measure_brightest_into,
};
use crate::ephemeris::places::StarPlaces;
use crate::frame::Frame;
use crate::identify::{ObservedStar, OtherFields, StarField};
use std::cell::{OnceCell, RefCell};

/// Sides of the blocks of pixels that are averaged, the cheapest first.
const FACTORS: [usize; 2] = [4, 2];
/// Least side of a coarse frame, in pixels.
const MIN_SIDE_PX: usize = 64;
/// Most pixels of a coarse frame: its detection is to cost little beside a search.
const MAX_PX: usize = 1 << 20;
/// Most detections: a search looks at the brightest.
const MAX_DETECTIONS: usize = 1000;

/// A frame whose stars are detected otherwise, when a search asks for them.
pub(super) struct OtherStars<'a> {
    frame: &'a Frame<'a>,
    /// The detection of the whole frame. Trails are searched in front of its background later, so a coarse
    /// frame is detected with buffers of its own.
    detector: &'a detect::Workspace,
    places: StarPlaces,
    /// What stands out in single pixels; none where it could not be looked for.
    looked: OnceCell<Option<RefCell<detect::Workspace>>>,
    brightest: [OnceCell<Option<StarField>>; TRIED_STARS.len()],
    coarse: [OnceCell<Option<StarField>>; FACTORS.len()],
}

impl<'a> OtherStars<'a> {
    pub fn new(frame: &'a Frame<'a>, detector: &'a detect::Workspace, places: StarPlaces) -> Self {
        Self {
            frame,
            detector,
            places,
            looked: OnceCell::new(),
            brightest: Default::default(),
            coarse: Default::default(),
        }
    }

    /// The brightest stars that stand out in single pixels, in one of the numbers that are tried.
    fn brightest(&self, number: usize) -> Option<&StarField> {
        if self.detector.is_interrupted() {
            return None;
        }
        let brightest = self.brightest[number].get_or_init(|| {
            let (config, mut stars) = (DetectConfig::default(), Detections::default());
            let look = || {
                let mut detector = self.detector.emptied();
                let looked = look_for_brightest(self.frame, &config, &mut detector);
                looked.ok().map(|()| RefCell::new(detector))
            };
            let detector = &mut *self.looked.get_or_init(look).as_ref()?.borrow_mut();
            let count = TRIED_STARS[number];
            measure_brightest_into(self.frame, &config, count, detector, &mut stars).ok()?;
            Some(star_field(self.frame, &stars, self.places))
        });
        brightest.as_ref()
    }

    /// The stars of the frame in blocks of `factor` × `factor` pixels, in pixels of the whole frame.
    fn detected(&self, factor: usize) -> Option<StarField> {
        let Self {
            frame, detector, ..
        } = self;
        let coarse_px = (frame.width / factor) * (frame.height / factor);
        let bytes = (coarse_px * size_of::<f32>()) as u64;
        let is_small = frame.width.min(frame.height) / factor < MIN_SIDE_PX;
        if is_small || coarse_px > MAX_PX || !detector.has_room(frame, bytes) {
            return None;
        }
        let coarse = frame.binned(factor);
        let config = DetectConfig {
            max_detections: MAX_DETECTIONS,
            ..DetectConfig::default()
        };
        let detections = detect(&coarse, &config, &mut detector.emptied()).ok()?;
        let field = star_field(&coarse, &detections, self.places);
        let scale = factor as f64;
        // The middle of the first block.
        let first_px = (scale - 1.0) / 2.0;
        let enlarged = |star: &ObservedStar| ObservedStar {
            position: PixelPoint::new(
                scale * star.position.x + first_px,
                scale * star.position.y + first_px,
            ),
            sigma_px: scale * star.sigma_px,
            ..*star
        };
        Some(StarField {
            width_px: frame.width as f64,
            height_px: frame.height as f64,
            spot_sigma_px: field.spot_sigma_px.map(|sigma_px| scale * sigma_px),
            stars: field.stars.iter().map(enlarged).collect(),
            ..field
        })
    }
}

impl OtherFields for OtherStars<'_> {
    fn few_brightest(&self) -> Option<&StarField> {
        self.brightest(0)
    }

    fn many_brightest(&self) -> Option<&StarField> {
        self.brightest(1)
    }

    fn resolutions(&self) -> usize {
        FACTORS.len()
    }

    fn at_resolution(&self, number: usize) -> Option<&StarField> {
        if self.detector.is_interrupted() {
            return None;
        }
        let coarse = self.coarse[number].get_or_init(|| self.detected(FACTORS[number]));
        coarse.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_of_coarser_frames_are_where_they_are_in_the_frame() {
        let stars = [[60.3, 210.7], [151.0, 80.0], [250.5, 250.25]];
        let light = |x: usize, y: usize| {
            let noise = ((x * 7919 + y * 104_729) % 101) as f64 * 0.1;
            let of_star = |[sx, sy]: [f64; 2]| {
                let distance = (x as f64 - sx).hypot(y as f64 - sy);
                3000.0 * (-distance * distance / 8.0).exp()
            };
            (noise + stars.into_iter().map(of_star).sum::<f64>()) as f32
        };
        let pixels = (0..300 * 320).map(|i| light(i % 320, i / 320)).collect();
        let frame = Frame::new(320, 300, pixels).unwrap();
        let detector = detect::Workspace::new();
        let other_fields = OtherStars::new(&frame, &detector, StarPlaces::default());
        for number in 0..FACTORS.len() {
            let field = other_fields.at_resolution(number).unwrap();
            assert_eq!((field.width_px, field.height_px), (320.0, 300.0));
            for [x, y] in stars {
                let place = PixelPoint::new(x, y);
                let off = |star: &ObservedStar| star.position.distance_to(&place);
                assert!(field.stars[..3].iter().any(|star| off(star) < 0.3));
            }
        }
        let small = Frame::new(100, 400, vec![0.0; 40_000]).unwrap();
        assert!(
            OtherStars::new(&small, &detector, StarPlaces::default())
                .at_resolution(0)
                .is_none()
        );
    }
}
