//! Panics as errors: a bug that one file meets ends that file and not the run.

use std::any::Any;
use std::cell::Cell;
use std::env;
use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, Once, PoisonError};

/// A panic: a bug in starpipe, or in a library that it uses.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a bug in starpipe, please report it: {message}{}", self.shown_place())]
pub struct Panicked {
    /// What the panic said.
    pub message: String,
    /// File and line of the source, where known.
    pub place: Option<String>,
}

impl Panicked {
    fn shown_place(&self) -> String {
        let place = self.place.as_ref();
        place.map_or_else(String::new, |place| format!(" ({place})"))
    }
}

thread_local! {
    /// Whether a panic on this thread becomes an error.
    static IS_CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// Whether panics are silent on all threads.
static IS_SILENT: AtomicBool = AtomicBool::new(false);

/// The latest panic of any thread: only the hook is message the place, only [`caught`] who asked.
static LATEST: Mutex<Option<Panicked>> = Mutex::new(None);

/// Calls `work` and makes an error of a panic, whose message is not printed. What `work` was changing
/// must not be used after an error.
///
/// # Errors
/// [`Panicked`] if `work` panics.
pub fn caught<R>(work: impl FnOnce() -> R) -> Result<R, Panicked> {
    set_hook();
    let outer = IS_CAUGHT.replace(true);
    let done = panic::catch_unwind(AssertUnwindSafe(work));
    IS_CAUGHT.set(outer);
    done.map_err(|payload| {
        let message = message(&*payload);
        let mut latest = LATEST.lock().unwrap_or_else(PoisonError::into_inner);
        let place = latest.take_if(|latest| latest.message == message);
        Panicked {
            message,
            place: place.and_then(|latest| latest.place),
        }
    })
}

/// The latest panic, where it could not be caught: a program in WebAssembly ends with it.
pub fn latest() -> Option<Panicked> {
    LATEST
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .clone()
}

/// From now on no panic prints anything, on any thread, unless `RUST_BACKTRACE` is set: for programs
/// in which [`caught`] surrounds everything, the work that is shared among threads included.
pub fn silence() {
    set_hook();
    IS_SILENT.store(env::var_os("RUST_BACKTRACE").is_none(), Ordering::Relaxed);
}

/// Keeps every panic in [`LATEST`], and passes on those that nobody catches to the hook before.
fn set_hook() {
    static SET: Once = Once::new();
    SET.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            *LATEST.lock().unwrap_or_else(PoisonError::into_inner) = Some(panicked(info));
            if !IS_CAUGHT.get() && !IS_SILENT.load(Ordering::Relaxed) {
                before(info);
            }
        }));
    });
}

fn panicked(info: &PanicHookInfo) -> Panicked {
    Panicked {
        message: message(info.payload()),
        place: info.location().map(|place| in_package(&place.to_string())),
    }
}

/// `tiff-0.11.3/src/lib.rs:12:3` of a place in a package, wherever that was compiled.
fn in_package(place: &str) -> String {
    let Some((package, _)) = place.rsplit_once("/src/") else {
        return place.to_owned();
    };
    let above = package.rfind('/').map_or(0, |slash| slash + 1);
    place[above..].to_owned()
}

fn message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    let text = text.or(payload.downcast_ref::<&str>().copied());
    text.unwrap_or("a panic without a message").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error_that_names_message_and_place() {
        assert_eq!(caught(|| 7), Ok(7));
        let number = 3;
        let found = caught(|| panic!("bad item {number}")).unwrap_err();
        assert_eq!(found.message, "bad item 3");
        let place = found.place.as_ref().unwrap();
        assert!(place.contains("panics.rs:"), "{place}");
        let message = found.to_string();
        assert!(
            message.contains("bad item 3 (") && message.contains(place),
            "{message}"
        );
        assert!(!IS_CAUGHT.get());
    }

    #[test]
    fn a_place_does_not_tell_where_the_package_was_compiled() {
        for (place, message) in [
            ("src/detect/mod.rs:1:2", "src/detect/mod.rs:1:2"),
            (
                "/home/me/tiff-0.11.3/src/a/b.rs:1:2",
                "tiff-0.11.3/src/a/b.rs:1:2",
            ),
            (
                "/rustc/ab12/library/core/src/slice.rs:1:2",
                "core/src/slice.rs:1:2",
            ),
        ] {
            assert_eq!(in_package(place), message);
        }
    }

    #[test]
    fn within_another_boundary_the_inner_one_catches() {
        let outer = caught(|| {
            let inner = caught(|| panic!("inner"));
            assert_eq!(inner.unwrap_err().message, "inner");
            panic!("outer")
        });
        assert_eq!(outer.unwrap_err().message, "outer");
    }

    #[test]
    fn panics_of_shared_work_are_caught_where_it_was_shared() {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(2)
            .build()
            .unwrap();
        let shared = || rayon::join(|| (), || panic!("on some thread"));
        let found = caught(|| pool.install(shared)).unwrap_err();
        assert_eq!(found.message, "on some thread");
        assert_eq!(pool.install(|| rayon::join(|| 1, || 2)), (1, 2));
    }

    #[test]
    fn other_panics_have_a_message_too() {
        let found = caught(|| panic::panic_any(7)).unwrap_err();
        assert_eq!(found.message, "a panic without a message");
    }
}
