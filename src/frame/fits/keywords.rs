//! Metadata from FITS headers, in the keywords that programs use in practice.
//!
//! - Date: DATE-OBS and its kin, times of day, Julian Dates ([`dates`](super::dates)).
//! - Exposure: EXPTIME, EXPOSURE, EXP-TIME or XPOSURE, in seconds, or EXPOINUS, in microseconds.
//! - Pixel size in micrometres: XPIXSZ, which includes the binning; else PIXSIZE1 or PIXSIZE, which
//!   do not and are multiplied by XBINNING.
//! - Focal length: FOCALLEN, FOCAL or FOCLEN, in millimetres.
//! - Site: SITELAT and SITELONG or SITELON (height SITEELEV), LAT-OBS and LONG-OBS (ALT-OBS), or OBSGEO-B and
//!   OBSGEO-L (OBSGEO-H). Angles in degrees, decimal or sexagesimal, north and east positive;
//!   heights in metres.
//! - Order of the rows: ROWORDER, `TOP-DOWN` or `BOTTOM-UP`. Without it an image is bottom-up, as FITS
//!   viewers draw it and as Siril and PixInsight read it.
//! - Saturation level: SATURATE; else DATAMAX where it is the full scale of 8 to 32 bits, or 1, as
//!   many programs write the highest value of the image there.
//! - Filters of a color camera: BAYERPAT or COLORTYP, `RGGB` and the like, for the first row of the
//!   picture, and shifted by XBAYROFF columns and YBAYROFF rows.
//! - Pixels without light: BIASSEC ([`overscan`](super::overscan)).
//! - Zenith distance: CENTALT or OBJCTALT, the altitude in degrees.
//! - Pointing of the mount: RA and DEC, OBJCTRA and OBJCTDEC, TELRA and TELDEC, or CRVAL1 and CRVAL2 of axes RA and
//!   DEC. Numbers are degrees, sexagesimal right ascensions hours.
//!
//! In keywords with a dash an underscore may stand for it: DATE_OBS.

use super::header::{UnitHeader, parse_number};
use crate::base::angle::Angle;
use crate::ephemeris::observer::Site;
use crate::frame::metadata::{
    ALTITUDE, EXPOSURE, FOCAL_LENGTH, FrameMetadata, HeaderNumber, PIXEL_SIZE,
};
use crate::frame::{BayerPattern, Frame, RowOrder};

/// Metadata from `keywords`.
pub(super) fn metadata(keywords: &Keywords) -> FrameMetadata {
    let mut metadata = FrameMetadata::default();
    metadata.row_order = keywords.row_order(&mut metadata);
    metadata.exposure_s = keywords.exposure_s(&mut metadata);
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
    metadata.bayer_pattern = keywords.bayer_pattern();
    metadata.pointing_deg = keywords.pointing_deg();
    metadata
}

/// The level from which on pixels are saturated, as a header states it.
pub(super) struct StatedSaturation {
    keyword: &'static str,
    level_adu: f64,
}

/// The saturation level from `keywords`.
pub(super) fn saturation(keywords: &Keywords) -> Option<StatedSaturation> {
    let number = |keyword| keywords.number_of(keyword);
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
            metadata.ignore(self.keyword, &text, "a level that no pixel exceeds");
        }
    }
}

/// The keywords of several headers.
pub(super) struct Keywords<'a>(Vec<&'a UnitHeader<'a>>);

impl<'a> Keywords<'a> {
    /// Those of `headers`; earlier headers have priority.
    pub(super) fn new(headers: impl Iterator<Item = &'a UnitHeader<'a>>) -> Self {
        Self(headers.collect())
    }

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

    /// Programs write other things into these keywords, such as `MONO` or names of other mosaics.
    fn bayer_pattern(&self) -> Option<BayerPattern> {
        let texts = ["BAYERPAT", "COLORTYP"].map(|keyword| self.text(keyword));
        let mut stated = texts.iter().flatten();
        let pattern = stated.find_map(|text| BayerPattern::of_name(text))?;
        let offset = |keyword| self.number_of(keyword).map_or(0, |offset| offset as i64);
        Some(pattern.shifted(offset("XBAYROFF"), offset("YBAYROFF")))
    }

