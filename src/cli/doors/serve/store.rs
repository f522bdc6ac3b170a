//! The folder of jobs: uploads that wait, and results. What was told to a client is there after a restart.
//!
//! A job is a folder named by its number: `upload`, then `job.json`; when it is begun `begun`; when it is done its
//! result files, then `result.json`. Each is written whole, and the last of them says that the others are there.

use crate::cli::output::files::make_directory;
use anyhow::{Context, bail};
use jiff::Timestamp;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use starpipe::base::files;
use starpipe::doors::nova::JobAnswers;
use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

/// Numbers begin with the seconds since 2020: clients keep answers by number, and must not meet those of an
/// earlier folder.
const SECONDS_OF_2020: u64 = 1_577_836_800;

/// Says that a folder is one of jobs, and is held as long as it is in use.
const LOCK: &str = "lock";
const UPLOAD: &str = "upload";
const JOB: &str = "job.json";
const RESULT: &str = "result.json";
/// One byte for each time that a worker began the job and the server did not live to tell how it ended.
const BEGUN: &str = "begun";

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

/// The same without the settings, which may be long.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct JobHead {
    pub(super) name: String,
    pub(super) received: String,
}

/// How it ended.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct JobResult {
    pub(super) started: String,
    pub(super) finished: String,
    pub(super) answers: JobAnswers,
    /// Whether nothing can be drawn: the upload is a list, or cannot be read.
    #[serde(default)]
    pub(super) has_no_picture: bool,
}

impl JobResult {
    /// A job that has just ended.
    pub(super) fn new(started: String, answers: JobAnswers) -> Self {
        Self {
            started,
            finished: now(),
            answers,
            has_no_picture: false,
        }
    }

    /// A job that gave nothing.
    pub(super) fn failed(started: String, reason: impl Into<String>) -> Self {
        Self {
            has_no_picture: true,
            ..Self::new(started, JobAnswers::failed(reason.into()))
        }
    }
}

/// How far a job is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum JobState {
    Solving,
    Success,
    Failure,
}

impl JobState {
    pub(super) fn of(result: Option<&JobResult>) -> Self {
        match result {
            None => Self::Solving,
            Some(result) if result.answers.calibration.is_some() => Self::Success,
            Some(_) => Self::Failure,
        }
    }

    /// As nova.astrometry.net calls it.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Solving => "solving",
            Self::Success => "success",
            Self::Failure => "failure",
        }
    }
}

/// Jobs in a folder.
pub(super) struct Store {
    folder: PathBuf,
    limit_bytes: u64,
    jobs: Mutex<Jobs>,
    /// Held while the bytes of a job are counted: the last count has all that was written.
    counting: Mutex<()>,
    /// Held as long as the folder is in use.
    _lock: File,
}

#[derive(Default)]
struct Jobs {
    entries: BTreeMap<u64, Entry>,
    /// The highest number that was given: none is given twice.
    last: u64,
}

struct Entry {
    bytes: u64,
    state: JobState,
    /// Where it could not be written.
    failure: Option<JobResult>,
}

impl Jobs {
    fn bytes(&self) -> u64 {
        self.entries.values().map(|entry| entry.bytes).sum()
    }

    /// Whether so many bytes more have room once all results are removed but those of the job `kept`.
    fn fits(&self, more: u64, limit: u64, kept: u64) -> bool {
        let stays =
            |(number, entry): &(&u64, &Entry)| entry.state == JobState::Solving || **number == kept;
        let staying = self.entries.iter().filter(stays);
        staying.map(|(_, entry)| entry.bytes).sum::<u64>() + more <= limit
    }

