//! How wide should a star's spot be? Centroid error over spot radius and noise.
//!
//! [`SpotNoiseGrid`], and [`PeakStudy`] or [`EnergyStudy`] → [`ErrorGrid`] → [`Surface`], [`ErrorCurve`]s →
//! [`Optimum`], [`IsoLine`]s
//!
//! 1. At every radius and noise of the grid: stars at random positions within a pixel, and the RMS
//!    distance between centroid and true position, σ_e.
//! 2. The least-squares surface of the paper through all of them ([`Surface`]).
//! 3. At each noise a smooth curve over the radius, its optimum, and the smallest radius that meets
//!    a given error.
//! 4. The lines of equal error, and how well a parabola describes each ([`Parabola`]).
//! 5. The distance from focus at which a lens makes such a spot ([`DefocusLens`]).
//!
//! Two questions must be kept apart. [`PeakStudy`] is that of the paper: all spots have the same
//! *brightest pixel*, so a wider spot has more light, and wide spots win. [`EnergyStudy`] is that
//! of a real sensor: the *energy* of a star is given, a wider spot spreads it over more noise, and
//! the best spot is narrow.
//!
//! Throughout, the "radius" σ_s is the standard deviation in pixels of a Gaussian spot before
//! integration over pixels, and σ_e is the RMS distance in two dimensions, √2 times the RMS error
//! on one axis.
//!
//! # Reference
//! Wang, Wang, Zhu, Liu & Ge 2019, Laser & Optoelectronics Progress 56, 101101, doi
//! 10.3788/LOP56.101101.

mod curve;
mod energy;
mod grid;
mod isoline;
mod lens;
mod peak;
mod surface;

pub use curve::{ErrorCurve, Optimum};
pub use energy::{Centroiding, EnergyStudy, MeasureError, SpotLimits};
pub use grid::{ErrorGrid, ErrorPoint, SpotNoiseGrid};
pub use isoline::{IsoLine, IsoPoint, Parabola};
pub use lens::DefocusLens;
pub use peak::{ExpectedError, PeakStudy, SpotInWindow, sampling_bias_px};
pub use surface::{Surface, SurfaceError};

/// Relative noise of the paper's twenty dark frames: fraction of full scale (eq. 4).
pub const PAPER_RELATIVE_NOISE: f64 = 9.32e-4;
/// RMS residual of the paper's own errors from its surface, in pixels (eq. 14).
pub const PAPER_RESIDUAL_PX: f64 = 0.0025;
