//! How do pixels map to the sky? The identified frame's coordinates as a FITS header (WCS).
//!
//! [`Solution`] → a primary header without data, like the `.wcs` files of astrometry.net: cards of
//! 80 characters in blocks of 2880 bytes
//!
//! Conventions are those of FITS. The centre of the first pixel of the file is (1, 1); `ROWORDER` says
//! whether that is the top or the bottom of the picture. `CRVAL` is the boresight: `CRPIX` is the frame's centre for a pinhole, and where the axis meets the
//! frame for other lenses. `CD` is in degrees per pixel; its determinant has the other sign for a
//! mirrored frame. A distortion is written in SIP form, fitted over the frame: `A` and `B` from pixels to
//! the plane, `AP` and `BP` back.
//!
//! # Reference
//! Calabretta & Greisen 2002, A&A 395, 1077 (`TAN`, `ZPN`); Shupe et al. 2005, ASP Conf. 347, 491 (SIP);
//! FITS Standard 4.0 (2018), sect. 4 (cards) and 8 (world coordinates).

mod plane;
mod sip;

use crate::base::coords::{Camera, Icrs, Rotation, UnitVector};
use crate::base::units::{ARCSEC_PER_RAD, DEG_PER_RAD};
use crate::camera::CameraModel;
use crate::ephemeris::places::AttitudeFrame;
use crate::frame::{
    COPY_CREATOR, FitsHeader, FitsSamples, FitsWriteError, Frame, RowOrder, write_rows,
};
use crate::identify::{Identification, SkyView};
use crate::solve::{Outcome, Solution};
use memchr::memmem;
use nalgebra::{Matrix2, RowVector2, Vector3};
use plane::Plane;
use sip::{Polynomial, Sip};

/// Start of the history that each header has.
const SOLVED_BY: &str = "Solved by starpipe";

/// The header of the frame named `frame`; `None` where it is not identified.
///
/// # Example
/// ```
/// use starpipe::report::wcs;
/// use starpipe::{Catalog, Context, IndexedCatalog, Workspace, solve_file};
///
/// // The stars to V 7 are enough for wide fields, and are indexed in a moment.
/// let catalog = Catalog::built_in().limited_to(7.0);
/// let indexed = IndexedCatalog::build(&catalog, &|_| ());
/// let context = Context::new(&indexed);
/// let file = "fixtures/orion/orion.png";
/// let solution = solve_file(file, None, &context, &mut Workspace::new())?;
/// let header = wcs::header(file, &solution).expect("the stars are identified");
/// assert_eq!(header.len() % 2880, 0);
/// let mut cards = header.chunks(80);
/// assert!(cards.any(|card| card.starts_with(b"CTYPE1  = 'RA---TAN")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn header(frame: &str, solution: &Solution) -> Option<Vec<u8>> {
    header_to_order(frame, solution, sip::MAX_ORDER)
}

/// [`header`] with polynomials of this order at most; of order 1 there are none, and the linear part is that which
/// fits best.
#[doc(hidden)]
pub fn header_to_order(frame: &str, solution: &Solution, max_order: usize) -> Option<Vec<u8>> {
    let row_order = solution.row_order.unwrap_or_default();
    let solved = cards(frame, solution, row_order, max_order)?;
    let mut header = FitsHeader::default();
    header.logical("SIMPLE", true, "FITS header without data");
    header.integer("BITPIX", 8, "");
    header.integer("NAXIS", 0, "the image is in the file named below");
    header.integer("IMAGEW", solution.width as i64, "columns of the image");
    header.integer("IMAGEH", solution.height as i64, "rows of the image");
    let order = row_order.keyword_value();
    header.text("ROWORDER", order, "of the image's file");
    header.extend(&solved);
    Some(header.to_bytes())
}

/// A copy of the frame named `name` as FITS, with its coordinates in the header; `None` where it is not
/// identified. Its first row is the first of `frame`, and ROWORDER says `row_order`: frames have the top row first
/// unless they are [as stored](Frame::as_stored). Levels are unsigned integers of 16 bits where all of them fit,
/// else floats.
///
/// # Errors
/// None of a frame that was read.
pub fn solved_copy(
    name: &str,
    frame: &Frame,
    solution: &Solution,
    row_order: RowOrder,
) -> Result<Option<Vec<u8>>, FitsWriteError> {
    let Some(solved) = cards(name, solution, RowOrder::TopDown, sip::MAX_ORDER) else {
        return Ok(None);
    };
    let mut header = FitsHeader::default();
    header.text("CREATOR", COPY_CREATOR, "with its coordinates");
    if let Some(exposure_s) = solution.exposure_s {
        header.real("EXPTIME", exposure_s, "[s] exposure");
    }
    header.extend(&solved);
    let write = |samples| {
        let mut file = Vec::new();
        write_rows(&mut file, frame, samples, &header, row_order).map(|()| file)
    };
    let file = match write(FitsSamples::Unsigned16) {
        Err(FitsWriteError::NoLevel { .. }) => write(FitsSamples::Float32),
        file => file,
    };
    file.map(Some)
}

