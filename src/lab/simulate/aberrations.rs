//! Where the light of a star falls about its position: elongated spots, and the aberrations of a
//! lens, as rays through its pupil.

use crate::base::coords::PixelPoint;
use crate::camera::data_sheet::DataSheet;
use std::f64::consts::PI;

/// A part of a star's light, displaced from its position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ray {
    /// Displacement along x and y, in pixels.
    pub offset_px: [f64; 2],
    /// Share of the light.
    pub fraction: f64,
}

/// The rays of a star at any position. Their centre of light is the position.
#[derive(Debug, Clone)]
pub(super) struct Aberrations {
    centre: PixelPoint,
    /// Half of the diagonal, in pixels.
    radius_px: f64,
    coma_px: f64,
    astigmatism_px: f64,
    field_curvature_px: f64,
    /// Along the longer axis of an elongated spot.
    elongation: Vec<Ray>,
    /// Standard deviation of the spot across its longer axis, in pixels.
    minor_sigma_px: f64,
}

impl Aberrations {
    pub fn from_sheet(sheet: &DataSheet) -> Self {
        let made = &sheet.imperfections;
        let [width, height] = [sheet.width_px, sheet.height_px].map(|side| side as f64);
        let stretch = made.spot_axis_ratio.sqrt();
        let minor_sigma_px = sheet.spot_sigma_px / stretch;
        let major_sigma_px = sheet.spot_sigma_px * stretch;
        Self {
            centre: PixelPoint::new((width - 1.0) / 2.0, (height - 1.0) / 2.0),
            radius_px: libm::hypot(width, height) / 2.0,
            coma_px: made.coma_px,
            astigmatism_px: made.astigmatism_px,
            field_curvature_px: made.field_curvature_px,
            elongation: elongation(
                major_sigma_px,
                minor_sigma_px,
                made.spot_angle_deg.to_radians(),
            ),
            minor_sigma_px,
        }
    }

    /// Standard deviation of the spot of each ray, in pixels.
    pub fn ray_sigma_px(&self) -> f64 {
        self.minor_sigma_px
    }

    /// Largest displacement, in pixels.
    pub fn reach_px(&self) -> f64 {
        let along = self.elongation.iter().map(|ray| ray.offset_px);
        let elongation_px = along.map(|[x, y]| libm::hypot(x, y)).fold(0.0, f64::max);
        let defocus_px = self.field_curvature_px.abs() + self.astigmatism_px.abs();
        elongation_px + self.coma_px.abs() + defocus_px
    }

    /// Replaces `rays` by those of a star at `position`.
    pub fn trace(&self, position: &PixelPoint, rays: &mut Vec<Ray>) {
        let field = [position.x - self.centre.x, position.y - self.centre.y];
        let field = field.map(|offset_px| offset_px / self.radius_px);
        let distance = libm::hypot(field[0], field[1]);
        let coma_px = self.coma_px * distance;
        let defocus_px = self.field_curvature_px * distance * distance;
        let astigmatism_px = self.astigmatism_px * distance * distance;
        rays.clear();
        if coma_px == 0.0 && defocus_px == 0.0 && astigmatism_px == 0.0 {
            return rays.extend(&self.elongation);
        }
        let [cos, sin] = field.map(|offset| offset / distance);
        for (rho, phi, share) in pupil() {
            let rho2 = rho * rho;
            // Seidel's terms, Born & Wolf 1999, section 5.3; the mean of the coma is subtracted.
            let (sin_phi, cos_phi) = libm::sincos(phi);
            let (sin_2_phi, cos_2_phi) = libm::sincos(2.0 * phi);
            let radial = (defocus_px + astigmatism_px) * rho * cos_phi
                + coma_px / 3.0 * (rho2 * (2.0 + cos_2_phi) - 1.0);
            let tangential =
                (defocus_px - astigmatism_px) * rho * sin_phi + coma_px / 3.0 * rho2 * sin_2_phi;
            let [x, y] = [
                radial * cos - tangential * sin,
                radial * sin + tangential * cos,
            ];
            rays.extend(self.elongation.iter().map(|along| Ray {
                offset_px: [x + along.offset_px[0], y + along.offset_px[1]],
                fraction: share * along.fraction,
            }));
        }
    }
}

