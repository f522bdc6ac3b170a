//! How the samples of a table of the PSF are laid out, and which of them each pixel of a window takes.

use super::gaussian::{GROUP_PX, MAX_WINDOW_PX, PIXEL_VARIANCE_PX2};
use multiversion::multiversion;

/// Samples that the spline at a point takes along an axis.
pub(super) const TAPS: usize = 4;

/// How a table is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct TableLayout {
    /// Samples in a pixel along each axis.
    pub(super) per_px: usize,
    /// Pixels along each side, from one more than the reach of the light on.
    pub(super) side: usize,
    /// Numbers in a row, in whole groups: the side, and zeros that follow it in as many pixels as a
    /// group may reach beyond it.
    pub(super) stride: usize,
}

impl TableLayout {
    /// Most samples in a pixel.
    pub const MAX_PER_PX: usize = 6;

    /// For components of this size that reach this far from the centre, in pixels.
    pub fn new(sigma_px: f64, reach_px: f64) -> Self {
        /// Largest distance of the samples over the width of a component, pixel included: the error of
        /// the interpolation is then below two thousandths of the component's peak.
        const MAX_STEP: f64 = 0.5;
        let width_px = (sigma_px.powi(2) + PIXEL_VARIANCE_PX2).sqrt();
        let per_px = (1.0 / (MAX_STEP * width_px)).ceil() as usize;
        let radius = (reach_px.ceil() as usize).clamp(1, MAX_WINDOW_PX);
        let side = 2 * radius + 3;
        Self {
            per_px: per_px.clamp(2, Self::MAX_PER_PX),
            side,
            stride: (side + GROUP_PX - 1).next_multiple_of(GROUP_PX),
        }
    }

    /// Where in a table the centre of the spot is, in pixels.
    pub fn centre_px(&self) -> f64 {
        0.5 * (self.side - 1) as f64
    }

    /// Numbers in a table, which begins and ends with a group of zeros.
    pub fn len(&self) -> usize {
        self.per_px * self.per_px * self.side * self.stride + 2 * GROUP_PX
    }

    /// Samples along each axis.
    pub fn samples(&self) -> usize {
        self.per_px * self.side
    }

    /// Where a row of the samples of a phase begins: those with the same place in their pixels.
    pub fn row(&self, [across, down]: [usize; 2], row: usize) -> usize {
        GROUP_PX + ((down * self.per_px + across) * self.side + row) * self.stride
    }
}

/// The samples that a pixel of a window takes along an axis.
#[derive(Debug, Clone, Copy)]
struct Taps {
    /// Weights of the samples for the light, and for its first and second derivative with respect
    /// to the pixel's place.
    weights: [[f32; TAPS]; 3],
    /// The same of each sample, as a vector.
    by_tap: [TapWeights; TAPS],
    /// Where they are in the table, along this axis.
    places: [isize; TAPS],
    /// Pixels of the table that hold the first and the last of them.
    pixels: [isize; 2],
}

impl Taps {
    /// For a pixel at a distance from the centre of a spot that is `scale` times that of the table;
    /// `steps` are those of [`AxisTaps::fill`].
    #[inline(always)]
    fn compute(layout: TableLayout, steps: [usize; 2], distance_px: f64, scale: f64) -> Self {
        // Farther away there is no light.
        let far_px = (layout.side + MAX_WINDOW_PX) as f64;
        let per_px = layout.per_px as f64;
        let in_table_px = (distance_px / scale).clamp(-far_px, far_px);
        let sample = (layout.centre_px() + in_table_px) * per_px;
        let base = sample.floor();
        let f = sample - base;
        let g = 1.0 - f;
        let near = |f: f64| ((3.0 * f - 6.0) * f * f + 4.0) / 6.0;
        let value = [g * g * g / 6.0, near(f), near(g), f * f * f / 6.0];
        let slope = [
            -0.5 * g * g,
            (1.5 * f - 2.0) * f,
            -(1.5 * g - 2.0) * g,
            0.5 * f * f,
        ];
        let curvature = [g, 3.0 * f - 2.0, 3.0 * g - 2.0, f];
        let by_place = per_px / scale;
        let weights = [
            (value, 1.0),
            (slope, by_place),
            (curvature, by_place * by_place),
        ];
        let [of_phase, of_pixel] = steps.map(|step| step as isize);
        let per_px = layout.per_px as isize;
        let first = base as isize - 1;
        let mut pixel = first.div_euclid(per_px);
        let mut phase = first - pixel * per_px;
        let mut pixels = [pixel; 2];
        let places = std::array::from_fn(|_| {
            let place = phase * of_phase + pixel * of_pixel;
            pixels[1] = pixel;
            phase += 1;
            if phase == per_px {
                (phase, pixel) = (0, pixel + 1);
            }
            place
        });
        let weights = weights.map(|(row, unit)| row.map(|weight| (weight * unit / scale) as f32));
        let [value, slope, curvature] = weights;
        Self {
            weights,
            by_tap: std::array::from_fn(|tap| [value[tap], slope[tap], curvature[tap], 0.0]),
            places,
            pixels,
        }
    }
}