/// The cards of the coordinates of the frame named `frame`, in a file with its rows in this order; `None`
/// where it is not identified.
fn cards(
    frame: &str,
    solution: &Solution,
    row_order: RowOrder,
    max_order: usize,
) -> Option<FitsHeader> {
    let Outcome::Identified(identification) = &solution.outcome else {
        return None;
    };
    let mut header = FitsHeader::default();
    Mapping::new(&identification.view(), row_order, max_order).add_to(&mut header);
    add_errors(&mut header, identification);
    if let Some(known) = &solution.date {
        let utc = known.date.to_iso();
        header.text("DATE-OBS", utc.trim_end_matches('Z'), "UTC");
        header.text("TIMESYS", "UTC", "");
    }
    add_history(&mut header, frame, solution, identification);
    Some(header)
}

/// Whether `file` is a header written by [`header`].
pub fn is_header(file: &[u8]) -> bool {
    file.starts_with(b"SIMPLE  =") && memmem::find(file, SOLVED_BY.as_bytes()).is_some()
}

/// Adds the mapping from a file's pixels to the directions of the catalogue.
pub fn add_projection(header: &mut FitsHeader, view: &SkyView, row_order: RowOrder) {
    Mapping::new(view, row_order, sip::MAX_ORDER).add_to(header);
}

/// The linear part of a frame's coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearWcs {
    /// Right ascension and declination of the reference point, in degrees.
    pub crval_deg: [f64; 2],
    /// Its pixel in the file, the first being (1, 1).
    pub crpix: [f64; 2],
    /// From offsets in pixels to degrees to the east (first row) and north.
    pub cd_deg: [[f64; 2]; 2],
}

/// The linear part of the coordinates that [`header`] writes; `None` where the frame is not identified.
pub fn linear(solution: &Solution) -> Option<LinearWcs> {
    let found = solution.outcome.identification()?;
    let row_order = solution.row_order.unwrap_or_default();
    let mapping = Mapping::new(&found.view(), row_order, sip::MAX_ORDER);
    Some(mapping.linear)
}

impl LinearWcs {
    /// Pixel scale, in degrees.
    pub fn scale_deg(&self) -> f64 {
        self.determinant_deg2().abs().sqrt()
    }

    /// Whether east and north are seen as in a mirror in the rows of the file.
    pub fn is_mirrored(&self) -> bool {
        self.determinant_deg2() > 0.0
    }

    fn determinant_deg2(&self) -> f64 {
        let [[xx, xy], [yx, yy]] = self.cd_deg;
        xx * yy - xy * yx
    }
}

/// The mapping from a file's pixels to the directions of the catalogue.
struct Mapping {
    plane: Plane,
    linear: LinearWcs,
    sip: Option<Sip>,
}

impl Mapping {
    fn new(view: &SkyView, row_order: RowOrder, max_order: usize) -> Self {
        let SkyView { camera, places, .. } = view;
        let icrs_to_camera = &places.astrometric_attitude(view.icrs_to_camera);
        let plane = Plane::from_camera(camera);
        let reference = if camera.is_pinhole() {
            camera.centre()
        } else {
            camera.axis()
        };
        let is_plain =
            camera.is_pinhole() && camera.distortion().is_none() && places.are_of_catalog();
        let place = |direction: &UnitVector<Camera>| {
            let apparent = view.icrs_to_camera.inverse().apply(direction);
            plane.place_of(&icrs_to_camera.apply(&places.astrometric(&apparent)))
        };
        let sip = (!is_plain)
            .then(|| Sip::new(camera, &reference, max_order, place))
            .flatten();
        let (sip, rows) = match row_order {
            RowOrder::TopDown => (sip, 1.0),
            RowOrder::BottomUp => (sip.as_ref().map(Sip::with_rows_reversed), -1.0),
        };
        let reversal = Matrix2::new(1.0, 0.0, 0.0, rows);
        let (boresight, _) = icrs_to_camera.boresight_and_up();
        let (ra_rad, dec_rad) = boresight.to_ra_dec();
        let (east, north) = sky_axes(icrs_to_camera);
        let pinhole = Matrix2::from_rows(&[east, north]) * mirror(camera)
            / camera.focal_length_px()
            * DEG_PER_RAD;
        let distorted = sip
            .as_ref()
            .map_or_else(Matrix2::identity, |sip| sip.linear);
        let cd = pinhole * reversal * distorted;
        let row = match row_order {
            RowOrder::TopDown => reference.y,
            RowOrder::BottomUp => camera.height_px - 1.0 - reference.y,
        };
        let linear = LinearWcs {
            crval_deg: [ra_rad, dec_rad].map(|rad| rad * DEG_PER_RAD),
            crpix: [reference.x + 1.0, row + 1.0],
            cd_deg: [[cd[(0, 0)], cd[(0, 1)]], [cd[(1, 0)], cd[(1, 1)]]],
        };
        let sip = sip.filter(|_| max_order > 1);
        Self { plane, linear, sip }
    }

