//! One block of memory, divided into what is kept in it.

use crate::detect::TILE_PX;
use crate::matching::{Match, Predicted};
use crate::{Catalog, Config, Error};
use bytemuck::Pod;

/// Rows that are filtered at once, and those that peaks are sought in.
pub(crate) const MAX_TAPS: usize = 9;
pub(crate) const PEAK_ROWS: usize = 3;
/// Cells along each side of the frame in which spots are looked up.
pub(crate) const LOOKUP_SIDE: usize = 32;

/// What is kept in the block.
#[derive(Debug)]
pub(crate) struct Buffers<'a> {
    /// A row of the image, rows filtered along x, and rows filtered along both.
    pub rows: &'a mut [f32],
    /// Level and noise of each tile of the image.
    pub tiles: &'a mut [[f32; 2]],
    /// Stars that are to be seen.
    pub predicted: &'a mut [Predicted],
    /// Spots and their stars.
    pub matches: &'a mut [Match],
    /// Direction of each spot.
    pub directions: &'a mut [[f64; 3]],
    /// The first spot of each cell of the frame, and the next one of each spot; 0 is none.
    pub first: &'a mut [u16],
    pub next: &'a mut [u16],
    /// Spots that are matched.
    pub taken: &'a mut [u8],
}

/// Elements of each buffer, in the order of [`Buffers`].
struct Lengths {
    rows: usize,
    tiles: usize,
    predicted: usize,
    spots: usize,
}

impl Lengths {
    fn new(config: &Config, catalog: &Catalog) -> Self {
        let [width, height] =
            [config.camera.width_px, config.camera.height_px].map(|side| side as usize);
        Self {
            rows: (1 + MAX_TAPS + PEAK_ROWS) * width,
            tiles: width.div_ceil(TILE_PX) * height.div_ceil(TILE_PX),
            predicted: catalog.most_in_view(),
            spots: config.max_stars as usize,
        }
    }

    fn words(&self) -> usize {
        words_of::<f32>(self.rows)
            + words_of::<[f32; 2]>(self.tiles)
            + words_of::<Predicted>(self.predicted)
            + words_of::<Match>(self.spots)
            + words_of::<[f64; 3]>(self.spots)
            + words_of::<u16>(LOOKUP_SIDE * LOOKUP_SIDE)
            + words_of::<u16>(self.spots)
            + words_of::<u8>(self.spots)
    }
}

/// Words of 8 bytes of the block for this configuration and catalogue.
pub(crate) fn words(config: &Config, catalog: &Catalog) -> usize {
    Lengths::new(config, catalog).words()
}

impl<'a> Buffers<'a> {
    pub(crate) fn new(
        block: &'a mut [u64],
        config: &Config,
        catalog: &Catalog,
    ) -> Result<Self, Error> {
        let lengths = Lengths::new(config, catalog);
        if block.len() < lengths.words() {
            return Err(Error::Memory);
        }
        let mut rest = block;
        Ok(Self {
            rows: take(&mut rest, lengths.rows),
            tiles: take(&mut rest, lengths.tiles),
            predicted: take(&mut rest, lengths.predicted),
            matches: take(&mut rest, lengths.spots),
            directions: take(&mut rest, lengths.spots),
            first: take(&mut rest, LOOKUP_SIDE * LOOKUP_SIDE),
            next: take(&mut rest, lengths.spots),
            taken: take(&mut rest, lengths.spots),
        })
    }
}

fn words_of<T>(count: usize) -> usize {
    (count * size_of::<T>()).div_ceil(size_of::<u64>())
}

fn take<'a, T: Pod>(rest: &mut &'a mut [u64], count: usize) -> &'a mut [T] {
    let (words, after) = core::mem::take(rest).split_at_mut(words_of::<T>(count));
    *rest = after;
    let bytes = &mut bytemuck::cast_slice_mut::<u64, u8>(words)[..count * size_of::<T>()];
    bytemuck::cast_slice_mut(bytes)
}
