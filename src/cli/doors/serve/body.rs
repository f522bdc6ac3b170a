//! The bodies of requests, limited while they are read: in their length, in their time, and in the memory of all;
//! and the memory of the answers that clients read slowly.

use super::refusal::Refusal;
use axum::body::{Body, Bytes, HttpBody};
use axum::http::StatusCode;
use http_body_util::BodyExt;
use hyper::body::{Frame, SizeHint};
use std::fs::File;
use std::io::Read;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{Instant, timeout, timeout_at};

/// How long a client may wait for its turn and its answer.
pub(super) const MAX_WAIT: Duration = Duration::from_secs(600);

/// Bodies that arrive slower than this are given up.
const MIN_BYTES_PER_S: u64 = 50_000;

/// Bodies of this many largest uploads may be in memory, and as much of answers.
const BODIES: usize = 4;

/// JSON with more bytes is large: as values it takes up to 32 times as much memory.
const LARGE_JSON_BYTES: usize = 64_000;

/// Calls at once that have large JSON.
const LARGE_CALLS: usize = 4;

/// Of the body of a request that is refused so much is read, so that its client reads the answer.
const DRAINED_BYTES: usize = 8_000_000;
const DRAINED_TIME: Duration = Duration::from_secs(2);

/// The limits of all bodies.
pub(super) struct Limits {
    pub(super) max_bytes: usize,
    /// How long the head of a request may take, and its body beside its length.
    pub(super) send_time: Duration,
    bodies_kb: Arc<Semaphore>,
    answers_kb: Arc<Semaphore>,
    large_calls: Arc<Semaphore>,
}

/// Bytes with their place in memory, which is free when nobody has any of them.
struct Held {
    bytes: Vec<u8>,
    _place: Option<OwnedSemaphorePermit>,
}

impl AsRef<[u8]> for Held {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

impl Limits {
    pub(super) fn new(max_mb: usize, send_time: Duration) -> Self {
        let max_bytes = max_mb.saturating_mul(1_000_000);
        let places = |number| Arc::new(Semaphore::new(number));
        Self {
            max_bytes,
            send_time,
            bodies_kb: places(BODIES * max_bytes / 1000),
            answers_kb: places(BODIES * max_bytes / 1000),
            large_calls: places(LARGE_CALLS),
        }
    }

    /// How long a connection may last: for the slowest upload, its turn, and an answer that is as long.
    pub(super) fn life(&self) -> Duration {
        let longest = Duration::from_secs(self.max_bytes as u64 / MIN_BYTES_PER_S);
        2 * (self.send_time + longest) + MAX_WAIT
    }

    /// An answer with its place in memory.
    pub(super) fn answer(&self, bytes: Vec<u8>) -> Result<Bytes, Refusal> {
        let _place = Some(self.place_of_answer(bytes.len() as u64)?);
        Ok(Bytes::from_owner(Held { bytes, _place }))
    }

    /// A file as an answer; it has its place before it is read.
    pub(super) fn file(&self, mut file: File) -> Result<Bytes, Refusal> {
        let failed = |error: std::io::Error| Refusal::internal(&error.into());
        let _place = Some(self.place_of_answer(file.metadata().map_err(failed)?.len())?);
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        Ok(Bytes::from_owner(Held { bytes, _place }))
    }

    fn place_of_answer(&self, bytes: u64) -> Result<OwnedSemaphorePermit, Refusal> {
        // An answer that is larger than all may be comes alone.
        let needed = bytes
            .div_ceil(1000)
            .min((BODIES * self.max_bytes / 1000) as u64);
        let needed = u32::try_from(needed).unwrap_or(u32::MAX);
        let place = Arc::clone(&self.answers_kb).try_acquire_many_owned(needed);
        place.map_err(|_| Refusal::busy("too many answers at once"))
    }

    /// A place for JSON of this length, which must be kept as long as its values; small ones need none.
    pub(super) fn place_of_json(
        &self,
        bytes: usize,
    ) -> Result<Option<OwnedSemaphorePermit>, Refusal> {
        if bytes <= LARGE_JSON_BYTES {
            return Ok(None);
        }
        let place = Arc::clone(&self.large_calls).try_acquire_owned();
        let place = place.map_err(|_| Refusal::busy("too many lists at once"))?;
        Ok(Some(place))
    }
}

/// Reads a body of at most `most` bytes.
///
/// # Errors
/// If it is too long, too slow, breaks off, or has no room.
pub(super) async fn receive<B>(limits: &Limits, body: B, most: usize) -> Result<Bytes, Refusal>
where
    B: HttpBody<Data = Bytes>,
{
    if body.size_hint().lower() > most as u64 {
        return Err(Refusal::too_large(most));
    }
    let mut body = std::pin::pin!(body);
    let begun = Instant::now() + limits.send_time;
    let mut bytes = Vec::new();
    let mut place: Option<OwnedSemaphorePermit> = None;
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
        if bytes.len() + data.len() > most {
            return Err(Refusal::too_large(most));
        }
        let held = place.as_ref().map_or(0, OwnedSemaphorePermit::num_permits);
        let needed = (bytes.len() + data.len()).div_ceil(1000);
        if needed > held {
            let more = u32::try_from(needed - held).unwrap_or(u32::MAX);
            let more = Arc::clone(&limits.bodies_kb).try_acquire_many_owned(more);
            let more = more.map_err(|_| Refusal::busy("too many uploads at once"))?;
            match &mut place {
                Some(place) => place.merge(more),
                None => place = Some(more),
            }
        }
        bytes.extend_from_slice(&data);
    }
    let _place = place;
    Ok(Bytes::from_owner(Held { bytes, _place }))
}

/// The body of a request, of which the rest can be read when its handler has refused it.
#[derive(Clone)]
pub(super) struct SharedBody(Arc<Mutex<Body>>);

impl SharedBody {
    pub(super) fn new(body: Body) -> Self {
        Self(Arc::new(Mutex::new(body)))
    }

    /// Reads the rest, within limits: a client that still sends loses the answer.
    pub(super) async fn drain(mut self) {
        let drained = async {
            let mut bytes = 0;
            while let Some(Ok(frame)) = self.frame().await {
                bytes += frame.data_ref().map_or(0, Bytes::len);
                if bytes > DRAINED_BYTES {
                    break;
                }
            }
        };
        let _ = timeout(DRAINED_TIME, drained).await;
    }

    fn lock(&self) -> MutexGuard<'_, Body> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl HttpBody for SharedBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut *self.lock()).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.lock().is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.lock().size_hint()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_connection_lasts_as_long_as_the_slowest_upload_and_its_answer() {
        let limits = |max_mb| Limits::new(max_mb, Duration::from_secs(30));
        for (max_mb, upload_s) in [(1, 20 + 30), (256, 5120 + 30), (4000, 80_000 + 30)] {
            let least = Duration::from_secs(upload_s) + MAX_WAIT;
            assert!(limits(max_mb).life() > least, "{max_mb} MB");
        }
    }

    #[test]
    fn answers_have_memory_until_nobody_has_them() {
        let limits = Limits::new(1, Duration::ZERO);
        let first = limits.answer(vec![0; 3_000_000]).unwrap();
        let part = first.slice(..10);
        drop(first);
        assert!(limits.answer(vec![0; 2_000_000]).is_err());
        assert!(limits.answer(vec![0; 1_000_000]).is_ok());
        drop(part);
        // One that is larger than all may be comes alone.
        let alone = limits.answer(vec![0; 9_000_000]).unwrap();
        assert!(limits.answer(vec![0]).is_err());
        drop(alone);
        assert!(limits.answer(vec![0]).is_ok());
    }
}
