//! Brightness where gray levels are not proportional to light, or the level without light is not known.
//!
//! (stars, frame, [`SkyLevels`]) → [`Curved`]
//!
//! 1. By each tone curve that a picture may have (`curve`), the levels of stars and of the sky around them
//!    become light (`spot`).
//! 2. By the right curve the magnitudes of light are those of the catalogue, less extinction and vignetting, on
//!    a dark sky as on a bright one. How well they are is the curve's likelihood.
//! 3. The level without light is that of the corners of an all-sky lens or of a dark, else it is anything up to
//!    the darkest part of the frame (`black`).
//! 4. The brightness is the mean over the curves that fit, each with its own level without light; its error
//!    contains how much they differ.
//!
//! Caveats: what a curve does between the level without light and that of the darkest stars' sky is not seen,
//! but only what its kind does there. Programs that cut off the dark end of a picture make its sky too faint.

mod black;
mod curve;
mod spot;

pub use curve::CurveKind;

use super::brightness::{SkyLevels, SkyLight, ZenithSky};
use super::clear_sky::ClearSky;
use super::curve_evidence::CurveEvidence;
use super::dark_level::DarkLevel;
use super::picture::SkyPicture;
use super::stars::SkyStar;
use crate::base::statistics::{Estimate, even_part};
use crate::photometry::IdentifiedFrame;
use crate::predict::SkyBrightness;
use black::Black;
use curve::ToneCurve;
use spot::{LitSpot, Spot};

/// Curves that stand for all that fit.
const SAMPLES: usize = 48;
/// Largest error of a brightness that is worth stating, in magnitudes.
const LARGEST_SIGMA_MAG: f64 = 0.7;

/// So many stars are independent at most: no curve here is the picture's to the last digit, and what it lacks they
/// share.
const INDEPENDENT_STARS: f64 = 40.0;

/// How gray levels go with light.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ToneFit {
    /// The likeliest kind of curve.
    pub kind: CurveKind,
    /// Its probability.
    pub probability: f64,
    /// Relative growth of the sky's level over that of its light, both above those without light: 1 where levels are
    /// proportional to light.
    pub exponent: Estimate,
}

/// Brightness by the curves that fit.
pub(super) struct Curved {
    /// The curves; `None` where levels are proportional to light.
    pub tone: Option<ToneFit>,
    /// What stars tell of it.
    pub evidence: Option<CurveEvidence>,
    /// The level without light.
    pub dark: DarkLevel,
    /// The brightness of each cell.
    pub cells: Vec<Option<SkyLight>>,
    /// That of the zenith.
    pub zenith: Option<ZenithSky>,
}

impl Curved {
    /// That of levels that are proportional to light above a known one.
    pub(super) fn of_levels(levels: &SkyLevels, clear_sky: &ClearSky, dark: DarkLevel) -> Self {
        let cells = 0..levels.cells.len();
        Self {
            tone: None,
            evidence: None,
            dark,
            cells: cells.map(|cell| levels.light(cell, clear_sky)).collect(),
            zenith: levels.zenith(clear_sky),
        }
    }
}

/// A curve, and the sky by it.
struct FittedCurve {
    curve: ToneCurve,
    clear_sky: ClearSky,
    /// Logarithm of its likelihood, and of its probability, but for constants.
    ln_likelihood: f64,
    ln_weight: f64,
}

/// What the curves of a frame are fitted to.
pub(super) struct CurvedFrame<'a, 'p> {
    /// The frame.
    pub frame: &'a IdentifiedFrame<'a>,
    /// Its pixels.
    pub picture: &'a SkyPicture<'a, 'p>,
    /// Its stars.
    pub stars: &'a [SkyStar],
    /// The clear sky by levels.
    pub clear_sky: &'a ClearSky,
    /// The sky's levels.
    pub levels: &'a SkyLevels,
}

impl CurvedFrame<'_, '_> {
    /// The brightness of a frame whose levels are proportional to light. `None` where it tells too little.
    pub fn with_unknown_dark_level(&self) -> Option<Curved> {
        let linear = FittedCurve {
            curve: ToneCurve::LINEAR,
            clear_sky: *self.clear_sky,
            ln_likelihood: 0.0,
            ln_weight: 0.0,
        };
        let curved = self.by(&[linear], &self.black()?)?;
        Some(Curved {
            tone: None,
            ..curved
        })
    }

    /// The brightness of a frame whose levels may have any curve. `None` where it tells too little.
    pub fn with_unknown_curve(&self) -> Option<Curved> {
        let black = self.black()?;
        let fitted = self.fitted(&black);
        let ln_likelihood = |fitted: &Option<FittedCurve>| {
            fitted
                .as_ref()
                .map_or(f64::NEG_INFINITY, |fitted| fitted.ln_likelihood)
        };
        let evidence = CurveEvidence(fitted.iter().map(ln_likelihood).collect());
        let fitted: Vec<FittedCurve> = fitted.into_iter().flatten().collect();
        let curved = self.by(&fitted, &black)?;
        Some(Curved {
            evidence: Some(evidence),
            ..curved
        })
    }

