//! The folder of jobs: uploads that wait, and results. What was told to a client is there after a restart.
//!
//! A job is a folder named by its number: `upload`, then `job.json`; when it is done its result files, then
//! `result.json`. Each is written whole, and the last of them says that the others are there.

use crate::cli::output::files::{make_directory, write_whole};
use anyhow::{Context, bail};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use starpipe::base::files;
use starpipe::doors::nova::JobAnswers;
use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

/// Numbers begin with the seconds since 2020: clients keep answers by number, and must not meet those of an
/// earlier folder.
const SECONDS_OF_2020: u64 = 1_577_836_800;

const UPLOAD: &str = "upload";
const JOB: &str = "job.json";
const RESULT: &str = "result.json";

/// What was uploaded.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Job {
    /// What the upload was called.
    pub(super) name: String,
    /// Its settings, without the session.
    pub(super) settings: Map<String, Value>,
    /// When it came, UTC.
    pub(super) received: String,
}

/// How it ended.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct JobResult {
    pub(super) started: String,
    pub(super) finished: String,
    pub(super) answers: JobAnswers,
}

/// Jobs in a folder.
pub(super) struct Store {
    folder: PathBuf,
    limit_bytes: u64,
    jobs: Mutex<BTreeMap<u64, Entry>>,
    /// Held as long as the folder is in use.
    _lock: File,
}

struct Entry {
    bytes: u64,
    is_done: bool,
}

