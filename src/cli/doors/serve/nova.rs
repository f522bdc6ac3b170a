//! The protocol of nova.astrometry.net. A submission, its job and its picture have one number.

use super::body::{Limits, receive};
use super::http::{FITS, TEXT, nova_reply, reply, shown_name, text_of};
use super::refusal::{NovaRefusal, Refusal};
use super::server::Server;
use super::solve::{blocking, check_queue};
use super::store::{Job, JobHead, JobResult, JobState, now};
use super::work::{Source, Wanted, Work};
use super::worker::WCS;
use super::{fetch, solve};
use axum::body::Bytes;
use axum::extract::{Path, Request, State};
use axum::http::{HeaderValue, header};
use axum::response::Response;
use serde_json::{Map, Value, json};
use starpipe::doors::nova::{JobAnswers, Upload, form};
use starpipe::report::tables::TableFormat;
use std::borrow::Cow;
use std::fmt::Write;
use std::sync::Arc;
use tokio::sync::OwnedSemaphorePermit;
use xxhash_rust::xxh3::xxh3_128;

type Answer = Result<Response, NovaRefusal>;
type Shared = State<Arc<Server>>;

/// Bytes of the JSON of a call.
const MAX_JSON_BYTES: usize = 4_000_000;
/// Bytes of the body of a call that uploads nothing.
const MAX_CALL_BYTES: usize = 64_000;

/// A call: its arguments, and the file that comes with it.
struct Call {
    arguments: Map<String, Value>,
    file: Option<(Option<String>, Bytes)>,
    /// That of the arguments in memory.
    _place: Option<OwnedSemaphorePermit>,
}

impl Call {
    /// Reads a call of at most `most` bytes.
    async fn receive(
        server: &Arc<Server>,
        request: Request,
        most: usize,
    ) -> Result<Self, NovaRefusal> {
        let kind = text_of(request.headers(), header::CONTENT_TYPE).to_owned();
        let most = match form::is_multipart(&kind) {
            true => most,
            // An encoded form may have three letters for one.
            false => most.min(3 * MAX_JSON_BYTES),
        };
        let body = receive(&server.limits, request.into_body(), most).await?;
        let server = Arc::clone(server);
        blocking(move || Self::parse(&server.limits, &kind, &body)).await
    }

    /// The call in a body of this kind: JSON alone, or a form.
    fn parse(limits: &Limits, kind: &str, body: &Bytes) -> Result<Self, NovaRefusal> {
        if kind.starts_with("application/json") {
            return Self::new(limits, body, None);
        }
        let parts = form::parts(kind, body).map_err(NovaRefusal::of_call)?;
        let part = |name: &str| parts.iter().find(|part| part.name == name);
        let stated = part("request-json").ok_or_else(|| NovaRefusal::of_call("no json"))?;
        let file = part("file").and_then(|file| match file.content {
            Cow::Borrowed(content) => Some((file.file_name.clone(), body.slice_ref(content))),
            // An encoded form has no files.
            Cow::Owned(_) => None,
        });
        Self::new(limits, &stated.content, file)
    }

    fn new(
        limits: &Limits,
        json: &[u8],
        file: Option<(Option<String>, Bytes)>,
    ) -> Result<Self, NovaRefusal> {
        if json.len() > MAX_JSON_BYTES {
            return Err(Refusal::too_large(MAX_JSON_BYTES).into());
        }
        let _place = limits.place_of_json(json.len())?;
        let refused = |_| NovaRefusal::of_call("failed to parse JSON");
        Ok(Self {
            arguments: serde_json::from_slice(json).map_err(refused)?,
            file,
            _place,
        })
    }

    /// The same of a client that has logged in; without its session.
    async fn of_session(
        server: &Arc<Server>,
        request: Request,
        most: usize,
    ) -> Result<Self, NovaRefusal> {
        let mut call = Self::receive(server, request, most).await?;
        let session = call.arguments.remove("session");
        let Some(session) = session.as_ref().and_then(Value::as_str) else {
            return Err(NovaRefusal::of_call("no \"session\" in JSON."));
        };
        if !server.keys.is_session(session) {
            let message = format!("no session with key \"{session}\"");
            return Err(NovaRefusal::of_call(message));
        }
        Ok(call)
    }