    /// Takes out the oldest results, but not the job `kept`, until there is room for so many bytes more.
    fn evict(&mut self, more: u64, limit: u64, kept: u64) -> Vec<u64> {
        let mut excess = (self.bytes() + more).saturating_sub(limit);
        let mut evicted = Vec::new();
        for (number, entry) in &self.entries {
            if excess == 0 {
                break;
            }
            if entry.state != JobState::Solving && *number != kept {
                excess = excess.saturating_sub(entry.bytes);
                evicted.push(*number);
            }
        }
        for number in &evicted {
            self.entries.remove(number);
        }
        evicted
    }
}

impl Store {
    /// Opens a folder; returns the numbers of jobs that wait, too.
    pub(super) fn open(folder: &Path, limit_mb: u64) -> anyhow::Result<(Self, Vec<u64>)> {
        make_directory(folder)?;
        let lock = locked(folder)?;
        let mut jobs = Jobs::default();
        for entry in read_directory(folder)?.flatten() {
            let name = entry.file_name();
            let name = name.to_str().unwrap_or_default();
            let number = name.parse().ok();
            let is_whole = |number: &u64| number.to_string() == name;
            let Some(number) = number.filter(is_whole) else {
                continue;
            };
            let path = entry.path();
            if !path.join(JOB).is_file() {
                // The server was killed before it answered, or while it removed the job.
                let _ = fs::remove_dir_all(&path);
                continue;
            }
            // After a power failure a file may be there without its content; then the job is done again.
            let result = json_in(&path.join(RESULT)).ok();
            let found = Entry {
                bytes: bytes_in(&path),
                state: JobState::of(result.as_ref()),
                failure: None,
            };
            jobs.entries.insert(number, found);
            jobs.last = jobs.last.max(number);
        }
        let entries = jobs.entries.iter();
        let waiting = entries.filter(|(_, entry)| entry.state == JobState::Solving);
        let waiting = waiting.map(|(number, _)| *number).collect();
        let store = Self {
            folder: folder.to_owned(),
            limit_bytes: limit_mb.saturating_mul(1_000_000),
            jobs: Mutex::new(jobs),
            counting: Mutex::default(),
            _lock: lock,
        };
        let evicted = store.lock().evict(0, store.limit_bytes, 0);
        store.erase(&evicted);
        Ok((store, waiting))
    }

    /// Keeps an upload; returns the number of its job.
    ///
    /// # Errors
    /// If there is no room, or it cannot be written.
    pub(super) fn add(&self, job: &Job, upload: &[u8]) -> anyhow::Result<u64> {
        let head = serde_json::to_vec(job)?;
        let bytes = (upload.len() + head.len()) as u64;
        let (number, evicted) = {
            let mut jobs = self.lock();
            if !jobs.fits(bytes, self.limit_bytes, 0) {
                bail!("{}: the folder is full", self.folder.display());
            }
            let evicted = jobs.evict(bytes, self.limit_bytes, 0);
            let now = SystemTime::now()
                .duration_since(UNIX_EPOCH)
                .unwrap_or_default();
            let first = now.as_secs().saturating_sub(SECONDS_OF_2020);
            jobs.last = first.max(jobs.last + 1);
            let number = jobs.last;
            let entry = Entry {
                bytes,
                state: JobState::Solving,
                failure: None,
            };
            jobs.entries.insert(number, entry);
            (number, evicted)
        };
        self.erase(&evicted);
        let write = || {
            fs::create_dir(self.path(number))?;
            files::write(&self.path(number).join(UPLOAD), upload)?;
            files::write(&self.path(number).join(JOB), &head)?;
            anyhow::Ok(())
        };
        let written = write().with_context(|| format!("writing {}", self.path(number).display()));
        if written.is_err() {
            self.lock().entries.remove(&number);
            self.remove_files(number);
        }
        written.map(|()| number)
    }

    /// How far a job is; `None` if there is none.
    pub(super) fn state(&self, number: u64) -> Option<JobState> {
        self.lock().entries.get(&number).map(|entry| entry.state)
    }

    /// The numbers of all jobs, the latest first.
    pub(super) fn numbers(&self) -> Vec<u64> {
        self.lock().entries.keys().rev().copied().collect()
    }

