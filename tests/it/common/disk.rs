//! Disks that are full or may not be written.

use std::path::Path;
use std::process::Command;

/// A file system in memory of limited size, unmounted on drop.
pub struct SmallDisk {
    place: tempfile::TempDir,
}

impl SmallDisk {
    /// `None`, saying so, where mounting is not allowed.
    pub fn new(options: &str) -> Option<Self> {
        let place = tempfile::tempdir().unwrap();
        let mut mount = Command::new("mount");
        mount
            .args(["-t", "tmpfs", "-o", options, "none"])
            .arg(place.path());
        match mount.output() {
            Ok(done) if done.status.success() => Some(Self { place }),
            _ => {
                eprintln!("skipped: no file system can be mounted here");
                None
            }
        }
    }

    /// Changes the limit.
    pub fn enlarge(&self, options: &str) {
        let remount = format!("remount,{options}");
        let mut mount = Command::new("mount");
        let done = mount.args(["-o", &remount]).arg(self.path()).status();
        assert!(done.unwrap().success());
    }

    /// Where it is mounted.
    pub fn path(&self) -> &Path {
        self.place.path()
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        // Best effort: leftovers are in a temporary directory.
        let _ = Command::new("umount").arg(self.path()).status();
    }
}
