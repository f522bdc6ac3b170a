//! From image to image.

use crate::agreement::FIT_STEPS;
use crate::block::{self, Buffers};
use crate::camera::Lens;
use crate::centroid::MAX_STEPS;
use crate::motion::Motion;
use crate::{Catalog, Config, Error, Image, Spot, detect, lost};

/// Where and when: what shifts the stars.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Sky {
    /// The time as a year, such as 2026.9.
    pub year: f64,
    /// Velocity relative to the barycentre of the solar system (ICRS), in km/s.
    pub velocity_km_s: [f64; 3],
}

/// The most work that a search may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct Budget {
    /// Triangles of spots.
    pub triangles: u32,
    /// Triangles of the catalogue that these are compared with.
    pub candidates: u32,
    /// Attitudes that are tried on all spots.
    pub attitudes: u32,
}

impl Default for Budget {
    fn default() -> Self {
        Self {
            triangles: 2000,
            candidates: 200_000,
            attitudes: 2000,
        }
    }
}

/// The work that a call did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(C)]
pub struct Work {
    /// Pixels that were filtered.
    pub pixels: u64,
    /// Peaks above the threshold.
    pub peaks: u64,
    /// Windows around stars.
    pub windows: u64,
    /// Steps of centroids and fits.
    pub iterations: u64,
    /// Triangles of spots.
    pub triangles: u32,
    /// Triangles of the catalogue that these were compared with.
    pub candidates: u32,
    /// Attitudes that were tried on all spots.
    pub attitudes: u32,
    /// Stars of the catalogue that were seen to be in the frame or not.
    pub stars: u64,
}

/// Finds and follows the attitude of a camera.
#[derive(Debug)]
pub struct Tracker<'a> {
    pub(crate) config: Config,
    pub(crate) lens: Lens,
    pub(crate) catalog: Catalog<'a>,
    pub(crate) buffers: Buffers<'a>,
    pub(crate) motion: Option<Motion>,
    /// Focal length over that of the configuration, as the last attitude has it.
    pub(crate) scale: f64,
    pub(crate) work: Work,
}

impl<'a> Tracker<'a> {
    /// Words of 8 bytes that the block of memory needs.
    ///
    /// # Errors
    /// Those of [`Tracker::new`].
    pub fn words(config: &Config, catalog: &Catalog) -> Result<usize, Error> {
        check(config, catalog)?;
        Ok(block::words(config, catalog))
    }

    /// A tracker that knows no attitude, and keeps all that it keeps in `block`.
    ///
    /// # Errors
    /// A value of the configuration is out of range, the lens is none, the field of view is not one of the catalogue's,
    /// or the block is too small.
    pub fn new(block: &'a mut [u64], config: Config, catalog: Catalog<'a>) -> Result<Self, Error> {
        let lens = check(&config, &catalog)?;
        let buffers = Buffers::new(block, &config, &catalog)?;
        Ok(Self {
            config,
            lens,
            catalog,
            buffers,
            motion: None,
            scale: 1.0,
            work: Work::default(),
        })
    }

    /// Writes the stars of an image to `spots`, the brightest first, and tells how many there are.
    ///
    /// # Errors
    /// [`Error::Image`] where the image has another size than the camera.
    pub fn detect(&mut self, image: &Image, spots: &mut [Spot]) -> Result<usize, Error> {
        image.check_camera(&self.config.camera)?;
        self.work = Work::default();
        Ok(detect::detect(
            image,
            &self.config,
            &mut self.buffers,
            spots,
            &mut self.work,
        ))
    }

    /// The work of the last call.
    pub fn work(&self) -> &Work {
        &self.work
    }

    /// The most work that a call can do: [`Tracker::detect`], [`Tracker::lost`] with this budget, or
    /// [`Tracker::track`].
    pub fn most_work(&self, budget: &Budget) -> [Work; 3] {
        let [width, height] =
            [self.config.camera.width_px, self.config.camera.height_px].map(u64::from);
        let spots = u64::from(self.config.max_stars);
        let centroids = spots * MAX_STEPS as u64;
        let stars = self.catalog.len() as u64;
        let attitudes = u64::from(budget.attitudes);
        // No two of the pixels in a square of 2 × 2 are both peaks.
        let peaks = width.div_ceil(2) * height.div_ceil(2);
        let image = Work {
            pixels: width * height,
            peaks,
            windows: spots,
            iterations: centroids,
            ..Work::default()
        };
        let lost = Work {
            iterations: attitudes * (lost::ROUNDS * FIT_STEPS) as u64,
            triangles: budget.triangles,
            candidates: budget.candidates,
            attitudes: budget.attitudes,
            stars: attitudes * lost::ROUNDS as u64 * stars,
            ..Work::default()
        };
        let track = Work {
            windows: spots,
            iterations: centroids + FIT_STEPS as u64,
            attitudes: 1,
            stars,
            ..Work::default()
        };
        [image, lost, track]
    }
}

fn check(config: &Config, catalog: &Catalog) -> Result<Lens, Error> {
    /// Fields of view may be this much wider or narrower than those of the catalogue.
    const SLACK: f64 = 1.02;
    config.check()?;
    let lens = Lens::new(config.camera)?;
    let [narrowest, widest] = catalog.fov_deg();
    let diagonal_deg = (2.0 * lens.radius_rad).to_degrees();
    if diagonal_deg > core::f64::consts::SQRT_2 * widest * SLACK || diagonal_deg < narrowest / SLACK
    {
        return Err(Error::Config);
    }
    Ok(lens)
}
