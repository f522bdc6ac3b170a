//! Standard output.
//!
//! Where a process begins without standard output, as after `>&-`, Rust's runtime opens `/dev/null`
//! in its place, and results would be lost without a message. So a function checks it before that.

use anyhow::Context;
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the process began without standard output.
static WAS_CLOSED: AtomicBool = AtomicBool::new(false);

/// Writes `text` to standard output and flushes it. Breaks if the reader has closed the pipe.
pub(crate) fn print(text: &str) -> anyhow::Result<ControlFlow<()>> {
    match write(text) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(ControlFlow::Break(())),
        Err(error) => Err(error).context("writing to standard output"),
        Ok(()) => Ok(ControlFlow::Continue(())),
    }
}

fn write(text: &str) -> io::Result<()> {
    if WAS_CLOSED.load(Ordering::Relaxed) && !text.is_empty() {
        return Err(io::Error::other("it is closed"));
    }
    let mut stdout = io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()
}

#[cfg(target_os = "linux")]
mod before_main {
    use super::WAS_CLOSED;
    use std::sync::atomic::Ordering;

    // Sound: the loader calls each function of this section once, before `main`, in the only thread
    // there is. This one takes no arguments and cannot panic. It makes one system call that changes
    // nothing, sets an atomic, and uses nothing that Rust's runtime prepares.
    // Needed: the runtime's `/dev/null` is opened as that of Python's `subprocess.DEVNULL`, so no
    // later check can tell them apart.
    #[allow(
        unsafe_code,
        reason = "puts a function pointer into a section; see above"
    )]
    #[used]
    #[unsafe(link_section = ".init_array")]
    static LOOK: extern "C" fn() = {
        extern "C" fn look() {
            let is_open = rustix::io::fcntl_getfd(rustix::stdio::stdout()).is_ok();
            WAS_CLOSED.store(!is_open, Ordering::Relaxed);
        }
        look
    };
}
