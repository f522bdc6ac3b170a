//! Tone curves: the gray level that light gives.

/// The kinds of curves that cameras and programs draw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum CurveKind {
    /// A level is proportional to light.
    Linear,
    /// A power of light, as gamma.
    Power,
    /// That of sRGB (IEC 61966-2-1), as in most JPEG files.
    Srgb,
    /// The midtones transfer function of programs that stretch pictures (XISF specification 1.0, § 11.5.7).
    Midtones,
    /// The inverse hyperbolic sine of light (Lupton et al. 2004, PASP 116, 133).
    Asinh,
}

impl CurveKind {
    /// All of them.
    pub(super) const ALL: [Self; 5] = [
        Self::Linear,
        Self::Power,
        Self::Srgb,
        Self::Midtones,
        Self::Asinh,
    ];

    /// Its code in reports.
    pub const fn code(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Power => "power",
            Self::Srgb => "srgb",
            Self::Midtones => "midtones",
            Self::Asinh => "asinh",
        }
    }

    /// How probable it is before stars tell.
    const fn prior(self) -> f64 {
        match self {
            Self::Power => 0.4,
            Self::Linear | Self::Srgb => 0.1,
            Self::Midtones | Self::Asinh => 0.2,
        }
    }

    /// Values of the number that tells curves of this kind apart.
    fn shapes(self) -> Vec<f64> {
        /// Powers of levels that are light: steps of a tenth.
        const POWERS: [usize; 2] = [11, 32];
        /// Lights at which a curve bends, over that of white: this many to a decade.
        const TO_A_DECADE: f64 = 6.0;
        const DECADES: [f64; 2] = [-3.0, 0.5];
        match self {
            Self::Linear | Self::Srgb => vec![1.0],
            Self::Power => (POWERS[0]..=POWERS[1])
                .map(|tenths| tenths as f64 / 10.0)
                .collect(),
            Self::Midtones | Self::Asinh => (0..=((DECADES[1] - DECADES[0]) * TO_A_DECADE) as i32)
                .map(|step| libm::pow(10.0, DECADES[0] + f64::from(step) / TO_A_DECADE))
                .collect(),
        }
    }
}

/// A tone curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ToneCurve {
    /// Its kind.
    pub kind: CurveKind,
    /// The power of a level that is light, or the light at which the curve bends, over that of white.
    shape: f64,
    /// The level at which the curve starts, and that of white, in ADU.
    levels_adu: [f64; 2],
}

impl ToneCurve {
    /// Levels that are light.
    pub(super) const LINEAR: Self = Self {
        kind: CurveKind::Linear,
        shape: 1.0,
        levels_adu: [0.0, 1.0],
    };

    /// The curves that a picture may have whose white is at a level, each with its probability before stars tell.
    /// All start at 0; powers may start at the level without light, too.
    pub(super) fn all(white_adu: f64, dark_adu: Option<f64>) -> Vec<(Self, f64)> {
        /// How probable it is that a power starts there.
        const FROM_DARK: f64 = 0.25;
        let of_kind = |kind: CurveKind| {
            let from_dark = dark_adu.filter(|_| kind == CurveKind::Power);
            let share = from_dark.map_or(0.0, |_| FROM_DARK);
            let shapes = kind.shapes();
            let prior = kind.prior() / shapes.len() as f64;
            let curve = move |shape: f64, start_adu: f64| Self {
                kind,
                shape,
                levels_adu: [start_adu, white_adu],
            };
            shapes.into_iter().flat_map(move |shape| {
                let lifted = from_dark.map(|dark_adu| (curve(shape, dark_adu), share * prior));
                [(curve(shape, 0.0), (1.0 - share) * prior)]
                    .into_iter()
                    .chain(lifted)
            })
        };
        CurveKind::ALL.into_iter().flat_map(of_kind).collect()
    }

    /// Light of a level, over that of white.
    pub(super) fn light(&self, level_adu: f64) -> f64 {
        let part = self.part(level_adu);
        let shape = self.shape;
        match self.kind {
            CurveKind::Linear => part,
            CurveKind::Power => libm::pow(part.abs(), shape).copysign(part),
            CurveKind::Srgb if part <= SRGB_TOE => part / SRGB_TOE_SLOPE,
            CurveKind::Srgb => libm::pow((part + 0.055) / 1.055, 2.4),
            CurveKind::Midtones => shape * part / (1.0 + shape - part),
            CurveKind::Asinh => shape * libm::sinh(part * libm::asinh(1.0 / shape)),
        }
    }

    /// By how much light grows with a level, over that of white, per ADU.
    pub(super) fn light_per_adu(&self, level_adu: f64) -> f64 {
        let part = self.part(level_adu);
        let shape = self.shape;
        let per_part = match self.kind {
            CurveKind::Linear => 1.0,
            CurveKind::Power => shape * libm::pow(part.abs(), shape - 1.0),
            CurveKind::Srgb if part <= SRGB_TOE => 1.0 / SRGB_TOE_SLOPE,
            CurveKind::Srgb => 2.4 / 1.055 * libm::pow((part + 0.055) / 1.055, 1.4),
            CurveKind::Midtones => shape * (1.0 + shape) / (1.0 + shape - part).powi(2),
            CurveKind::Asinh => {
                let scale = libm::asinh(1.0 / shape);
                shape * scale * libm::cosh(part * scale)
            }
        };
        per_part / (self.levels_adu[1] - self.levels_adu[0])
    }

    /// A level over that of white.
    fn part(&self, level_adu: f64) -> f64 {
        let [start_adu, white_adu] = self.levels_adu;
        (level_adu - start_adu) / (white_adu - start_adu)
    }
}

/// Level below which the curve of sRGB is a line, and its slope there.
const SRGB_TOE: f64 = 0.04045;
const SRGB_TOE_SLOPE: f64 = 12.92;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_grows_with_levels_from_none_to_that_of_white() {
        let curves = ToneCurve::all(255.0, None);
        let total: f64 = curves.iter().map(|(_, prior)| prior).sum();
        assert!((total - 1.0).abs() < 1e-12, "{total}");
        for (curve, _) in curves {
            assert!(curve.light(0.0).abs() < 1e-12, "{curve:?}");
            assert!((curve.light(255.0) - 1.0).abs() < 1e-9, "{curve:?}");
            for level_adu in [3.0, 40.0, 180.0] {
                let step_adu = 1e-4;
                let by_steps = (curve.light(level_adu + step_adu)
                    - curve.light(level_adu - step_adu))
                    / (2.0 * step_adu);
                let ratio = curve.light_per_adu(level_adu) / by_steps;
                assert!(by_steps > 0.0 && (ratio - 1.0).abs() < 1e-5, "{curve:?}");
            }
        }
    }

    #[test]
    fn the_curve_of_srgb_is_that_of_its_standard() {
        let (curve, _) = ToneCurve::all(255.0, None)
            .into_iter()
            .find(|(curve, _)| curve.kind == CurveKind::Srgb)
            .unwrap();
        for (level_adu, light) in [(5.0, 0.001_518), (50.0, 0.031_896), (188.0, 0.502_886)] {
            let found = curve.light(level_adu);
            assert!((found / light - 1.0).abs() < 1e-3, "{found} {light}");
        }
    }
}
