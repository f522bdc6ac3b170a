//! Metadata from FITS headers, in the keywords that programs use in practice.
//!
//! - Date: DATE-OBS, if necessary with the time in TIME-OBS, UT, UTC or UTSTART; else DATE-AVG,
//!   DATE-BEG, DATE-END, MJD-OBS, MJD-AVG or MJD-BEG. The moment within the exposure does not
//!   matter for star positions.
//! - Exposure: EXPTIME, EXPOSURE or EXP_TIME, in seconds.
//! - Pixel size in micrometres: XPIXSZ, which includes the binning; else PIXSIZE1 or PIXSIZE, which
//!   do not and are multiplied by XBINNING.
//! - Focal length: FOCALLEN, FOCAL or FOCLEN, in millimetres.
//! - Site: SITELAT and SITELONG (height SITEELEV), LAT-OBS and LONG-OBS (ALT-OBS), or OBSGEO-B and
//!   OBSGEO-L (OBSGEO-H). Angles in degrees, decimal or sexagesimal, north and east positive;
//!   heights in metres.
//! - Order of the rows: ROWORDER, `TOP-DOWN` or `BOTTOM-UP`. Without it an image is bottom-up, as FITS
//!   viewers draw it and as Siril and PixInsight read it.
//! - Saturation level: SATURATE; else DATAMAX where it is the full scale of 8 to 32 bits, or 1, as
//!   many programs write the highest value of the image there.
//! - Zenith distance: CENTALT or OBJCTALT, the altitude in degrees.
//!
//! The pointing of the mount (OBJCTRA, RA, CRVAL1) is not used.

use super::header::Header;
use crate::base::angle::Angle;
use crate::base::epoch::ObservationDate;
use crate::frame::metadata::{
    ALTITUDE, EXPOSURE, FOCAL_LENGTH, FrameMetadata, HeaderNumber, PIXEL_SIZE,
};
use crate::frame::{Frame, RowOrder};
use crate::sky::observer::Site;

/// Metadata from `headers`; earlier headers have priority.
pub(super) fn metadata<'a>(headers: impl Iterator<Item = &'a Header<'a>>) -> FrameMetadata {
    let keywords = Keywords(headers.collect());
    let mut metadata = FrameMetadata::default();
    metadata.row_order = keywords.row_order(&mut metadata);
    metadata.exposure_s = keywords.number(
        &mut metadata,
        &EXPOSURE,
        &["EXPTIME", "EXPOSURE", "EXP_TIME"],
    );
    metadata.focal_length_mm = keywords.number(
        &mut metadata,
        &FOCAL_LENGTH,
        &["FOCALLEN", "FOCAL", "FOCLEN"],
    );
    metadata.pixel_size_um = keywords.pixel_size_um(&mut metadata);
    metadata.date = keywords.date(&mut metadata);
    metadata.site = keywords.site(&mut metadata);
    let altitude_deg = keywords.number(&mut metadata, &ALTITUDE, &["CENTALT", "OBJCTALT"]);
    metadata.zenith_distance_deg = altitude_deg.map(|altitude| 90.0 - altitude);
    metadata
}

/// The level from which on pixels are saturated, as a header states it.
pub(super) struct StatedSaturation {
    keyword: &'static str,
    level_adu: f64,
}

/// The saturation level from `headers`; earlier headers have priority.
pub(super) fn saturation<'a>(
    headers: impl Iterator<Item = &'a Header<'a>>,
) -> Option<StatedSaturation> {
    let keywords = Keywords(headers.collect());
    let number = |keyword| keywords.0.iter().find_map(|header| header.number(keyword));
    let stated = |keyword, level_adu| StatedSaturation { keyword, level_adu };
    let saturate = number("SATURATE").map(|level| stated("SATURATE", level));
    let is_full_scale = |level: &f64| {
        let of_bits = |bits| [0.0, 1.0].map(|less| f64::powi(2.0, bits) - less);
        *level == 1.0 || (8..=32).flat_map(of_bits).any(|full| full == *level)
    };
    saturate.or_else(|| {
        let highest = number("DATAMAX").filter(is_full_scale);
        highest.map(|level| stated("DATAMAX", level))
    })
}

impl StatedSaturation {
    /// Lowers the saturation level of `frame` to this, unless it is implausible.
    pub fn apply(&self, frame: &mut Frame<'_>, metadata: &mut FrameMetadata) {
        let level_adu = self.level_adu as f32;
        if frame.can_saturate_at(level_adu) {
            let of_format = frame.saturation_adu.unwrap_or(f32::INFINITY);
            frame.saturation_adu = Some(level_adu.min(of_format));
        } else {
            let text = self.level_adu.to_string();
            metadata.ignore(self.keyword, &text, "a level that the data do not exceed");
        }
    }
}

