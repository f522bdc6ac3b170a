//! How wide a star's spot should be: the error of its centroid over spot radius and noise.
//!
//! [`Grid`], and [`PeakStudy`] or [`EnergyStudy`] → [`ErrorGrid`] → [`Surface`], [`ErrorCurve`]s → [`Optimum`], [`IsoLine`]s
//!
//! 1. At every radius and noise of the grid, stars at random places within a pixel, and the root of the mean of the squared
//!    distances between centroids and places: σ_e.
//! 2. The paper's least-squares surface through all of them ([`Surface`]).
//! 3. A smooth curve over the radius at each noise, and from it the best radius, and the smallest that meets an error.
//! 4. The lines of equal error, and how well a parabola describes each ([`Parabola`]).
//! 5. How far from its focus a lens makes such a spot ([`Lens`]).
//!
//! There are two questions, which must not be mixed up. [`PeakStudy`] is the paper's: all spots have the same *brightest
//! pixel*, so a wider one has more light, and wide spots win. [`EnergyStudy`] is what a real sensor faces: a star's *energy*
//! is what it is, a wider spot spreads it over more noise, and the best spot is narrow.
//!
//! Everywhere σ_s, the "radius", is the standard deviation of a Gaussian spot before the pixels integrate it, in pixels, and σ_e
//! is the root mean square of the distance, √2 times that along one axis.
//!
//! # Reference
//! Wang, Wang, Zhu, Liu & Ge 2019, Laser & Optoelectronics Progress 56, 101101, doi 10.3788/LOP56.101101.

mod curve;
mod energy;
mod grid;
mod isoline;
mod lens;
mod peak;
mod surface;

pub use curve::{ErrorCurve, Optimum};
pub use energy::{Centroiding, EnergyStudy, Reach};
pub use grid::{ErrorGrid, ErrorPoint, Grid};
pub use isoline::{IsoLine, IsoPoint, Parabola};
pub use lens::Lens;
pub use peak::{Expected, PeakStudy, SpotInWindow, sampling_bias_px};
pub use surface::{Surface, SurfaceError};

/// The relative noise of the paper's twenty dark frames: parts of full scale (eq. 4).
pub const PAPER_RELATIVE_NOISE: f64 = 9.32e-4;
/// The root mean square of the paper's own errors about its surface, in pixels (eq. 14).
pub const PAPER_RESIDUAL_PX: f64 = 0.0025;
