//! Exif attributes in TIFF, JPEG and PNG.
//!
//! Exif attributes → [`FrameMetadata`], from `DateTimeOriginal`, `ExposureTime`, `FocalLength`,
//! `FocalPlaneXResolution`, the GPS position and `Orientation`. TIFF's own `DateTime` is ignored: it is the time
//! at which the file was last changed.
//!
//! Caveat: without `OffsetTimeOriginal` or `OffsetTime` the time is that of a local clock.

use super::metadata::{EXPOSURE, FOCAL_LENGTH, FrameMetadata, HeaderNumber, PIXEL_SIZE};
use super::orientation::Orientation;
use crate::base::epoch::ObservationDate;
use crate::ephemeris::observer::Site;
use exif::{Field, In, Reader, Tag, Value};

/// Metadata from the Exif attributes in `bytes`, which have the layout of a TIFF file, for a frame
/// `width` pixels wide. Attributes that cannot be parsed are skipped.
pub(super) fn metadata(bytes: &[u8], width: usize) -> FrameMetadata {
    let attributes = Attributes(fields(bytes));
    let mut metadata = FrameMetadata::default();
    metadata.orientation = attributes.orientation();
    metadata.exposure_s = attributes.number(&mut metadata, &EXPOSURE, Tag::ExposureTime);
    metadata.focal_length_mm = attributes.number(&mut metadata, &FOCAL_LENGTH, Tag::FocalLength);
    metadata.pixel_size_um = attributes.pixel_size_um(&mut metadata, width);
    metadata.site = attributes.site(&mut metadata);
    if let Some(day) = attributes.text(Tag::DateTimeOriginal) {
        let date = attributes.date(&day);
        metadata.date = metadata.plausible_date("DateTimeOriginal", &day, date);
        let is_local = metadata.date.is_some_and(|date| !date.has_time());
        metadata.local_date = is_local.then(|| attributes.local_date(&day)).flatten();
    }
    metadata
}

/// All attributes that can be parsed. Many cameras write Exif that violates the standard somewhere.
fn fields(bytes: &[u8]) -> Vec<Field> {
    if let Ok((fields, _)) = exif::parse_exif(bytes) {
        return fields;
    }
    let mut lenient = Reader::new();
    let read = lenient.continue_on_error(true).read_raw(bytes.to_vec());
    let exif = read.or_else(|error| error.distill_partial_result(|_| ()));
    exif.map_or(Vec::new(), |exif| exif.fields().cloned().collect())
}

struct Attributes(Vec<Field>);

impl Attributes {
    fn value(&self, tag: Tag) -> Option<&Value> {
        let field = self
            .0
            .iter()
            .find(|field| field.tag == tag && field.ifd_num == In::PRIMARY)?;
        Some(&field.value)
    }

    fn text(&self, tag: Tag) -> Option<String> {
        match self.value(tag)? {
            Value::Ascii(lines) => {
                let text = String::from_utf8_lossy(lines.first()?);
                let text = text.trim_matches(['\0', ' ']).to_owned();
                // Cameras without a clock write blanks and colons.
                text.contains(|c: char| c.is_ascii_digit()).then_some(text)
            }
            _ => None,
        }
    }

    fn raw_number(&self, tag: Tag) -> Option<f64> {
        match self.value(tag)? {
            Value::Rational(numbers) => Some(numbers.first()?.to_f64()),
            Value::SRational(numbers) => Some(numbers.first()?.to_f64()),
            Value::Float(numbers) => numbers.first().map(|number| f64::from(*number)),
            Value::Double(numbers) => numbers.first().copied(),
            other => other.get_uint(0).map(f64::from),
        }
    }

    /// How the picture is drawn: as stored if the attribute is absent or has no such value.
    fn orientation(&self) -> Orientation {
        let value = self.value(Tag::Orientation).and_then(|v| v.get_uint(0));
        value.and_then(Orientation::of_tag).unwrap_or_default()
    }

