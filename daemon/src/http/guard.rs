//! Keeping web pages out of the loopback listener.
//!
//! Any page in a browser on this machine can send requests to a loopback address. Pages
//! of other sites name themselves in `Origin`; pages that had their own name resolve to
//! the loopback address (DNS rebinding) name themselves in `Host`.

use axum::extract::Request;
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::problem::Refusal;

/// Refuses requests that do not speak to this machine by one of its own names.
pub(crate) async fn local_callers_only(request: Request, next: Next) -> Response {
    match check(request.headers()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    }
}

fn check(headers: &HeaderMap) -> Result<(), Refusal> {
    let host = headers
        .get(header::HOST)
        .and_then(|host| host.to_str().ok());
    if !host.is_some_and(is_local) {
        return Err(forbidden(format!(
            "the request is for the host {}",
            host.unwrap_or("(none)")
        )));
    }
    let Some(origin) = headers.get(header::ORIGIN) else {
        return Ok(());
    };
    let local = origin
        .to_str()
        .ok()
        .and_then(|origin| origin.split_once("://"))
        .is_some_and(|(_, host)| is_local(host));
    if local {
        Ok(())
    } else {
        Err(forbidden(
            "the request comes from a page of another site".into(),
        ))
    }
}

/// `localhost`, 127.x.x.x or ::1, with or without a port.
fn is_local(authority: &str) -> bool {
    let host = match authority.rsplit_once(':') {
        Some((host, port)) if port.bytes().all(|b| b.is_ascii_digit()) => host,
        _ => authority,
    };
    let bare = host
        .strip_prefix('[')
        .and_then(|host| host.strip_suffix(']'))
        .unwrap_or(host);
    host.eq_ignore_ascii_case("localhost")
        || bare
            .parse::<std::net::IpAddr>()
            .is_ok_and(|address| address.is_loopback())
}

fn forbidden(detail: String) -> Refusal {
    Refusal::new(
        StatusCode::FORBIDDEN,
        "not-local",
        detail,
        Some("speak to the service as localhost or 127.0.0.1"),
    )
}

#[cfg(test)]
mod tests {
    use super::is_local;

    #[test]
    fn only_this_machines_own_names_are_local() {
        for local in [
            "localhost",
            "LOCALHOST:80",
            "127.0.0.1:7437",
            "127.1.2.3",
            "[::1]:7437",
            "[::1]",
        ] {
            assert!(is_local(local), "{local}");
        }
        for other in [
            "example.org",
            "localhost.example.org:80",
            "127.0.0.1.example.org",
            "10.0.0.1",
            "",
            "127.0.0.1:80.example.org",
            "[::1].example.org",
        ] {
            assert!(!is_local(other), "{other}");
        }
    }
}