    /// What is kept, in bytes.
    pub(super) fn bytes(&self) -> u64 {
        self.lock().bytes()
    }

    /// What was uploaded: a [`Job`], or its [`JobHead`].
    pub(super) fn job<T: DeserializeOwned>(&self, number: u64) -> anyhow::Result<T> {
        json_in(&self.path(number).join(JOB))
    }

    /// The content of what was uploaded.
    pub(super) fn upload(&self, number: u64) -> anyhow::Result<Vec<u8>> {
        let path = self.path(number).join(UPLOAD);
        fs::read(&path).with_context(|| format!("reading {}", path.display()))
    }

    /// Says that a worker begins a job; returns how often the server has ended while it was solved.
    pub(super) fn begin(&self, number: u64) -> anyhow::Result<u64> {
        let path = self.path(number).join(BEGUN);
        let mark = || {
            let mut file = File::options().create(true).append(true).open(&path)?;
            let before = file.metadata()?.len();
            file.write_all(b"1")?;
            std::io::Result::Ok(before)
        };
        mark().with_context(|| format!("writing {}", path.display()))
    }

    /// Takes back that a job was begun: it is left to the next start.
    pub(super) fn leave(&self, number: u64) {
        let _ = fs::remove_file(self.path(number).join(BEGUN));
    }

    /// How a job ended, if it is done.
    pub(super) fn result(&self, number: u64) -> anyhow::Result<Option<JobResult>> {
        match self.lock().entries.get(&number) {
            Some(Entry {
                failure: Some(failure),
                ..
            }) => return Ok(Some(failure.clone())),
            Some(entry) if entry.state != JobState::Solving => {}
            _ => return Ok(None),
        }
        json_in(&self.path(number).join(RESULT)).map(Some)
    }

    /// Keeps how a job ended, and its files. Older results make room for them.
    pub(super) fn finish(
        &self,
        number: u64,
        result: &JobResult,
        files: Vec<(&str, Vec<u8>)>,
    ) -> anyhow::Result<()> {
        for (name, content) in files {
            self.make_room(number, content.len() as u64);
            self.write(number, name, &content)?;
        }
        self.write(number, RESULT, &serde_json::to_vec(result)?)?;
        self.leave(number);
        self.set(number, JobState::of(Some(result)), None);
        Ok(())
    }

    /// Keeps that a job failed; in memory alone where that cannot be written.
    pub(super) fn fail(&self, number: u64, failure: JobResult) {
        if let Err(error) = self.finish(number, &failure, Vec::new()) {
            tracing::error!("{error:#}");
            self.leave(number);
            self.set(number, JobState::Failure, Some(failure));
        }
    }

    fn set(&self, number: u64, state: JobState, failure: Option<JobResult>) {
        if let Some(entry) = self.lock().entries.get_mut(&number) {
            (entry.state, entry.failure) = (state, failure);
        }
    }

