//! The sky at each place of a frame, on the grid that all frames of a night share.

use crate::sky::{Place, SkyCell, SkyMap, horizon_places};
use serde::{Deserialize, Serialize};

/// The sky in the cells of `horizon_places`, in their order; `null` where nothing is known.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct NightCells {
    /// Brightness: V magnitude of a square arcsecond.
    pub mag_arcsec2: Box<[Hundredths]>,
    /// Extinction beyond that of clear air, in magnitudes.
    pub extinction_mag: Box<[Hundredths]>,
    /// Probability that this is below 0.2 mag.
    pub clear: Box<[Hundredths]>,
}

/// A number of two decimals between ±327, or none, in two bytes: a night has a million of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Option<f64>", into = "Option<f64>")]
pub struct Hundredths(i16);

impl Hundredths {
    const NONE: i16 = i16::MIN;

    /// The number.
    pub fn get(self) -> Option<f64> {
        (self.0 != Self::NONE).then(|| f64::from(self.0) / 100.0)
    }
}

impl From<Option<f64>> for Hundredths {
    fn from(value: Option<f64>) -> Self {
        let hundredths = |value: f64| (100.0 * value).round().max(f64::from(Self::NONE + 1)) as i16;
        let known = value.filter(|value| !value.is_nan());
        Self(known.map_or(Self::NONE, hundredths))
    }
}

impl From<Hundredths> for Option<f64> {
    fn from(value: Hundredths) -> Self {
        value.get()
    }
}

impl NightCells {
    /// Those of a sky that is divided by altitude and azimuth, else `None`.
    pub(super) fn from_sky(sky: &SkyMap) -> Option<Self> {
        let mut cells = sky.cells.iter().peekable();
        // Both are in the same order.
        let at_places: Vec<Option<&SkyCell>> = horizon_places()
            .iter()
            .map(|place| cells.next_if(|cell| cell.place == *place))
            .collect();
        let values = |of: fn(&SkyCell) -> Option<f64>| {
            let of_cell = |cell: &Option<&SkyCell>| Hundredths::from(cell.and_then(of));
            at_places.iter().map(of_cell).collect()
        };
        (sky.cells.len() > 1 && cells.peek().is_none()).then(|| Self {
            mag_arcsec2: values(|cell| Some(cell.light?.mag_arcsec2.value)),
            extinction_mag: values(|cell| Some(cell.extinction_mag?.value)),
            clear: values(|cell| cell.clear),
        })
    }
}

/// Altitude and azimuth of the middle of each cell, in degrees.
pub(super) fn middles_deg() -> Vec<[f64; 2]> {
    let middle = |range: [f64; 2]| 0.5 * (range[0] + range[1]);
    let of = |place: &Place| match *place {
        Place::Horizon {
            altitude_deg,
            azimuth_deg,
        } => [middle(altitude_deg), middle(azimuth_deg)],
        Place::Frame { .. } => [f64::NAN; 2],
    };
    horizon_places().iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_decimals_are_kept_and_written_as_they_are() {
        for (text, value) in [
            ("21.37", Some(21.37)),
            ("-0.05", Some(-0.05)),
            ("0.0", Some(0.0)),
            ("null", None),
        ] {
            let cell: Hundredths = serde_json::from_str(text).unwrap();
            assert_eq!(cell.get(), value);
            assert_eq!(serde_json::to_string(&cell).unwrap(), text);
        }
        assert_eq!(Hundredths::from(Some(f64::NAN)).get(), None);
        assert_eq!(Hundredths::from(Some(-1e9)).get(), Some(-327.67));
        assert_eq!(size_of::<Hundredths>(), 2);
    }
}