    fn argument(&self, name: &str) -> Option<&str> {
        self.arguments.get(name).and_then(Value::as_str)
    }
}

/// `/api/login`
pub(super) async fn login(State(server): Shared, request: Request) -> Answer {
    let call = Call::receive(&server, request, MAX_CALL_BYTES).await?;
    let key = call.argument("apikey");
    let key = key.ok_or_else(|| NovaRefusal::of_call("need \"apikey\""))?;
    let session = server.keys.session(key.trim());
    let session = session.ok_or_else(|| NovaRefusal::of_call("bad apikey"))?;
    Ok(nova_reply(&json!({
        "status": "success",
        "message": "authenticated user: ",
        "session": session,
    })))
}

/// `/api/upload`
pub(super) async fn upload(State(server): Shared, request: Request) -> Answer {
    check_queue(&server)?;
    let mut call = Call::of_session(&server, request, server.limits.max_bytes).await?;
    let (name, content) = match call.file.take() {
        Some((name, content)) => (shown_name(name.as_deref()), content),
        None => ("json-xy".to_owned(), Bytes::new()),
    };
    submit(&server, name, call, content).await
}

/// `/api/url_upload`; lists of stars are sent here, too.
pub(super) async fn url_upload(State(server): Shared, request: Request) -> Answer {
    check_queue(&server)?;
    let call = Call::of_session(&server, request, server.limits.max_bytes).await?;
    let Some(url) = call.argument("url").map(str::to_owned) else {
        return submit(&server, "json-xy".to_owned(), call, Bytes::new()).await;
    };
    if !server.allows_url {
        let message = "this server fetches no addresses; upload the file (or start the server with --allow-url)";
        return Err(NovaRefusal::of_call(message));
    }
    let content = fetch::fetch(&server.limits, &url).await?;
    let path = url.split(['?', '#']).next();
    submit(&server, shown_name(path), call, content).await
}

async fn submit(server: &Arc<Server>, name: String, call: Call, content: Bytes) -> Answer {
    let received = now();
    let shared = Arc::clone(server);
    let submitted = blocking(move || {
        let upload = Upload::from_json(&call.arguments).map_err(NovaRefusal::of_call)?;
        if content.is_empty() && !upload.has_list() {
            let message = "no file, no \"url\", and no \"x\" and \"y\"";
            return Err(NovaRefusal::of_call(message));
        }
        let hash = format!("{:032x}", xxh3_128(&content));
        let job = Job {
            name,
            settings: call.arguments,
            received,
        };
        let place = shared.queue.place().ok_or_else(solve::no_place)?;
        let added = shared.store.add(&job, &content);
        let number = added.map_err(|error| {
            tracing::error!("{error:#}");
            Refusal::busy("the folder of jobs is full or cannot be written")
        })?;
        place.fill(Work::Job(number));
        Ok((number, hash))
    });
    let (number, hash) = submitted.await?;
    tracing::info!(job = number, "uploaded");
    Ok(nova_reply(
        &json!({"status": "success", "subid": number, "hash": hash}),
    ))
}

/// `/api/myjobs`: those of all clients.
pub(super) async fn my_jobs(State(server): Shared, request: Request) -> Answer {
    Call::of_session(&server, request, MAX_CALL_BYTES).await?;
    let jobs = server.store.numbers();
    Ok(nova_reply(&json!({"status": "success", "jobs": jobs})))
}

/// `/api/submission_images`
pub(super) async fn submission_images(State(server): Shared, request: Request) -> Answer {
    let call = Call::of_session(&server, request, MAX_CALL_BYTES).await?;
    let number = call.arguments.get("subid").and_then(Value::as_u64);
    let known = number.filter(|number| server.store.state(*number).is_some());
    let known = known.ok_or_else(|| NovaRefusal::of_call("submission does not exist"))?;
    Ok(nova_reply(
        &json!({"status": "success", "image_ids": [known]}),
    ))
}

