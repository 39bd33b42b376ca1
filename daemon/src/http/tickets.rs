//! Tickets: links that a browser can follow, which sends no token along.
//!
//! A ticket is for one file and for a short time. It is signed with a key that this run of the
//! service has made for itself, so that nothing has to be kept.

use axum::extract::State;
use axum::http::{Method, StatusCode, Uri};
use axum::response::Json;
use deliverables::hexadecimal;
use hmac::{Hmac, KeyInit, Mac};
use jiff::Timestamp;
use relief_api::{CreateTicket, Ticket, path};
use sha2::Sha256;
use subtle::ConstantTimeEq;

use super::Context;
use super::openapi::Problems;
use super::problem::{Body, Refusal};

/// For how long a download may be begun.
const SECONDS: u32 = 60;
/// In the query of the link.
const NAME: &str = "ticket=";

/// Signs tickets, and knows those that it has signed. None hold where the system gives no random
/// bytes for the key.
#[derive(Clone)]
pub(super) struct Tickets(Option<Hmac<Sha256>>);

impl Tickets {
    /// With a key that nobody else has.
    pub(super) fn new() -> Self {
        let mut key = [0; 32];
        let filled = getrandom::fill(&mut key)
            .inspect_err(|error| tracing::error!(%error, "no links for browsers can be made"));
        Self(filled.ok().and_then(|()| Hmac::new_from_slice(&key).ok()))
    }

    fn sign(&self, path: &str, until: i64) -> Option<String> {
        let mut signer = self.0.clone()?;
        signer.update(until.to_string().as_bytes());
        signer.update(b"\n");
        signer.update(path.as_bytes());
        let mac = signer.finalize().into_bytes();
        Some(hexadecimal(&mac))
    }

    fn issue(&self, path: &str, now: i64) -> Option<String> {
        let until = now + i64::from(SECONDS);
        Some(format!("{path}?{NAME}{until}-{}", self.sign(path, until)?))
    }

    fn holds(&self, path: &str, ticket: &str, now: i64) -> bool {
        let Some((until, mac)) = ticket.split_once('-') else {
            return false;
        };
        let Ok(until) = until.parse() else {
            return false;
        };
        let signed = self.sign(path, until).unwrap_or_default();
        now < until && !mac.is_empty() && signed.as_bytes().ct_eq(mac.as_bytes()).into()
    }

    /// Whether a request has a ticket for what it asks for.
    pub(super) fn admit(&self, method: &Method, uri: &Uri) -> bool {
        let reads = method == Method::GET || method == Method::HEAD;
        let ticket = uri.query().and_then(|query| query.strip_prefix(NAME));
        let now = Timestamp::now().as_second();
        reads && ticket.is_some_and(|ticket| self.holds(uri.path(), ticket, now))
    }
}

/// A link to a file that holds for a minute without a token, for browsers.
#[utoipa::path(post, path = path::TICKETS, tag = "results", operation_id = "create_ticket",
    request_body = CreateTicket,
    responses((status = 201, body = Ticket), (status = 404, response = Problems)))]
pub(super) async fn create(
    State(context): State<Context>,
    Body(request): Body<CreateTicket>,
) -> Result<(StatusCode, Json<Ticket>), Refusal> {
    let path = request.path;
    let plain = path.parse::<Uri>().is_ok_and(|uri| uri.path() == path);
    if !plain || !is_file(&path) {
        return Err(Refusal::new(
            StatusCode::BAD_REQUEST,
            "no-file",
            format!("`{path}` is the path of no file: tickets are for files only"),
            Some("/v1/spool/RESULT/FILE and /v1/scans/SCAN/journal are such paths"),
        ));
    }
    let url = context.tickets.issue(&path, Timestamp::now().as_second());
    let url = url.ok_or_else(|| Refusal::internal("the system gives no random bytes"))?;
    let ticket = Ticket {
        url,
        expires_in_s: SECONDS,
    };
    Ok((StatusCode::CREATED, Json(ticket)))
}

/// Of the spool, or a journal.
fn is_file(path: &str) -> bool {
    let parts: Vec<&str> = path.split('/').collect();
    match parts.as_slice() {
        ["", "v1", "spool", result, file] => !result.is_empty() && !file.is_empty(),
        ["", "v1", "scans", scan, "journal"] => !scan.is_empty(),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ticket_is_for_one_file_and_a_minute() {
        let tickets = Tickets::new();
        let url = tickets.issue("/v1/spool/a/b.igs", 1000).unwrap();
        let (path, ticket) = url.split_once("?ticket=").unwrap();
        assert!(tickets.holds(path, ticket, 1000));
        assert!(tickets.holds(path, ticket, 1059));
        assert!(!tickets.holds(path, ticket, 1060), "too late");
        assert!(!tickets.holds("/v1/spool/a/c.igs", ticket, 1000));
        let later = ticket.replacen("1060", "9060", 1);
        assert!(!tickets.holds(path, &later, 1000));
        for wrong in ["", "-", "1060-", "x-y", &ticket[..ticket.len() - 1]] {
            assert!(!tickets.holds(path, wrong, 1000), "{wrong}");
        }
        let others = Tickets::new();
        assert!(!others.holds(path, ticket, 1000), "of another run");
    }

    #[test]
    fn tickets_are_for_files_and_for_reading() {
        assert!(is_file("/v1/spool/a/b.igs") && is_file("/v1/scans/a/journal"));
        for other in [
            "/v1/status",
            "/v1/spool/a",
            "/v1/spool//b",
            "/v1/scans/a",
            "/",
            "",
        ] {
            assert!(!is_file(other), "{other}");
        }
        let tickets = Tickets::new();
        let url = tickets.issue("/v1/spool/a/b", Timestamp::now().as_second());
        let url = url.unwrap();
        let uri: Uri = url.parse().unwrap();
        assert!(tickets.admit(&Method::GET, &uri));
        assert!(!tickets.admit(&Method::POST, &uri));
        let bare: Uri = "/v1/spool/a/b".parse().unwrap();
        assert!(!tickets.admit(&Method::GET, &bare));
    }
}
