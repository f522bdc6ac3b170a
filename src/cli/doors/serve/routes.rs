//! Which address answers what, and what all answers have.

use super::body::SharedBody;
use super::http::{JSON, TEXT, reply};
use super::page::OPENAPI;
use super::refusal::Refusal;
use super::server::Server;
use super::{nova, solve};
use axum::Router;
use axum::body::{Body, HttpBody};
use axum::extract::{Request, State};
use axum::http::uri::{PathAndQuery, Uri};
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use std::sync::Arc;
use std::time::Instant;

/// What pages of this server may load: their own files alone.
const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; \
                      img-src 'self' data: blob:; connect-src 'self'; worker-src 'self'; manifest-src 'self'; \
                      form-action 'self'; base-uri 'none'; frame-ancestors 'none'";

/// By this header the page knows that it can send its pictures here.
const SIGN: header::HeaderName = header::HeaderName::from_static("starpipe");

const HEADERS: [(header::HeaderName, &str); 5] = [
    (header::CONTENT_SECURITY_POLICY, POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    // Without one, the form of this server has no origin either.
    (header::REFERRER_POLICY, "same-origin"),
    (header::CACHE_CONTROL, "no-store"),
    (SIGN, "serve"),
];

/// The routes. Addresses may end with a slash.
pub(super) fn router(server: Arc<Server>) -> Router {
    let files = Router::new()
        .route("/wcs_file/{id}", get(nova::wcs_file))
        .route("/rdls_file/{id}", get(nova::rdls_file))
        .route("/axy_file/{id}", get(nova::axy_file))
        .route("/corr_file/{id}", get(nova::corr_file))
        .route("/new_fits_file/{id}", get(nova::new_fits_file))
        .route("/annotated_display/{id}", get(nova::annotated))
        .route("/annotated_full/{id}", get(nova::annotated))
        .route("/user_images/{id}", get(nova::annotated))
        .route("/red_green_image_display/{id}", get(nova::detections))
        .route("/extraction_image_display/{id}", get(nova::detections))
        .route("/joblog/{id}", get(nova::job_log));
    // Clients send what they have, as forms, where they only ask.
    let either = |handler| get(handler).post(handler);
    let api = Router::new()
        .route("/login", post(nova::login))
        .route("/upload", post(nova::upload))
        .route("/url_upload", post(nova::url_upload))
        .route("/myjobs", post(nova::my_jobs))
        .route("/submission_images", post(nova::submission_images))
        .route(
            "/submissions/{id}",
            get(nova::submission).post(nova::submission),
        )
        .route("/jobs/{id}", get(nova::job).post(nova::job))
        .route("/jobs/{id}/{what}", either(nova::job_answer));
    let inner = Router::new()
        .nest("/api", api)
        .merge(files)
        .route("/solve", post(solve::solve))
        .route("/health", get(|| async { reply(TEXT, "ok\n") }))
        .route("/metrics", get(metrics))
        .route("/openapi.json", get(|| async { reply(JSON, OPENAPI) }))
        .fallback(get(file))
        .method_not_allowed_fallback(|| async {
            Refusal::new(StatusCode::METHOD_NOT_ALLOWED, "not with this method")
        })
        .with_state(Arc::clone(&server));
    Router::new()
        .fallback_service(inner)
        .layer(from_fn_with_state(server, around))
}

async fn metrics(State(server): State<Arc<Server>>) -> Response {
    let (waiting, running) = (server.queue.len(), server.queue.running());
    let text = server.metrics.text(waiting, running, server.store.bytes());
    reply(TEXT, text)
}

/// A file of the page.
async fn file(State(server): State<Arc<Server>>, request: Request) -> Result<Response, Refusal> {
    let name = request.uri().path().trim_start_matches('/').to_owned();
    solve::blocking(move || {
        let file = server.page.file(&name);
        let (kind, content) = file.ok_or_else(|| Refusal::unknown("such address"))?;
        let content = content.map_err(|error| Refusal::internal(&error))?;
        Ok(reply(kind, content))
    })
    .await
}

/// What is done for each request: its address is tidied, a foreign page is refused, the rest of its body is read,
/// and its answer is logged.
async fn around(State(server): State<Arc<Server>>, request: Request, next: Next) -> Response {
    let begun = Instant::now();
    let (mut head, body) = request.into_parts();
    head.uri = tidied(&head.uri);
    let (method, path) = (head.method.clone(), head.uri.path().to_owned());
    // Such a client sends no body before it is asked for it.
    let waits = head.headers.contains_key(header::EXPECT);
    let body = SharedBody::new(body);
    let request = Request::from_parts(head, Body::new(body.clone()));
    let mut response = match server.hosts.check(&method, request.headers()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    };
    if !waits && !body.is_end_stream() {
        body.drain().await;
    }
    for (name, value) in HEADERS {
        let value = HeaderValue::from_static(value);
        response.headers_mut().entry(name).or_insert(value);
    }
    let status = response.status().as_u16();
    server.metrics.count_request(status);
    let ms = begun.elapsed().as_millis();
    tracing::info!(%method, path, status, ms, "request");
    response
}

/// The address without the server's name, which proxies' clients send, and without a slash at its end.
fn tidied(uri: &Uri) -> Uri {
    let path = match uri.path().trim_end_matches('/') {
        "" => "/",
        path => path,
    };
    let query = uri
        .query()
        .map_or(String::new(), |query| format!("?{query}"));
    let tidied = PathAndQuery::try_from(format!("{path}{query}"));
    tidied.map_or_else(|_| uri.clone(), Uri::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_tidied() {
        for (stated, expected) in [
            ("/api/login/", "/api/login"),
            (
                "http://nova.astrometry.net/api/jobs/1/info/?a=b/",
                "/api/jobs/1/info?a=b/",
            ),
            ("/", "/"),
            ("//?a", "/?a"),
        ] {
            assert_eq!(tidied(&stated.parse().unwrap()).to_string(), expected);
        }
    }
}
