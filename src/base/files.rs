//! Reads of files alone, and atomic writes: a reader finds the old file or the new one, never a part.

use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind, Read, Write};
use std::path::Path;
use std::time::Duration;

/// Temporary files begin and end so.
const PREFIX: &str = ".starpipe-";
const SUFFIX: &str = ".tmp";

/// Opens a file for reading. A pipe, a socket or a device is refused: it may never end. Those that the
/// shell has opened are read like standard input.
///
/// # Errors
/// I/O errors.
pub fn open(path: &Path) -> io::Result<File> {
    if is_opened_by_shell(path) {
        return File::open(path);
    }
    // Only to open a device may have an effect; and what is opened may be another by then.
    check_kind(&fs::metadata(path)?)?;
    let file = open_at_once(path)?;
    check_kind(&file.metadata()?)?;
    Ok(file)
}

/// Whether `path` names a file that the shell has opened for this process, as `<(command)` does. It
/// may be a pipe. What is reached by way of these directories is not meant.
fn is_opened_by_shell(path: &Path) -> bool {
    let Some(path) = path.to_str() else {
        return false;
    };
    let mut parents = ["/dev/fd/", "/proc/self/fd/"].iter();
    let number = parents.find_map(|parent| path.strip_prefix(parent));
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    path == "/dev/stdin" || number.is_some_and(is_number)
}

fn check_kind(found: &Metadata) -> io::Result<()> {
    if found.is_file() || found.is_dir() {
        return Ok(());
    }
    let message = "it is a pipe, a socket or a device, not a file";
    Err(io::Error::other(message))
}

/// Opens without waiting for the other end of a pipe.
#[cfg(unix)]
fn open_at_once(path: &Path) -> io::Result<File> {
    use std::os::unix::fs::OpenOptionsExt;
    let flags = rustix::fs::OFlags::NONBLOCK | rustix::fs::OFlags::NOCTTY;
    let flags = flags.bits().cast_signed();
    File::options().read(true).custom_flags(flags).open(path)
}

#[cfg(not(unix))]
fn open_at_once(path: &Path) -> io::Result<File> {
    File::open(path)
}

/// Reads a file of at most `limit` bytes.
///
/// # Errors
/// As for [`open`], and the file being larger.
pub fn read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    read_stream(open(path)?, limit)
}

/// Reads a stream of at most `limit` bytes to its end.
///
/// # Errors
/// I/O errors, and the stream being longer.
pub fn read_stream(stream: impl Read, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    stream.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        let message = format!("too large: found more than {limit} bytes");
        return Err(io::Error::other(message));
    }
    Ok(bytes)
}

/// [`read`] for a text.
///
/// # Errors
/// As for [`read`], and the content not being UTF-8.
pub fn read_text(path: &Path, limit: u64) -> io::Result<String> {
    text_of(read(path, limit)?)
}

/// The text that `bytes` are, without a byte order mark.
///
/// # Errors
/// The content not being UTF-8.
pub fn text_of(mut bytes: Vec<u8>) -> io::Result<String> {
    let mark = bytes.len() - without_byte_order_mark(&bytes)?.len();
    bytes.drain(..mark);
    String::from_utf8(bytes).map_err(|error| io::Error::new(ErrorKind::InvalidData, error))
}

/// The text in `bytes` behind the byte order mark that editors may put before it.
///
/// # Errors
/// The content being UTF-16, by its mark or by the zeros in its first characters.
pub fn without_byte_order_mark(bytes: &[u8]) -> io::Result<&[u8]> {
    let is_utf_16 = match bytes {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => true,
        [0, second, 0, fourth, ..] => *second != 0 && *fourth != 0,
        [first, 0, third, 0, ..] => *first != 0 && *third != 0,
        _ => false,
    };
    if is_utf_16 {
        let message = "found UTF-16 text, expected UTF-8: save it as UTF-8";
        return Err(io::Error::new(ErrorKind::InvalidData, message));
    }
    Ok(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))
}

/// Creates a temporary file in the folder of `path`, with the permissions of any new file.
///
/// Once written, [`persist`](tempfile::NamedTempFile::persist) renames it to `path`.
///
/// # Errors
/// I/O errors, and `path` being a device, a pipe or a directory, which the rename would replace.
pub fn beside(path: &Path) -> io::Result<tempfile::NamedTempFile> {
    if fs::metadata(path).is_ok_and(|found| !found.is_file()) {
        return Err(io::Error::other("it exists and is not a regular file"));
    }
    let parent = path.parent().filter(|parent| *parent != Path::new(""));
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Temporary files are private by default; the process's umask still applies.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(parent.unwrap_or(Path::new(".")))?;
    // As long as the file is written, it is not taken for one that was left behind. Not every file
    // system has locks.
    let _ = file.as_file().lock();
    Ok(file)
}