struct Keywords<'a>(Vec<&'a Header<'a>>);

impl Keywords<'_> {
    fn row_order(&self, metadata: &mut FrameMetadata) -> RowOrder {
        const KEYWORD: &str = "ROWORDER";
        let Some(text) = self.text(KEYWORD) else {
            return RowOrder::BottomUp;
        };
        RowOrder::of_keyword(&text).unwrap_or_else(|| {
            metadata.ignore(KEYWORD, &text, "TOP-DOWN or BOTTOM-UP");
            RowOrder::BottomUp
        })
    }

    fn text(&self, keyword: &str) -> Option<String> {
        let found = self.0.iter().find_map(|header| header.text(keyword));
        found.map(|text| text.into_owned())
    }

    /// The first plausible value among `keywords`.
    fn number(
        &self,
        metadata: &mut FrameMetadata,
        number: &HeaderNumber,
        keywords: &[&str],
    ) -> Option<f64> {
        keywords.iter().find_map(|keyword| {
            let text = self.text(keyword)?;
            let value = self.0.iter().find_map(|header| header.number(keyword));
            metadata.plausible(number, keyword, &text, value)
        })
    }

    fn pixel_size_um(&self, metadata: &mut FrameMetadata) -> Option<f64> {
        let as_stored = self.number(metadata, &PIXEL_SIZE, &["XPIXSZ"]);
        as_stored.or_else(|| {
            let unbinned = self.number(metadata, &PIXEL_SIZE, &["PIXSIZE1", "PIXSIZE"])?;
            let binning = self.0.iter().find_map(|header| header.number("XBINNING"));
            Some(unbinned * binning.filter(|b| (1.0..=64.0).contains(b)).unwrap_or(1.0))
        })
    }

    fn site(&self, metadata: &mut FrameMetadata) -> Option<Site> {
        [
            ("SITELAT", "SITELONG", "SITEELEV"),
            ("LAT-OBS", "LONG-OBS", "ALT-OBS"),
            ("OBSGEO-B", "OBSGEO-L", "OBSGEO-H"),
        ]
        .into_iter()
        .find_map(|(lat, lon, height)| {
            let texts = self.text(lat).zip(self.text(lon))?;
            let degrees = |text: &str| Angle::parse(text)?.in_degrees();
            let height_m = self.0.iter().find_map(|header| header.number(height));
            let place = degrees(&texts.0).zip(degrees(&texts.1));
            let place = place.map(|(lat_deg, lon_deg)| (lat_deg, lon_deg, height_m.unwrap_or(0.0)));
            let (keywords, text) = (format!("{lat}, {lon}"), format!("{}, {}", texts.0, texts.1));
            metadata.plausible_site(&keywords, &text, place)
        })
    }

    fn date(&self, metadata: &mut FrameMetadata) -> Option<ObservationDate> {
        let calendar = ["DATE-OBS", "DATE-AVG", "DATE-BEG", "DATE-END"];
        let from_calendar = calendar.iter().find_map(|keyword| {
            let text = self.text(keyword)?;
            let date = self.calendar_date(&text);
            metadata.plausible_date(keyword, &text, date)
        });
        from_calendar.or_else(|| {
            ["MJD-OBS", "MJD-AVG", "MJD-BEG"]
                .iter()
                .find_map(|keyword| {
                    let text = self.text(keyword)?;
                    let days = self.0.iter().find_map(|header| header.number(keyword));
                    let date = days.and_then(ObservationDate::from_modified_julian_date);
                    metadata.plausible_date(keyword, &text, date)
                })
        })
    }

    /// Parses ISO 8601, or DD/MM/YY as in FITS until 1999.
    fn calendar_date(&self, text: &str) -> Option<ObservationDate> {
        let day = match text.split('/').collect::<Vec<_>>()[..] {
            [day, month, year] if year.len() == 2 => format!("19{year}-{month}-{day}"),
            _ => text.to_owned(),
        };
        if day.contains('T') {
            return day.parse().ok();
        }
        let times = ["TIME-OBS", "UT", "UTC", "UTSTART"];
        let with_time = times.iter().find_map(|keyword| {
            let time = self.text(keyword)?;
            format!("{day}T{time}").parse().ok()
        });
        with_time.or_else(|| day.parse().ok())
    }
}