impl Store {
    /// Opens a folder; returns the numbers of jobs that wait, too.
    pub(super) fn open(folder: &Path, limit_mb: u64) -> anyhow::Result<(Self, Vec<u64>)> {
        make_directory(folder)?;
        let path = folder.join("lock");
        let lock = File::create(&path).with_context(|| format!("writing {}", path.display()))?;
        match lock.try_lock() {
            // Not every file system has locks.
            Ok(()) | Err(TryLockError::Error(_)) => {}
            Err(TryLockError::WouldBlock) => {
                bail!("{}: in use by another server", folder.display())
            }
        }
        let mut jobs = BTreeMap::new();
        let entries = fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()));
        for entry in entries?.flatten() {
            let number = entry
                .file_name()
                .to_str()
                .and_then(|name| name.parse().ok());
            let Some(number) = number else { continue };
            let path = entry.path();
            if !path.join(JOB).is_file() {
                // The server was killed before it answered, or while it removed the job.
                let _ = fs::remove_dir_all(&path);
                continue;
            }
            let is_done = path.join(RESULT).is_file();
            let bytes = bytes_in(&path);
            jobs.insert(number, Entry { bytes, is_done });
        }
        let waiting = jobs.iter().filter(|(_, entry)| !entry.is_done);
        let waiting = waiting.map(|(number, _)| *number).collect();
        let store = Self {
            folder: folder.to_owned(),
            limit_bytes: limit_mb.saturating_mul(1_000_000),
            jobs: Mutex::new(jobs),
            _lock: lock,
        };
        store.make_room(0)?;
        Ok((store, waiting))
    }

    /// Keeps an upload; returns the number of its job.
    ///
    /// # Errors
    /// If there is no room, or it cannot be written.
    pub(super) fn add(&self, job: &Job, upload: &[u8]) -> anyhow::Result<u64> {
        self.make_room(upload.len() as u64)?;
        let number = {
            let mut jobs = self.lock();
            let now = SystemTime::now()
                .duration_since(UNIX_EPOCH)
                .unwrap_or_default();
            let first = now.as_secs().saturating_sub(SECONDS_OF_2020).max(1);
            let last = jobs.last_key_value().map_or(0, |(last, _)| *last);
            let number = first.max(last + 1);
            let bytes = upload.len() as u64;
            jobs.insert(
                number,
                Entry {
                    bytes,
                    is_done: false,
                },
            );
            number
        };
        let write = || {
            fs::create_dir(self.path(number))?;
            files::write(&self.path(number).join(UPLOAD), upload)?;
            files::write(&self.path(number).join(JOB), &serde_json::to_vec(job)?)?;
            anyhow::Ok(())
        };
        let written = write().with_context(|| format!("writing {}", self.path(number).display()));
        if written.is_err() {
            self.remove(number);
        }
        written.map(|()| number)
    }

    /// Forgets a job.
    pub(super) fn remove(&self, number: u64) {
        self.lock().remove(&number);
        // Without it, the rest is no job.
        let _ = fs::remove_file(self.path(number).join(JOB));
        let _ = fs::remove_dir_all(self.path(number));
    }

    /// Whether a job is done; `None` if there is none.
    pub(super) fn is_done(&self, number: u64) -> Option<bool> {
        self.lock().get(&number).map(|entry| entry.is_done)
    }

    /// The numbers of all jobs, the latest first.
    pub(super) fn numbers(&self) -> Vec<u64> {
        self.lock().keys().rev().copied().collect()
    }

    /// What is kept, in bytes.
    pub(super) fn bytes(&self) -> u64 {
        self.lock().values().map(|entry| entry.bytes).sum()
    }

    /// What was uploaded.
    pub(super) fn job(&self, number: u64) -> anyhow::Result<Job> {
        self.json(number, JOB)
    }

    /// The content of what was uploaded.
    pub(super) fn upload(&self, number: u64) -> anyhow::Result<Vec<u8>> {
        let path = self.path(number).join(UPLOAD);
        fs::read(&path).with_context(|| format!("reading {}", path.display()))
    }

    /// How a job ended, if it is done.
    pub(super) fn result(&self, number: u64) -> anyhow::Result<Option<JobResult>> {
        match self.is_done(number) {
            Some(true) => self.json(number, RESULT).map(Some),
            _ => Ok(None),
        }
    }

    /// Keeps how a job ended, and its files.
    pub(super) fn finish(
        &self,
        number: u64,
        result: &JobResult,
        files: Vec<(&str, Vec<u8>)>,
    ) -> anyhow::Result<()> {
        for (name, content) in files {
            self.put(number, name, &content)?;
        }
        self.put(number, RESULT, &serde_json::to_vec(result)?)?;
        if let Some(entry) = self.lock().get_mut(&number) {
            entry.is_done = true;
        }
        self.make_room(0)
    }

    /// A result file of a job; `None` if it has none.
    pub(super) fn file(&self, number: u64, name: &str) -> anyhow::Result<Option<Vec<u8>>> {
        let path = self.path(number).join(name);
        match fs::read(&path) {
            Ok(content) => Ok(Some(content)),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error).with_context(|| format!("reading {}", path.display())),
        }
    }

    /// Keeps a result file of a job.
    pub(super) fn put(&self, number: u64, name: &str, content: &[u8]) -> anyhow::Result<()> {
        write_whole(&self.path(number).join(name), content)?;
        if let Some(entry) = self.lock().get_mut(&number) {
            entry.bytes += content.len() as u64;
        }
        Ok(())
    }

    /// Removes the oldest results until there is room for so many bytes more.
    fn make_room(&self, more: u64) -> anyhow::Result<()> {
        loop {
            let oldest = {
                let jobs = self.lock();
                let bytes: u64 = jobs.values().map(|entry| entry.bytes).sum();
                if bytes + more <= self.limit_bytes {
                    return Ok(());
                }
                let done = jobs.iter().find(|(_, entry)| entry.is_done);
                done.map(|(number, _)| *number)
            };
            match oldest {
                Some(number) => {
                    tracing::info!(job = number, "removed: the folder is full");
                    self.remove(number);
                }
                // At the start, what waits has room that it was given before.
                None if more == 0 => return Ok(()),
                None => bail!("{}: the folder is full", self.folder.display()),
            }
        }
    }

    fn json<T: DeserializeOwned>(&self, number: u64, name: &str) -> anyhow::Result<T> {
        let path = self.path(number).join(name);
        let read = || anyhow::Ok(serde_json::from_slice(&fs::read(&path)?)?);
        read().with_context(|| format!("reading {}", path.display()))
    }

    fn path(&self, number: u64) -> PathBuf {
        self.folder.join(number.to_string())
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<u64, Entry>> {
        self.jobs.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The bytes of the files in a folder.
fn bytes_in(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let files = entries.filter_map(|entry| entry.metadata().ok());
    files.map(|file| file.len()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job() -> Job {
        Job {
            name: "a.png".to_owned(),
            settings: Map::new(),
            received: String::new(),
        }
    }

    fn done() -> JobResult {
        JobResult {
            started: String::new(),
            finished: String::new(),
            answers: JobAnswers::failed("none".to_owned()),
        }
    }

    #[test]
    fn what_was_told_is_there_after_a_restart() {
        let directory = tempfile::tempdir().unwrap();
        let (store, waiting) = Store::open(directory.path(), 1).unwrap();
        assert!(waiting.is_empty());
        assert!(Store::open(directory.path(), 1).is_err(), "two servers");
        let [first, second] = [b"one", b"two"].map(|bytes| store.add(&job(), bytes).unwrap());
        store
            .finish(first, &done(), vec![("wcs", b"W".to_vec())])
            .unwrap();
        // A server that was killed before it had written a job.
        fs::create_dir(directory.path().join("77")).unwrap();
        drop(store);
        let (store, waiting) = Store::open(directory.path(), 1).unwrap();
        assert_eq!(waiting, [second]);
        assert_eq!(store.numbers(), [second, first]);
        assert_eq!(
            store.result(first).unwrap().unwrap().answers,
            done().answers
        );
        assert_eq!(store.file(first, "wcs").unwrap().unwrap(), b"W");
        assert_eq!(store.upload(second).unwrap(), b"two");
        assert!(store.result(second).unwrap().is_none());
        assert!(!directory.path().join("77").exists());
        assert_eq!(store.is_done(77), None);
    }

    #[test]
    fn the_oldest_results_make_room_and_what_waits_does_not() {
        let directory = tempfile::tempdir().unwrap();
        let (store, _) = Store::open(directory.path(), 1).unwrap();
        let upload = vec![0; 400_000];
        let first = store.add(&job(), &upload).unwrap();
        let second = store.add(&job(), &upload).unwrap();
        assert!(store.add(&job(), &upload).is_err());
        for number in [first, second] {
            store.finish(number, &done(), Vec::new()).unwrap();
        }
        let third = store.add(&job(), &upload).unwrap();
        assert_eq!(store.numbers(), [third, second]);
        assert!(!store.path(first).exists());
    }
}