/// Makes a directory for results, and removes what a process that was killed has left in it.
///
/// # Errors
/// I/O errors on making the directory.
pub fn make_directory(directory: &Path) -> io::Result<()> {
    fs::create_dir_all(directory)?;
    // Best effort: such files do no harm but to the disk.
    let entries = fs::read_dir(directory).into_iter().flatten().flatten();
    for path in entries
        .map(|entry| entry.path())
        .filter(|path| is_temporary(path))
    {
        if is_left_behind(&path).unwrap_or(false) {
            let _ = fs::remove_file(&path);
        }
    }
    Ok(())
}

fn is_temporary(path: &Path) -> bool {
    let name = path
        .file_name()
        .and_then(|name| name.to_str())
        .unwrap_or_default();
    name.starts_with(PREFIX) && name.ends_with(SUFFIX)
}

/// Whether nobody writes a temporary file any longer.
fn is_left_behind(path: &Path) -> io::Result<bool> {
    // Between making a file and locking it.
    const NEW: Duration = Duration::from_secs(10);
    let found = fs::symlink_metadata(path)?;
    let age = found.modified()?.elapsed().unwrap_or_default();
    Ok(found.is_file() && age > NEW && File::open(path)?.try_lock().is_ok())
}

/// Writes `bytes` to `path` atomically.
///
/// # Errors
/// As for [`beside`], and I/O errors on writing.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = beside(path)?;
    file.write_all(bytes)?;
    finish(file, path)
}

/// Names a file that [`beside`] has made and that is written.
///
/// # Errors
/// I/O errors.
pub fn finish(file: tempfile::NamedTempFile, path: &Path) -> io::Result<()> {
    file.as_file().sync_all()?;
    file.persist(path).map_err(|refused| refused.error)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::SystemTime;

    #[test]
    fn what_a_killed_process_left_is_removed_and_nothing_else() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        let long_ago = SystemTime::now() - Duration::from_secs(3600);
        for name in [".starpipe-left.tmp", ".starpipe-notes", "mine.tmp"] {
            let file = File::create(at(name)).unwrap();
            file.set_modified(long_ago).unwrap();
        }
        let written = beside(&at("result")).unwrap();
        written.as_file().set_modified(long_ago).unwrap();
        make_directory(directory.path()).unwrap();
        assert!(!at(".starpipe-left.tmp").exists());
        assert!(at(".starpipe-notes").exists() && at("mine.tmp").exists());
        assert!(written.path().exists());
        finish(written, &at("result")).unwrap();
        assert!(at("result").exists());
    }

    #[test]
    fn a_byte_order_mark_is_dropped_and_utf_16_is_refused() {
        let text = |bytes: &[u8]| text_of(bytes.to_vec()).map_err(|error| error.to_string());
        assert_eq!(text(b"\xef\xbb\xbfa.fits\r\n").as_deref(), Ok("a.fits\r\n"));
        assert_eq!(text(b"a").as_deref(), Ok("a"));
        assert_eq!(text(b"").as_deref(), Ok(""));
        for bytes in [&b"\xff\xfea\0"[..], b"\xfe\xff\0a", b"a\0b\0", b"\0a\0b"] {
            assert!(text(bytes).unwrap_err().contains("UTF-16"), "{bytes:?}");
        }
        assert!(text(b"\xe9t\xe9").is_err());
    }

    #[test]
    fn the_shell_opens_files_by_their_number_alone() {
        for path in ["/dev/stdin", "/dev/fd/63", "/proc/self/fd/0"] {
            assert!(is_opened_by_shell(Path::new(path)), "{path}");
        }
        let others = [
            "/dev/fd/../zero",
            "/dev/fd/3/../../zero",
            "/dev/stdin/../zero",
            "/dev/fd",
            "/dev/fd/",
            "/dev/fd//dev/zero",
            "/proc/self/fd/../../../dev/zero",
            "/dev/fdx/3",
        ];
        for path in others {
            assert!(!is_opened_by_shell(Path::new(path)), "{path}");
        }
    }

    #[test]
    #[cfg(unix)]
    fn a_pipe_or_device_is_not_opened_by_any_name() {
        let directory = tempfile::tempdir().unwrap();
        let link = directory.path().join("link.png");
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
        let pipe = directory.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        let zero = Path::new("/dev/fd/../../../dev/zero");
        for path in [&*link, &*pipe, zero, Path::new("/dev/null")] {
            let error = open(path).unwrap_err().to_string();
            assert!(error.contains("a pipe, a socket or a device"), "{error}");
        }
        // Whoever put a pipe in the place of a file does not make it wait.
        let opened = open_at_once(&pipe).unwrap();
        assert!(check_kind(&opened.metadata().unwrap()).is_err());
    }

    #[test]
    fn an_endless_stream_is_refused() {
        let ones = || io::repeat(b'1');
        let error = read_stream(ones(), 1000).unwrap_err().to_string();
        assert!(error.starts_with("too large: found more than 1000 bytes"));
        assert_eq!(read_stream(ones().take(1000), 1000).unwrap().len(), 1000);
    }
}
