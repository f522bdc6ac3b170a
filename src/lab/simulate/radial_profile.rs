//! Spots that are a function of the distance only, integrated over pixels: Moffat's and Airy's.

use crate::base::statistics::GAUSSIAN_FWHM;
use crate::camera::data_sheet::{Imperfections, SpotForm};
use std::f64::consts::PI;

/// Radius of these spots, in standard deviations of a Gaussian as wide: 0.06 % of the light of
/// Moffat's with an exponent of 2.5 lies beyond, and 2 % of Airy's.
pub(super) const PROFILE_SIGMAS: f64 = 25.0;

/// The density of the light of a star over the distance.
#[derive(Debug, Clone)]
pub(super) struct RadialProfile {
    /// Per square pixel, at equal steps of the distance from 0.
    densities: Vec<f64>,
    step_px: f64,
    /// Below this distance pixels are integrated with more points, in pixels.
    core_px: f64,
}

impl RadialProfile {
    /// The profile of the camera's spots as wide as a Gaussian of `sigma_px`; `None` for forms that
    /// need none.
    pub fn tabulate(made: &Imperfections, sigma_px: f64) -> Option<Self> {
        /// Steps of the table in a standard deviation: linear interpolation is right to 10⁻⁴.
        const STEPS: f64 = 64.0;
        let step_px = sigma_px / STEPS;
        let half_width_px = GAUSSIAN_FWHM / 2.0 * sigma_px;
        let density: Box<dyn Fn(f64) -> f64> = match made.spot_form {
            SpotForm::Gaussian | SpotForm::SampledGaussian | SpotForm::Disc | SpotForm::File => {
                return None;
            }
            SpotForm::Moffat => Box::new(moffat(half_width_px, made.moffat_beta)),
            SpotForm::Airy => Box::new(airy(half_width_px, made.obstruction)),
        };
        let steps = ((PROFILE_SIGMAS * sigma_px + 2.0) / step_px).ceil() as usize;
        let densities = (0..=steps + 1).map(|step| density(step as f64 * step_px));
        Some(Self {
            densities: densities.collect(),
            step_px,
            core_px: 4.0 * sigma_px + 1.0,
        })
    }

    fn density(&self, distance_px: f64) -> f64 {
        let at = distance_px / self.step_px;
        let step = at as usize;
        match self.densities.get(step..step + 2) {
            Some(&[from, to]) => from + (to - from) * (at - step as f64),
            _ => 0.0,
        }
    }

    /// Fraction of the light in a pixel at (x, y) from the star, by Gauss-Legendre quadrature.
    pub fn fraction(&self, x_px: f64, y_px: f64) -> f64 {
        /// Places on half of a pixel's side, and weights, of six points.
        const FINE: [(f64, f64); 3] = [
            (0.119_309_593_041_598_46, 0.233_956_967_286_345_52),
            (0.330_604_693_233_132_24, 0.180_380_786_524_069_3),
            (0.466_234_757_101_576, 0.085_662_246_189_585_18),
        ];
        /// The same of two points.
        const COARSE: [(f64, f64); 1] = [(0.288_675_134_594_812_9, 0.5)];
        let rule: &[(f64, f64)] = if libm::hypot(x_px, y_px) < self.core_px {
            &FINE
        } else {
            &COARSE
        };
        let points = || {
            rule.iter()
                .flat_map(|&(at, weight)| [(at, weight), (-at, weight)])
        };
        let row = |(y, of_y): (f64, f64)| {
            let point = move |(x, of_x): (f64, f64)| {
                of_x * of_y * self.density(libm::hypot(x_px + x, y_px + y))
            };
            points().map(point).sum::<f64>()
        };
        points().map(row).sum()
    }
}

/// Moffat 1969, A&A 3, 455: `(β − 1)/(πα²) · (1 + r²/α²)^−β`.
fn moffat(half_width_px: f64, beta: f64) -> impl Fn(f64) -> f64 {
    let alpha = half_width_px / (libm::pow(2.0, 1.0 / beta) - 1.0).sqrt();
    let peak = (beta - 1.0) / (PI * alpha * alpha);
    move |distance_px| peak * libm::pow(1.0 + (distance_px / alpha).powi(2), -beta)
}

/// The pattern of a pupil whose central part ε is obstructed (Born & Wolf 1999, section 8.6.2).
fn airy(half_width_px: f64, obstruction: f64) -> impl Fn(f64) -> f64 {
    /// Argument at which an unobstructed pattern is at half of its maximum.
    const HALF: f64 = 1.616_339_948_310_703;
    let unit_px = half_width_px / HALF;
    let open = 1.0 - obstruction * obstruction;
    let peak = open / (4.0 * PI * unit_px * unit_px);
    // 2 J₁(v) / v.
    let jinc = |v: f64| {
        if v < 1e-6 { 1.0 } else { 2.0 * libm::j1(v) / v }
    };
    move |distance_px| {
        let v = distance_px / unit_px;
        let amplitude = (jinc(v) - obstruction * obstruction * jinc(obstruction * v)) / open;
        peak * amplitude * amplitude
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profile(form: SpotForm, obstruction: f64) -> RadialProfile {
        let made = Imperfections {
            spot_form: form,
            obstruction,
            ..Imperfections::default()
        };
        RadialProfile::tabulate(&made, 1.1).unwrap()
    }

    #[test]
    fn the_light_is_whole_and_half_as_dense_at_half_of_the_width() {
        let reach = (PROFILE_SIGMAS * 1.1) as i32;
        for (form, obstruction, beyond) in [
            (SpotForm::Moffat, 0.0, 1e-3),
            (SpotForm::Airy, 0.0, 0.03),
            (SpotForm::Airy, 0.4, 0.05),
        ] {
            let profile = profile(form, obstruction);
            let pixel = |x: i32, y: i32| profile.fraction(f64::from(x) - 0.3, f64::from(y) + 0.1);
            let row = |y: i32| (-reach..=reach).map(|x| pixel(x, y)).sum::<f64>();
            let sum: f64 = (-reach..=reach).map(row).sum();
            assert!(sum < 1.0 + 1e-6 && sum > 1.0 - beyond, "{form:?} {sum}");
            let half = profile.density(GAUSSIAN_FWHM / 2.0 * 1.1) / profile.density(0.0);
            assert!(obstruction > 0.0 || (half - 0.5).abs() < 1e-4, "{half}");
        }
    }
}
