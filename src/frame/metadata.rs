//! How a frame was taken, according to its file.

use super::bayer_pattern::BayerPattern;
use super::orientation::Orientation;
use super::row_order::RowOrder;
use crate::base::epoch::ObservationDate;
use crate::base::format::excerpt;
use crate::ephemeris::observer::Site;
use std::fmt;
use std::ops::RangeInclusive;

/// How a frame was taken, according to its file. The values are plausible, not verified.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct FrameMetadata {
    /// Order of the rows in the file.
    pub row_order: RowOrder,
    /// How the file's rows lie in the picture. They count from the top once it is applied.
    pub orientation: Orientation,
    /// Date of the exposure.
    pub date: Option<ObservationDate>,
    /// Date and time that the camera's clock showed, where nothing says what it is ahead of UTC; then
    /// [`date`](Self::date) is the day alone.
    pub local_date: Option<ObservationDate>,
    /// Exposure time, in seconds.
    pub exposure_s: Option<f64>,
    /// Pixel pitch of the stored pixels, binning included, in micrometres.
    pub pixel_size_um: Option<f64>,
    /// Focal length of the optics, in millimetres.
    pub focal_length_mm: Option<f64>,
    /// The observer's site.
    pub site: Option<Site>,
    /// Zenith distance that the mount reported, in degrees.
    pub zenith_distance_deg: Option<f64>,
    /// Right ascension and declination to which the mount says that it points, in degrees.
    pub pointing_deg: Option<[f64; 2]>,
    /// Which image of the file it is, where it is not the first.
    pub choice: Option<ImageChoice>,
    /// The mosaic of color filters that the file states. Drivers of grey cameras state one, too.
    pub bayer_pattern: Option<BayerPattern>,
    /// Level of a pixel without light, in ADU, by pixels of the detector that light does not reach.
    pub dark_level_adu: Option<f64>,
    /// Values outside their plausible range. They are not used.
    pub ignored: Vec<IgnoredValue>,
    /// What the file leaves open, and how it was read.
    pub assumed: Vec<Assumption>,
}

/// What a file leaves open, and how it was read. `Display` gives the sentence.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Assumption {
    /// Four planes were read as red, green, blue and a fourth that is not used.
    FourPlanes,
    /// Day and month of a date may be exchanged; the day was taken to come first.
    DayFirst {
        /// The keyword.
        keyword: String,
        /// The text found there.
        found: String,
    },
}

impl Assumption {
    /// Code for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::FourPlanes => "four_planes",
            Self::DayFirst { .. } => "day_before_month",
        }
    }
}

impl fmt::Display for Assumption {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FourPlanes => f.write_str(
                "the first three of four planes were read as red, green and blue, and the fourth was \
                 ignored; the option page selects a single plane",
            ),
            Self::DayFirst { keyword, found } => write!(
                f,
                "{keyword} is ambiguous: found {found}, read as day, month, year"
            ),
        }
    }
}

/// The image that was read of a file whose first image is smaller, such as a preview.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct ImageChoice {
    /// Number of images in the file.
    pub images: usize,
    /// The page that was read, from 1.
    pub page: usize,
    /// Whether it is no page of its own but attached to that page.
    pub is_attached: bool,
    /// Its width and height.
    pub size_px: [usize; 2],
    /// Width and height of the first image.
    pub first_px: [usize; 2],
}

impl fmt::Display for ImageChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([width, height], [first_width, first_height]) = (self.size_px, self.first_px);
        let attached = if self.is_attached {
            "the image attached to "
        } else {
            ""
        };
        write!(
            f,
            "the largest of {} images in the file was read: {attached}page {}, {width} × {height} pixels; \
             the first image has {first_width} × {first_height} pixels",
            self.images, self.page
        )
    }
}

/// A value in a file's header that is not used because it is implausible.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct IgnoredValue {
    /// The keyword or keywords.
    pub keyword: String,
    /// The text found there.
    pub found: String,
    /// What was expected instead.
    pub expected: String,
}

impl fmt::Display for IgnoredValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            keyword,
            found,
            expected,
        } = self;
        let found = excerpt(found);
        write!(
            f,
            "{keyword} is ignored: found {found}, expected {expected}"
        )
    }
}

/// A number in a header, and its plausible range.
pub(super) struct HeaderNumber {
    name: &'static str,
    unit: &'static str,
    limits: RangeInclusive<f64>,
}

pub(super) const EXPOSURE: HeaderNumber = HeaderNumber {
    name: "an exposure",
    unit: "s",
    limits: 1e-6..=1e6,
};

