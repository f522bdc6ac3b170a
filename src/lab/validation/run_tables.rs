//! Both tables of a run, frame by frame.
//!
//! `frames.csv` and `stars.csv` get the rows of one frame after the other, in order. After an interruption they are
//! cut back to the last frame that both have whole.

use super::record::{FrameRecord, StarRecord};
use super::summary::{Accumulator, RunFacts, ValidationSummary};
use crate::store::{CsvTable, RowReader, StoreError, lock};
use serde::Serialize;
use std::fs::File;
use std::path::Path;

/// Frames in a part of the tables.
pub const FRAMES_PER_PART: u64 = 1000;

/// The tables of frames and of stars in a run's directory. No other process can open them
/// meanwhile.
pub struct RunTables {
    _lock: File,
    frames: CsvTable<FrameRecord>,
    stars: CsvTable<StarRecord>,
    /// Number of frames that both tables have.
    done: u64,
    /// Byte offsets of the first row of each part, in both tables.
    part_starts: Vec<[u64; 2]>,
}

/// The rows of a frame as lines of CSV.
pub struct FrameLines {
    frame: Vec<u8>,
    stars: Vec<u8>,
}

impl FrameLines {
    /// The lines of a frame and of its stars.
    ///
    /// # Errors
    /// [`StoreError::Row`].
    pub fn new(frame: &FrameRecord, stars: &[StarRecord]) -> Result<Self, StoreError> {
        Ok(Self {
            frame: lines(std::slice::from_ref(frame))?,
            stars: lines(stars)?,
        })
    }
}

fn lines<R: Serialize>(rows: &[R]) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::WriterBuilder::new()
        .has_headers(false)
        .from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    Ok(writer.into_inner().map_err(|error| error.into_error())?)
}

impl RunTables {
    /// Opens the tables in `directory`, which are new or end with the last frame that both have
    /// whole. `seed_of` is the seed of each frame.
    ///
    /// # Errors
    /// [`StoreError::Locked`], [`StoreError::Changed`], [`StoreError::File`].
    pub fn open(directory: &Path, seed_of: impl Fn(u64) -> u64) -> Result<Self, StoreError> {
        let mut tables = Self {
            _lock: lock_file(directory)?,
            frames: CsvTable::open(directory)?,
            stars: CsvTable::open(directory)?,
            done: 0,
            part_starts: Vec::new(),
        };
        tables.cut_back(seed_of)?;
        Ok(tables)
    }

    /// Number of frames that are done.
    pub fn done(&self) -> u64 {
        self.done
    }

    fn cut_back(&mut self, seed_of: impl Fn(u64) -> u64) -> Result<(), StoreError> {
        let mut frames = self.frames.rows()?;
        let mut stars = self.stars.rows()?;
        let mut ends = [frames.end(), stars.end()];
        self.part_starts.push(ends);
        while let Some(row) = frames.next() {
            let row = row?;
            let (number, seed) = (self.done, seed_of(self.done));
            if (row.frame, row.seed) != (number, seed) {
                return Err(frames.changed(format!(
                    "frame {} with seed {}, expected frame {number} with seed {seed}",
                    row.frame, row.seed
                )));
            }
            if !skip_stars(&mut stars, &row)? {
                break;
            }
            ends = [frames.end(), stars.end()];
            self.count_frame(ends);
        }
        drop((frames, stars));
        self.frames.cut(ends[0])?;
        self.stars.cut(ends[1])
    }

    /// Counts a frame whose rows end at these byte offsets.
    fn count_frame(&mut self, ends: [u64; 2]) {
        self.done += 1;
        if self.done.is_multiple_of(FRAMES_PER_PART) {
            self.part_starts.push(ends);
        }
    }

    /// Adds the next frame: its stars first, so that a frame in the table has all of them.
    ///
    /// # Errors
    /// [`StoreError::File`].
    pub fn add(&mut self, lines: &FrameLines) -> Result<(), StoreError> {
        self.stars.add(&lines.stars)?;
        self.frames.add(&lines.frame)?;
        self.count_frame([self.frames.length(), self.stars.length()]);
        Ok(())
    }

    /// Number of parts that have all their frames.
    pub fn whole_parts(&self) -> u64 {
        self.done / FRAMES_PER_PART
    }

    /// Number of parts, with the last one, which may have fewer frames.
    pub fn parts(&self) -> u64 {
        self.done.div_ceil(FRAMES_PER_PART)
    }

    /// The rows of a part in both tables.
    ///
    /// # Errors
    /// [`StoreError::File`].
    pub fn part(
        &self,
        part: u64,
    ) -> Result<(RowReader<FrameRecord>, RowReader<StarRecord>), StoreError> {
        let part = part as usize;
        let start = self.part_starts[part];
        let lengths = [self.frames.length(), self.stars.length()];
        let end = self.part_starts.get(part + 1).unwrap_or(&lengths);
        Ok((
            self.frames.rows_between([start[0], end[0]])?,
            self.stars.rows_between([start[1], end[1]])?,
        ))
    }

    /// The rows of all frames.
    ///
    /// # Errors
    /// [`StoreError::File`].
    pub fn frames(&self) -> Result<RowReader<FrameRecord>, StoreError> {
        self.frames.rows()
    }

    /// Summarizes all rows. They are read from the files, so that the summary cannot depend on how
    /// often the run was interrupted.
    ///
    /// # Errors
    /// [`StoreError::Changed`], [`StoreError::File`].
    pub fn summary(
        &self,
        facts: RunFacts,
        limit_vmag: f64,
    ) -> Result<ValidationSummary, StoreError> {
        let mut accumulator = Accumulator::new(facts, limit_vmag);
        for frame in self.frames.rows()? {
            accumulator.add_frame(&frame?);
        }
        for star in self.stars.rows()? {
            accumulator.add_star(&star?);
        }
        Ok(accumulator.finish())
    }
}

/// Reads the stars of a frame; whether all of them are there.
fn skip_stars(stars: &mut RowReader<StarRecord>, frame: &FrameRecord) -> Result<bool, StoreError> {
    for _ in 0..frame.star_rows {
        let Some(star) = stars.next() else {
            return Ok(false);
        };
        let found = star?.frame;
        if found != frame.frame {
            return Err(stars.changed(format!(
                "a star of frame {found}, expected one of frame {}",
                frame.frame
            )));
        }
    }
    Ok(true)
}

fn lock_file(directory: &Path) -> Result<File, StoreError> {
    let path = directory.join("run.lock");
    let file = File::create(&path).map_err(StoreError::file("locking", &path))?;
    lock(&file, directory)?;
    Ok(file)
}