/// `/api/submissions/ID`
pub(super) async fn submission(State(server): Shared, Path(id): Path<String>) -> Answer {
    let (number, _) = found(&server, &id)?;
    let (job, result) = kept(&server, number).await?;
    let calibration = result
        .as_ref()
        .and_then(|result| result.answers.calibration);
    let calibrations: Vec<[u64; 2]> = calibration.iter().map(|_| [number; 2]).collect();
    // As Python writes what is not there.
    let time = |of: fn(&JobResult) -> &String| {
        let time = result.as_ref().map(of);
        time.cloned().unwrap_or_else(|| "None".to_owned())
    };
    Ok(nova_reply(&json!({
        "user": 1,
        "processing_started": job.received,
        "processing_finished": time(|result| &result.finished),
        "user_images": [number],
        "images": [number],
        "jobs": [number],
        "job_calibrations": calibrations,
    })))
}

/// `/api/jobs/ID`
pub(super) async fn job(State(server): Shared, Path(id): Path<String>) -> Answer {
    let (_, state) = found(&server, &id)?;
    Ok(nova_reply(&json!({"status": state.word()})))
}

/// `/api/jobs/ID/calibration` and so on.
pub(super) async fn job_answer(
    State(server): Shared,
    Path((id, what)): Path<(String, String)>,
) -> Answer {
    let (number, _) = found(&server, &id)?;
    let (job, result) = kept(&server, number).await?;
    let state = JobState::of(result.as_ref());
    let answers = result.map_or_else(JobAnswers::default, |result| result.answers);
    let no_calibration =
        || json!({"error": format!("no calibration data available for job {number}")});
    let answer = match what.as_str() {
        "calibration" => match answers.calibration {
            Some(calibration) => json!(calibration),
            None => no_calibration(),
        },
        "annotations" if answers.calibration.is_none() => no_calibration(),
        "annotations" => json!({"annotations": answers.annotations}),
        "objects_in_field" => json!({"objects_in_field": answers.names()}),
        "tags" | "machine_tags" => json!({"tags": answers.names()}),
        "info" => info(&job, &answers, state.word()),
        _ => return Err(Refusal::unknown("such address").into()),
    };
    Ok(nova_reply(&answer))
}

fn info(job: &JobHead, answers: &JobAnswers, status: &str) -> Value {
    let names = answers.names();
    let mut info = json!({
        "status": status,
        "original_filename": job.name,
        "objects_in_field": names,
        "tags": names,
        "machine_tags": names,
        // What follows astrometry.net does not have.
        "sentence": answers.sentence,
        "notes": answers.notes,
        "reason": answers.reason,
    });
    if let Some(calibration) = answers.calibration {
        info["calibration"] = json!(calibration);
    }
    info
}

/// `/joblog/ID`
pub(super) async fn job_log(State(server): Shared, Path(id): Path<String>) -> Answer {
    let (number, _) = found(&server, &id)?;
    let (job, result) = kept(&server, number).await?;
    let state = JobState::of(result.as_ref()).word();
    let mut text = format!("{}: {state}\n", job.name);
    if let Some(JobResult { answers, .. }) = result {
        let notes = answers.notes.iter().map(|note| &note.text);
        let lines = answers.sentence.iter().chain(&answers.reason).chain(notes);
        for line in lines {
            let _ = writeln!(text, "{line}");
        }
    }
    Ok(reply(TEXT, text))
}

/// `/wcs_file/ID`
pub(super) async fn wcs_file(State(server): Shared, Path(id): Path<String>) -> Answer {
    file(&server, &id, WCS, "wcs.fits").await
}

/// `/rdls_file/ID`
pub(super) async fn rdls_file(State(server): Shared, Path(id): Path<String>) -> Answer {
    file(&server, &id, TableFormat::Rdls.extension(), "rdls.fits").await
}

/// `/axy_file/ID`
pub(super) async fn axy_file(State(server): Shared, Path(id): Path<String>) -> Answer {
    file(&server, &id, TableFormat::Axy.extension(), "axy.fits").await
}

