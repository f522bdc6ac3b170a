//! The C interface: `include/starpipe.h` says it in C.
//!
//! Every function is reentrant: what is kept lies in the block of memory that the caller gives, and nowhere else. No
//! function allocates, starts a thread, opens a file or lets a panic out.
#![cfg_attr(not(feature = "std"), no_std)]
#![allow(
    unsafe_code,
    reason = "pointers come from C; each function says what must hold of them"
)]

use core::ffi::{CStr, c_char, c_int, c_void};
use core::mem::{align_of, size_of};
use core::slice;
use starpipe_flight::{
    Attitude, Budget, Catalog, Config, Error, Image, Sky, Spot, Status, Tracker, Work,
    limiting_v_mag,
};

/// All went well.
pub const STARPIPE_OK: c_int = 0;
/// A value of the configuration is out of range.
pub const STARPIPE_CONFIG: c_int = 1;
/// The lens shows two directions in one place within the frame.
pub const STARPIPE_LENS: c_int = 2;
/// The catalogue is none of this version, or is cut short.
pub const STARPIPE_CATALOG: c_int = 3;
/// The catalogue is damaged.
pub const STARPIPE_CATALOG_HASH: c_int = 4;
/// The block of memory is too small.
pub const STARPIPE_MEMORY: c_int = 5;
/// The image is not of the camera's size.
pub const STARPIPE_IMAGE: c_int = 6;
/// The time is not later than that of the image before.
pub const STARPIPE_TIME: c_int = 7;
/// A pointer is null.
pub const STARPIPE_NULL: c_int = 8;
/// A fault of the library itself: please report it.
pub const STARPIPE_FAULT: c_int = 9;

/// Rows of pixels, the upper one first.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct StarpipeImage {
    /// The first pixel.
    pub pixels: *const c_void,
    /// Bits of a pixel: 8 or 16, in the byte order of the machine.
    pub bits: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Pixels from one row to the next.
    pub stride: u32,
}

/// What is kept, in the caller's memory.
#[derive(Debug)]
pub struct StarpipeTracker(Tracker<'static>);

/// Where the buffers begin: behind the tracker.
const BUFFERS_AT: usize = size_of::<StarpipeTracker>().next_multiple_of(align_of::<u64>());
/// The memory of the caller may begin anywhere.
const ALIGNMENT: usize = if align_of::<StarpipeTracker>() > align_of::<u64>() {
    align_of::<StarpipeTracker>()
} else {
    align_of::<u64>()
};

/// Bytes of the block of memory that `starpipe_init` needs.
///
/// # Safety
/// `config` and `bytes` point to values, `catalog` to `catalog_bytes` bytes, or they are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn starpipe_size(
    config: *const Config,
    catalog: *const u8,
    catalog_bytes: usize,
    bytes: *mut usize,
) -> c_int {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (config, bytes) =
            unsafe { (config.as_ref().ok_or(NULL)?, bytes.as_mut().ok_or(NULL)?) };
        // SAFETY: the same.
        let catalog = unsafe { catalog_of(catalog, catalog_bytes)? };
        let words = Tracker::words(config, &catalog).map_err(code)?;
        *bytes = BUFFERS_AT + words * size_of::<u64>() + ALIGNMENT - 1;
        Ok(())
    })
}

/// Begins in a block of memory. `tracker` then points into it; nothing need be freed.
///
/// # Safety
/// `memory` points to `memory_bytes` bytes that nothing else uses while the tracker is used. The catalogue stays where it
/// is, unchanged, for as long. The other pointers point to values. Any of them may be null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn starpipe_init(
    memory: *mut c_void,
    memory_bytes: usize,
    config: *const Config,
    catalog: *const u8,
    catalog_bytes: usize,
    tracker: *mut *mut StarpipeTracker,
) -> c_int {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (config, tracker) =
            unsafe { (config.as_ref().ok_or(NULL)?, tracker.as_mut().ok_or(NULL)?) };
        // SAFETY: the same.
        let catalog = unsafe { catalog_of(catalog, catalog_bytes)? };
        if memory.is_null() {
            return Err(NULL);
        }
        let shift = memory.align_offset(ALIGNMENT);
        let needed = shift.checked_add(BUFFERS_AT).ok_or(STARPIPE_MEMORY)?;
        let rest = memory_bytes.checked_sub(needed).ok_or(STARPIPE_MEMORY)?;
        // SAFETY: both parts lie in the caller's memory, as was just computed, are aligned, and do not overlap. Zeros are
        // valid words.
        let (place, block) = unsafe {
            let start = memory.cast::<u8>().add(shift);
            let buffers = start.add(BUFFERS_AT).cast::<u64>();
            let words = rest / size_of::<u64>();
            buffers.write_bytes(0, words);
            (
                start.cast::<StarpipeTracker>(),
                slice::from_raw_parts_mut(buffers, words),
            )
        };
        let made = Tracker::new(block, *config, catalog).map_err(code)?;
        // SAFETY: the place is large enough and aligned. A tracker owns nothing, so that none need be dropped.
        unsafe { place.write(StarpipeTracker(made)) };
        *tracker = place;
        Ok(())
    })
}

