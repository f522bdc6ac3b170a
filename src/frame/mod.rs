//! What does a file hold? The image as the detector recorded it.
//!
//! file, bytes or an array in memory → [`Frame`]: pixel values at the file's full depth, and
//! [`FrameMetadata`], how the image was taken. Pixels are row-major, the top row of the picture
//! first; (0, 0) is the centre of the top-left pixel.
//!
//! 1. The first bytes decide the format; the file's name is not used. Gzip is decompressed first.
//!    Formats of cameras and phones that are not read are named, with what to convert them to.
//! 2. The size in the header is checked against [`MAX_PIXELS`] before anything is allocated.
//! 3. Color is converted to luminance with the ITU-R BT.601 weights ([`LUMINANCE_WEIGHTS`]). They
//!    are the inverse of JPEG's color transform, so a color JPEG gives the luma that it stores.
//! 4. A color pixel is saturated if any channel is. Its luminance is unknown, so it is set to full
//!    scale.
//! 5. Where neither file nor format state the level from which on pixels are saturated, or no pixel
//!    reaches it, the level that the highest pixels share is ([`Frame::saturation_level_adu`]).
//! 6. Infinities become NaN. NaN marks a pixel without a value.
//!
//! A file may hold several images, its pages, counted from 1; the largest is read unless another is
//! chosen, or all are ([`Pages`]). Pages are the images of a TIFF file in file order, and in FITS every image with two axes
//! in a header-data unit and every plane of a cube. A cube of three planes is one color image.
//!
//! FITS images are stored bottom-up, unless `ROWORDER` is `TOP-DOWN`: their rows are reversed on
//! reading, so that y = 0 is the top row as FITS viewers draw the picture ([`RowOrder`]). Pictures of
//! other formats are turned as their `Orientation` says ([`Orientation`]).
//!
//! Raw frames of color cameras are read as they are; [`Mosaic`] finds them and makes them grey.
//!
//! Caveats: transparency is ignored. JPEG's gamma is not undone, so fluxes from JPEG are not
//! linear. Integers and floats of more than 24 bits are rounded to 24.

mod bayer_pattern;
mod colors;
mod columns;
mod compressed;
mod directory;
mod error;
mod exif;
mod fits;
mod folder;
mod format;
mod image;
mod jpeg;
mod jpeg_rows;
mod jpeg_scans;
mod levels;
mod limits;
mod memory;
mod metadata;
mod mosaic;
mod orientation;
mod other_file;
mod pages;
mod pixels;
mod raster;
mod read_budget;
mod reader;
mod row_order;
mod saturation;
mod stored_rows;
mod tiff;
mod unsupported_formats;

pub use bayer_pattern::BayerPattern;
pub use colors::Colors;
pub use columns::DefectiveColumn;
#[cfg(feature = "overlay")]
pub(crate) use directory::OVERLAY_TEXT;
pub use directory::{
    CALIBRATION_CREATOR, COPY_CREATOR, TABLE_CREATOR, files_in, is_calibration_frame, is_copy,
    is_overlay, is_table,
};
pub use error::FrameError;
pub(crate) use fits::{BLOCK_BYTES, write_rows};
pub use fits::{FitsHeader, FitsSamples, FitsWriteError, write_fits};
pub use folder::{Cameras, Folder, PassedOver};
pub use format::FrameFormat;
pub use image::Frame;
pub use image::check_size;
#[cfg(feature = "overlay")]
pub(crate) use levels::luminance;
pub use levels::{LUMINANCE_WEIGHTS, WholeNumber};
pub use limits::{MAX_PAGES, MAX_PIXELS, MIN_SIDE_PX};
pub use memory::MemoryLimit;
pub use metadata::{Assumption, FrameMetadata};
pub use metadata::{IgnoredValue, ImageChoice};
pub use mosaic::Mosaic;
pub use orientation::Orientation;
pub use other_file::OtherFile;
pub use pages::{ImageName, PageChoice, Pages};
pub use pixels::Pixels;
pub use reader::{Buffers, decode, read};
pub use reader::{decode_page, decode_page_with, read_page, read_page_with, read_stream};
pub use row_order::RowOrder;
pub(crate) use saturation::SaturationFinder;
pub use tiff::{TiffOptions, TiffSamples, write_tiff};

#[cfg(test)]
mod orientation_tests;
#[cfg(test)]
mod tests;
