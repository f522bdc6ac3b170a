//! The light of a trail along it.

use super::shape::TrailShape;
use crate::detect::fit::FrameMaps;

/// Light in steps of one pixel along a direction through a point, summed across.
#[derive(Debug, Clone, Default)]
pub(super) struct TrailProfile {
    /// Light of each step, in ADU.
    pub light: Vec<f64>,
    /// Inverse variance of each step, in ADU⁻²; 0 where nothing is known.
    pub weight: Vec<f64>,
    /// Sum over the pixels of light × distance across, for each step.
    pub across: Vec<f64>,
    /// The step that the point is in the middle of.
    pub middle: usize,
}

/// A point and a direction, and how far from the point pixels count.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strip {
    pub x: f64,
    pub y: f64,
    pub shape: TrailShape,
    pub reach_px: f64,
}

impl Strip {
    /// Distances along and across of a point.
    pub fn place(&self, x: f64, y: f64) -> [f64; 2] {
        let ([cos, sin], dx, dy) = (self.shape.direction, x - self.x, y - self.y);
        [dx * cos + dy * sin, dy * cos - dx * sin]
    }

    /// Moves the point along and across.
    pub fn shift(&mut self, along_px: f64, across_px: f64) {
        let [cos, sin] = self.shape.direction;
        self.x += along_px * cos - across_px * sin;
        self.y += along_px * sin + across_px * cos;
    }

    /// The columns of the strip in row `y`, of `width` columns.
    fn columns(&self, y: usize, width: usize) -> std::ops::Range<usize> {
        let ([cos, sin], dy) = (self.shape.direction, y as f64 - self.y);
        let along = interval(cos, dy * sin, self.reach_px);
        let across = interval(-sin, dy * cos, self.shape.half_breadth_px);
        let first = self.x + along[0].max(across[0]);
        let last = self.x + along[1].min(across[1]);
        let first = first.ceil().max(0.0) as usize;
        // Beyond the first column or before the last, a negative number is none.
        let end = (last.floor() + 1.0).max(0.0) as usize;
        first..end.min(width)
    }
}

/// The x for which |slope · x + offset| is at most `limit`.
fn interval(slope: f64, offset: f64, limit: f64) -> [f64; 2] {
    if slope.abs() < 1e-9 {
        let is_inside = offset.abs() <= limit;
        return if is_inside {
            [f64::NEG_INFINITY, f64::INFINITY]
        } else {
            [f64::INFINITY, f64::NEG_INFINITY]
        };
    }
    let ends = [(-limit - offset) / slope, (limit - offset) / slope];
    [ends[0].min(ends[1]), ends[0].max(ends[1])]
}

impl TrailProfile {
    /// Sums the pixels of a strip.
    pub fn measure(&mut self, maps: &FrameMaps<'_>, strip: &Strip) {
        let view = &maps.view;
        self.middle = strip.reach_px.ceil() as usize;
        let steps = 2 * self.middle + 1;
        for values in [&mut self.light, &mut self.weight, &mut self.across] {
            values.clear();
            values.resize(steps, 0.0);
        }
        let (level, sigma) = maps.background.at(strip.x as f32, strip.y as f32);
        let variance = (f64::from(sigma) * maps.correlation_at(strip.x, strip.y)).powi(2);
        // Without noise only the unevenness of the light counts.
        let variance = if variance > 0.0 { variance } else { 1.0 };
        let rows = strip.reach_px + strip.shape.half_breadth_px;
        let first = (strip.y - rows).max(0.0) as usize;
        let end = ((strip.y + rows).max(0.0) as usize + 1).min(view.height);
        for y in first..end {
            for x in strip.columns(y, view.width) {
                let light = f64::from(view.at(x, y) - level);
                if light.is_nan() {
                    continue;
                }
                let [along, across] = strip.place(x as f64, y as f64);
                let place = (along + self.middle as f64).max(0.0);
                let step = place as usize;
                // Steps share a pixel that is between them: else they would have unequal numbers.
                for (step, share) in [(step, 1.0 - place.fract()), (step + 1, place.fract())] {
                    if step < steps {
                        self.light[step] += share * light;
                        self.across[step] += share * light * across;
                        self.weight[step] += share;
                    }
                }
            }
        }
        // Of as many pixels as a step has on average.
        let average = 2.0 * strip.shape.half_breadth_px;
        let values = self.light.iter_mut().zip(&mut self.across);
        for ((light, across), pixels) in values.zip(&mut self.weight) {
            if *pixels > 0.0 {
                let scale = average / *pixels;
                *light *= scale;
                *across *= scale;
                *pixels = 1.0 / (variance * average * scale);
            }
        }
    }

    /// Takes from the profile what is known between two distances along it.
    pub fn forget(&mut self, from: f64, to: f64) {
        let step = |at: f64| (at + self.middle as f64).round().max(0.0) as usize;
        let end = (step(to) + 1).min(self.weight.len());
        for weight in self.weight.get_mut(step(from)..end).into_iter().flatten() {
            *weight = 0.0;
        }
    }

    /// Slope of the light within `reach_px` of the middle: distance across per distance along.
    pub fn slope(&self, reach_px: f64) -> f64 {
        let reach = reach_px.round() as usize;
        let first = self.middle.saturating_sub(reach);
        let end = (self.middle + reach + 1).min(self.light.len());
        let sums = (first..end).fold([0.0; 2], |[moment, square], step| {
            let along = step as f64 - self.middle as f64;
            [
                moment + along * self.across[step],
                square + along * along * self.light[step],
            ]
        });
        sums[0] / sums[1]
    }
}
