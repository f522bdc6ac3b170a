//! The body of a request, limited while it is read: in its length, in its time, and in the memory of all bodies.

use super::refusal::Refusal;
use axum::body::{Bytes, HttpBody};
use axum::http::StatusCode;
use http_body_util::BodyExt;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{Instant, timeout_at};

/// Bodies that arrive slower than this are given up.
const MIN_BYTES_PER_S: u64 = 50_000;

/// Bodies of this many largest uploads may be in memory.
const BODIES: usize = 4;

/// The limits of all bodies.
pub(super) struct Limits {
    max_bytes: usize,
    /// How long the head of a request may take, and its body beside its length.
    pub(super) send_time: Duration,
    /// Memory for bodies, in kB.
    memory_kb: Arc<Semaphore>,
}

impl Limits {
    pub(super) fn new(max_mb: usize, send_time: Duration) -> Self {
        let max_bytes = max_mb.saturating_mul(1_000_000);
        Self {
            max_bytes,
            send_time,
            memory_kb: Arc::new(Semaphore::new(BODIES * max_bytes / 1000)),
        }
    }
}

/// A body with its place in memory.
pub(super) struct Received {
    pub(super) bytes: Bytes,
    _memory: Option<OwnedSemaphorePermit>,
}

impl Received {
    /// A part of it, with its place in memory.
    pub(super) fn part(self, part: &[u8]) -> Self {
        Self {
            bytes: self.bytes.slice_ref(part),
            ..self
        }
    }

    /// A content that was kept; it has its place in the memory of a frame.
    pub(super) fn kept(content: Vec<u8>) -> Self {
        Self {
            bytes: content.into(),
            _memory: None,
        }
    }
}

/// Reads a body.
///
/// # Errors
/// If it is too long, too slow, breaks off, or has no room.
pub(super) async fn receive<B>(limits: &Limits, body: B) -> Result<Received, Refusal>
where
    B: HttpBody<Data = Bytes>,
{
    let too_long = || {
        let most = limits.max_bytes / 1_000_000;
        let message = format!("the body is too large: at most {most} MB are accepted");
        Refusal::new(StatusCode::PAYLOAD_TOO_LARGE, message)
    };
    if body.size_hint().lower() > limits.max_bytes as u64 {
        return Err(too_long());
    }
    let mut body = std::pin::pin!(body);
    let begun = Instant::now() + limits.send_time;
    let mut bytes = Vec::new();
    let mut memory: Option<OwnedSemaphorePermit> = None;
    loop {
        let at_least = Duration::from_millis(bytes.len() as u64 * 1000 / MIN_BYTES_PER_S);
        let frame = timeout_at(begun + at_least, body.frame()).await;
        let frame = frame.map_err(|_| {
            Refusal::new(StatusCode::REQUEST_TIMEOUT, "the body arrives too slowly")
        })?;
        let Some(frame) = frame else { break };
        let frame = frame.map_err(|_| Refusal::invalid("the body breaks off"))?;
        let Ok(data) = frame.into_data() else {
            continue;
        };
        if bytes.len() + data.len() > limits.max_bytes {
            return Err(too_long());
        }
        let held = memory.as_ref().map_or(0, OwnedSemaphorePermit::num_permits);
        let needed = (bytes.len() + data.len()).div_ceil(1000);
        if needed > held {
            let more = u32::try_from(needed - held).unwrap_or(u32::MAX);
            let more = Arc::clone(&limits.memory_kb).try_acquire_many_owned(more);
            let more = more.map_err(|_| Refusal::busy("too many uploads at once"))?;
            match &mut memory {
                Some(memory) => memory.merge(more),
                None => memory = Some(more),
            }
        }
        bytes.extend_from_slice(&data);
    }
    Ok(Received {
        bytes: bytes.into(),
        _memory: memory,
    })
}