/// Writes the stars of an image to `stars`, the brightest first, and their number to `count`.
///
/// # Safety
/// `tracker` is that of `starpipe_init`, `image` and its pixels are what it says, `stars` points to `capacity` stars, and
/// `count` to a number, or they are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn starpipe_detect(
    tracker: *mut StarpipeTracker,
    image: *const StarpipeImage,
    stars: *mut Spot,
    capacity: usize,
    count: *mut usize,
) -> c_int {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (tracker, count) =
            unsafe { (tracker.as_mut().ok_or(NULL)?, count.as_mut().ok_or(NULL)?) };
        if stars.is_null() {
            return Err(NULL);
        }
        // SAFETY: the same. What the caller's memory held is not read before it is written, but may be no number: every
        // pattern of bits is one.
        let (image, stars) =
            unsafe { (image_of(image)?, slice::from_raw_parts_mut(stars, capacity)) };
        *count = tracker.0.detect(&image, stars).map_err(code)?;
        Ok(())
    })
}

/// Finds the attitude of stars, the brightest of them first, of which nothing is known. `attitude->status` says whether it
/// is found.
///
/// # Safety
/// `tracker` is that of `starpipe_init`, `stars` points to `count` stars, and the others to values, or they are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn starpipe_lost(
    tracker: *mut StarpipeTracker,
    stars: *const Spot,
    count: usize,
    sky: *const Sky,
    budget: *const Budget,
    attitude: *mut Attitude,
) -> c_int {
    guarded(|| {
        if stars.is_null() {
            return Err(NULL);
        }
        // SAFETY: the caller's promise.
        let (tracker, stars) = unsafe {
            (
                tracker.as_mut().ok_or(NULL)?,
                slice::from_raw_parts(stars, count),
            )
        };
        // SAFETY: the same.
        let (sky, budget, attitude) = unsafe {
            (
                sky.as_ref().ok_or(NULL)?,
                budget.as_ref().ok_or(NULL)?,
                attitude.as_mut().ok_or(NULL)?,
            )
        };
        *attitude = tracker.0.lost(stars, sky, budget);
        Ok(())
    })
}

/// Begins to track with an attitude of `starpipe_lost`; `time_s` is that of the middle of its exposure, in seconds.
///
/// # Safety
/// `tracker` is that of `starpipe_init`, and `attitude` points to one, or they are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn starpipe_start(
    tracker: *mut StarpipeTracker,
    attitude: *const Attitude,
    time_s: f64,
) -> c_int {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (tracker, attitude) = unsafe {
            (
                tracker.as_mut().ok_or(NULL)?,
                attitude.as_ref().ok_or(NULL)?,
            )
        };
        tracker.0.start(attitude, time_s);
        Ok(())
    })
}

/// Finds the attitude of an image from those before it; `time_s` is that of the middle of its exposure, in seconds.
///
/// # Safety
/// `tracker` is that of `starpipe_init`, `image` and its pixels are what it says, and the others point to values, or they
/// are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn starpipe_track(
    tracker: *mut StarpipeTracker,
    image: *const StarpipeImage,
    time_s: f64,
    sky: *const Sky,
    attitude: *mut Attitude,
) -> c_int {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (tracker, image) = unsafe { (tracker.as_mut().ok_or(NULL)?, image_of(image)?) };
        // SAFETY: the same.
        let (sky, attitude) =
            unsafe { (sky.as_ref().ok_or(NULL)?, attitude.as_mut().ok_or(NULL)?) };
        *attitude = tracker.0.track(&image, time_s, sky).map_err(code)?;
        Ok(())
    })
}

/// V magnitude at which half of the stars are detected.
///
/// # Safety
/// Both point to values, or are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn starpipe_limit(config: *const Config, v_mag: *mut f64) -> c_int {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (config, v_mag) =
            unsafe { (config.as_ref().ok_or(NULL)?, v_mag.as_mut().ok_or(NULL)?) };
        *v_mag = limiting_v_mag(config);
        Ok(())
    })
}

/// The work of the last call, and the most work that a call can do: three values, of `starpipe_detect`, of
/// `starpipe_lost` with this budget, and of `starpipe_track`.
///
/// # Safety
/// `tracker` is that of `starpipe_init`, `most` points to three values, and the others to one, or they are null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn starpipe_work(
    tracker: *const StarpipeTracker,
    budget: *const Budget,
    work: *mut Work,
    most: *mut Work,
) -> c_int {
    guarded(|| {
        if most.is_null() {
            return Err(NULL);
        }
        // SAFETY: the caller's promise.
        let (tracker, budget) =
            unsafe { (tracker.as_ref().ok_or(NULL)?, budget.as_ref().ok_or(NULL)?) };
        // SAFETY: the same.
        let (work, most) = unsafe {
            (
                work.as_mut().ok_or(NULL)?,
                slice::from_raw_parts_mut(most, 3),
            )
        };
        *work = *tracker.0.work();
        most.copy_from_slice(&tracker.0.most_work(budget));
        Ok(())
    })
}

