//! What reading a frame may take, memory and time, and what of its colors is wanted.

use super::error::FrameError;
use super::memory::MemoryLimit;
use crate::base::interrupt::{Interrupt, Interrupted};
use crate::base::size::Size;
use std::cell::Cell;
use std::io::{self, BufRead, Read, Seek, SeekFrom};

/// Pixels that are decoded between two looks at the time: in some hundred microseconds.
pub(super) const PIXELS_BETWEEN_CHECKS: usize = 1 << 16;

/// What a pixel of a frame of floats takes at least: later on its values are copied once.
pub(super) const FLOATS_BYTES_PER_PIXEL: usize = 2 * size_of::<f32>();

/// The budget of one frame. Readers and decoders charge to it what they hold before they allocate it,
/// and ask it whether to go on.
#[derive(Debug, Default)]
pub(super) struct ReadBudget {
    limit: MemoryLimit,
    booked_bytes: Cell<u64>,
    interrupt: Interrupt,
    channel: Option<usize>,
    has_colors: Cell<bool>,
}

impl ReadBudget {
    /// A budget of which nothing is spent.
    pub fn new(limit: MemoryLimit, interrupt: Interrupt) -> Self {
        Self {
            limit,
            interrupt,
            ..Self::default()
        }
    }

    /// The same for one channel of a color image, in place of its luminance: 0 is red.
    pub fn of_channel(self, channel: usize) -> Self {
        Self {
            channel: Some(channel),
            ..self
        }
    }

    /// The channel of a color image that is wanted in place of its luminance. Decoders ask where the image has
    /// colors.
    pub fn color_channel(&self) -> Option<usize> {
        self.has_colors.set(true);
        self.channel
    }

    /// Whether the image has colors: known once it is decoded.
    pub fn has_colors(&self) -> bool {
        self.has_colors.get()
    }

    /// Books what is held from now on.
    /// # Errors
    /// [`FrameError::OutOfMemory`] if there is no room for it.
    pub fn hold(&self, bytes: u64) -> Result<(), FrameError> {
        let held = self.booked_bytes.get().saturating_add(bytes);
        if held > self.limit.bytes() {
            return Err(FrameError::OutOfMemory {
                needed_bytes: held,
                limit_bytes: self.limit.bytes(),
            });
        }
        self.booked_bytes.set(held);
        Ok(())
    }

    /// Books that so much is held no longer.
    pub fn release(&self, bytes: u64) {
        let held = self.booked_bytes.get().saturating_sub(bytes);
        self.booked_bytes.set(held);
    }

    /// Makes room for `length` bytes in all in `bytes`, whose capacity is booked.
    /// # Errors
    /// [`FrameError::OutOfMemory`].
    pub fn reserve(&self, bytes: &mut Vec<u8>, length: usize) -> Result<(), FrameError> {
        let before = bytes.capacity();
        if length <= before {
            return Ok(());
        }
        // They may be copied to another place.
        self.hold(length as u64)?;
        let reserved = bytes.try_reserve_exact(length - bytes.len());
        reserved.map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
        self.release(before as u64);
        Ok(())
    }

    /// Appends all that `reader` gives to `bytes`, whose capacity is booked.
    /// # Errors
    /// [`FrameError::OutOfMemory`], [`FrameError::Interrupted`], and [`FrameError::Io`] for those of
    /// the reader.
    pub fn append(&self, reader: &mut impl Read, bytes: &mut Vec<u8>) -> Result<(), FrameError> {
        const FIRST_BYTES: usize = 1 << 16;
        let why = |error: io::Error| self.why(error.into());
        loop {
            let room = bytes.capacity() - bytes.len();
            reader.take(room as u64).read_to_end(bytes).map_err(why)?;
            if bytes.len() < bytes.capacity() {
                return Ok(());
            }
            // There may be nothing more.
            let mut next = Vec::new();
            if reader.take(1).read_to_end(&mut next).map_err(why)? == 0 {
                return Ok(());
            }
            let grown = bytes.len() + (bytes.len() / 2).max(FIRST_BYTES);
            let left = usize::try_from(self.left_bytes()).unwrap_or(usize::MAX);
            self.reserve(bytes, grown.min(left).max(bytes.len() + 1))?;
            bytes.append(&mut next);
        }
    }

    /// What may be held beside all that is booked.
    pub fn left_bytes(&self) -> u64 {
        self.limit.bytes().saturating_sub(self.booked_bytes.get())
    }