    /// The value of `keyword`, which may be written with underscores instead of dashes.
    pub(super) fn text(&self, keyword: &str) -> Option<String> {
        let of = |keyword: &str| self.0.iter().find_map(|header| header.text(keyword));
        let found = of(keyword).or_else(|| {
            let has_dash = keyword.contains('-');
            has_dash.then(|| of(&keyword.replace('-', "_")))?
        });
        found.map(|text| text.into_owned())
    }

    /// The value as a number.
    pub(super) fn number_of(&self, keyword: &str) -> Option<f64> {
        parse_number(&self.text(keyword)?)
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
            metadata.plausible(number, keyword, &text, parse_number(&text))
        })
    }

    /// Where the mount points. Programs write other things into these keywords, or zeros.
    fn pointing_deg(&self) -> Option<[f64; 2]> {
        let is_world = self
            .text("CTYPE1")
            .is_some_and(|axis| axis.starts_with("RA"));
        let pairs = [
            ("RA", "DEC"),
            ("OBJCTRA", "OBJCTDEC"),
            ("TELRA", "TELDEC"),
            ("CRVAL1", "CRVAL2"),
        ];
        let pairs = pairs
            .into_iter()
            .filter(|(ra, _)| *ra != "CRVAL1" || is_world);
        let mut places = pairs.filter_map(|(ra, dec)| {
            let ra_deg = match Angle::parse(&self.text(ra)?)? {
                Angle::Sexagesimal(hours) | Angle::Hours(hours) => 15.0 * hours,
                Angle::Decimal(degrees) | Angle::Degrees(degrees) => degrees,
            };
            Some([ra_deg, Angle::parse(&self.text(dec)?)?.in_degrees()?])
        });
        places.find(|[ra_deg, dec_deg]| {
            let is_place = (0.0..=360.0).contains(ra_deg) && dec_deg.abs() <= 90.0;
            is_place && [*ra_deg, *dec_deg] != [0.0; 2]
        })
    }

    fn exposure_s(&self, metadata: &mut FrameMetadata) -> Option<f64> {
        const SECONDS: [&str; 4] = ["EXPTIME", "EXPOSURE", "EXP-TIME", "XPOSURE"];
        /// Written by capture programs of ZWO.
        const MICROSECONDS: &str = "EXPOINUS";
        let seconds = self.number(metadata, &EXPOSURE, &SECONDS);
        seconds.or_else(|| {
            let text = self.text(MICROSECONDS)?;
            let value = parse_number(&text).map(|microseconds| microseconds / 1e6);
            metadata.plausible(&EXPOSURE, MICROSECONDS, &text, value)
        })
    }

    fn pixel_size_um(&self, metadata: &mut FrameMetadata) -> Option<f64> {
        let as_stored = self.number(metadata, &PIXEL_SIZE, &["XPIXSZ"]);
        as_stored.or_else(|| {
            let unbinned = self.number(metadata, &PIXEL_SIZE, &["PIXSIZE1", "PIXSIZE"])?;
            let binning = self.number_of("XBINNING");
            Some(unbinned * binning.filter(|b| (1.0..=64.0).contains(b)).unwrap_or(1.0))
        })
    }

    fn site(&self, metadata: &mut FrameMetadata) -> Option<Site> {
        [
            ("SITELAT", "SITELONG", "SITEELEV"),
            ("SITELAT", "SITELON", "SITEELEV"),
            ("LAT-OBS", "LONG-OBS", "ALT-OBS"),
            ("OBSGEO-B", "OBSGEO-L", "OBSGEO-H"),
        ]
        .into_iter()
        .find_map(|(lat, lon, height)| {
            let texts = self.text(lat).zip(self.text(lon))?;
            let degrees = |text: &str| Angle::parse(text)?.in_degrees();
            let height_m = self.number_of(height);
            let place = degrees(&texts.0).zip(degrees(&texts.1));
            let place = place.map(|(lat_deg, lon_deg)| (lat_deg, lon_deg, height_m.unwrap_or(0.0)));
            let (keywords, text) = (format!("{lat}, {lon}"), format!("{}, {}", texts.0, texts.1));
            metadata.plausible_site(&keywords, &text, place)
        })
    }
}