    /// A result file of a job; `None` if it has none.
    pub(super) fn file(&self, number: u64, name: &str) -> anyhow::Result<Option<File>> {
        let path = self.path(number).join(name);
        match File::open(&path) {
            Ok(file) => Ok(Some(file)),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error).with_context(|| format!("reading {}", path.display())),
        }
    }

    /// Keeps a result file that was made later, where there is room for it.
    pub(super) fn put(&self, number: u64, name: &str, content: &[u8]) -> anyhow::Result<()> {
        let more = content.len() as u64;
        if self.lock().fits(more, self.limit_bytes, number) {
            self.make_room(number, more);
            self.write(number, name, content)?;
        }
        Ok(())
    }

    /// Removes the oldest results until a job, if it is still there, has room for so many bytes more.
    fn make_room(&self, number: u64, more: u64) {
        let evicted = {
            let mut jobs = self.lock();
            let evicted = jobs.evict(more, self.limit_bytes, number);
            if let Some(entry) = jobs.entries.get_mut(&number) {
                entry.bytes += more;
            }
            evicted
        };
        self.erase(&evicted);
    }

    /// Writes a file of a job, and counts what the job has then.
    fn write(&self, number: u64, name: &str, content: &[u8]) -> anyhow::Result<()> {
        let path = self.path(number).join(name);
        let written = files::write(&path, content);
        let _counting = self.counting.lock().unwrap_or_else(PoisonError::into_inner);
        // Counted in the folder: the file may have been there before.
        let bytes = bytes_in(&self.path(number));
        if let Some(entry) = self.lock().entries.get_mut(&number) {
            entry.bytes = bytes;
        }
        written.with_context(|| format!("writing {}", path.display()))
    }

    /// Removes the folders of jobs that were evicted.
    fn erase(&self, evicted: &[u64]) {
        for number in evicted {
            tracing::info!(job = number, "removed: the folder is full");
            self.remove_files(*number);
        }
    }

    fn remove_files(&self, number: u64) {
        // Without it, the rest is no job.
        let _ = fs::remove_file(self.path(number).join(JOB));
        let _ = fs::remove_dir_all(self.path(number));
    }

    fn path(&self, number: u64) -> PathBuf {
        self.folder.join(number.to_string())
    }

    fn lock(&self) -> MutexGuard<'_, Jobs> {
        self.jobs.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The lock of a folder of jobs. What is no such folder is not touched: in it, folders of jobs are removed.
fn locked(folder: &Path) -> anyhow::Result<File> {
    let path = folder.join(LOCK);
    if !path.is_file() && read_directory(folder)?.next().is_some() {
        let folder = folder.display();
        bail!("{folder}: is not empty, and no folder of jobs; give one of its own");
    }
    let lock = File::create(&path).with_context(|| format!("writing {}", path.display()))?;
    match lock.try_lock() {
        // Not every file system has locks.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(lock),
        Err(TryLockError::WouldBlock) => {
            bail!("{}: in use by another server", folder.display())
        }
    }
}

fn read_directory(folder: &Path) -> anyhow::Result<fs::ReadDir> {
    fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))
}

fn json_in<T: DeserializeOwned>(path: &Path) -> anyhow::Result<T> {
    let read = || anyhow::Ok(serde_json::from_slice(&fs::read(path)?)?);
    read().with_context(|| format!("reading {}", path.display()))
}