pub(super) const PIXEL_SIZE: HeaderNumber = HeaderNumber {
    name: "a pixel",
    unit: "µm",
    limits: 0.1..=200.0,
};

pub(super) const FOCAL_LENGTH: HeaderNumber = HeaderNumber {
    name: "a focal length",
    unit: "mm",
    limits: 1.0..=100_000.0,
};

pub(super) const ALTITUDE: HeaderNumber = HeaderNumber {
    name: "an altitude",
    unit: "degrees",
    limits: 0.0..=90.0,
};

impl FrameMetadata {
    /// Pixel scale at the frame's centre, in radians, where focal length and pixel size are known.
    pub fn pixel_scale_rad(&self) -> Option<f64> {
        const UM_PER_MM: f64 = 1000.0;
        let focal_length_um = self.focal_length_mm? * UM_PER_MM;
        Some(self.pixel_size_um? / focal_length_um)
    }

    /// Returns `value` if it is within the range of `number`; otherwise records it as ignored.
    pub(super) fn plausible(
        &mut self,
        number: &HeaderNumber,
        keyword: &str,
        text: &str,
        value: Option<f64>,
    ) -> Option<f64> {
        let plausible = value.filter(|value| number.limits.contains(value));
        if plausible.is_none() {
            let (low, high) = (number.limits.start(), number.limits.end());
            let HeaderNumber { name, unit, .. } = number;
            self.ignore(
                keyword,
                text,
                &format!("{name} from {low} to {high} {unit}"),
            );
        }
        plausible
    }

    /// Returns `date` if there is one; otherwise records the text as ignored.
    pub(super) fn plausible_date(
        &mut self,
        keyword: &str,
        text: &str,
        date: Option<ObservationDate>,
    ) -> Option<ObservationDate> {
        if date.is_none() {
            let years = crate::base::epoch::YEARS;
            let expected = format!("a date from {} to {}", years.start(), years.end());
            self.ignore(keyword, text, &expected);
        }
        date
    }

    /// Returns the site at a latitude and longitude in degrees and a height in metres. If they are
    /// out of range, records the text as ignored.
    pub(super) fn plausible_site(
        &mut self,
        keywords: &str,
        text: &str,
        place: Option<(f64, f64, f64)>,
    ) -> Option<Site> {
        if place.is_some_and(|(lat, lon, _)| lat == 0.0 && lon == 0.0) {
            // A point in the Gulf of Guinea, and what programs write where no site is set.
            self.ignore(
                keywords,
                text,
                "a site other than 0, 0 (which usually means that none is set)",
            );
            return None;
        }
        let site = place.and_then(|(lat, lon, height)| Site::new(lat, lon, height).ok());
        if site.is_none() {
            self.ignore(
                keywords,
                text,
                "a latitude from -90 to 90 and a longitude from -180 to 360 degrees",
            );
        }
        site
    }

    /// Records a value as ignored.
    pub(super) fn ignore(&mut self, keyword: &str, text: &str, expected: &str) {
        self.ignored.push(IgnoredValue {
            keyword: keyword.to_owned(),
            found: text.to_owned(),
            expected: expected.to_owned(),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_of_4_65_um_behind_35_mm_spans_27_arcseconds() {
        let metadata = FrameMetadata {
            pixel_size_um: Some(4.65),
            focal_length_mm: Some(35.0),
            ..FrameMetadata::default()
        };
        let arcsec = metadata.pixel_scale_rad().unwrap() * crate::base::units::ARCSEC_PER_RAD;
        assert!((arcsec - 27.404).abs() < 1e-3, "{arcsec}");
        assert_eq!(FrameMetadata::default().pixel_scale_rad(), None);
    }

    #[test]
    fn implausible_values_are_recorded_and_not_used() {
        let mut metadata = FrameMetadata::default();
        for (text, value) in [("0", Some(0.0)), ("NaN", Some(f64::NAN)), ("long", None)] {
            assert_eq!(metadata.plausible(&EXPOSURE, "EXPTIME", text, value), None);
        }
        assert_eq!(
            metadata.ignored[0].to_string(),
            "EXPTIME is ignored: found 0, expected an exposure from 0.000001 to 1000000 s"
        );
        assert_eq!(metadata.ignored.len(), 3);
        assert_eq!(
            metadata.plausible(&EXPOSURE, "EXPTIME", "2", Some(2.0)),
            Some(2.0)
        );
        assert_eq!(metadata.ignored.len(), 3);
    }
}