/// `/corr_file/ID`
pub(super) async fn corr_file(State(server): Shared, Path(id): Path<String>) -> Answer {
    file(&server, &id, TableFormat::Corr.extension(), "corr.fits").await
}

/// `/new_fits_file/ID`
pub(super) async fn new_fits_file(State(server): Shared, Path(id): Path<String>) -> Answer {
    let copy = made(&server, &id, Wanted::SolvedCopy, "new.fits").await?;
    Ok(attached(copy, "new-image.fits"))
}

/// `/annotated_display/ID`
pub(super) async fn annotated(State(server): Shared, Path(id): Path<String>) -> Answer {
    picture(&server, &id, Wanted::Annotated, "annotated.jpg").await
}

/// `/extraction_image_display/ID` and `/red_green_image_display/ID`
pub(super) async fn detections(State(server): Shared, Path(id): Path<String>) -> Answer {
    picture(&server, &id, Wanted::Detections, "detections.png").await
}

/// A file that was written when the job was done.
async fn file(server: &Arc<Server>, id: &str, kept: &'static str, name: &'static str) -> Answer {
    let (number, _) = found(server, id)?;
    let content = read(server, number, kept).await?;
    let content = content.ok_or_else(|| Refusal::unknown(format_args!("{name} of this job")))?;
    Ok(attached(content, name))
}

/// A picture with marks.
async fn picture(server: &Arc<Server>, id: &str, wanted: Wanted, name: &'static str) -> Answer {
    let picture = made(server, id, wanted, name).await?;
    Ok(reply(wanted.kind(), picture))
}

/// A file that is made of the upload when it is wanted first, and kept as `name`.
async fn made(
    server: &Arc<Server>,
    id: &str,
    wanted: Wanted,
    name: &'static str,
) -> Result<Bytes, Refusal> {
    let (number, state) = found(server, id)?;
    if state == JobState::Solving {
        return Err(Refusal::unknown("result of this job yet"));
    }
    if let Some(content) = read(server, number, name).await? {
        return Ok(content);
    }
    let (_, result) = kept(server, number).await?;
    let has_none = result.is_none_or(|result| result.has_no_picture);
    if has_none || (wanted == Wanted::SolvedCopy && state == JobState::Failure) {
        return Err(Refusal::unknown(format_args!("{name} of this job")));
    }
    let content = solve::answered(server, Source::Job(number), wanted).await?;
    let shared = Arc::clone(server);
    blocking(move || {
        if let Err(error) = shared.store.put(number, name, &content) {
            tracing::error!("{error:#}");
        }
        Ok(content)
    })
    .await
}

async fn read(
    server: &Arc<Server>,
    number: u64,
    name: &'static str,
) -> Result<Option<Bytes>, Refusal> {
    let server = Arc::clone(server);
    blocking(move || {
        let file = server.store.file(number, name);
        let file = file.map_err(|error| server.unreadable(number, &error))?;
        file.map(|file| server.limits.file(file)).transpose()
    })
    .await
}

fn attached(content: Bytes, name: &str) -> Response {
    let mut response = reply(FITS, content);
    if let Ok(value) = HeaderValue::try_from(format!("attachment; filename={name}")) {
        response
            .headers_mut()
            .insert(header::CONTENT_DISPOSITION, value);
    }
    response
}

/// The number of a job that is there, and how far it is.
fn found(server: &Server, id: &str) -> Result<(u64, JobState), Refusal> {
    let number = id.parse().ok();
    let found = number.and_then(|number| Some((number, server.store.state(number)?)));
    found.ok_or_else(|| Refusal::unknown("such job"))
}

async fn kept(server: &Arc<Server>, number: u64) -> Result<(JobHead, Option<JobResult>), Refusal> {
    let server = Arc::clone(server);
    blocking(move || {
        let read = || anyhow::Ok((server.store.job(number)?, server.store.result(number)?));
        read().map_err(|error| server.unreadable(number, &error))
    })
    .await
}
