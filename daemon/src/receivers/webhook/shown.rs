//! Addresses as they are shown, in logs and over the API. Many receivers know who may post by the
//! path alone, others by a query or by a name and password, so that none of these is shown.

use axum::http::Uri;
use axum::http::uri::Authority;

/// Stands for what is not shown.
const LEFT_OUT: &str = "...";

/// Scheme, host and port of an address, and `/...` for whatever follows.
///
/// Of a text that cannot be read as an address nothing is shown: nobody knows what somebody has
/// put there by mistake.
pub(crate) fn shown_url(text: &str) -> String {
    let Ok(uri) = text.parse::<Uri>() else {
        return LEFT_OUT.to_owned();
    };
    let (Some(scheme), Some(authority)) = (uri.scheme_str(), uri.authority()) else {
        return LEFT_OUT.to_owned();
    };
    // As in "://host", which is read all the same.
    if scheme.is_empty() {
        return LEFT_OUT.to_owned();
    }
    let more = match (uri.path(), uri.query()) {
        ("" | "/", None) => String::new(),
        _ => format!("/{LEFT_OUT}"),
    };
    let told = match authority.as_str().contains('@') {
        true => format!("{LEFT_OUT}@"),
        false => String::new(),
    };
    let host = host_and_port(authority).unwrap_or_else(|| LEFT_OUT.to_owned());
    format!("{scheme}://{told}{host}{more}")
}

/// Host and port of an address, for messages.
pub(super) fn shown_host(url: &str) -> String {
    let uri = url.parse::<Uri>().ok();
    let authority = uri.as_ref().and_then(Uri::authority);
    let host = authority.and_then(host_and_port);
    host.unwrap_or_else(|| LEFT_OUT.to_owned())
}

/// None where what stands for the port is no number: it may be the beginning of a password.
fn host_and_port(authority: &Authority) -> Option<String> {
    let own = authority.as_str();
    let own = own.rsplit_once('@').map_or(own, |(_, own)| own);
    let is_whole = own == authority.host() || authority.port_u16().is_some();
    is_whole.then(|| own.to_owned())
}

/// Where a receiver at this address leads to: elsewhere, or to another path of its own.
pub(super) fn shown_location(url: &str, location: &str) -> String {
    if location.contains("://") {
        return shown_url(location);
    }
    let (scheme, _) = url.split_once("://").unwrap_or_default();
    if location.starts_with("//") {
        return shown_url(&format!("{scheme}:{location}"));
    }
    format!("{scheme}://{}/{LEFT_OUT}", shown_host(url))
}

/// What a receiver said, without the path and query that it was asked for: many repeat those.
pub(super) fn without_path(url: &str, answer: &str) -> String {
    let uri = url.parse::<Uri>().ok();
    let Some(asked) = uri.as_ref().and_then(Uri::path_and_query) else {
        return answer.to_owned();
    };
    let mut shown = answer.to_owned();
    for part in [asked.as_str(), asked.path(), asked.query().unwrap_or("/")] {
        // A slash alone tells nothing, and stands everywhere.
        if !matches!(part, "" | "/") {
            shown = shown.replace(part, LEFT_OUT);
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_shown_without_what_may_be_secret() {
        for (url, shown) in [
            ("https://a.example", "https://a.example"),
            ("https://a.example:8443/", "https://a.example:8443"),
            ("http://[::1]:80/hunter2", "http://[::1]:80/..."),
            ("https://a.example/T0/hunter2", "https://a.example/..."),
            ("https://a.example?key=hunter2", "https://a.example/..."),
            ("https://a.example/b@c?hunter2", "https://a.example/..."),
            ("https://hunter2@a.example/", "https://...@a.example"),
            ("https://a:hunter2@b.example/c", "https://...@b.example/..."),
            ("https://hunter:2/@a.example/", "https://hunter:2/..."),
            ("https://a:hunter2/@b.example/", "https://.../..."),
            ("https://a.example:99999/", "https://..."),
            // Not to be read as addresses.
            ("https://a b/hunter2", "..."),
            ("https://a:hunter 2@b.example", "..."),
            ("https:/a.example/hunter2", "..."),
            ("a:hunter2@b.example", "..."),
            ("whsec_hunter2", "..."),
            ("hunter2 https://a.example", "..."),
            ("://hunter2", "..."),
            ("", "..."),
        ] {
            assert_eq!(shown_url(url), shown, "{url}");
        }
    }

    #[test]
    fn where_a_receiver_leads_is_shown_in_the_same_way() {
        let url = "https://a.example:8443/hunter2";
        for (location, shown) in [
            ("https://b.example/hunter2", "https://b.example/..."),
            ("//b.example/hunter2", "https://b.example/..."),
            ("/login?hunter2", "https://a.example:8443/..."),
            ("hunter2", "https://a.example:8443/..."),
            ("", "https://a.example:8443/..."),
        ] {
            assert_eq!(shown_location(url, location), shown, "{location}");
        }
    }

    #[test]
    fn answers_do_not_repeat_the_path() {
        let url = "https://a.example/T0/hunter2?key=hunter3";
        for (answer, shown) in [
            ("Cannot POST /T0/hunter2?key=hunter3.", "Cannot POST ...."),
            ("no /T0/hunter2 here", "no ... here"),
            ("key=hunter3?", "...?"),
            ("out of order", "out of order"),
        ] {
            assert_eq!(without_path(url, answer), shown, "{answer}");
        }
        for url in ["https://a.example/", "https://a.example"] {
            assert_eq!(without_path(url, "and/or"), "and/or");
        }
    }
}
