//! One list of centroids, and the truth about it.

use super::{Mirrored, Protocol};
use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::camera::{CameraModel, focal_length_px};
use crate::identify::{IndexedCatalog, Photometry};
use crate::photometry::instrumental_mag;
use crate::pipeline::{CentroidList, ListedCentroid};
use crate::sky::catalog::StarIndex;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Stars so many standard deviations below the limit may still be observed above it.
const FAINTEST_SIGMAS: f64 = 4.0;
/// The flux of a star of V = 0 in lists of instrumental magnitudes: any would do.
const FLUX_OF_V_0: f64 = 1e8;

/// A list of centroids as a camera would give it.
#[derive(Debug, Clone)]
pub struct Observation {
    /// What the identification sees, brightest first.
    pub list: CentroidList,
    /// Which star of the catalogue each centroid of the list is; `None` for false ones.
    pub stars: Vec<Option<StarIndex>>,
    /// The camera.
    pub camera: CameraModel,
    /// Its attitude.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
}

impl Observation {
    /// Draws a list as `protocol` says.
    pub fn draw(protocol: &Protocol, indexed: &IndexedCatalog, rng: &mut ChaCha8Rng) -> Self {
        let icrs_to_camera = random_rotation(rng);
        let mirrored = match protocol.mirrored {
            Mirrored::Never => false,
            Mirrored::Half => rng.random_bool(0.5),
            Mirrored::Always => true,
        };
        let (width_px, height_px) = (protocol.width_px as f64, protocol.height_px as f64);
        let focal_px = focal_length_px(width_px, protocol.fov_deg * RAD_PER_DEG);
        let camera = CameraModel::pinhole(width_px, height_px, focal_px, mirrored);
        let stars = stars_seen(protocol, indexed, (&camera, &icrs_to_camera), rng);
        let mut drawn = drawn_stars(protocol, &stars, rng);
        drawn.extend(false_stars(protocol, &stars, rng));
        drawn.sort_by(|a, b| a.v_mag.total_cmp(&b.v_mag));
        Self {
            list: CentroidList {
                width: protocol.width_px,
                height: protocol.height_px,
                photometry: protocol.photometry,
                centroids: drawn
                    .iter()
                    .map(|d| d.listed(protocol.photometry))
                    .collect(),
            },
            stars: drawn.iter().map(|d| d.star).collect(),
            camera,
            icrs_to_camera,
        }
    }

    /// How many of the centroids are stars.
    pub fn true_stars(&self) -> usize {
        self.stars.iter().flatten().count()
    }
}

/// One centroid of the list.
struct Drawn {
    position: PixelPoint,
    v_mag: f64,
    /// Which star of the catalogue it is, if any.
    star: Option<StarIndex>,
}

impl Drawn {
    fn listed(&self, photometry: Photometry) -> ListedCentroid {
        let flux = match photometry {
            Photometry::JohnsonV => None,
            Photometry::Instrumental => Some(FLUX_OF_V_0 * 10f64.powf(-0.4 * self.v_mag)),
        };
        ListedCentroid {
            position: self.position,
            mag: flux.map_or(self.v_mag, instrumental_mag),
            flux,
        }
    }
}

/// The catalogue's stars on the frame that are above the limit: where they stand, and their observed magnitudes.
fn stars_seen(
    protocol: &Protocol,
    indexed: &IndexedCatalog,
    (camera, icrs_to_camera): (&CameraModel, &Rotation<Icrs, Camera>),
    rng: &mut ChaCha8Rng,
) -> Vec<Drawn> {
    let limit_v_mag = limiting_v_mag(protocol, camera, indexed);
    let faintest = limit_v_mag + FAINTEST_SIGMAS * protocol.mag_sigma;
    let centre = icrs_to_camera.inverse().apply(&UnitVector::BORESIGHT);
    let mut around = Vec::new();
    indexed
        .grid
        .for_each_within(&centre, camera.radius_rad(), faintest as f32, |star| {
            around.push(StarIndex::from(star.catalog));
        });
    around.sort_unstable();
    let seen = |index: StarIndex| {
        let star = indexed.catalog().star(index);
        let pixel = camera.pixel_of(&icrs_to_camera.apply(&star.direction));
        let position = pixel.filter(|pixel| camera.contains(pixel))?;
        let v_mag = f64::from(star.v_mag) + protocol.mag_sigma * normal(rng);
        (v_mag <= limit_v_mag).then_some(Drawn {
            position,
            v_mag,
            star: Some(index),
        })
    };
    around.into_iter().filter_map(seen).collect()
}

/// The stars that are not missing, with the errors of their centroids.
fn drawn_stars(protocol: &Protocol, stars: &[Drawn], rng: &mut ChaCha8Rng) -> Vec<Drawn> {
    let drawn = |star: &Drawn| {
        let [dx, dy] = [normal(rng), normal(rng)].map(|n| protocol.centroid_sigma_px * n);
        let position = PixelPoint::new(star.position.x + dx, star.position.y + dy);
        (!rng.random_bool(protocol.missing)).then_some(Drawn { position, ..*star })
    };
    stars.iter().filter_map(drawn).collect()
}

/// Strewn evenly over the frame, each as bright as a star of this frame taken at random.
fn false_stars(protocol: &Protocol, stars: &[Drawn], rng: &mut ChaCha8Rng) -> Vec<Drawn> {
    let wanted = protocol.false_stars * stars.len() as f64;
    let count = wanted as usize + usize::from(rng.random_bool(wanted.fract()));
    let mut strewn = || Drawn {
        position: PixelPoint::new(
            rng.random_range(0.0..protocol.width_px as f64) - 0.5,
            rng.random_range(0.0..protocol.height_px as f64) - 0.5,
        ),
        v_mag: stars[rng.random_range(0..stars.len())].v_mag,
        star: None,
    };
    (0..count).map(|_| strewn()).collect()
}

/// The magnitude to which the sky has, on average, the wanted number of stars on a frame.
fn limiting_v_mag(protocol: &Protocol, camera: &CameraModel, indexed: &IndexedCatalog) -> f64 {
    let area_sq_deg = camera.fov_x_rad() * camera.fov_y_rad() * DEG_PER_RAD.powi(2);
    indexed.magnitude_of_density(protocol.mean_stars / area_sq_deg)
}

/// A rotation taken from all with the same probability: a direction in four dimensions (Shoemake 1992).
pub fn random_rotation(rng: &mut ChaCha8Rng) -> Rotation<Icrs, Camera> {
    Rotation::from_quaternion(std::array::from_fn(|_| normal(rng)))
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}
