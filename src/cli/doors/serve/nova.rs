//! The protocol of nova.astrometry.net. A submission, its job and its picture have one number.

use super::body::{Received, receive};
use super::http::{TEXT, nova_reply, reply, shown_name, text_of};
use super::refusal::{NovaRefusal, Refusal};
use super::server::Server;
use super::store::{Job, JobResult};
use super::work::{Wanted, Work};
use super::worker::{WCS, input_of_job, now};
use super::{fetch, solve};
use axum::extract::{Path, Request, State};
use axum::http::{HeaderValue, header};
use axum::response::Response;
use serde_json::{Map, Value, json};
use starpipe::doors::nova::{JobAnswers, Upload, form};
use starpipe::report::tables::TableFormat;
use std::fmt::Write;
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_128;

type Answer = Result<Response, NovaRefusal>;
type Shared = State<Arc<Server>>;

const FITS: &str = "application/fits";

/// A call: its arguments, and the file that comes with it.
struct Call {
    arguments: Map<String, Value>,
    file: Option<(Option<String>, Received)>,
}

impl Call {
    async fn receive(server: &Server, request: Request) -> Result<Self, NovaRefusal> {
        let kind = text_of(request.headers(), header::CONTENT_TYPE).to_owned();
        let body = receive(&server.limits, request.into_body()).await?;
        if kind.starts_with("application/json") {
            let arguments = arguments(&body.bytes)?;
            return Ok(Self {
                arguments,
                file: None,
            });
        }
        let whole = body.bytes.clone();
        let parts = form::parts(&kind, &whole).map_err(NovaRefusal::of_call)?;
        let part = |name: &str| parts.iter().find(|part| part.name == name);
        let Some(stated) = part("request-json") else {
            return Err(NovaRefusal::of_call("no json"));
        };
        let file = part("file").filter(|_| form::is_multipart(&kind));
        Ok(Self {
            arguments: arguments(&stated.content)?,
            file: file.map(|file| (file.file_name.clone(), body.part(&file.content))),
        })
    }

    /// The same of a client that has logged in; without its session.
    async fn of_session(server: &Server, request: Request) -> Result<Self, NovaRefusal> {
        let mut call = Self::receive(server, request).await?;
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
}

fn arguments(json: &[u8]) -> Result<Map<String, Value>, NovaRefusal> {
    let refused = |_| NovaRefusal::of_call("failed to parse JSON");
    serde_json::from_slice(json).map_err(refused)
}

/// `/api/login`
pub(super) async fn login(State(server): Shared, request: Request) -> Answer {
    let call = Call::receive(&server, request).await?;
    let key = call.arguments.get("apikey").and_then(Value::as_str);
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
    let call = Call::of_session(&server, request).await?;
    let (name, content) = match call.file {
        Some((name, content)) => (shown_name(name.as_deref()), content),
        None => ("json-xy".to_owned(), Received::kept(Vec::new())),
    };
    submit(&server, name, call.arguments, content).await
}

/// `/api/url_upload`; lists of stars are sent here, too.
pub(super) async fn url_upload(State(server): Shared, request: Request) -> Answer {
    check_queue(&server)?;
    let call = Call::of_session(&server, request).await?;
    let stated = call.arguments.get("url").and_then(Value::as_str);
    let Some(url) = stated.map(str::to_owned) else {
        let content = Received::kept(Vec::new());
        return submit(&server, "json-xy".to_owned(), call.arguments, content).await;
    };
    if !server.allows_url {
        let message = "this server fetches no addresses; upload the file (or start the server with --allow-url)";
        return Err(NovaRefusal::of_call(message));
    }
    let content = fetch::fetch(&server.limits, &url).await?;
    let path = url.split(['?', '#']).next();
    submit(&server, shown_name(path), call.arguments, content).await
}

fn check_queue(server: &Server) -> Result<(), Refusal> {
    // It is taken once the body is there: slow clients keep no places.
    server.queue.place().map(drop).ok_or_else(solve::no_place)
}

async fn submit(
    server: &Arc<Server>,
    name: String,
    settings: Map<String, Value>,
    content: Received,
) -> Answer {
    let upload = Upload::from_json(&settings).map_err(NovaRefusal::of_call)?;
    if content.bytes.is_empty() && !upload.has_list() {
        return Err(NovaRefusal::of_call(
            "no file, no \"url\", and no \"x\" and \"y\"",
        ));
    }
    let hash = format!("{:032x}", xxh3_128(&content.bytes));
    let received = now();
    let job = Job {
        name,
        settings,
        received,
    };
    let shared = Arc::clone(server);
    let number = solve::blocking(move || {
        let place = shared.queue.place().ok_or_else(solve::no_place)?;
        let added = shared.store.add(&job, &content.bytes);
        let number = added.map_err(|error| {
            tracing::error!("{error:#}");
            Refusal::busy("the folder of jobs is full or cannot be written")
        })?;
        place.fill(Work::Job(number));
        Ok(number)
    })
    .await?;
    tracing::info!(job = number, "uploaded");
    Ok(nova_reply(
        &json!({"status": "success", "subid": number, "hash": hash}),
    ))
}

/// `/api/myjobs`: those of all clients.
pub(super) async fn my_jobs(State(server): Shared, request: Request) -> Answer {
    Call::of_session(&server, request).await?;
    let jobs = server.store.numbers();
    Ok(nova_reply(&json!({"status": "success", "jobs": jobs})))
}

/// `/api/submission_images`
pub(super) async fn submission_images(State(server): Shared, request: Request) -> Answer {
    let call = Call::of_session(&server, request).await?;
    let number = call.arguments.get("subid").and_then(Value::as_u64);
    let known = number.filter(|number| server.store.is_done(*number).is_some());
    let known = known.ok_or_else(|| NovaRefusal::of_call("submission does not exist"))?;
    Ok(nova_reply(
        &json!({"status": "success", "image_ids": [known]}),
    ))
}

/// `/api/submissions/ID`
pub(super) async fn submission(State(server): Shared, Path(id): Path<String>) -> Answer {
    let number = number_of(&server, &id)?;
    let (job, result) = kept(&server, number)?;
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
    let (_, result) = kept(&server, number_of(&server, &id)?)?;
    Ok(nova_reply(&json!({"status": status(result.as_ref())})))
}

/// `/api/jobs/ID/calibration` and so on.
pub(super) async fn job_answer(
    State(server): Shared,
    Path((id, what)): Path<(String, String)>,
) -> Answer {
    let number = number_of(&server, &id)?;
    let (job, result) = kept(&server, number)?;
    let state = status(result.as_ref());
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
        "info" => info(&job, &answers, state),
        _ => return Err(Refusal::unknown("such address").into()),
    };
    Ok(nova_reply(&answer))
}

