//! A local maximum of the filtered frame above the threshold: a candidate for a star.

use crate::detect::pixels::View;

/// A local maximum of the filtered frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Peak {
    /// Column.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// Vertex of the parabolas through the filtered values, from the pixel's centre, in pixels.
    pub offset_px: [f32; 2],
    /// The filtered value, and those to the left, to the right, above and below; `None` at the
    /// border.
    pub values: Option<(f32, [f32; 4])>,
    /// Filtered value over its local noise.
    pub snr: f32,
    /// Height above the highest saddle towards a higher maximum of its region, in units of the
    /// local noise; `snr` for the highest.
    pub prominence: f32,
    /// Index of its region.
    pub region: usize,
    /// Whether the spot's core reaches full scale.
    pub saturated: bool,
}

/// The vertices of the parabolas through a maximum and the values next to it along x and y, from
/// its centre, in pixels.
pub(super) fn parabola_vertex(value: f32, [left, right, above, below]: [f32; 4]) -> [f32; 2] {
    /// Half a pixel, less what could round to the next.
    const MAX_OFFSET_PX: f32 = 0.49;
    let vertex = |before: f32, after: f32| {
        let curvature = 2.0 * value - before - after;
        let offset = 0.5 * (after - before) / curvature;
        // The filter's sum over the largest floats is infinite.
        if curvature > 0.0 && !offset.is_nan() {
            offset.clamp(-MAX_OFFSET_PX, MAX_OFFSET_PX)
        } else {
            0.0
        }
    };
    [vertex(left, right), vertex(above, below)]
}

/// Whether a pixel within one pixel of (x, y) is saturated.
pub(super) fn is_saturated(frame: &View<'_>, x: usize, y: usize, saturation_adu: f32) -> bool {
    let mut rows = y.saturating_sub(1)..(y + 2).min(frame.height);
    rows.any(|row| {
        let mut columns = x.saturating_sub(1)..(x + 2).min(frame.width);
        columns.any(|column| frame.at(column, row) >= saturation_adu)
    })
}

/// Sorts by height in ascending order of this key, highest first; of equal heights, which are
/// positive, the lower `index` comes first.
pub(super) fn highest_first(snr: f32, index: usize) -> u64 {
    u64::from(!snr.to_bits()) << 32 | index as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vertex_is_within_the_pixel_whatever_is_beside_it() {
        assert_eq!(parabola_vertex(2.0, [1.0, 1.0, 0.0, 1.0]), [0.0, 1.0 / 6.0]);
        let values = [f32::NEG_INFINITY, f32::MIN, -1.0, 1.0];
        for before in values {
            for after in values {
                let [x, y] = parabola_vertex(1.0, [before, after, after, before]);
                assert!(x.abs() < 0.5 && y.abs() < 0.5, "{before} {after}: {x} {y}");
            }
        }
    }
}
