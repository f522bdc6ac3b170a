//! Files that are written whole or not at all.

use std::fs;
use std::io;
use std::path::Path;

/// A temporary file beside `path`, with the permissions of any other new file, which takes that name by
/// [`persist`](tempfile::NamedTempFile::persist) once it is whole.
///
/// # Errors
/// Those of the system; and where `path` is a device, a pipe or a directory, whose place a new name would take.
pub fn beside(path: &Path) -> io::Result<tempfile::NamedTempFile> {
    if fs::metadata(path).is_ok_and(|found| !found.is_file()) {
        return Err(io::Error::other("it exists and is no regular file"));
    }
    let parent = path.parent().filter(|parent| *parent != Path::new(""));
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Temporary files are private by default; the process's umask takes away what the user wants taken away.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(parent.unwrap_or(Path::new(".")))
}
