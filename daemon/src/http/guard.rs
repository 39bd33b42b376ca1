//! Who may ask on the loopback listener: bearers of a token, and no web page.
//!
//! Any page in a browser on this machine can send requests to a loopback address. Pages
//! of other sites name themselves in `Origin`, or the browser says so in `Sec-Fetch-Site`;
//! pages that had their own name resolve to the loopback address (DNS rebinding) name
//! themselves in `Host`. Any user of this machine can connect as well; the token tells
//! those who may.

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::Context;
use super::problem::Refusal;

const SEC_FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// Who asks on the loopback address: the name of the token.
#[derive(Debug, Clone)]
pub(super) struct Asker(pub(super) String);

/// Stands for whoever asks on the socket.
pub(super) const ON_SOCKET: &str = "socket";

/// Refuses requests of other sites' pages, and those without a token or ticket that holds.
pub(crate) async fn bearers_only(
    State(context): State<Context>,
    mut request: Request,
    next: Next,
) -> Response {
    let hosts = context.service.config();
    let hosts = &hosts.http.hosts;
    let admitted = check_place(request.uri(), request.headers(), hosts).and_then(|()| {
        if context.tickets.admit(request.method(), request.uri()) {
            return Ok("(ticket)".to_owned());
        }
        let token = token(request.headers())?;
        let bearer = context.service.tokens.bearer(token);
        bearer.ok_or_else(|| unauthorized("the token of the request does not hold"))
    });
    match admitted {
        Ok(bearer) => {
            tracing::debug!(bearer, method = %request.method(), path = request.uri().path(), "request");
            request.extensions_mut().insert(Asker(bearer));
            next.run(request).await
        }
        Err(refusal) => {
            tracing::warn!(reason = refusal.detail(), "refused a request on loopback");
            let challenge = refusal.status() == StatusCode::UNAUTHORIZED;
            let mut response = refusal.into_response();
            if challenge {
                response
                    .headers_mut()
                    .insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
            }
            response
        }
    }
}

/// Refuses requests that name another machine: the page itself is for everybody here, and shows
/// nothing without a token.
pub(crate) async fn this_machine_only(
    State(context): State<Context>,
    request: Request,
    next: Next,
) -> Response {
    let hosts = &context.service.config().http.hosts;
    match check_host(request.uri(), request.headers(), hosts) {
        Ok(_) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    }
}

/// The request speaks to this machine by one of its own names, or those of its proxy. Gives the
/// name.
fn check_host<'a>(
    uri: &Uri,
    headers: &'a HeaderMap,
    proxies: &[String],
) -> Result<&'a str, Refusal> {
    let host = single(headers, header::HOST)?;
    // A request line may name a host of its own, which then is the one that is meant.
    let named = [host, uri.authority().map(|authority| authority.as_str())];
    for name in named.into_iter().flatten() {
        if !is_local(name) && !is_proxy(name, proxies) {
            return Err(not_local(format!("the request is for the host {name}")));
        }
    }
    let Some(host) = host else {
        return Err(not_local("the request is for the host (none)".into()));
    };
    Ok(host)
}

/// The same, and it speaks for no page of another site.
fn check_place(uri: &Uri, headers: &HeaderMap, proxies: &[String]) -> Result<(), Refusal> {
    let host = check_host(uri, headers, proxies)?;
    if let Some(origin) = single(headers, header::ORIGIN)? {
        // Nobody but a proxy has a certificate.
        let scheme = match origin.strip_prefix("https://") {
            Some(authority) if is_proxy(host, proxies) => Some(authority),
            _ => origin.strip_prefix("http://"),
        };
        let own = scheme.is_some_and(|authority| authority.eq_ignore_ascii_case(host));
        if !own {
            return Err(not_local(format!(
                "the request comes from a page of another site, {origin}"
            )));
        }
    }
    match single(headers, SEC_FETCH_SITE)? {
        None | Some("same-origin" | "none") => Ok(()),
        Some(site) => Err(not_local(format!(
            "the browser says that the request comes from a page of another site ({site})"
        ))),
    }
}

/// The token that is sent along, of whatever worth.
fn token(headers: &HeaderMap) -> Result<&str, Refusal> {
    let sent = single(headers, header::AUTHORIZATION)?
        .ok_or_else(|| unauthorized("the request bears no token"))?;
    sent.split_once(' ')
        .filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"))
        .map(|(_, token)| token.trim())
        .ok_or_else(|| unauthorized("the request's Authorization is no bearer token"))
}

