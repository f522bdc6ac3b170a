//! Colors of lines, and of numbers.

/// Red, green and blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rgb(pub [u8; 3]);

/// Colors of lines that everybody can tell apart.
///
/// # Reference
/// Okabe & Ito 2008, Color Universal Design.
impl Rgb {
    /// The first line.
    pub const BLUE: Self = Self([0, 114, 178]);
    /// The second.
    pub const ORANGE: Self = Self([213, 94, 0]);
    /// The third.
    pub const GREEN: Self = Self([0, 158, 115]);
    /// The fourth.
    pub const PURPLE: Self = Self([204, 121, 167]);
    /// What is expected.
    pub const GREY: Self = Self([130, 130, 130]);
    /// Letters.
    pub const BLACK: Self = Self([0; 3]);
    /// What figures are drawn on.
    pub const PAPER: Self = Self([255; 3]);

    /// On the way to another color; `part` from 0 to 1.
    pub fn mixed(self, to: Self, part: f64) -> Self {
        let channel = |i: usize| {
            let [from, to] = [self.0[i], to.0[i]].map(f64::from);
            (from + part.clamp(0.0, 1.0) * (to - from)).round() as u8
        };
        Self([channel(0), channel(1), channel(2)])
    }
}

/// Colors of numbers, shown as a bar beside the panel.
#[derive(Debug, Clone)]
pub struct ColorScale {
    /// The quantity and its unit.
    pub title: String,
    /// The numbers of the first and the last color.
    pub ends: [f64; 2],
    /// Whether equal ratios have equal distances.
    pub is_log: bool,
    /// The color of a place between the ends, from 0 to 1.
    pub palette: fn(f64) -> Rgb,
}

impl ColorScale {
    /// The color of a number; beyond the ends, the color of the end.
    pub fn color(&self, value: f64) -> Rgb {
        let [first, last] = self.ends;
        let part = if self.is_log {
            libm::log(value / first) / libm::log(last / first)
        } else {
            (value - first) / (last - first)
        };
        (self.palette)(if part.is_finite() { part } else { 0.0 })
    }
}

/// For numbers of one sign, from dark violet to yellow: lightness grows evenly, also for the color-blind.
///
/// # Reference
/// Viridis: van der Walt & Smith 2015, matplotlib 1.5.
pub fn sequential(part: f64) -> Rgb {
    between(
        &[
            [68, 1, 84],
            [71, 44, 122],
            [59, 81, 139],
            [44, 113, 142],
            [33, 144, 141],
            [39, 173, 129],
            [92, 200, 99],
            [170, 220, 50],
            [253, 231, 37],
        ],
        part,
    )
}

/// For numbers of both signs: blue below, white in the middle, red above.
///
/// # Reference
/// Brewer 2003, Transactions in GIS 7, 483 (RdBu).
pub fn diverging(part: f64) -> Rgb {
    between(
        &[
            [33, 102, 172],
            [103, 169, 207],
            [209, 229, 240],
            [255, 255, 255],
            [253, 219, 199],
            [239, 138, 98],
            [178, 24, 43],
        ],
        part,
    )
}

/// From black to white.
pub fn grey(part: f64) -> Rgb {
    between(&[[0; 3], [255; 3]], part)
}

/// A color between evenly spaced ones.
fn between(stops: &[[u8; 3]], part: f64) -> Rgb {
    let place = part.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
    let below = (place as usize).min(stops.len() - 2);
    Rgb(stops[below]).mixed(Rgb(stops[below + 1]), place - below as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_have_their_numbers() {
        let mut scale = ColorScale {
            title: String::new(),
            ends: [-2.0, 2.0],
            is_log: false,
            palette: diverging,
        };
        assert_eq!(scale.color(0.0), Rgb::PAPER);
        assert_eq!(scale.color(9.0), Rgb([178, 24, 43]));
        // Bright skies have low magnitudes.
        (scale.ends, scale.palette) = ([22.0, 18.0], sequential);
        assert_eq!(scale.color(18.0), Rgb([253, 231, 37]));
        (scale.ends, scale.is_log) = ([0.01, 1.0], true);
        assert_eq!(scale.color(0.1), sequential(0.5));
    }
}