    fn number(&self, metadata: &mut FrameMetadata, number: &HeaderNumber, tag: Tag) -> Option<f64> {
        let value = self.raw_number(tag)?;
        metadata.plausible(number, &tag.to_string(), &value.to_string(), Some(value))
    }

    /// The pixel pitch, from the resolution in the focal plane. If the image was scaled down, its
    /// pixels are larger by that factor.
    fn pixel_size_um(&self, metadata: &mut FrameMetadata, width: usize) -> Option<f64> {
        let per_unit = self.raw_number(Tag::FocalPlaneXResolution)?;
        let unit_um = match self
            .value(Tag::FocalPlaneResolutionUnit)
            .and_then(|unit| unit.get_uint(0))
        {
            Some(3) => 10_000.0,
            Some(4) => 1000.0,
            Some(5) => 1.0,
            // Inches are the default.
            _ => 25_400.0,
        };
        let original_width = self
            .raw_number(Tag::PixelXDimension)
            .filter(|width| *width > 0.0);
        let reduction = original_width.map_or(1.0, |original| original / width as f64);
        let size_um = unit_um / per_unit * reduction;
        metadata.plausible(
            &PIXEL_SIZE,
            &Tag::FocalPlaneXResolution.to_string(),
            &format!("{per_unit} pixels on {unit_um} µm"),
            Some(size_um),
        )
    }

    /// The GPS position: degrees, minutes and seconds as ratios, and a letter for the hemisphere.
    fn site(&self, metadata: &mut FrameMetadata) -> Option<Site> {
        let angle = |tag: Tag, letter: Tag, negative: u8| -> Option<f64> {
            let Value::Rational(parts) = self.value(tag)? else {
                return None;
            };
            let sixtieths = [1.0, 60.0, 3600.0];
            let parts = parts
                .iter()
                .zip(sixtieths)
                .map(|(part, n)| part.to_f64() / n);
            let degrees: f64 = parts.sum();
            let is_negative = match self.value(letter)? {
                Value::Ascii(lines) => lines.first()?.first()?.eq_ignore_ascii_case(&negative),
                _ => return None,
            };
            Some(if is_negative { -degrees } else { degrees })
        };
        let lat_deg = angle(Tag::GPSLatitude, Tag::GPSLatitudeRef, b'S')?;
        let lon_deg = angle(Tag::GPSLongitude, Tag::GPSLongitudeRef, b'W')?;
        let is_below = self.value(Tag::GPSAltitudeRef).and_then(|v| v.get_uint(0)) == Some(1);
        let height_m = self.raw_number(Tag::GPSAltitude).unwrap_or(0.0);
        let height_m = if is_below { -height_m } else { height_m };
        let text = format!("{lat_deg}, {lon_deg}");
        metadata.plausible_site(
            "GPSLatitude, GPSLongitude",
            &text,
            Some((lat_deg, lon_deg, height_m)),
        )
    }

    /// Parses a date as Exif writes it, `2019:07:29 20:47:26`: in UTC where the offset of the clock is
    /// stated, else the day.
    fn date(&self, text: &str) -> Option<ObservationDate> {
        let offset = self
            .text(Tag::OffsetTimeOriginal)
            .or_else(|| self.text(Tag::OffsetTime));
        let in_utc = offset.and_then(|offset| self.iso(text, &offset).parse().ok());
        let (day, _) = text.split_once(' ').unwrap_or((text, ""));
        in_utc.or_else(|| day.replace(':', "-").parse().ok())
    }

    /// The same as the clock showed it, with its time.
    fn local_date(&self, text: &str) -> Option<ObservationDate> {
        let shown = self.iso(text, "").parse().ok();
        shown.filter(ObservationDate::has_time)
    }

