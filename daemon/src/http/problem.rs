//! From the service's refusals to HTTP: the only place that knows both.

use std::time::Duration;

use axum::extract::rejection::JsonRejection;
use axum::extract::{FromRequest, Request};
use axum::http::{HeaderValue, Method, StatusCode, Uri, header};
use axum::response::{IntoResponse, Json, Response};
use relief_api::Problem;
use scanner_driver::ScannerError;
use serde::de::DeserializeOwned;

use crate::error::{ServiceError, bounded};
use crate::store::StoreError;
use crate::tokens::TokenError;

/// A refused request.
#[derive(Debug)]
pub(crate) struct Refusal(Problem);

impl Refusal {
    pub(crate) fn new(
        status: StatusCode,
        kind: &str,
        detail: impl Into<String>,
        hint: Option<&str>,
    ) -> Self {
        let title = {
            let words = kind.replace('-', " ");
            let mut letters = words.chars();
            letters.next().map_or_else(String::new, |first| {
                first.to_uppercase().chain(letters).collect()
            })
        };
        Self(Problem {
            kind: kind.to_owned(),
            title,
            status: status.as_u16(),
            detail: bounded(detail.into()),
            hint: hint.map(str::to_owned),
        })
    }

    pub(crate) fn status(&self) -> StatusCode {
        StatusCode::from_u16(self.0.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR)
    }

    pub(crate) fn detail(&self) -> &str {
        &self.0.detail
    }

    pub(crate) fn internal(detail: impl Into<String>) -> Self {
        Self::new(
            StatusCode::INTERNAL_SERVER_ERROR,
            "internal-error",
            detail,
            Some("the service's log says more"),
        )
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let mut response = (self.status(), Json(self.0)).into_response();
        response.headers_mut().insert(
            header::CONTENT_TYPE,
            HeaderValue::from_static(Problem::MEDIA_TYPE),
        );
        response
    }
}