/// The value of a field that may be there once: of two, others might read the second.
pub(super) fn single(headers: &HeaderMap, name: HeaderName) -> Result<Option<&str>, Refusal> {
    let mut values = headers.get_all(&name).iter();
    let value = values.next();
    let unclear = |what| {
        Refusal::new(
            StatusCode::BAD_REQUEST,
            "unclear-request",
            format!("the header field {name} {what}"),
            None,
        )
    };
    if values.next().is_some() {
        return Err(unclear("is there more than once"));
    }
    value
        .map(|value| value.to_str().map_err(|_| unclear("is not ASCII")))
        .transpose()
}

/// A host without its port.
fn without_port(authority: &str) -> &str {
    match authority.rsplit_once(':') {
        Some((host, port)) if port.bytes().all(|b| b.is_ascii_digit()) => host,
        _ => authority,
    }
}

/// One of the configured names, with or without a port.
fn is_proxy(authority: &str, proxies: &[String]) -> bool {
    let host = without_port(authority);
    proxies.iter().any(|name| host.eq_ignore_ascii_case(name))
}

/// `localhost`, 127.x.x.x or ::1, with or without a port.
fn is_local(authority: &str) -> bool {
    let host = without_port(authority);
    let bare = host
        .strip_prefix('[')
        .and_then(|host| host.strip_suffix(']'))
        .unwrap_or(host);
    host.eq_ignore_ascii_case("localhost")
        || bare
            .parse::<std::net::IpAddr>()
            .is_ok_and(|address| address.is_loopback())
}

fn not_local(detail: String) -> Refusal {
    Refusal::new(
        StatusCode::FORBIDDEN,
        "not-local",
        detail,
        Some(
            "speak to the service as localhost or 127.0.0.1; names of a reverse proxy go into \
             http.hosts",
        ),
    )
}

fn unauthorized(detail: &str) -> Refusal {
    Refusal::new(
        StatusCode::UNAUTHORIZED,
        "no-token",
        detail,
        Some(
            "make one with `relief token create NAME` on the service's socket, and send it as \
             `Authorization: Bearer TOKEN` (relief: --token-file or RELIEF_TOKEN)",
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

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

    fn place(uri: &str, fields: &[(&'static str, &'static str)]) -> Result<(), String> {
        let mut headers = HeaderMap::new();
        for &(name, value) in fields {
            headers.append(name, HeaderValue::from_static(value));
        }
        let proxies = ["bench.example".to_owned()];
        let checked = check_place(&uri.parse().unwrap(), &headers, &proxies);
        checked.map_err(|refusal| refusal.detail().to_owned())
    }

    #[test]
    fn web_pages_are_told_from_programs() {
        let host = ("host", "127.0.0.1:7437");
        for fields in [
            &[host][..],
            &[host, ("origin", "http://127.0.0.1:7437")],
            &[host, ("sec-fetch-site", "none")],
            &[host, ("sec-fetch-site", "same-origin")],
        ] {
            assert_eq!(place("/v1/status", fields), Ok(()), "{fields:?}");
        }
        assert_eq!(place("http://localhost/v1/status", &[host]), Ok(()));
        let proxy = ("host", "Bench.example");
        for fields in [
            &[proxy][..],
            &[("host", "bench.example:8443")],
            &[proxy, ("origin", "https://bench.example")],
            &[proxy, ("origin", "http://bench.example")],
        ] {
            assert_eq!(place("/v1/status", fields), Ok(()), "{fields:?}");
        }
        for (uri, fields, why) in [
            ("/", &[][..], "(none)"),
            ("/", &[("host", "a.example")], "a.example"),
            ("http://a.example/", &[host], "a.example"),
            ("/", &[host, ("host", "a.example")], "more than once"),
            ("/", &[host, ("origin", "http://a.example")], "a.example"),
            ("/", &[host, ("origin", "null")], "null"),
            ("/", &[("host", "x.bench.example")], "x.bench.example"),
            (
                "/",
                &[proxy, ("origin", "https://a.example")],
                "another site",
            ),
            (
                "/",
                &[host, ("origin", "http://127.0.0.1:80")],
                "another site",
            ),
            (
                "/",
                &[host, ("origin", "https://127.0.0.1:7437")],
                "another site",
            ),
            ("/", &[host, ("sec-fetch-site", "cross-site")], "cross-site"),
            ("/", &[host, ("sec-fetch-site", "same-site")], "same-site"),
        ] {
            let refused = place(uri, fields).unwrap_err();
            assert!(refused.contains(why), "{refused}");
        }
    }
}
