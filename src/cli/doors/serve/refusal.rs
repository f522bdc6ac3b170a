//! Why a request is refused, as its client reads it.

use super::http::{JSON, TEXT};
use crate::cli::output::messages::one_line;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::json;
use starpipe::base::remedy::OptionNames;
use starpipe::detect::DetectError;
use starpipe::frame::FrameError;
use starpipe::solve::{Error, remedies_of};
use std::fmt::Display;

/// Seconds after which it is worth to ask again.
const RETRY_S: &str = "5";

/// Why a request is refused.
#[derive(Debug)]
pub(super) struct Refusal {
    pub(super) status: StatusCode,
    pub(super) message: String,
}

impl Refusal {
    pub(super) fn new(status: StatusCode, message: impl Display) -> Self {
        Self {
            status,
            message: message.to_string(),
        }
    }

    pub(super) fn invalid(message: impl Display) -> Self {
        Self::new(StatusCode::BAD_REQUEST, message)
    }

    pub(super) fn unknown(what: impl Display) -> Self {
        Self::new(StatusCode::NOT_FOUND, format_args!("there is no {what}"))
    }

    pub(super) fn too_large(most_bytes: usize) -> Self {
        let most_kb = most_bytes / 1000;
        let message = format!("the body is too large: at most {most_kb} kB are accepted");
        Self::new(StatusCode::PAYLOAD_TOO_LARGE, message)
    }

    pub(super) fn busy(message: &str) -> Self {
        Self::new(StatusCode::SERVICE_UNAVAILABLE, message)
    }

    pub(super) fn ending() -> Self {
        Self::busy("the server is ending")
    }

    /// Something failed that the client cannot help.
    pub(super) fn internal(error: &anyhow::Error) -> Self {
        tracing::error!("{}", one_line(error.as_ref()));
        let message = "the server could not read or write its files";
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, message)
    }

    /// Why a frame cannot be solved.
    pub(super) fn of_frame(error: &anyhow::Error) -> Self {
        let see = OptionNames::Words.see(&remedies_of(error.as_ref()));
        let (status, message) = (status_of(error), one_line(error.as_ref()));
        if status == StatusCode::INTERNAL_SERVER_ERROR {
            tracing::error!("{message}");
        }
        Self::new(status, message + &see)
    }

    fn response(&self, body: &serde_json::Value) -> Response {
        let kind = [(header::CONTENT_TYPE, JSON)];
        let mut response = (self.status, kind, body.to_string()).into_response();
        if self.status == StatusCode::SERVICE_UNAVAILABLE {
            let retry = header::HeaderValue::from_static(RETRY_S);
            response.headers_mut().insert(header::RETRY_AFTER, retry);
        }
        response
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        self.response(&json!({"error": self.message}))
    }
}

/// The same in the protocol of nova.astrometry.net.
pub(super) struct NovaRefusal(pub(super) Refusal);

impl NovaRefusal {
    /// An error of a call, which the protocol tells with status 200.
    pub(super) fn of_call(message: impl Display) -> Self {
        Self(Refusal::new(StatusCode::OK, message))
    }
}

impl From<Refusal> for NovaRefusal {
    fn from(refusal: Refusal) -> Self {
        Self(refusal)
    }
}

impl IntoResponse for NovaRefusal {
    fn into_response(self) -> Response {
        let body = json!({"status": "error", "errormessage": self.0.message});
        let mut response = self.0.response(&body);
        let kind = header::HeaderValue::from_static(TEXT);
        response.headers_mut().insert(header::CONTENT_TYPE, kind);
        response
    }
}

fn status_of(error: &anyhow::Error) -> StatusCode {
    let of_cause = |cause: &(dyn std::error::Error + 'static)| {
        if let Some(error) = cause.downcast_ref() {
            return status_of_frame(error);
        }
        match (cause.downcast_ref(), cause.downcast_ref()) {
            (Some(DetectError::Interrupted(_)), _) => Some(StatusCode::GATEWAY_TIMEOUT),
            (_, Some(Error::Panicked { .. })) => Some(StatusCode::INTERNAL_SERVER_ERROR),
            _ => None,
        }
    };
    let found = error.chain().find_map(of_cause);
    found.unwrap_or(StatusCode::UNPROCESSABLE_ENTITY)
}

/// `None` where a cause tells it.
fn status_of_frame(error: &FrameError) -> Option<StatusCode> {
    Some(match error {
        FrameError::File { source, .. } => return status_of_frame(source),
        FrameError::Empty
        | FrameError::UnknownFormat { .. }
        | FrameError::ForeignFormat { .. }
        | FrameError::Unsupported { .. } => StatusCode::UNSUPPORTED_MEDIA_TYPE,
        FrameError::TooLarge { .. }
        | FrameError::TooMuchMemory { .. }
        | FrameError::OutOfMemory { .. }
        | FrameError::TooManyBytes { .. } => StatusCode::PAYLOAD_TOO_LARGE,
        FrameError::Interrupted(_) => StatusCode::GATEWAY_TIMEOUT,
        FrameError::Panicked(_) => StatusCode::INTERNAL_SERVER_ERROR,
        _ => return None,
    })
}