impl From<ServiceError> for Refusal {
    fn from(error: ServiceError) -> Self {
        use StatusCode as S;
        let (status, kind, hint): (_, _, Option<String>) = match &error {
            ServiceError::Stopping | ServiceError::Store(StoreError::Closed { .. }) => (
                S::SERVICE_UNAVAILABLE,
                "service-stopping",
                Some("try again once it runs again".into()),
            ),
            ServiceError::TakesNoScans => (
                S::CONFLICT,
                "takes-no-scans",
                Some("ask a service that has scanners".into()),
            ),
            ServiceError::ScannerBusy { .. } => (
                S::CONFLICT,
                "scanner-busy",
                Some("wait for its end, or abort it".into()),
            ),
            ServiceError::NoSuchScanner { .. } => (S::NOT_FOUND, "no-such-scanner", None),
            ServiceError::WhichScanner { .. } => (
                S::BAD_REQUEST,
                "which-scanner",
                Some("say which one is meant: --scanner, or `scanner` in the request".into()),
            ),
            ServiceError::Scanner { section, error } => {
                let (status, kind, hint) = scanner_problem(error);
                let hint = hint.map(|hint| hint.replace(" scanner.", &format!(" {section}.")));
                (status, kind, hint)
            }
            ServiceError::Calibration(_) => (S::CONFLICT, "other-calibration", None),
            ServiceError::Plan(_) => (S::BAD_REQUEST, "impossible-scan", None),
            ServiceError::Setting(_) => (S::BAD_REQUEST, "wrong-setting", None),
            ServiceError::LongName { .. } => (S::BAD_REQUEST, "long-name", None),
            ServiceError::NoSuchScan { .. } => (
                S::NOT_FOUND,
                "no-such-scan",
                Some("`relief scans` lists the scans there are".into()),
            ),
            ServiceError::ScanIsOver { .. } => (S::CONFLICT, "scan-is-over", None),
            ServiceError::ScanNotOver { .. } => (
                S::CONFLICT,
                "scan-not-over",
                Some("wait for its end, or abort it".into()),
            ),
            ServiceError::NothingKept { .. } => (S::CONFLICT, "nothing-kept", None),
            ServiceError::NothingToAbort { .. } => (S::CONFLICT, "nothing-to-abort", None),
            ServiceError::NothingToResume { .. } => (S::CONFLICT, "nothing-to-resume", None),
            ServiceError::WhichPaused { .. } => (
                S::CONFLICT,
                "which-scan",
                Some(
                    "look at the scanner that is to go on, then name it (--scanner) or its scan"
                        .into(),
                ),
            ),
            ServiceError::NothingToPause { .. } => (S::CONFLICT, "nothing-to-pause", None),
            ServiceError::CannotPause { .. } => (S::CONFLICT, "cannot-pause", None),
            ServiceError::WhichRunning { .. } => (
                S::CONFLICT,
                "which-scan",
                Some(
                    "name the scanner that is to stop (--scanner) or its scan; `relief abort` ends \
                     all of them"
                        .into(),
                ),
            ),
            ServiceError::NoSuchJob { .. } => (
                S::NOT_FOUND,
                "no-such-job",
                Some("`relief jobs` lists the jobs there are".into()),
            ),
            ServiceError::WrongJobState { .. } => (S::CONFLICT, "wrong-job-state", None),
            ServiceError::NoSuchWebhook { .. } => (
                S::NOT_FOUND,
                "no-such-webhook",
                Some("each has a section [[webhooks]], [[mqtt]] or [[mail]] in the configuration".into()),
            ),
            ServiceError::NoSuchHook { .. } => (
                S::NOT_FOUND,
                "no-such-hook",
                Some("each has a section [[hooks]] in the configuration".into()),
            ),
            ServiceError::NoSuchUpload { .. } => (
                S::NOT_FOUND,
                "no-such-upload",
                Some("each has a section [[uploads]] in the configuration".into()),
            ),
            ServiceError::NoResult => (
                S::CONFLICT,
                "no-result",
                Some("take a scan, or rerun one".into()),
            ),
            ServiceError::WebhookBusy { .. } => (
                S::CONFLICT,
                "webhook-busy",
                Some("try again in a moment".into()),
            ),
            ServiceError::NotInSpool { .. } => (S::NOT_FOUND, "not-in-spool", None),
            ServiceError::NoRecordOfResult { .. } => (
                S::CONFLICT,
                "no-record-of-result",
                Some(
                    "it is left by a job whose record was lost: remove the folder once you have it"
                        .into(),
                ),
            ),
            ServiceError::NoRoom { .. } => (
                S::INSUFFICIENT_STORAGE,
                "no-room",
                Some(
                    "remove results or kept scans that are no longer needed, or let [storage] do \
                     so by age and size"
                        .into(),
                ),
            ),
            ServiceError::RequestUnderWay => (
                S::CONFLICT,
                "request-under-way",
                Some("ask again in a moment: the answer is then that of the first request".into()),
            ),
            ServiceError::KeyUsed { .. } => (
                S::UNPROCESSABLE_ENTITY,
                "key-used",
                Some("give each request a key of its own, such as a random UUID".into()),
            ),
            ServiceError::TooLarge { .. } => (
                S::CONFLICT,
                "scan-too-large",
                Some("run it again with these settings: `relief rerun`".into()),
            ),
            ServiceError::Regridding => (
                S::SERVICE_UNAVAILABLE,
                "busy-regridding",
                Some("try again in a moment".into()),
            ),
            ServiceError::NoImage { .. } => (S::CONFLICT, "no-image", None),
            ServiceError::Unwanted => (S::REQUEST_TIMEOUT, "slow-request", None),
            ServiceError::Store(_) => (
                S::INTERNAL_SERVER_ERROR,
                "records-unusable",
                Some("see that the disk is mounted, writable and has room, then try again".into()),
            ),
            ServiceError::Spool(spool) => (
                S::INTERNAL_SERVER_ERROR,
                "spool-unusable",
                Some(spool.hint()),
            ),
            ServiceError::Io { .. } => (S::INTERNAL_SERVER_ERROR, "file-unreadable", None),
            ServiceError::Token(token) => token_problem(token),
            ServiceError::Thread(_) => (S::INTERNAL_SERVER_ERROR, "no-thread", None),
        };
        Self::new(status, kind, error.to_string(), hint.as_deref())
    }
}