    fn black(&self) -> Option<Black> {
        let picture = self.picture;
        Black::find(
            picture.frame,
            self.frame.detections,
            picture.dark,
            picture.is_flat,
        )
    }

    /// Each curve; `None` where stars do not fit to it.
    fn fitted(&self, black: &Black) -> Vec<Option<FittedCurve>> {
        let highest = self.picture.frame.range_adu()[1];
        let white_adu = f64::from(self.picture.frame.saturation_adu.unwrap_or(highest));
        let curves = ToneCurve::all(white_adu, black.level_adu());
        let mut spots = self.spots(white_adu);
        spots.retain(|spot| curves.iter().all(|(curve, _)| spot.by(curve).is_some()));
        let usual = self
            .picture
            .usual_curves
            .filter(|usual| usual.0.len() == curves.len());
        let independent = (INDEPENDENT_STARS / spots.len().max(1) as f64).min(1.0);
        let fitted = curves.iter().enumerate().map(|(index, (curve, prior))| {
            let lit: Vec<LitSpot> = spots.iter().filter_map(|spot| spot.by(curve)).collect();
            let stars: Vec<SkyStar> = lit.iter().map(|lit| lit.star).collect();
            let (clear_sky, ln_posterior) = ClearSky::of_light(&stars, self.picture.is_flat)?;
            // Magnitudes of light scatter more than those of levels by a curve that compresses light.
            let ln_response: f64 = lit.iter().map(|lit| lit.ln_response).sum();
            let ln_likelihood = (ln_posterior - ln_response) * independent;
            let ln_usual = usual.map_or(0.0, |usual| usual.0[index]);
            Some(FittedCurve {
                curve: *curve,
                clear_sky,
                ln_likelihood,
                ln_weight: libm::log(*prior) + ln_likelihood + ln_usual,
            })
        });
        fitted.collect()
    }

    /// The stars that are well enough measured to tell the curve. A choice by what they should be prefers none
    /// that noise makes brighter, or dimmer.
    fn spots(&self, white_adu: f64) -> Vec<Spot> {
        const WANTED: usize = 80;
        const MAX: usize = 160;
        /// Those with larger errors are seen where noise makes them brighter.
        const LARGEST_SIGMAS_MAG: [f64; 3] = [0.06, 0.1, 0.15];
        /// Brighter ones are whole only where noise makes them dimmer. Over white.
        const BRIGHTEST_PEAK: f64 = 0.8;
        let frame = self.frame;
        let reach_px = spot::reach_px(frame.detections);
        let spot = |star: &SkyStar| {
            star.measured?;
            let light_per_flux = libm::pow(10.0, 0.4 * star.brighter_mag)
                * frame.lens_transmission(&star.pixel)
                * frame.exposure_s.unwrap_or(1.0);
            let flux = libm::pow(10.0, -0.4 * self.clear_sky.instrumental_mag(star));
            let expected = (flux, 1.0 / light_per_flux);
            let spot = Spot::measure(self.picture.frame, star, (reach_px, white_adu), expected)?;
            let peak_adu = spot.peak_adu(frame.detections.spot_sigma_px);
            (peak_adu < BRIGHTEST_PEAK * white_adu).then_some(spot)
        };
        let mut chosen: Vec<Spot> = self.stars.iter().filter_map(spot).collect();
        let count = |largest_mag: f64| {
            let is_bright = |spot: &&Spot| spot.sigma_mag() < largest_mag;
            chosen.iter().filter(is_bright).count()
        };
        let [.., most_mag] = LARGEST_SIGMAS_MAG;
        let enough = LARGEST_SIGMAS_MAG.into_iter();
        let enough = enough.filter(|largest_mag| count(*largest_mag) >= WANTED);
        let largest_mag = enough.fold(most_mag, f64::min);
        chosen.retain(|spot| spot.sigma_mag() < largest_mag);
        // The brightest bend most.
        chosen.sort_by(|a, b| a.v_mag().total_cmp(&b.v_mag()));
        chosen.truncate(MAX);
        Spot::deviate(&mut chosen);
        Spot::add_light_beyond(&mut chosen);
        chosen
    }

