//! `POST /solve`: a frame in, the JSON of `process` out, or another of its results.

use super::body::{MAX_WAIT, receive};
use super::http::{reply, shown_name, text_of};
use super::refusal::Refusal;
use super::server::Server;
use super::work::{Input, Request as Asked, Source, Wanted, Work};
use axum::body::Bytes;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::Response;
use starpipe::doors::nova::form::{self, Part};
use starpipe::solve::SolveOptions;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::sync::Arc;
use tokio::sync::oneshot;

/// What the page of `answer=html` may do: its style, its program and its picture are within it.
const POLICY: HeaderValue = HeaderValue::from_static(
    "sandbox allow-scripts; default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; \
     img-src data:",
);

/// `POST /solve`
pub(super) async fn solve(
    State(server): State<Arc<Server>>,
    request: Request,
) -> Result<Response, Refusal> {
    check_queue(&server)?;
    let query = form::fields(request.uri().query().unwrap_or_default().as_bytes());
    let mut stated = Stated::default();
    stated.add_all(&query);
    check_key(&server, request.headers(), &stated)?;
    let kind = text_of(request.headers(), header::CONTENT_TYPE).to_owned();
    let body = receive(&server.limits, request.into_body(), server.limits.max_bytes).await?;
    let content = if form::is_multipart(&kind) {
        let parts = form::parts(&kind, &body).map_err(Refusal::invalid)?;
        stated.add_all(&parts);
        let file = parts.iter().find(|part| part.file_name.is_some());
        let file = file.ok_or_else(|| Refusal::invalid("the form has no file"))?;
        stated.name = stated.name.or_else(|| file.file_name.clone());
        body.slice_ref(&file.content)
    } else {
        body
    };
    let wanted = stated.wanted()?;
    let input = Input {
        name: shown_name(stated.name.as_deref()),
        content,
        options: stated.options(&server.options)?,
        page: stated.page()?,
        upload: None,
    };
    let made = answered(&server, Source::Given(Box::new(input)), wanted).await?;
    let mut response = reply(wanted.kind(), made);
    if wanted == Wanted::Html {
        let headers = response.headers_mut();
        headers.insert(header::CONTENT_SECURITY_POLICY, POLICY);
    }
    Ok(response)
}

/// What a request states.
#[derive(Default)]
struct Stated {
    options: BTreeMap<String, String>,
    /// What is no option of the solution, by name.
    other: BTreeMap<String, String>,
    name: Option<String>,
    key: Option<String>,
}

impl Stated {
    fn add_all(&mut self, parts: &[Part]) {
        for part in parts.iter().filter(|part| part.file_name.is_none()) {
            let value = part.text().into_owned();
            match part.name.as_str() {
                // A field of a page that was left empty.
                _ if value.is_empty() => {}
                "name" => self.name = Some(value),
                "key" => self.key = Some(value),
                name @ ("answer" | "draw" | "page" | "rings") => {
                    self.other.insert(name.to_owned(), value);
                }
                name => drop(self.options.insert(name.replace('-', "_"), value)),
            }
        }
    }

    fn other(&self, name: &str) -> Option<&str> {
        self.other.get(name).map(String::as_str)
    }

    fn wanted(&self) -> Result<Wanted, Refusal> {
        let [answer, rings, draw] = ["answer", "rings", "draw"].map(|name| self.other(name));
        Wanted::stated(answer, rings, draw).map_err(Refusal::invalid)
    }

    fn page(&self) -> Result<Option<NonZeroUsize>, Refusal> {
        let number = self.other("page").map(str::parse).transpose();
        number.map_err(|_| Refusal::invalid("page must be the number of an image, from 1"))
    }

    /// The options of the server with what is stated, within its time limit.
    fn options(&self, of_server: &SolveOptions) -> Result<SolveOptions, Refusal> {
        let options = of_server.clone().with(&self.options);
        let mut options = options.map_err(|error| {
            let name = error.name.replace('_', "-");
            Refusal::invalid(format_args!("{name} {}", error.reason))
        })?;
        let limits = [options.time_limit_s, of_server.time_limit_s];
        options.time_limit_s = limits.into_iter().flatten().min_by(f64::total_cmp);
        Ok(options)
    }
}

fn check_key(server: &Server, headers: &HeaderMap, stated: &Stated) -> Result<(), Refusal> {
    let bearer = text_of(headers, header::AUTHORIZATION).strip_prefix("Bearer ");
    let key = bearer.map(str::trim).or(stated.key.as_deref());
    if server.keys.accepts(key) {
        return Ok(());
    }
    let message = "a key is needed: Authorization: Bearer KEY";
    Err(Refusal::new(StatusCode::UNAUTHORIZED, message))
}

/// Refuses where the queue is full. A place is taken once the body is there: slow clients keep none.
pub(super) fn check_queue(server: &Server) -> Result<(), Refusal> {
    server.queue.place().map(drop).ok_or_else(no_place)
}

/// The queue has no place.
pub(super) fn no_place() -> Refusal {
    Refusal::busy("the queue is full; ask again later")
}

/// Waits until a worker has made what is wanted of a frame.
pub(super) async fn answered(
    server: &Server,
    source: Source,
    wanted: Wanted,
) -> Result<Bytes, Refusal> {
    let place = server.queue.place().ok_or_else(no_place)?;
    let (answer, answered) = oneshot::channel();
    let request = Asked {
        source,
        wanted,
        answer,
    };
    place.fill(Work::Request(request));
    match tokio::time::timeout(MAX_WAIT, answered).await {
        Ok(Ok(made)) => made,
        Ok(Err(_)) => Err(Refusal::ending()),
        Err(_) => {
            let message = "the answer takes too long";
            Err(Refusal::new(StatusCode::GATEWAY_TIMEOUT, message))
        }
    }
}

/// Does work that reads or writes files, beside the answering of requests.
pub(super) async fn blocking<R: Send + 'static, E: From<Refusal> + Send + 'static>(
    work: impl FnOnce() -> Result<R, E> + Send + 'static,
) -> Result<R, E> {
    let done = tokio::task::spawn_blocking(work).await;
    done.unwrap_or_else(|error| Err(Refusal::internal(&error.into()).into()))
}