/// Rays along the longer axis that make a round Gaussian an elongated one.
fn elongation(major_sigma_px: f64, minor_sigma_px: f64, angle_rad: f64) -> Vec<Ray> {
    /// Distance of the rays, in standard deviations of the round Gaussian. The sum over them is the
    /// integral to 10⁻⁸.
    const STEP_SIGMAS: f64 = 1.0;
    /// End of the rays, in standard deviations of their distribution.
    const REACH_SIGMAS: f64 = 6.0;
    let sigma_px = (major_sigma_px.powi(2) - minor_sigma_px.powi(2)).sqrt();
    let step_px = STEP_SIGMAS * minor_sigma_px.min(sigma_px);
    if sigma_px < 1e-6 * minor_sigma_px {
        return vec![Ray {
            offset_px: [0.0; 2],
            fraction: 1.0,
        }];
    }
    let last = (REACH_SIGMAS * sigma_px / step_px).ceil() as i32;
    let weight = |step: i32| libm::exp(-0.5 * (f64::from(step) * step_px / sigma_px).powi(2));
    let (sin, cos) = libm::sincos(angle_rad);
    let sum: f64 = (-last..=last).map(weight).sum();
    let ray = |step: i32| {
        let along_px = f64::from(step) * step_px;
        Ray {
            offset_px: [along_px * cos, along_px * sin],
            fraction: weight(step) / sum,
        }
    };
    (-last..=last).map(ray).collect()
}

/// Radius, azimuth and share of the light of points of the pupil, spread evenly over it.
fn pupil() -> impl Iterator<Item = (f64, f64, f64)> {
    const RINGS: i32 = 8;
    const AZIMUTHS: i32 = 16;
    let share = 1.0 / f64::from(RINGS * AZIMUTHS);
    (0..RINGS).flat_map(move |ring| {
        let rho = ((f64::from(ring) + 0.5) / f64::from(RINGS)).sqrt();
        // Every other ring is turned by half a step.
        let first = 0.5 * f64::from(ring % 2);
        let phi = move |step: i32| 2.0 * PI * (f64::from(step) + first) / f64::from(AZIMUTHS);
        (0..AZIMUTHS).map(move |step| (rho, phi(step), share))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;

    /// Number of rays at a position, centre of their light, and second moments xx, yy, xy.
    fn moments(aberrations: &Aberrations, at: &PixelPoint) -> (usize, [f64; 2], [f64; 3]) {
        let mut rays = Vec::new();
        aberrations.trace(at, &mut rays);
        let sum =
            |f: &dyn Fn(&Ray) -> f64| rays.iter().map(|ray| ray.fraction * f(ray)).sum::<f64>();
        let at = |axis: usize| move |ray: &Ray| ray.offset_px[axis];
        let product = |i: usize, j: usize| move |ray: &Ray| ray.offset_px[i] * ray.offset_px[j];
        let second = [
            sum(&product(0, 0)),
            sum(&product(1, 1)),
            sum(&product(0, 1)),
        ];
        assert!((sum(&|_| 1.0) - 1.0).abs() < 1e-12);
        (rays.len(), [sum(&at(0)), sum(&at(1))], second)
    }

    #[test]
    fn an_elongated_spot_has_the_moments_of_its_axes() {
        let mut sheet = Preset::Experiment1.data_sheet();
        sheet.spot_sigma_px = 1.2;
        sheet.imperfections.spot_axis_ratio = 2.0;
        sheet.imperfections.spot_angle_deg = 90.0;
        let aberrations = Aberrations::from_sheet(&sheet);
        let minor2 = aberrations.ray_sigma_px().powi(2);
        let (_, centre, [xx, yy, xy]) = moments(&aberrations, &PixelPoint::new(10.0, 20.0));
        assert!(centre.iter().all(|at| at.abs() < 1e-12));
        assert!((xx + minor2 - 0.72).abs() < 1e-6, "{xx}");
        assert!((yy + minor2 - 2.88).abs() < 1e-6, "{yy}");
        assert!(xy.abs() < 1e-12);
    }

    #[test]
    fn aberrations_grow_outward_and_leave_the_centre_of_light() {
        let mut sheet = Preset::Experiment1.data_sheet();
        let made = &mut sheet.imperfections;
        (made.coma_px, made.field_curvature_px) = (6.0, 2.0);
        let aberrations = Aberrations::from_sheet(&sheet);
        let middle = aberrations.centre;
        assert_eq!(moments(&aberrations, &middle).0, 1);
        let (_, centre, [xx, ..]) = moments(&aberrations, &PixelPoint::new(0.0, 0.0));
        assert!(centre.iter().all(|at| at.abs() < 1e-9), "{centre:?}");
        let halfway = PixelPoint::new(middle.x / 2.0, middle.y / 2.0);
        let (.., [inner, ..]) = moments(&aberrations, &halfway);
        assert!(xx > 2.0 * inner && inner > 0.0);
    }
}
