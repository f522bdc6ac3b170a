//! The size of a frame, by who states it and by its camera.

use crate::base::size::Size;

/// Why a frame has no size that all who state one agree on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameSizeError {
    /// The frame is stated to have another size than the camera's frames.
    #[error(
        "the frame size was given as {}, but the camera description says {} × {} pixels",
        sides(*stated), camera.width, camera.height
    )]
    Contradiction {
        /// Stated width and height, in pixels.
        stated: [Option<usize>; 2],
        /// Size of the camera's frames.
        camera: Size,
    },
    /// The camera's data sheet and its lens are of frames of two sizes.
    #[error(
        "the camera description says {} × {} pixels, but its lens was measured in frames of {} × {}: give \
         the width and height of the frame",
        sheet.width, sheet.height, lens.width, lens.height
    )]
    Ambiguous {
        /// Size by the data sheet.
        sheet: Size,
        /// Size by the lens.
        lens: Size,
    },
}

/// Sides in words.
fn sides(stated: [Option<usize>; 2]) -> String {
    let named = [(stated[0], "wide"), (stated[1], "high")];
    let named = named
        .iter()
        .filter_map(|(side, name)| Some(format!("{} pixels {name}", (*side)?)));
    named.collect::<Vec<_>>().join(" and ")
}

/// Width and height of a frame, as they are stated, or as those of its camera, whose frames have one of
/// `sizes`; `None` where nobody states them.
///
/// # Errors
/// [`FrameSizeError`] where they contradict each other.
pub(crate) fn agreed_size(
    stated: [Option<usize>; 2],
    sizes: &[Size],
) -> Result<[Option<usize>; 2], FrameSizeError> {
    let Some(camera) = sizes.first() else {
        return Ok(stated);
    };
    let is_stated = |size: &&Size| {
        let mut sides = size.sides().into_iter().zip(stated);
        sides.all(|(side, stated)| stated.is_none_or(|stated| stated == side))
    };
    let mut fitting = sizes.iter().filter(is_stated);
    let Some(size) = fitting.next() else {
        return Err(FrameSizeError::Contradiction {
            stated,
            camera: *camera,
        });
    };
    match fitting.find(|other| *other != size) {
        None => Ok(size.sides().map(Some)),
        Some(lens) => Err(FrameSizeError::Ambiguous {
            sheet: *size,
            lens: *lens,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_completes_what_is_stated() {
        let camera = [Size::new(2592, 1944)];
        for stated in [
            [None, None],
            [Some(2592), None],
            [None, Some(1944)],
            [Some(2592), Some(1944)],
        ] {
            let size = agreed_size(stated, &camera).unwrap();
            assert_eq!(size, [Some(2592), Some(1944)]);
        }
        assert_eq!(agreed_size([Some(7), None], &[]), Ok([Some(7), None]));
    }

    #[test]
    fn what_contradicts_the_camera_is_refused() {
        let camera = [Size::new(2592, 1944)];
        let error = |stated| agreed_size(stated, &camera).unwrap_err().to_string();
        assert_eq!(
            error([Some(1000), None]),
            "the frame size was given as 1000 pixels wide, but the camera description says 2592 × 1944 pixels"
        );
        assert_eq!(
            error([Some(2592), Some(1945)]),
            "the frame size was given as 2592 pixels wide and 1945 pixels high, but the camera description \
             says 2592 × 1944 pixels"
        );
    }

    #[test]
    fn a_lens_of_other_frames_than_the_data_sheets_leaves_the_size_open() {
        let sizes = [Size::new(2592, 1944), Size::new(1296, 972)];
        let error = agreed_size([None, None], &sizes).unwrap_err();
        assert!(
            error.to_string().contains("give the width and height"),
            "{error}"
        );
        let binned = agreed_size([Some(1296), None], &sizes);
        assert_eq!(binned, Ok([Some(1296), Some(972)]));
        let same = [Size::new(2592, 1944); 2];
        assert!(agreed_size([None, None], &same).is_ok());
    }
}