    /// The mean brightness by `curves`.
    fn by(&self, curves: &[FittedCurve], black: &Black) -> Option<Curved> {
        let sky_adu = self.levels.median_adu()?;
        let chosen = sampled(curves);
        let mut cells: Vec<CurveMean> = Vec::new();
        let (mut zenith, mut exponent) = (CurveMean::default(), CurveMean::default());
        for (at, fitted) in chosen.iter().enumerate() {
            // Levels without light are even over all curves, and over each kind of them.
            let probability = even_part(at);
            let curve = &fitted.curve;
            let dark = black.light(curve, probability, sky_adu);
            let light = self
                .levels
                .in_units(|level_adu| curve.light(level_adu) - dark, &fitted.clear_sky);
            let (of_cells, of_zenith) = self.levels.brightness_of(&light, &fitted.clear_sky);
            cells.resize(of_cells.len(), CurveMean::default());
            for (mean, light) in cells.iter_mut().zip(&of_cells) {
                mean.add_light(light.as_ref());
            }
            zenith.add_light(of_zenith.as_ref());
            exponent.add(Estimate {
                value: exponent_of(curve, dark, sky_adu, black),
                sigma: 0.0,
            });
        }
        let light = |mean: &CurveMean| mean.light(chosen.len());
        let cells: Vec<Option<SkyLight>> = cells.iter().map(light).collect();
        let zenith = light(&zenith).map(ZenithSky::from_light);
        let is_known = zenith.is_some() || cells.iter().any(Option::is_some);
        is_known.then(|| Curved {
            tone: exponent.estimate(chosen.len()).map(|exponent| {
                let (kind, probability) = likeliest_kind(&chosen);
                ToneFit {
                    kind,
                    probability,
                    exponent,
                }
            }),
            evidence: None,
            dark: black.dark_level(),
            cells,
            zenith,
        })
    }
}

/// Relative growth of a level over that of light, both above those without light.
fn exponent_of(curve: &ToneCurve, dark: f64, sky_adu: f64, black: &Black) -> f64 {
    let over_adu = sky_adu - black.level_adu().unwrap_or(0.0);
    (curve.light(sky_adu) - dark) / (curve.light_per_adu(sky_adu) * over_adu)
}

/// Curves that stand for all, as many of each as it is probable.
fn sampled(curves: &[FittedCurve]) -> Vec<&FittedCurve> {
    let most = curves
        .iter()
        .map(|curve| curve.ln_weight)
        .fold(f64::MIN, f64::max);
    let weight = |curve: &FittedCurve| libm::exp(curve.ln_weight - most);
    let total: f64 = curves.iter().map(weight).sum();
    let mut chosen = Vec::with_capacity(SAMPLES);
    let mut up_to = 0.0;
    for curve in curves {
        up_to += weight(curve) / total;
        while (chosen.len() as f64 + 0.5) / (SAMPLES as f64) < up_to && chosen.len() < SAMPLES {
            chosen.push(curve);
        }
    }
    chosen
}

/// The kind that most of them have, and their share.
fn likeliest_kind(curves: &[&FittedCurve]) -> (CurveKind, f64) {
    let count = |kind| curves.iter().filter(|of| of.curve.kind == kind).count();
    let counts = CurveKind::ALL.map(|kind| (kind, count(kind)));
    let first = (CurveKind::Linear, 0);
    let more = |most: (CurveKind, usize), next: (CurveKind, usize)| match next.1 > most.1 {
        true => next,
        false => most,
    };
    let (kind, count) = counts.into_iter().fold(first, more);
    (kind, count as f64 / curves.len().max(1) as f64)
}

/// A mean over curves.
#[derive(Debug, Clone, Copy, Default)]
struct CurveMean {
    count: usize,
    sum: f64,
    /// Sums of squared values and of variances.
    squares: f64,
    variances: f64,
}

impl CurveMean {
    fn add(&mut self, estimate: Estimate) {
        self.count += 1;
        self.sum += estimate.value;
        self.squares += estimate.value.powi(2);
        self.variances += estimate.sigma.powi(2);
    }

    fn add_light(&mut self, light: Option<&SkyLight>) {
        if let Some(light) = light {
            self.add(light.mag_arcsec2);
        }
    }

    /// The mean, with the scatter in its error; `None` where some of `expected` values are missing.
    fn estimate(&self, expected: usize) -> Option<Estimate> {
        /// Share of curves by which there is light at least.
        const MIN_FRACTION: f64 = 0.9;
        if self.count == 0 || (self.count as f64) < MIN_FRACTION * expected as f64 {
            return None;
        }
        let count = self.count as f64;
        let value = self.sum / count;
        let scatter = (self.squares / count - value * value).max(0.0);
        Some(Estimate {
            value,
            sigma: (scatter + self.variances / count).sqrt(),
        })
    }

    /// The mean brightness, where curves and levels without light leave it open by little
    /// enough to be of use.
    fn light(&self, expected: usize) -> Option<SkyLight> {
        let mag_arcsec2 = self.estimate(expected)?;
        (mag_arcsec2.sigma < LARGEST_SIGMA_MAG).then(|| SkyLight {
            mag_arcsec2,
            bv_mag: None,
            luminance_cd_m2: SkyBrightness::MagArcsec2(mag_arcsec2.value).luminance_cd_m2(),
        })
    }
}