    fn add_to(&self, header: &mut FitsHeader) {
        let LinearWcs {
            crval_deg,
            crpix,
            cd_deg,
        } = self.linear;
        let suffix = if self.sip.is_some() { "-SIP" } else { "" };
        header.integer("WCSAXES", 2, "");
        let (code, name) = self.plane.code_and_name();
        header.text("CTYPE1", &format!("RA---{code}{suffix}"), name);
        header.text("CTYPE2", &format!("DEC--{code}{suffix}"), "");
        header.text("CUNIT1", "deg", "");
        header.text("CUNIT2", "deg", "");
        header.real("CRVAL1", crval_deg[0], "RA of the boresight");
        header.real("CRVAL2", crval_deg[1], "Dec of the boresight");
        header.real("CRPIX1", crpix[0], "first pixel is 1");
        header.real("CRPIX2", crpix[1], "first pixel is 1");
        for (row, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let keyword = format!("CD{}_{}", row + 1, column + 1);
            header.real(&keyword, cd_deg[row][column], "degrees a pixel");
        }
        self.plane.add_to(header);
        header.real("LONPOLE", 180.0, "");
        header.text("RADESYS", "ICRS", "");
        header.real("EQUINOX", 2000.0, "");
        if let Some(sip) = &self.sip {
            add_sip(header, sip);
        }
    }
}

fn add_errors(header: &mut FitsHeader, identification: &Identification) {
    let (east, north) = sky_axes(&identification.attitude(AttitudeFrame::Icrs));
    let [sigma_x, sigma_y, _] = identification.attitude_sigma_rad();
    // A rotation about x moves the boresight along y, and one about y along x.
    for (keyword, axis) in [("CRDER1", east), ("CRDER2", north)] {
        let sigma_rad = libm::hypot(axis[0] * sigma_y, axis[1] * sigma_x);
        let sigma_deg = sigma_rad * DEG_PER_RAD;
        header.real(keyword, sigma_deg, "standard error of the center");
    }
}

/// East and north components of the camera's x and y axes at the centre.
fn sky_axes(icrs_to_camera: &Rotation<Icrs, Camera>) -> (RowVector2<f64>, RowVector2<f64>) {
    let (boresight, _) = icrs_to_camera.boresight_and_up();
    let (east, north) = boresight.east_north();
    let along = |axis: Vector3<f64>| {
        let in_camera = icrs_to_camera.matrix() * axis;
        RowVector2::new(in_camera.x, in_camera.y)
    };
    (along(east), along(north))
}

/// Converts offsets in the file to offsets along the camera's axes.
fn mirror(camera: &CameraModel) -> Matrix2<f64> {
    let x = if camera.mirrored { -1.0 } else { 1.0 };
    Matrix2::new(x, 0.0, 0.0, 1.0)
}

fn add_sip(header: &mut FitsHeader, sip: &Sip) {
    let mut add = |name: &str, polynomial: &Polynomial, comment: &str| {
        let order = polynomial.order as i64;
        header.integer(&format!("{name}_ORDER"), order, comment);
        for (p, q, value) in polynomial.terms() {
            if value != 0.0 {
                header.real(&format!("{name}_{p}_{q}"), value, "");
            }
        }
    };
    add("A", &sip.forward[0], "observed to ideal, along x");
    add("B", &sip.forward[1], "observed to ideal, along y");
    add("AP", &sip.inverse[0], "ideal to observed, along x");
    add("BP", &sip.inverse[1], "ideal to observed, along y");
}

fn field(camera: &CameraModel) -> String {
    let degrees = |angle_rad: f64| angle_rad * DEG_PER_RAD;
    match camera.fov_x_rad().zip(camera.fov_y_rad()) {
        Some((x, y)) => format!("{:.4} x {:.4} deg", degrees(x), degrees(y)),
        None => format!("within {:.1} deg of the axis", degrees(camera.radius_rad())),
    }
}

fn add_history(
    header: &mut FitsHeader,
    frame: &str,
    solution: &Solution,
    identification: &Identification,
) {
    let camera = &identification.camera;
    let sigma = identification
        .attitude_sigma_rad()
        .map(|sigma_rad| sigma_rad * ARCSEC_PER_RAD);
    let matched = identification.matches.len();
    let lines = [
        format!("{SOLVED_BY} {}", env!("CARGO_PKG_VERSION")),
        format!("Image: {frame}"),
        format!(
            "Field {}, focal length {:.3} +- {:.3} px{}",
            field(camera),
            camera.central_focal_length_px(),
            identification.focal_length_sigma_px,
            if camera.mirrored { ", mirrored" } else { "" },
        ),
        format!(
            "{matched} of {} detections matched, rms {:.4} px, log10 false alarm {:.1}",
            solution.sources.len(),
            identification.rms_px,
            identification.log10_false_alarm,
        ),
        format!(
            "Standard errors: about x {:.3}, about y {:.3}, roll {:.3} arcsec",
            sigma[0], sigma[1], sigma[2]
        ),
    ];
    for line in lines {
        header.history(&line);
    }
}

#[cfg(test)]
mod tests;