/// The version of the library.
#[unsafe(no_mangle)]
pub extern "C" fn starpipe_version() -> *const c_char {
    const VERSION: &CStr =
        match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
            Ok(version) => version,
            Err(_) => c"",
        };
    VERSION.as_ptr()
}

/// What a function returned, in words.
#[unsafe(no_mangle)]
pub extern "C" fn starpipe_error_text(error: c_int) -> *const c_char {
    let text = match error {
        STARPIPE_OK => c"all went well",
        STARPIPE_CONFIG => c"a value of the configuration is out of range",
        STARPIPE_LENS => c"the lens shows two directions in one place within the frame",
        STARPIPE_CATALOG => c"this is no catalog of this version, or it is cut short",
        STARPIPE_CATALOG_HASH => c"the catalog is damaged: its hash is another",
        STARPIPE_MEMORY => c"the block of memory is too small",
        STARPIPE_IMAGE => c"the image is not of the camera's size",
        STARPIPE_TIME => c"the time is not later than that of the image before",
        STARPIPE_NULL => c"a pointer is null",
        STARPIPE_FAULT => c"a fault of the library itself: please report it",
        _ => c"this is no error",
    };
    text.as_ptr()
}

/// The status of an attitude, in words.
#[unsafe(no_mangle)]
pub extern "C" fn starpipe_status_text(status: Status) -> *const c_char {
    let text = match status {
        Status::FOUND => c"the attitude is known",
        Status::TOO_FEW_STARS => c"there are too few stars",
        Status::NOT_IDENTIFIED => c"no attitude is sure enough",
        Status::BUDGET_SPENT => c"the budget ended before the search",
        Status::NO_ATTITUDE_BEFORE => c"no attitude is known of the images before",
        _ => c"this is no status",
    };
    text.as_ptr()
}

const NULL: c_int = STARPIPE_NULL;

fn code(error: Error) -> c_int {
    match error {
        Error::Config => STARPIPE_CONFIG,
        Error::Lens => STARPIPE_LENS,
        Error::Catalog => STARPIPE_CATALOG,
        Error::CatalogHash => STARPIPE_CATALOG_HASH,
        Error::Memory => STARPIPE_MEMORY,
        Error::Image => STARPIPE_IMAGE,
        Error::Time => STARPIPE_TIME,
        _ => STARPIPE_FAULT,
    }
}

/// # Safety
/// `bytes` points to as many bytes, which stay, or is null.
unsafe fn catalog_of(bytes: *const u8, count: usize) -> Result<Catalog<'static>, c_int> {
    if bytes.is_null() {
        return Err(NULL);
    }
    // SAFETY: the caller's promise.
    Catalog::new(unsafe { slice::from_raw_parts(bytes, count) }).map_err(code)
}

/// # Safety
/// `image` points to an image whose pixels are there, or it is null.
unsafe fn image_of<'a>(image: *const StarpipeImage) -> Result<Image<'a>, c_int> {
    // SAFETY: the caller's promise.
    let image = unsafe { image.as_ref() }.ok_or(NULL)?;
    if image.pixels.is_null() {
        return Err(NULL);
    }
    let [width, height, stride] =
        [image.width, image.height, image.stride].map(|side| side as usize);
    let before = stride
        .checked_mul(height.saturating_sub(1))
        .ok_or(STARPIPE_IMAGE)?;
    let count = before
        .checked_add(width)
        .filter(|count| *count <= isize::MAX as usize / 2)
        .ok_or(STARPIPE_IMAGE)?;
    match image.bits {
        8 => {
            // SAFETY: the caller's promise.
            let pixels = unsafe { slice::from_raw_parts(image.pixels.cast::<u8>(), count) };
            Image::of_8_bits(pixels, [width, height], stride).map_err(code)
        }
        16 if image.pixels.cast::<u16>().is_aligned() => {
            // SAFETY: the caller's promise; the alignment was just checked.
            let pixels = unsafe { slice::from_raw_parts(image.pixels.cast::<u16>(), count) };
            Image::of_16_bits(pixels, [width, height], stride).map_err(code)
        }
        _ => Err(STARPIPE_IMAGE),
    }
}

/// The code of what a function returns; a panic ends here.
#[cfg(feature = "std")]
fn guarded(call: impl FnOnce() -> Result<(), c_int>) -> c_int {
    let call = std::panic::AssertUnwindSafe(call);
    std::panic::catch_unwind(call)
        .map_or(STARPIPE_FAULT, |result| result.err().unwrap_or(STARPIPE_OK))
}

/// The code of what a function returns.
#[cfg(not(feature = "std"))]
fn guarded(call: impl FnOnce() -> Result<(), c_int>) -> c_int {
    call().err().unwrap_or(STARPIPE_OK)
}

/// Without an operating system nothing can be told of a fault: the watchdog of the computer sees it.
#[cfg(not(any(feature = "std", test)))]
#[panic_handler]
fn halt(_: &core::panic::PanicInfo) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