    /// The date in ISO 8601, with its fraction of a second, and this after it.
    fn iso(&self, text: &str, offset: &str) -> String {
        let (day, time) = text.split_once(' ').unwrap_or((text, ""));
        let day = day.replace(':', "-");
        let fraction = self
            .text(Tag::SubSecTimeOriginal)
            .map_or(String::new(), |digits| format!(".{digits}"));
        format!("{day}T{time}{fraction}{offset}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use exif::Rational;
    use exif::experimental::Writer;
    use std::io::Cursor;

    fn field(tag: Tag, value: Value) -> Field {
        Field {
            tag,
            ifd_num: In::PRIMARY,
            value,
        }
    }

    fn ascii(text: &str) -> Value {
        Value::Ascii(vec![text.as_bytes().to_vec()])
    }

    fn ratio(num: u32, denom: u32) -> Value {
        Value::Rational(vec![Rational { num, denom }])
    }

    fn written(fields: &[Field]) -> Vec<u8> {
        let mut writer = Writer::new();
        fields.iter().for_each(|field| writer.push_field(field));
        let mut out = Cursor::new(Vec::new());
        writer.write(&mut out, false).unwrap();
        out.into_inner()
    }

    #[test]
    fn a_camera_s_attributes_are_read() {
        let bytes = written(&[
            field(Tag::DateTimeOriginal, ascii("2019:07:29 22:47:26")),
            field(Tag::OffsetTimeOriginal, ascii("+02:00")),
            field(Tag::SubSecTimeOriginal, ascii("25")),
            field(Tag::ExposureTime, ratio(1, 4)),
            field(Tag::FocalLength, ratio(350, 10)),
            field(Tag::FocalPlaneXResolution, ratio(2000, 1)),
            field(Tag::FocalPlaneResolutionUnit, Value::Short(vec![3])),
            field(Tag::PixelXDimension, Value::Long(vec![6000])),
        ]);
        let metadata = metadata(&bytes, 3000);
        assert_eq!(metadata.date.unwrap().to_iso(), "2019-07-29T20:47:26.25Z");
        assert_eq!(metadata.exposure_s, Some(0.25));
        assert_eq!(metadata.focal_length_mm, Some(35.0));
        // 5 µm as taken, at half the width.
        assert_eq!(metadata.pixel_size_um, Some(10.0));
        assert!(metadata.ignored.is_empty(), "{:?}", metadata.ignored);
    }

    #[test]
    fn a_gps_position_is_read_and_one_without_a_fix_is_recorded() {
        let three = |parts: [(u32, u32); 3]| {
            let ratio = |(num, denom)| Rational { num, denom };
            Value::Rational(parts.map(ratio).to_vec())
        };
        let place = |latitude| {
            let bytes = written(&[
                field(Tag::GPSLatitudeRef, ascii("S")),
                field(Tag::GPSLatitude, latitude),
                field(Tag::GPSLongitudeRef, ascii("W")),
                field(Tag::GPSLongitude, three([(70, 1), (44, 1), (120, 10)])),
                field(Tag::GPSAltitude, ratio(2700, 1)),
            ]);
            metadata(&bytes, 10)
        };
        let site = place(three([(30, 1), (14, 1), (27, 1)])).site.unwrap();
        assert!((site.lat_deg() + 30.0 + 14.0 / 60.0 + 27.0 / 3600.0).abs() < 1e-9);
        assert!((site.lon_deg() + 70.0 + 44.0 / 60.0 + 12.0 / 3600.0).abs() < 1e-9);
        assert_eq!(site.height_m(), 2700.0);
        let lost = place(three([(0, 0), (0, 0), (0, 0)]));
        assert_eq!((lost.site, lost.ignored.len()), (None, 1));
    }

    #[test]
    fn jpeg_png_and_tiff_carry_it() {
        use image::{ExtendedColorType, ImageEncoder, codecs};
        let exif = written(&[field(Tag::ExposureTime, ratio(1, 4))]);
        let mut jpeg = Vec::new();
        let mut encoder = codecs::jpeg::JpegEncoder::new(&mut jpeg);
        encoder.set_exif_metadata(exif.clone()).unwrap();
        let grey = ExtendedColorType::L8;
        encoder.write_image(&[7; 64], 8, 8, grey).unwrap();
        let mut png = Vec::new();
        let mut encoder = codecs::png::PngEncoder::new(&mut png);
        encoder.set_exif_metadata(exif).unwrap();
        encoder.write_image(&[7; 64], 8, 8, grey).unwrap();
        let mut tiff = Cursor::new(Vec::new());
        let mut encoder = tiff::encoder::TiffEncoder::new(&mut tiff).unwrap();
        let mut directory = encoder.extra_directory().unwrap();
        let exposure = tiff::encoder::Rational { n: 1, d: 4 };
        let tag = tiff::tags::Tag::Unknown(Tag::ExposureTime.number());
        directory.write_tag(tag, exposure).unwrap();
        let offset = directory.finish_with_offsets().unwrap();
        let mut image = encoder
            .new_image::<tiff::encoder::colortype::Gray8>(8, 8)
            .unwrap();
        let pointer = tiff::tags::Tag::ExifDirectory;
        image
            .encoder()
            .write_tag(pointer, offset.pointer.0 as u32)
            .unwrap();
        image.write_data(&[7; 64]).unwrap();
        for file in [jpeg, png, tiff.into_inner()] {
            let frame = crate::frame::decode(&file).unwrap();
            assert_eq!(frame.metadata.exposure_s, Some(0.25));
        }
    }

    #[test]
    fn undamaged_attributes_among_damaged_ones_are_read() {
        let mut bytes = written(&[
            field(Tag::ExposureTime, ratio(1, 4)),
            field(Tag::FocalLength, ratio(350, 10)),
        ]);
        let entry = Tag::FocalLength.number().to_be_bytes();
        let at = bytes.windows(2).position(|w| w == entry).unwrap();
        bytes[at + 8] = 0xff;
        let metadata = metadata(&bytes, 10);
        assert_eq!(
            (metadata.exposure_s, metadata.focal_length_mm),
            (Some(0.25), None)
        );
    }

    #[test]
    fn without_a_time_zone_the_time_is_local() {
        let bytes = written(&[field(Tag::DateTimeOriginal, ascii("2019:07:29 22:47:26"))]);
        let found = metadata(&bytes, 10);
        assert_eq!(found.date.unwrap().to_iso(), "2019-07-29");
        assert_eq!(found.local_date.unwrap().to_iso(), "2019-07-29T22:47:26Z");
        let stated = metadata(
            &written(&[
                field(Tag::DateTimeOriginal, ascii("2019:07:29 22:47:26")),
                field(Tag::OffsetTime, ascii("+02:00")),
            ]),
            10,
        );
        assert_eq!(stated.date.unwrap().to_iso(), "2019-07-29T20:47:26Z");
        assert_eq!(stated.local_date, None);
        let day = metadata(
            &written(&[field(Tag::DateTimeOriginal, ascii("2019:07:29"))]),
            10,
        );
        assert_eq!(day.local_date, None);
    }

    #[test]
    fn implausible_attributes_are_recorded_but_an_unset_clock_is_not() {
        let bytes = written(&[
            field(Tag::DateTimeOriginal, ascii("0000:00:00 00:00:00")),
            field(Tag::FocalLength, ratio(0, 1)),
            field(Tag::ExposureTime, ratio(1, 0)),
        ]);
        let noted = metadata(&bytes, 10);
        assert_eq!(noted.ignored.len(), 3, "{:?}", noted.ignored);
        assert_eq!((noted.date, noted.focal_length_mm), (None, None));
        let blank = written(&[field(Tag::DateTimeOriginal, ascii("    :  :     :  :  "))]);
        assert_eq!(metadata(&blank, 10), FrameMetadata::default());
    }
}
