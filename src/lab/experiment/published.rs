//! The paper's data of its experiments.

use crate::base::coords::PixelPoint;
use crate::base::epoch::ObservationDate;
use crate::camera::data_sheet::Preset;
use crate::ephemeris::observer::Site;
use serde::Deserialize;

/// An experiment as it was published.
#[derive(Debug, Clone, PartialEq)]
pub struct Published {
    /// Its number in the paper.
    pub number: u8,
    /// Its camera, with exposure, sky and zenith distance.
    pub preset: Preset,
    /// Date of the frame.
    pub date: ObservationDate,
    /// Site.
    pub site: Site,
    /// The limiting magnitude that the paper computes: V, eq. (13) and (14).
    pub limit_vmag: f64,
    /// The faintest star that it found, in V.
    pub faintest_vmag: f64,
    /// The stars of its table.
    pub stars: Vec<PublishedStar>,
}

/// A star of table 3 or 4.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct PublishedStar {
    /// Its number in SKY2000.
    pub skymap_number: u32,
    /// Column of its centroid, in pixels.
    pub x_px: f64,
    /// Row of its centroid, in pixels.
    pub y_px: f64,
    /// V magnitude.
    pub vmag: f64,
}

impl PublishedStar {
    /// Position of its centroid.
    pub fn position(&self) -> PixelPoint {
        PixelPoint::new(self.x_px, self.y_px)
    }
}

impl Published {
    /// Experiment 1 or 2; `None` for other numbers.
    ///
    /// # Reference
    /// Tong, Li & Wang 2014, section 2.2.
    pub fn experiment(number: u8) -> Option<Self> {
        let (preset, date, limit_vmag, table) = match number {
            1 => (
                Preset::Experiment1,
                "2014-03-13T21:18+08:00",
                8.15,
                include_str!("table-3.csv"),
            ),
            2 => (
                Preset::Experiment2,
                "2014-05-12T21:05+08:00",
                9.01,
                include_str!("table-4.csv"),
            ),
            _ => return None,
        };
        let stars = rows(table);
        Some(Self {
            number,
            preset,
            date: date.parse().ok()?,
            site: Site::new(38.874, 121.667, 0.0).ok()?,
            limit_vmag,
            faintest_vmag: stars.iter().map(|star| star.vmag).fold(f64::MIN, f64::max),
            stars,
        })
    }
}

/// The rows of a built-in table; a test checks that they are complete.
fn rows(table: &str) -> Vec<PublishedStar> {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(table.as_bytes());
    reader.deserialize().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_are_complete_and_their_faintest_stars_are_the_papers() {
        let [first, second] = [1, 2].map(|number| Published::experiment(number).unwrap());
        assert_eq!((first.stars.len(), second.stars.len()), (7, 9));
        assert_eq!((first.faintest_vmag, second.faintest_vmag), (8.17, 8.97));
        assert_eq!(first.stars[6].skymap_number, 14_250_073);
        assert_eq!(second.stars[1].position(), PixelPoint::new(152.06, 172.85));
        assert_eq!(first.date.to_iso(), "2014-03-13T13:18:00Z");
        assert_eq!(second.date.to_iso(), "2014-05-12T13:05:00Z");
        assert_eq!(Published::experiment(3), None);
    }
}
