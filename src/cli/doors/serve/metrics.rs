//! Counters for monitoring, in the text format of Prometheus.

use std::fmt::Write;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Upper ends of the classes of solving times, in seconds.
const CLASSES_S: [f64; 9] = [0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0];

/// How a frame ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ending {
    Identified,
    NotIdentified,
    Failed,
}

impl Ending {
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Identified => "identified",
            Self::NotIdentified => "not_identified",
            Self::Failed => "failed",
        }
    }
}

/// Counters since the start.
pub(super) struct Metrics {
    workers: usize,
    endings: [AtomicU64; 3],
    classes: [AtomicU64; CLASSES_S.len()],
    spent_ms: AtomicU64,
    /// Requests by the first digit of their status.
    requests: [AtomicU64; 6],
}

impl Metrics {
    pub(super) fn new(workers: usize) -> Self {
        Self {
            workers,
            endings: Default::default(),
            classes: Default::default(),
            spent_ms: AtomicU64::default(),
            requests: Default::default(),
        }
    }

    pub(super) fn end(&self, ending: Ending, spent: Duration) {
        self.endings[ending as usize].fetch_add(1, Ordering::Relaxed);
        let spent_ms = u64::try_from(spent.as_millis()).unwrap_or(u64::MAX);
        self.spent_ms.fetch_add(spent_ms, Ordering::Relaxed);
        let is_within = |end_s: &f64| spent.as_secs_f64() <= *end_s;
        if let Some(class) = CLASSES_S.iter().position(is_within) {
            self.classes[class].fetch_add(1, Ordering::Relaxed);
        }
    }

    pub(super) fn count_request(&self, status: u16) {
        if let Some(counter) = self.requests.get(usize::from(status / 100)) {
            counter.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The counters as text, with how many frames wait and run, and how much of jobs is kept.
    pub(super) fn text(&self, waiting: usize, running: usize, kept_bytes: u64) -> String {
        let of = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        let mut text = String::new();
        let mut add = |name: &str, kind: &str, help: &str, values: &[(String, String)]| {
            let _ = writeln!(
                text,
                "# HELP starpipe_{name} {help}\n# TYPE starpipe_{name} {kind}"
            );
            for (suffix, value) in values {
                let _ = writeln!(text, "starpipe_{name}{suffix} {value}");
            }
        };
        let one = |value: u64| [(String::new(), value.to_string())];
        let all = [Ending::Identified, Ending::NotIdentified, Ending::Failed];
        let endings = all.map(|ending| {
            let label = format!("{{outcome=\"{}\"}}", ending.word());
            (label, of(&self.endings[ending as usize]).to_string())
        });
        add(
            "frames_total",
            "counter",
            "Frames that were solved.",
            &endings,
        );
        let requests = self.requests.iter().enumerate().skip(1);
        let requests = requests
            .map(|(digit, counter)| (format!("{{status=\"{digit}xx\"}}"), of(counter).to_string()));
        let requests: Vec<_> = requests.collect();
        add(
            "requests_total",
            "counter",
            "Requests that were answered.",
            &requests,
        );
        let waiting = one(waiting as u64);
        add("queue_length", "gauge", "Frames that wait.", &waiting);
        add(
            "running",
            "gauge",
            "Frames that are being solved.",
            &one(running as u64),
        );
        add(
            "workers",
            "gauge",
            "Frames that can be solved at once.",
            &one(self.workers as u64),
        );
        add(
            "folder_bytes",
            "gauge",
            "What is kept of jobs.",
            &one(kept_bytes),
        );
        let mut sum = 0;
        let mut classes: Vec<_> = CLASSES_S
            .iter()
            .zip(&self.classes)
            .map(|(end_s, counter)| {
                sum += of(counter);
                (format!("_bucket{{le=\"{end_s}\"}}"), sum.to_string())
            })
            .collect();
        let count: u64 = self.endings.iter().map(of).sum();
        let spent_s = of(&self.spent_ms) as f64 / 1000.0;
        classes.push(("_bucket{le=\"+Inf\"}".to_owned(), count.to_string()));
        classes.push(("_sum".to_owned(), spent_s.to_string()));
        classes.push(("_count".to_owned(), count.to_string()));
        add("solve_seconds", "histogram", "Times of solving.", &classes);
        text
    }
}