    /// Refuses an image for which there is no room: reading it takes so many bytes for each of its
    /// pixels at once, the finished frame among them.
    /// # Errors
    /// [`FrameError::TooMuchMemory`].
    pub fn check_image(&self, size: Size, bytes_per_pixel: usize) -> Result<(), FrameError> {
        let Size { width, height } = size;
        let pixels = (width as u64).saturating_mul(height as u64);
        let needed_bytes = pixels.saturating_mul(bytes_per_pixel as u64);
        if needed_bytes <= self.left_bytes() {
            return Ok(());
        }
        Err(FrameError::TooMuchMemory {
            width,
            height,
            needed_bytes: needed_bytes.saturating_add(self.booked_bytes.get()),
            limit_bytes: self.limit.bytes(),
        })
    }

    /// [`Self::check_time`] for errors of another type.
    pub fn check_interrupt(&self) -> Result<(), Interrupted> {
        self.interrupt.check()
    }

    /// Ends the work with `?` if its time is over. Ask every few milliseconds.
    /// # Errors
    /// [`FrameError::Interrupted`].
    pub fn check_time(&self) -> Result<(), FrameError> {
        Ok(self.interrupt.check()?)
    }

    /// Reads `inner` as long as there is time. Decoders that cannot be asked are ended so.
    pub fn timed<R>(&self, inner: R) -> Timed<'_, R> {
        Timed {
            inner,
            interrupt: &self.interrupt,
            reads: 0,
        }
    }

    /// `otherwise`, or that the time is over: decoders that fail because of [`Timed`] do not say so.
    pub fn why(&self, otherwise: FrameError) -> FrameError {
        self.check_time().err().unwrap_or(otherwise)
    }
}

/// A reader that fails once the time is over.
pub(super) struct Timed<'a, R> {
    inner: R,
    interrupt: &'a Interrupt,
    /// Since the last look at the time.
    reads: usize,
}

impl<R> Timed<'_, R> {
    /// Bytes of one read. Compressed, they are some megabytes at most, which take milliseconds.
    const MAX_BYTES: usize = 1 << 13;
    /// Reads of a few bytes between two looks at the time.
    const READS: usize = 1 << 6;

    fn check(&mut self, bytes: usize) -> io::Result<()> {
        self.reads += 1;
        if self.reads >= Self::READS || bytes >= Self::MAX_BYTES {
            self.reads = 0;
            self.interrupt.check().map_err(io::Error::other)?;
        }
        Ok(())
    }
}

impl<R: Read> Read for Timed<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.check(buffer.len())?;
        let length = buffer.len().min(Self::MAX_BYTES);
        self.inner.read(&mut buffer[..length])
    }
}

impl<R: BufRead> BufRead for Timed<'_, R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.check(0)?;
        let all = self.inner.fill_buf()?;
        Ok(&all[..all.len().min(Self::MAX_BYTES)])
    }

    fn consume(&mut self, bytes: usize) {
        self.inner.consume(bytes);
    }
}

impl<R: Seek> Seek for Timed<'_, R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.inner.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    #[test]
    fn what_is_held_counts() {
        let budget = ReadBudget::new(MemoryLimit::of_bytes(1000), Interrupt::default());
        budget.hold(600).unwrap();
        assert!(budget.check_image(Size::new(10, 10), 4).is_ok());
        assert!(budget.check_image(Size::new(10, 10), 5).is_err());
        let error = budget.hold(401).unwrap_err();
        assert!(matches!(
            error,
            FrameError::OutOfMemory {
                needed_bytes: 1001,
                ..
            }
        ));
        budget.release(200);
        assert_eq!(budget.left_bytes(), 600);
        assert!(budget.hold(u64::MAX).is_err());
    }

    #[test]
    fn a_reader_fails_when_the_time_is_over() {
        let is_due = Arc::new(AtomicBool::new(false));
        let interrupt = Interrupt::when({
            let is_due = Arc::clone(&is_due);
            move || is_due.load(Ordering::Relaxed)
        });
        let budget = ReadBudget::new(MemoryLimit::DEFAULT, interrupt);
        let content = vec![7; 1 << 20];
        let mut reader = budget.timed(Cursor::new(&content));
        let mut found = vec![0; 1 << 19];
        reader.read_exact(&mut found).unwrap();
        assert_eq!(found, content[..1 << 19]);
        assert!(reader.fill_buf().unwrap().len() < 1 << 16);
        is_due.store(true, Ordering::Relaxed);
        assert!(reader.read_exact(&mut found).is_err());
        let mut byte = [0];
        let mut reads = 0..1000;
        assert!(reads.any(|_| reader.read(&mut byte).is_err()));
        assert!(matches!(
            budget.why(FrameError::Empty),
            FrameError::Interrupted(_)
        ));
    }
}