/// The samples that all pixels of a window take along an axis.
#[derive(Debug, Clone, Default)]
pub(super) struct AxisTaps {
    /// Those of each pixel; those of the first where the others take the next pixels of the table.
    pixels: Vec<Taps>,
    /// How far the next pixel is in the table.
    step: isize,
    /// First pixel with light, and the one after the last.
    pub(super) lit: [usize; 2],
    /// Pixels of the table that hold the samples of these: the first, and the one after the last.
    pub(super) samples: [usize; 2],
}

impl AxisTaps {
    /// For a spot at `at_px` in a window of `side` pixels; `steps` are how far the next phase and the
    /// next pixel are in the table.
    #[inline(always)]
    fn fill(
        &mut self,
        layout: TableLayout,
        steps: [usize; 2],
        at_px: f64,
        scale: f64,
        side: usize,
    ) {
        let different = if scale == 1.0 { 1 } else { side };
        self.pixels.clear();
        // A loop, as what `extend` calls is not compiled for the processor.
        for pixel in 0..different {
            let distance_px = pixel as f64 - at_px;
            self.pixels
                .push(Taps::compute(layout, steps, distance_px, scale));
        }
        self.step = steps[1] as isize;
        // The samples of the others are not all in the table.
        let before = |bound: isize, tap: usize| {
            if scale == 1.0 {
                let pixels = bound - self.pixels[0].pixels[tap];
                pixels.clamp(0, side as isize) as usize
            } else {
                self.pixels.partition_point(|taps| taps.pixels[tap] < bound)
            }
        };
        let end = before(layout.side as isize, 1);
        self.lit = [before(0, 0).min(end), end];
        let last = self.pixels.get(end.saturating_sub(1));
        let first = self.pixels.get(self.lit[0]);
        self.samples = match (first, last) {
            (Some(first), Some(last)) => {
                let bound = |pixel: isize| pixel.clamp(0, layout.stride as isize) as usize;
                let first = bound(first.pixels[0]);
                [first, bound(last.pixels[1] + 1).max(first)]
            }
            _ => [0; 2],
        };
    }

    /// The weights of each sample of a pixel that has its own, and where these are in the table.
    #[inline(always)]
    pub fn by_tap(&self, pixel: usize) -> (&[TapWeights; TAPS], [isize; TAPS]) {
        let taps = &self.pixels[pixel];
        (&taps.by_tap, taps.places)
    }

    /// The weights of a pixel, and where its samples are in the table.
    #[inline(always)]
    pub fn at(&self, pixel: usize) -> PixelTaps<'_> {
        match self.pixels.get(pixel) {
            Some(taps) => (&taps.weights, taps.places),
            None => {
                let Taps {
                    weights, places, ..
                } = &self.pixels[0];
                let farther = pixel as isize * self.step;
                (weights, places.map(|place| place + farther))
            }
        }
    }
}

/// The weights of a sample for the light and its first and second derivative; the last number fills a vector.
pub(super) type TapWeights = [f32; 4];
/// The weights of the samples of a pixel along an axis, and where they are.
pub(super) type PixelTaps<'a> = (&'a [[f32; TAPS]; 3], [isize; TAPS]);

/// [`AxisTaps::fill`] along both axes.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(super) fn fill_axes(
    axes: &mut [AxisTaps; 2],
    layout: TableLayout,
    steps: [[usize; 2]; 2],
    place_px: [f64; 2],
    scale: f64,
    sides: [usize; 2],
) {
    for (axis, taps) in axes.iter_mut().enumerate() {
        taps.fill(layout, steps[axis], place_px[axis], scale, sides[axis]);
    }
}
