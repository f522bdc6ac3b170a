//! What a picture shows in which no stars were identified: the Moon, star trails, a drawing, clouds, and so on.
//!
//! Each look has one criterion, of which its file says why it holds. The order goes from what nothing else looks
//! like to what is left: writing, seams, day, aurora, trails, discs, strokes, black, clouds, few stars. Where none
//! holds, nothing is said: a wrong cause is worse than none.

mod arcs;
mod cells;
mod defocus;
mod disc;
mod light;
mod seams;
mod shapes;
mod sky_light;
mod strokes;
mod words;

use super::cause::Diagnosis;
use crate::detect::Detections;
use crate::frame::Frame;
use cells::Cells;
use light::Light;
use std::cell::OnceCell;

/// Fewer stars than this are too few to be sure which they are.
const FEW_STARS: usize = 8;

/// A picture in which no stars were identified.
pub(crate) struct Unexplained<'a> {
    /// The frame and its detections.
    pub frame: &'a Frame<'a>,
    pub detections: &'a Detections,
    /// Reads red and blue of a picture that has all colors in each pixel.
    pub colors: &'a dyn Fn() -> Option<[Frame<'static>; 2]>,
}

/// Bytes that a look at a frame of so many pixels takes.
pub(crate) fn bytes(pixels: usize) -> u64 {
    Light::bytes(pixels)
}

impl Unexplained<'_> {
    /// What the picture shows. Where a cause is known, it stays unless the picture clearly shows another.
    pub fn look(&self, known: Option<&Diagnosis>) -> Option<Diagnosis> {
        let view = View::new(self);
        match known {
            None => view.clear().or_else(|| view.likely()),
            Some(Diagnosis::Saturated { .. }) => view
                .written()
                .or_else(|| view.aurora())
                .or_else(|| view.drawn()),
            Some(Diagnosis::Trails { .. }) => view
                .written()
                .or_else(|| view.aurora())
                .or_else(|| arcs::find(&view.light)),
            Some(
                Diagnosis::DoubleExposure(_)
                | Diagnosis::Negative { .. }
                | Diagnosis::TooNarrow { .. },
            ) => view.clear(),
            Some(_) => None,
        }
    }
}

/// The picture, reduced.
struct View<'a> {
    case: &'a Unexplained<'a>,
    light: Light,
    cells: Cells,
    colors: OnceCell<Option<Vec<[f32; 3]>>>,
}

impl<'a> View<'a> {
    fn new(case: &'a Unexplained) -> Self {
        Self {
            case,
            light: Light::of(case.frame),
            cells: Cells::of(case.frame),
            colors: OnceCell::new(),
        }
    }

    /// The colors of the cells, where the picture has some.
    fn colors(&self) -> Option<&[[f32; 3]]> {
        let read = || (self.case.colors)().map(|frames| cells::colors(&self.cells, &frames));
        self.colors.get_or_init(read).as_deref()
    }

    /// What nothing but its cause looks like.
    fn clear(&self) -> Option<Diagnosis> {
        self.written()
            .or_else(|| self.mosaic())
            .or_else(|| self.day())
            // Its rays are long and thin, too.
            .or_else(|| self.aurora())
            .or_else(|| arcs::find(&self.light))
            .or_else(|| self.out_of_focus())
            .or_else(|| self.disc())
            .or_else(|| self.drawn())
    }

    /// What is likely where the stars were not identified.
    fn likely(&self) -> Option<Diagnosis> {
        self.black()
            .or_else(|| self.clouds())
            .or_else(|| self.few_stars())
    }

    /// Text, or a sky with labels.
    fn written(&self) -> Option<Diagnosis> {
        /// Fewest words and letters.
        const MIN_WORDS: usize = 6;
        const MIN_LETTERS: usize = 30;
        /// Letters of a page with noise.
        const MANY_LETTERS: usize = 100;
        /// Share of equal neighbors from which a picture has no noise.
        const FLAT: f64 = 0.4;
        let found = words::read(&self.light);
        let is_flat = self.light.flat_share > FLAT;
        let is_text = 2 * found.in_lines > found.words && found.letters > found.others;
        if found.words < MIN_WORDS || found.letters < MIN_LETTERS {
            None
        } else if is_text && (is_flat || found.letters > MANY_LETTERS) {
            Some(Diagnosis::Drawing)
        } else {
            (is_flat && found.is_spread).then_some(Diagnosis::Labels { words: found.words })
        }
    }

    fn drawn(&self) -> Option<Diagnosis> {
        strokes::are_drawn(&self.light).then_some(Diagnosis::Drawing)
    }

    fn mosaic(&self) -> Option<Diagnosis> {
        seams::parts(&self.light).map(|parts| Diagnosis::Mosaic { parts })
    }

    fn day(&self) -> Option<Diagnosis> {
        let is_day =
            |colors| sky_light::is_day(&self.cells, colors, &self.light, self.case.detections);
        self.colors()
            .is_some_and(is_day)
            .then_some(Diagnosis::Daylight)
    }

    fn out_of_focus(&self) -> Option<Diagnosis> {
        let disc_px = defocus::disc_px(&self.light)?;
        Some(Diagnosis::OutOfFocus { disc_px })
    }

    fn disc(&self) -> Option<Diagnosis> {
        let found = disc::find(&self.light)?;
        Some(Diagnosis::BrightDisc {
            middle_px: found.middle_px,
            diameter_px: found.diameter_px,
        })
    }

    fn aurora(&self) -> Option<Diagnosis> {
        let is_aurora = |colors| sky_light::is_aurora(colors, &self.light);
        self.colors()
            .is_some_and(is_aurora)
            .then_some(Diagnosis::Aurora)
    }

    fn black(&self) -> Option<Diagnosis> {
        let detections = self.case.detections;
        sky_light::is_black(&self.cells, &self.light, detections).then(|| {
            let hot = detections
                .sources
                .iter()
                .filter(|source| source.flags.hot_pixel);
            Diagnosis::Black {
                hot_pixels: hot.count(),
            }
        })
    }

    fn clouds(&self) -> Option<Diagnosis> {
        let variation = sky_light::patchiness(&self.cells, &self.light, self.case.detections)?;
        Some(Diagnosis::Clouds { variation })
    }

    fn few_stars(&self) -> Option<Diagnosis> {
        let sources = &self.case.detections.sources;
        let stars = sources
            .iter()
            .filter(|source| source.flags.is_star_like())
            .count();
        // None at all is a failure of its own, which says what detection found.
        (4..FEW_STARS)
            .contains(&stars)
            .then_some(Diagnosis::FewStars { stars })
    }
}
