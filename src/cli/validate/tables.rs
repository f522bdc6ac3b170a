//! The tables of a run as CSV: rows are added in the order of the frames, and after an interruption cut back to the last whole
//! frame.

use super::columns::Row;
use super::parquet::{self, FRAMES_PER_PART};
use anyhow::{Context, anyhow, bail};
use serde::Serialize;
use starpipe::study::validation::{FrameRecord, StarRecord};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufReader, Read, Seek, SeekFrom, Take, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

/// The rows of frames and of stars that a directory holds.
pub(super) struct Tables {
    directory: PathBuf,
    /// Held as long as this lives: no other run is at work here.
    _lock: File,
    frames: Table<FrameRecord>,
    stars: Table<StarRecord>,
    /// Frames that both have.
    done: u64,
    /// Where the rows of each part begin.
    part_starts: Vec<[u64; 2]>,
    /// The first so many parts are there.
    parts_written: u64,
}

/// The rows of a frame, as they are written.
pub(super) struct Lines {
    pub(super) frame: Vec<u8>,
    pub(super) stars: Vec<u8>,
}

impl Lines {
    pub(super) fn new(frame: &FrameRecord, stars: &[StarRecord]) -> anyhow::Result<Self> {
        Ok(Self {
            frame: lines(std::slice::from_ref(frame))?,
            stars: lines(stars)?,
        })
    }
}

fn lines<R: Serialize>(rows: &[R]) -> anyhow::Result<Vec<u8>> {
    let mut writer = csv::WriterBuilder::new()
        .has_headers(false)
        .from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    writer
        .into_inner()
        .map_err(|error| error.into_error().into())
}

/// One table.
struct Table<R> {
    path: PathBuf,
    file: File,
    /// Bytes up to the end of the last row that counts.
    length: u64,
    rows: PhantomData<R>,
}

impl Tables {
    /// The tables in `directory`, empty ones where there are none, cut back to the last frame that both have whole. `seed_of` is
    /// what the seed of a frame must be.
    pub(super) fn open(directory: &Path, seed_of: impl Fn(u64) -> u64) -> anyhow::Result<Self> {
        let mut tables = Self {
            _lock: lock(directory)?,
            directory: directory.to_owned(),
            frames: Table::open(directory)?,
            stars: Table::open(directory)?,
            done: 0,
            part_starts: Vec::new(),
            parts_written: 0,
        };
        tables.cut_back(seed_of)?;
        Ok(tables)
    }

    /// Frames that are done.
    pub(super) fn done(&self) -> u64 {
        self.done
    }

    fn cut_back(&mut self, seed_of: impl Fn(u64) -> u64) -> anyhow::Result<()> {
        let mut frames = self.frames.whole_rows()?;
        let mut stars = self.stars.whole_rows()?;
        let mut ends = [frames.at, stars.at];
        self.part_starts.push(ends);
        while let Some(row) = frames.next() {
            let row = row?;
            let expected = (self.done, seed_of(self.done));
            if (row.frame, row.seed) != expected {
                bail!(
                    "{}, line {}: frame {} with the seed {}, expected frame {} with the seed {}{ADVICE}",
                    self.frames.path.display(),
                    frames.line,
                    row.frame,
                    row.seed,
                    expected.0,
                    expected.1
                );
            }
            if !self.has_all_stars(&mut stars, row.star_rows)? {
                break;
            }
            self.done += 1;
            ends = [frames.at, stars.at];
            if self.done.is_multiple_of(FRAMES_PER_PART) {
                self.part_starts.push(ends);
            }
        }
        drop((frames, stars));
        self.frames.cut(ends[0])?;
        self.stars.cut(ends[1])
    }

    /// Whether the next rows of stars are those of the frame after the last one done, so many of them.
    fn has_all_stars(&self, stars: &mut Rows<StarRecord>, expected: u64) -> anyhow::Result<bool> {
        for _ in 0..expected {
            let Some(star) = stars.next() else {
                return Ok(false);
            };
            let frame = star?.frame;
            if frame != self.done {
                bail!(
                    "{}, line {}: a star of frame {frame}, expected one of frame {}{ADVICE}",
                    self.stars.path.display(),
                    stars.line,
                    self.done
                );
            }
        }
        Ok(true)
    }

