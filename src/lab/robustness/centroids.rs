//! Simulated centroids, and the truth about them.

use super::protocol::{Mirrored, TrialProtocol};
use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::camera::{CameraModel, focal_length_px};
use crate::catalog::StarIndex;
use crate::centroids::{CentroidList, ListedCentroid};
use crate::identify::{IndexedCatalog, Photometry};
use crate::photometry::instrumental_mag;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A simulated list of centroids, with its truth.
#[derive(Debug, Clone)]
pub struct SimulatedCentroids {
    /// The list, brightest first.
    pub list: CentroidList,
    /// The catalogue star of each centroid; `None` for false stars.
    pub stars: Vec<Option<StarIndex>>,
    /// The camera.
    pub camera: CameraModel,
    /// Its attitude.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
}

impl SimulatedCentroids {
    /// Draws a list according to `protocol`.
    pub fn draw(protocol: &TrialProtocol, indexed: &IndexedCatalog, rng: &mut ChaCha8Rng) -> Self {
        let icrs_to_camera = random_rotation(rng);
        let mirrored = match protocol.mirrored {
            Mirrored::Never => false,
            Mirrored::Half => rng.random_bool(0.5),
            Mirrored::Always => true,
        };
        let (width_px, height_px) = (protocol.width_px as f64, protocol.height_px as f64);
        let focal_px = focal_length_px(width_px, protocol.fov_deg * RAD_PER_DEG);
        let camera = CameraModel::pinhole(width_px, height_px, focal_px, mirrored);
        let stars = observed_stars(protocol, indexed, &camera, &icrs_to_camera, rng);
        let mut centroids = listed_stars(protocol, &stars, rng);
        centroids.extend(false_stars(protocol, &stars, rng));
        centroids.sort_by(|a, b| a.v_mag.total_cmp(&b.v_mag));
        Self {
            list: CentroidList {
                width: Some(protocol.width_px),
                height: Some(protocol.height_px),
                photometry: protocol.photometry,
                has_brightness: true,
                centroids: centroids
                    .iter()
                    .map(|centroid| centroid.listed(protocol.photometry))
                    .collect(),
            },
            stars: centroids.iter().map(|centroid| centroid.star).collect(),
            camera,
            icrs_to_camera,
        }
    }

    /// Number of centroids that are true stars.
    pub fn true_stars(&self) -> usize {
        self.stars.iter().flatten().count()
    }
}

/// A simulated centroid.
struct SimulatedCentroid {
    position: PixelPoint,
    v_mag: f64,
    /// Its catalogue star; `None` for a false star.
    star: Option<StarIndex>,
}

impl SimulatedCentroid {
    fn listed(&self, photometry: Photometry) -> ListedCentroid {
        /// Flux of a star of V = 0 in lists of instrumental magnitudes (arbitrary).
        const FLUX_OF_V_0: f64 = 1e8;
        let flux = match photometry {
            Photometry::JohnsonV => None,
            Photometry::Instrumental => Some(FLUX_OF_V_0 * libm::pow(10f64, -0.4 * self.v_mag)),
        };
        ListedCentroid {
            flux,
            ..ListedCentroid::new(self.position, flux.map_or(self.v_mag, instrumental_mag))
        }
    }
}

/// The catalogue stars on the frame above the limit, with true positions and observed magnitudes.
fn observed_stars(
    protocol: &TrialProtocol,
    indexed: &IndexedCatalog,
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
    rng: &mut ChaCha8Rng,
) -> Vec<SimulatedCentroid> {
    /// Stars fainter than the limit by this many standard deviations may be observed above it.
    const MARGIN_SIGMAS: f64 = 4.0;
    let limit_v_mag = limiting_v_mag(protocol, camera, indexed);
    let faintest = limit_v_mag + MARGIN_SIGMAS * protocol.mag_sigma;
    let centre = icrs_to_camera.inverse().apply(&UnitVector::BORESIGHT);
    let mut around = Vec::new();
    indexed
        .grid
        .for_each_within(&centre, camera.radius_rad(), faintest as f32, |star| {
            around.push(star.index);
        });
    around.sort_unstable();
    let observed = |index: StarIndex| {
        let star = indexed.catalog().star(index);
        let pixel = camera.pixel_of(&icrs_to_camera.apply(&star.direction));
        let position = pixel.filter(|pixel| camera.contains(pixel))?;
        let v_mag = f64::from(star.v_mag) + protocol.mag_sigma * normal(rng);
        (v_mag <= limit_v_mag).then_some(SimulatedCentroid {
            position,
            v_mag,
            star: Some(index),
        })
    };
    around.into_iter().filter_map(observed).collect()
}

/// The stars that are not missing, with centroid errors.
fn listed_stars(
    protocol: &TrialProtocol,
    stars: &[SimulatedCentroid],
    rng: &mut ChaCha8Rng,
) -> Vec<SimulatedCentroid> {
    let listed = |star: &SimulatedCentroid| {
        let [dx, dy] = [normal(rng), normal(rng)].map(|n| protocol.centroid_sigma_px * n);
        let position = PixelPoint::new(star.position.x + dx, star.position.y + dy);
        (!rng.random_bool(protocol.missing)).then_some(SimulatedCentroid { position, ..*star })
    };
    stars.iter().filter_map(listed).collect()
}

/// False stars, uniform over the frame, each as bright as a random star of this frame, and those that
/// are brighter than all stars.
fn false_stars(
    protocol: &TrialProtocol,
    stars: &[SimulatedCentroid],
    rng: &mut ChaCha8Rng,
) -> Vec<SimulatedCentroid> {
    /// Brighter false stars are so much brighter than the brightest star, at most.
    const MOST_BRIGHTER_MAG: f64 = 2.0;
    let wanted = protocol.false_stars * stars.len() as f64;
    let count = wanted as usize + usize::from(rng.random_bool(wanted.fract()));
    let brightest = stars.iter().map(|star| star.v_mag);
    let brightest = brightest.fold(f64::INFINITY, f64::min);
    let mut false_star = |number: usize| SimulatedCentroid {
        position: PixelPoint::new(
            rng.random_range(0.0..protocol.width_px as f64) - 0.5,
            rng.random_range(0.0..protocol.height_px as f64) - 0.5,
        ),
        v_mag: if number < count {
            stars[rng.random_range(0..stars.len())].v_mag
        } else {
            brightest - rng.random_range(0.0..MOST_BRIGHTER_MAG)
        },
        star: None,
    };
    let all = if stars.is_empty() {
        0
    } else {
        count + protocol.bright_false_stars
    };
    (0..all).map(&mut false_star).collect()
}

/// The magnitude limit that gives the requested mean number of stars on a frame.
fn limiting_v_mag(protocol: &TrialProtocol, camera: &CameraModel, indexed: &IndexedCatalog) -> f64 {
    let area_sq_deg = camera.solid_angle_sr() * DEG_PER_RAD.powi(2);
    indexed.magnitude_of_density(protocol.mean_stars / area_sq_deg)
}

/// A random rotation, uniform over all rotations: a uniform direction in four dimensions (Shoemake
/// 1992).
pub fn random_rotation(rng: &mut ChaCha8Rng) -> Rotation<Icrs, Camera> {
    Rotation::from_quaternion(std::array::from_fn(|_| normal(rng)))
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}