fn token_problem(error: &TokenError) -> (StatusCode, &'static str, Option<String>) {
    use StatusCode as S;
    match error {
        TokenError::Name { .. } => (S::BAD_REQUEST, "wrong-token-name", None),
        TokenError::Taken { .. } => (
            S::CONFLICT,
            "token-name-taken",
            Some("revoke that one first, or take another name".into()),
        ),
        TokenError::NoSuch { .. } => (
            S::NOT_FOUND,
            "no-such-token",
            Some("`relief token list` lists the tokens there are".into()),
        ),
        TokenError::TooMany => (
            S::CONFLICT,
            "too-many-tokens",
            Some("revoke those that nobody uses".into()),
        ),
        TokenError::File { .. } | TokenError::Damaged { .. } | TokenError::Random(_) => {
            (S::INTERNAL_SERVER_ERROR, "tokens-unusable", None)
        }
    }
}

/// 503 while the scanner cannot be reached, 502 where it answers with trouble. Hints name
/// keys of the section `scanner`, whatever the scanner's own is.
fn scanner_problem(error: &ScannerError) -> (StatusCode, &'static str, Option<&'static str>) {
    use StatusCode as S;
    match error {
        ScannerError::NoSuchPort { .. } => (
            S::SERVICE_UNAVAILABLE,
            "no-such-port",
            Some("set scanner.port in the configuration to the port it is on"),
        ),
        ScannerError::PortBusy { .. } => (
            S::SERVICE_UNAVAILABLE,
            "port-busy",
            Some("end the other program, or set scanner.port to another port"),
        ),
        ScannerError::NotOnUsb { .. } => (
            S::SERVICE_UNAVAILABLE,
            "no-such-usb-device",
            Some("set scanner.vendor_id, product_id and serial_number to those of the scanner"),
        ),
        ScannerError::ManyOnUsb { .. } => (
            S::SERVICE_UNAVAILABLE,
            "several-usb-devices",
            Some("set scanner.serial_number to that of the scanner that is meant"),
        ),
        ScannerError::UsbBusy { .. } => (
            S::SERVICE_UNAVAILABLE,
            "usb-device-busy",
            Some("end the other program, or keep the driver from the scanner by a udev rule"),
        ),
        ScannerError::NotAScannerOnUsb { .. } => (
            S::BAD_GATEWAY,
            "wrong-device",
            Some("set scanner.vendor_id and product_id to those of the scanner"),
        ),
        ScannerError::Permission { .. }
        | ScannerError::Forbidden { .. }
        | ScannerError::UsbPermission { .. } => (S::SERVICE_UNAVAILABLE, "no-permission", None),
        ScannerError::NotAPort { .. } | ScannerError::Port { .. } => (
            S::SERVICE_UNAVAILABLE,
            "port-unusable",
            Some("set scanner.port in the configuration to the port the scanner is on"),
        ),
        ScannerError::WrongDevice { .. } => (
            S::BAD_GATEWAY,
            "wrong-device",
            Some("set scanner.port in the configuration to the port the scanner is on"),
        ),
        ScannerError::WrongScanner { .. } => (
            S::BAD_GATEWAY,
            "wrong-scanner",
            Some(
                "have two cables been swapped? Put them right, or set scanner.port or \
                 scanner.serial_number to what is there",
            ),
        ),
        ScannerError::Timeout { .. } => (
            S::GATEWAY_TIMEOUT,
            "scanner-silent",
            Some("is it switched on, and do scanner.port and scanner.baud fit it?"),
        ),
        ScannerError::Refused { .. } => (S::BAD_GATEWAY, "scanner-refused", None),
        ScannerError::Fault(_) => (
            S::BAD_GATEWAY,
            "scanner-fault",
            Some("mend the fault at the scanner, then try again"),
        ),
        ScannerError::ScanRunning => (S::CONFLICT, "scanner-busy", None),
        ScannerError::Aborted => (S::CONFLICT, "aborted", None),
        _ => (S::BAD_GATEWAY, "scanner-trouble", None),
    }
}