    /// Adds the next frame: first its stars, so that a frame in its table has all of them.
    pub(super) fn add(&mut self, lines: &Lines) -> anyhow::Result<()> {
        self.stars.add(&lines.stars)?;
        self.frames.add(&lines.frame)?;
        self.done += 1;
        if self.done.is_multiple_of(FRAMES_PER_PART) {
            self.part_starts
                .push([self.frames.length, self.stars.length]);
        }
        Ok(())
    }

    /// Takes away the part that does not have all its frames yet: it will have more.
    pub(super) fn remove_unfinished_part(&self) -> anyhow::Result<()> {
        let part = self.done / FRAMES_PER_PART;
        parquet::remove_parts::<FrameRecord>(&self.directory, part)?;
        parquet::remove_parts::<StarRecord>(&self.directory, part)
    }

    /// Writes the parts that are not there yet; at the `end` the last one, too, with what frames it has.
    pub(super) fn write_parts(&mut self, end: bool) -> anyhow::Result<()> {
        let whole = self.done / FRAMES_PER_PART;
        let last = !self.done.is_multiple_of(FRAMES_PER_PART) && end;
        for part in self.parts_written..whole + u64::from(last) {
            self.frames
                .write_part(&self.directory, part, self.bounds(part, 0))?;
            self.stars
                .write_part(&self.directory, part, self.bounds(part, 1))?;
        }
        self.parts_written = whole;
        Ok(())
    }

    /// Where the rows of a part begin and end in one of the tables.
    fn bounds(&self, part: u64, table: usize) -> [u64; 2] {
        let part = part as usize;
        let end = [self.frames.length, self.stars.length];
        let next = self.part_starts.get(part + 1).unwrap_or(&end);
        [self.part_starts[part][table], next[table]]
    }

    /// The rows of frames.
    pub(super) fn frames(&self) -> anyhow::Result<Rows<FrameRecord>> {
        self.frames.whole_rows()
    }

    /// The rows of stars.
    pub(super) fn stars(&self) -> anyhow::Result<Rows<StarRecord>> {
        self.stars.whole_rows()
    }
}

fn lock(directory: &Path) -> anyhow::Result<File> {
    let path = directory.join("run.lock");
    let locking = || format!("locking {}", path.display());
    let file = File::create(&path).with_context(locking)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => {
            bail!("another run is at work in {}", directory.display())
        }
        Err(TryLockError::Error(error)) => Err(error).with_context(locking),
    }
}

/// What can be done about a table that is not what it should be.
const ADVICE: &str = "; the table was changed: remove the directory to begin anew";

impl<R: Row> Table<R> {
    fn open(directory: &Path) -> anyhow::Result<Self> {
        let path = directory.join(format!("{}.csv", R::TABLE));
        let open = || -> std::io::Result<Self> {
            let mut file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .open(&path)?;
            let length = length_of_whole_lines(&mut file)?;
            if length == 0 {
                file.set_len(0)?;
                file.seek(SeekFrom::Start(0))?;
                file.write_all(heading::<R>().as_bytes())?;
            }
            Ok(Self {
                length: length.max(heading::<R>().len() as u64),
                path: path.clone(),
                file,
                rows: PhantomData,
            })
        };
        open().with_context(|| format!("opening {}", path.display()))
    }

    /// The rows that have an end of line.
    fn whole_rows(&self) -> anyhow::Result<Rows<R>> {
        let mut first = vec![0; heading::<R>().len()];
        let mut file = File::open(&self.path).with_context(|| self.reading())?;
        let read = file.read_exact(&mut first);
        if read.is_err() || first != heading::<R>().as_bytes() {
            bail!(
                "{}, line 1: not the heading of a table of {}, {:?}{ADVICE}",
                self.path.display(),
                R::TABLE,
                heading::<R>().trim_end()
            );
        }
        self.rows([first.len() as u64, self.length], 2)
    }