fn info(job: &Job, answers: &JobAnswers, status: &str) -> Value {
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

fn status(result: Option<&JobResult>) -> &'static str {
    match result {
        None => "solving",
        Some(result) if result.answers.calibration.is_some() => "success",
        Some(_) => "failure",
    }
}

/// `/joblog/ID`
pub(super) async fn job_log(State(server): Shared, Path(id): Path<String>) -> Answer {
    let (job, result) = kept(&server, number_of(&server, &id)?)?;
    let state = status(result.as_ref());
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
    let picture = made(&server, &id, Wanted::Annotated, "annotated.jpg").await?;
    Ok(reply("image/jpeg", picture))
}

/// `/extraction_image_display/ID` and `/red_green_image_display/ID`
pub(super) async fn detections(State(server): Shared, Path(id): Path<String>) -> Answer {
    let picture = made(&server, &id, Wanted::Detections, "detections.png").await?;
    Ok(reply("image/png", picture))
}

/// A file that was written when the job was done.
async fn file(server: &Arc<Server>, id: &str, kept: &'static str, name: &'static str) -> Answer {
    let number = number_of(server, id)?;
    let content = read(server, number, kept).await?;
    let content = content.ok_or_else(|| Refusal::unknown(format_args!("{name} of this job")))?;
    Ok(attached(content, name))
}

/// A file that is made of the upload when it is wanted first.
async fn made(
    server: &Arc<Server>,
    id: &str,
    wanted: Wanted,
    name: &'static str,
) -> Result<Vec<u8>, Refusal> {
    let number = number_of(server, id)?;
    if server.store.is_done(number) == Some(false) {
        return Err(Refusal::unknown("result of this job yet"));
    }
    if let Some(content) = read(server, number, name).await? {
        return Ok(content);
    }
    let shared = Arc::clone(server);
    let input = solve::blocking(move || {
        input_of_job(&shared, number).map_err(|error| Refusal::internal(&error))
    });
    let content = solve::answered(server, input.await?, wanted).await?;
    let shared = Arc::clone(server);
    solve::blocking(move || {
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
) -> Result<Option<Vec<u8>>, Refusal> {
    let server = Arc::clone(server);
    solve::blocking(move || {
        let content = server.store.file(number, name);
        content.map_err(|error| Refusal::internal(&error))
    })
    .await
}

fn attached(content: Vec<u8>, name: &str) -> Response {
    let mut response = reply(FITS, content);
    if let Ok(value) = HeaderValue::try_from(format!("attachment; filename={name}")) {
        response
            .headers_mut()
            .insert(header::CONTENT_DISPOSITION, value);
    }
    response
}

/// The number of a job that is there.
fn number_of(server: &Server, id: &str) -> Result<u64, Refusal> {
    let number = id.parse().ok();
    let known = number.filter(|number| server.store.is_done(*number).is_some());
    known.ok_or_else(|| Refusal::unknown("such job"))
}

fn kept(server: &Server, number: u64) -> Result<(Job, Option<JobResult>), Refusal> {
    let read = || anyhow::Ok((server.store.job(number)?, server.store.result(number)?));
    read().map_err(|error| Refusal::internal(&error))
}