/// The time of the clock, UTC, as nova.astrometry.net writes it.
pub(super) fn now() -> String {
    Timestamp::now()
        .strftime("%Y-%m-%d %H:%M:%S.%6f")
        .to_string()
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
        JobResult::new(String::new(), JobAnswers::failed("none".to_owned()))
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
        // A server that was killed before it had written a job, and what is no job.
        for name in ["77", "+78", "079"] {
            fs::create_dir(directory.path().join(name)).unwrap();
        }
        drop(store);
        let (store, waiting) = Store::open(directory.path(), 1).unwrap();
        assert_eq!(waiting, [second]);
        assert_eq!(store.numbers(), [second, first]);
        assert_eq!(
            store.result(first).unwrap().unwrap().answers,
            done().answers
        );
        assert!(store.file(first, "wcs").unwrap().is_some());
        assert!(store.file(first, "corr").unwrap().is_none());
        assert_eq!(store.upload(second).unwrap(), b"two");
        assert!(store.result(second).unwrap().is_none());
        let exists = ["77", "+78", "079"].map(|name| directory.path().join(name).exists());
        assert_eq!(exists, [false, true, true]);
        assert_eq!(store.state(77), None);
    }

    #[test]
    fn a_folder_of_something_else_is_not_touched() {
        let directory = tempfile::tempdir().unwrap();
        let picture = directory.path().join("2023").join("a.png");
        fs::create_dir(directory.path().join("2023")).unwrap();
        fs::write(&picture, b"P").unwrap();
        let refused = Store::open(directory.path(), 1).err().unwrap().to_string();
        assert!(refused.contains("is not empty, and no folder"), "{refused}");
        assert!(picture.exists() && !directory.path().join(LOCK).exists());
    }

    #[test]
    fn a_result_that_was_not_written_whole_is_made_again() {
        let directory = tempfile::tempdir().unwrap();
        let (store, _) = Store::open(directory.path(), 1).unwrap();
        let number = store.add(&job(), b"one").unwrap();
        store.finish(number, &done(), Vec::new()).unwrap();
        fs::write(store.path(number).join(RESULT), b"").unwrap();
        drop(store);
        let (store, waiting) = Store::open(directory.path(), 1).unwrap();
        assert_eq!(waiting, [number]);
        assert_eq!(store.state(number), Some(JobState::Solving));
    }

    #[test]
    fn the_oldest_results_make_room_and_what_waits_does_not() {
        let directory = tempfile::tempdir().unwrap();
        let (store, _) = Store::open(directory.path(), 1).unwrap();
        let upload = vec![0; 400_000];
        let first = store.add(&job(), &upload).unwrap();
        store.finish(first, &done(), Vec::new()).unwrap();
        let second = store.add(&job(), &upload).unwrap();
        // What has no room costs no result.
        assert!(store.add(&job(), &[0; 700_000]).is_err());
        assert_eq!(store.numbers(), [second, first]);
        let third = store.add(&job(), &upload).unwrap();
        assert_eq!(store.numbers(), [third, second]);
        assert!(!store.path(first).exists());
        assert!(store.add(&job(), &upload).is_err());
        store.finish(second, &done(), Vec::new()).unwrap();
        store.finish(third, &done(), Vec::new()).unwrap();
        // A file that is made later makes room, and counts once.
        for _ in 0..2 {
            store.put(third, "new.fits", &[0; 250_000]).unwrap();
            assert_eq!(store.numbers(), [third]);
            assert_eq!(store.bytes(), bytes_in(&store.path(third)));
        }
        store.put(third, "annotated.jpg", &upload).unwrap();
        assert!(store.file(third, "annotated.jpg").unwrap().is_none());
        // All numbers are new, also those after the highest was removed.
        let fourth = store.add(&job(), &[0; 900_000]).unwrap();
        assert!(fourth > third && store.numbers() == [fourth]);
    }

    #[test]
    fn a_failure_that_cannot_be_written_is_told() {
        let directory = tempfile::tempdir().unwrap();
        let (store, _) = Store::open(directory.path(), 1).unwrap();
        let number = store.add(&job(), b"one").unwrap();
        // No file can take the name of a directory.
        let taken = store.path(number).join(RESULT);
        fs::create_dir(&taken).unwrap();
        assert!(store.finish(number, &done(), Vec::new()).is_err());
        assert_eq!(store.state(number), Some(JobState::Solving));
        store.fail(number, JobResult::failed(String::new(), "why"));
        assert_eq!(store.state(number), Some(JobState::Failure));
        let told = store.result(number).unwrap().unwrap().answers.reason;
        assert_eq!(told.as_deref(), Some("why"));
        drop(store);
        fs::remove_dir(&taken).unwrap();
        let (_, waiting) = Store::open(directory.path(), 1).unwrap();
        assert_eq!(waiting, [number]);
    }

    #[test]
    fn it_is_counted_how_often_a_job_was_begun_and_not_ended() {
        let directory = tempfile::tempdir().unwrap();
        let (store, _) = Store::open(directory.path(), 1).unwrap();
        let number = store.add(&job(), b"one").unwrap();
        let counts = [(); 3].map(|()| store.begin(number).unwrap());
        assert_eq!(counts, [0, 1, 2]);
        store.leave(number);
        assert_eq!(store.begin(number).unwrap(), 0);
    }
}