    /// The rows between two places, the first on this line.
    fn rows(&self, [from, to]: [u64; 2], first_line: u64) -> anyhow::Result<Rows<R>> {
        let mut file = File::open(&self.path).with_context(|| self.reading())?;
        file.seek(SeekFrom::Start(from))
            .with_context(|| self.reading())?;
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            // How many fields a row has is checked, and told of with its line.
            .flexible(true)
            .from_reader(BufReader::new(file).take(to - from));
        Ok(Rows {
            path: self.path.clone(),
            reader,
            names: R::columns().iter().map(|column| column.name).collect(),
            record: csv::StringRecord::new(),
            from,
            at: from,
            line: first_line - 1,
            rows: PhantomData,
        })
    }

    fn write_part(&self, directory: &Path, part: u64, bounds: [u64; 2]) -> anyhow::Result<()> {
        if parquet::part_path::<R>(directory, part).exists() {
            return Ok(());
        }
        parquet::write_part(directory, part, self.rows(bounds, 1)?)
    }

    fn cut(&mut self, length: u64) -> anyhow::Result<()> {
        self.length = length;
        let cut = self.file.set_len(length);
        cut.and_then(|()| self.file.seek(SeekFrom::Start(length)).map(drop))
            .with_context(|| format!("cutting back {}", self.path.display()))
    }

    fn add(&mut self, lines: &[u8]) -> anyhow::Result<()> {
        self.length += lines.len() as u64;
        self.file
            .write_all(lines)
            .with_context(|| format!("writing {}", self.path.display()))
    }

    fn reading(&self) -> String {
        format!("reading {}", self.path.display())
    }
}

fn heading<R: Row>() -> String {
    let names: Vec<_> = R::columns().iter().map(|column| column.name).collect();
    names.join(",") + "\n"
}

/// Bytes up to the end of the last line that has one.
fn length_of_whole_lines(file: &mut File) -> std::io::Result<u64> {
    const STEP_BYTES: u64 = 1 << 16;
    let mut end = file.seek(SeekFrom::End(0))?;
    let mut bytes = Vec::new();
    while end > 0 {
        let from = end.saturating_sub(STEP_BYTES);
        bytes.resize((end - from) as usize, 0);
        file.seek(SeekFrom::Start(from))?;
        file.read_exact(&mut bytes)?;
        if let Some(last) = memchr::memrchr(b'\n', &bytes) {
            return Ok(from + last as u64 + 1);
        }
        end = from;
    }
    Ok(0)
}

/// Rows, read one by one.
pub(super) struct Rows<R> {
    path: PathBuf,
    reader: csv::Reader<Take<BufReader<File>>>,
    names: csv::StringRecord,
    record: csv::StringRecord,
    from: u64,
    /// Where the last row read ends.
    at: u64,
    /// Its line.
    line: u64,
    rows: PhantomData<R>,
}

impl<R: Row> Iterator for Rows<R> {
    type Item = anyhow::Result<R>;

    fn next(&mut self) -> Option<Self::Item> {
        let read = self.reader.read_record(&mut self.record);
        self.line += 1;
        let row = match read {
            Ok(false) => return None,
            Ok(true) if self.record.len() != self.names.len() => Err(anyhow!(
                "{} fields, expected {}",
                self.record.len(),
                self.names.len()
            )),
            Ok(true) => self
                .record
                .deserialize(Some(&self.names))
                .map_err(|error| self.bad_field(&error)),
            Err(error) => Err(error.into()),
        };
        self.at = self.from + self.reader.position().byte();
        let place = || format!("{}, line {}", self.path.display(), self.line);
        Some(row.map_err(|error| anyhow!("{}: {error:#}{ADVICE}", place())))
    }
}

impl<R> Rows<R> {
    fn bad_field(&self, error: &csv::Error) -> anyhow::Error {
        let csv::ErrorKind::Deserialize { err, .. } = error.kind() else {
            return anyhow!("{error}");
        };
        let field = err.field().and_then(|field| {
            let field = field as usize;
            Some((self.names.get(field)?, self.record.get(field)?))
        });
        match field {
            Some((name, found)) => anyhow!("{name} is {found:?}: {}", err.kind()),
            // Of words it is not told in which field they are; they are told themselves.
            None => anyhow!("{}", err.kind()),
        }
    }
}