pub(crate) async fn no_such_path(uri: Uri) -> Refusal {
    Refusal::new(
        StatusCode::NOT_FOUND,
        "no-such-path",
        format!("there is nothing at {}", uri.path()),
        Some("the API begins at /v1/status"),
    )
}

pub(crate) async fn no_such_method(method: Method, uri: Uri) -> Refusal {
    Refusal::new(
        StatusCode::METHOD_NOT_ALLOWED,
        "method-not-allowed",
        format!("{} does not take {method}", uri.path()),
        None,
    )
}

/// A JSON body, whose faults are told like any other problem. No body at all stands for
/// a request without wishes.
pub(crate) struct Body<T>(pub(crate) T);

impl<S: Send + Sync, T: DeserializeOwned + Default> FromRequest<S> for Body<T> {
    type Rejection = Refusal;

    async fn from_request(request: Request, state: &S) -> Result<Self, Refusal> {
        let bare = !request.headers().contains_key(header::CONTENT_TYPE)
            && request
                .headers()
                .get(header::CONTENT_LENGTH)
                .is_none_or(|length| length == "0")
            && !request.headers().contains_key(header::TRANSFER_ENCODING);
        if bare {
            return Ok(Self(T::default()));
        }
        // An object only: as a bare list of values, `[]` would stand for every default, and
        // so start a scan.
        type Object = serde_json::Map<String, serde_json::Value>;
        let Json(object) = Json::<Object>::from_request(request, state)
            .await
            .map_err(|rejection| wrong_body(&rejection))?;
        serde_json::from_value(object.into())
            .map(Self)
            .map_err(|error| {
                let text = format!("the body is not as it must be: {error}");
                Refusal::new(StatusCode::BAD_REQUEST, "wrong-body", text, None)
            })
    }
}

fn wrong_body(rejection: &JsonRejection) -> Refusal {
    let (status, hint) = match rejection {
        JsonRejection::MissingJsonContentType(_) => (
            StatusCode::UNSUPPORTED_MEDIA_TYPE,
            Some("send JSON with `Content-Type: application/json`"),
        ),
        _ => (StatusCode::BAD_REQUEST, None),
    };
    Refusal::new(status, "wrong-body", rejection.body_text(), hint)
}

pub(super) fn long_body(limit: usize) -> Refusal {
    let text = format!("the body exceeds the length limit of {limit} bytes");
    Refusal::new(StatusCode::PAYLOAD_TOO_LARGE, "wrong-body", text, None)
}

pub(super) fn slow_body(longest: Duration) -> Refusal {
    let text = format!("the body did not arrive within {} ms", longest.as_millis());
    Refusal::new(StatusCode::REQUEST_TIMEOUT, "slow-request", text, None)
}

pub(super) fn broken_body(error: &axum::Error) -> Refusal {
    let text = format!("the body cannot be read: {error}");
    Refusal::new(StatusCode::BAD_REQUEST, "wrong-body", text, None)
}

pub(super) fn too_many_listeners(limit: usize) -> Refusal {
    Refusal::new(
        StatusCode::SERVICE_UNAVAILABLE,
        "too-many-listeners",
        format!("{limit} clients listen to the events, and no more may"),
        Some("end a `relief watch` that nobody needs, or raise http.listeners"),
    )
}

/// A whole reply, for whoever finds no place: nothing of the request has been read.
pub(super) fn too_many_connections(limit: usize) -> Vec<u8> {
    let Refusal(problem) = Refusal::new(
        StatusCode::SERVICE_UNAVAILABLE,
        "too-many-connections",
        format!("{limit} clients are connected, and no more may"),
        Some("try again in a moment, or raise http.connections"),
    );
    let body = serde_json::to_string(&problem).unwrap_or_default();
    format!(
        "HTTP/1.1 503 Service Unavailable\r\nContent-Type: {}\r\nContent-Length: {}\r\n\
         Connection: close\r\nRetry-After: 1\r\n\r\n{body}",
        Problem::MEDIA_TYPE,
        body.len()
    )
    .into_bytes()
}
