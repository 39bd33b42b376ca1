//! Sending a file: whole, in part, or not at all to whoever has it already (RFC 9110).

use std::io::SeekFrom;
use std::os::unix::fs::MetadataExt;

use axum::body::Body;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use tokio::io::{AsyncReadExt, AsyncSeekExt};
use tokio_util::io::ReaderStream;

use super::guard::single;
use super::problem::Refusal;
use crate::error::ServiceError;

/// Fields by which a client asks for a part, or only for what it has not got.
#[derive(utoipa::IntoParams)]
#[into_params(parameter_in = Header)]
#[allow(dead_code)] // They are read where they are needed; this describes them.
pub(super) struct DownloadHeaders {
    /// Bytes that are wanted, such as `bytes=0-1023`; of several ranges all are sent, as the whole.
    #[param(rename = "Range")]
    range: Option<String>,
    /// The range is wanted only if the file still has this `ETag`.
    #[param(rename = "If-Range")]
    if_range: Option<String>,
    /// Nothing is wanted if the file has one of these.
    #[param(rename = "If-None-Match")]
    if_none_match: Option<String>,
}

/// The file, as it is sent.
#[derive(utoipa::IntoResponses)]
#[allow(dead_code)] // This describes what is sent.
pub(super) enum Download {
    /// The whole file
    #[response(status = 200, content_type = "application/octet-stream",
        headers(("ETag" = String, description = "Names this content")))]
    Whole(Vec<u8>),
    /// The part that was asked for
    #[response(status = 206, content_type = "application/octet-stream",
        headers(("ETag" = String, description = "Names this content"),
            ("Content-Range" = String, description = "Which part of how many bytes")))]
    Part(Vec<u8>),
    /// The client has it already
    #[response(status = 304)]
    Same,
}

/// Sends a file, which may be larger than memory.
pub(super) async fn download(
    file: std::fs::File,
    name: &str,
    asked: &HeaderMap,
) -> Result<Response, Refusal> {
    let unreadable = |source| ServiceError::Io {
        what: name.to_owned(),
        source,
    };
    let mut file = tokio::fs::File::from_std(file);
    let metadata = file.metadata().await.map_err(unreadable)?;
    let bytes = metadata.len();
    // Files are put in place whole, and a journal only grows: what is another content is another
    // file, or has another length or time.
    let etag = format!(
        "\"{:x}-{bytes:x}-{:x}.{:x}\"",
        metadata.ino(),
        metadata.mtime(),
        metadata.mtime_nsec()
    );
    let mut headers = vec![
        (header::ETAG, etag.clone()),
        (header::ACCEPT_RANGES, "bytes".to_owned()),
        (header::CACHE_CONTROL, "private, no-cache".to_owned()),
        (header::CONTENT_TYPE, content_type(name).to_owned()),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff".to_owned()),
    ];
    if name.ends_with(".html") {
        // Pages of ours have no scripts; whatever else is put into the spool shall have none.
        let policy = "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:";
        headers.push((header::CONTENT_SECURITY_POLICY, policy.to_owned()));
    }
    if has(asked, &etag)? {
        return Ok(answer(StatusCode::NOT_MODIFIED, headers, Body::empty()));
    }
    let (status, first, length) = match wanted(asked, &etag, bytes)? {
        Wanted::All => (StatusCode::OK, 0, bytes),
        Wanted::Part { first, last } => {
            headers.push((
                header::CONTENT_RANGE,
                format!("bytes {first}-{last}/{bytes}"),
            ));
            (StatusCode::PARTIAL_CONTENT, first, last + 1 - first)
        }
        Wanted::Beyond => {
            let refusal = Refusal::new(
                StatusCode::RANGE_NOT_SATISFIABLE,
                "no-such-range",
                format!("{name} has {bytes} bytes, and none of those that are wanted"),
                None,
            );
            let mut response = refusal.into_response();
            if let Ok(range) = HeaderValue::try_from(format!("bytes */{bytes}")) {
                response.headers_mut().insert(header::CONTENT_RANGE, range);
            }
            return Ok(response);
        }
    };
    if first > 0 {
        let sought = file.seek(SeekFrom::Start(first)).await;
        sought.map_err(unreadable)?;
    }
    headers.push((header::CONTENT_LENGTH, length.to_string()));
    // The length is promised before; a journal that grows meanwhile must not exceed it.
    let body = Body::from_stream(ReaderStream::new(file.take(length)));
    Ok(answer(status, headers, body))
}

fn answer(status: StatusCode, headers: Vec<(HeaderName, String)>, body: Body) -> Response {
    let mut response = (status, body).into_response();
    for (name, value) in headers {
        // All are ASCII.
        if let Ok(value) = HeaderValue::try_from(value) {
            response.headers_mut().insert(name, value);
        }
    }
    response
}

/// Whether the client has this content.
fn has(asked: &HeaderMap, etag: &str) -> Result<bool, Refusal> {
    let known = single(asked, header::IF_NONE_MATCH)?;
    let same = |known: &str| {
        let known = known.trim();
        known == "*" || known.strip_prefix("W/").unwrap_or(known) == etag
    };
    Ok(known.is_some_and(|known| known.split(',').any(same)))
}

#[derive(Debug, PartialEq)]
enum Wanted {
    All,
    Part {
        first: u64,
        last: u64,
    },
    /// None of it.
    Beyond,
}

/// What is wanted of so many bytes. A range that is not understood, or several, are for the whole.
fn wanted(asked: &HeaderMap, etag: &str, bytes: u64) -> Result<Wanted, Refusal> {
    let Some(range) = single(asked, header::RANGE)? else {
        return Ok(Wanted::All);
    };
    if single(asked, header::IF_RANGE)?.is_some_and(|known| known != etag) {
        return Ok(Wanted::All);
    }
    let Ok(parsed) = http_range_header::parse_range_header(range) else {
        return Ok(Wanted::All);
    };
    match parsed.validate(bytes) {
        Ok(ranges) => match ranges.as_slice() {
            [one] => Ok(Wanted::Part {
                first: *one.start(),
                last: *one.end(),
            }),
            _ => Ok(Wanted::All),
        },
        Err(_) => Ok(Wanted::Beyond),
    }
}

/// Media type by the file's ending; those of the registered types that we write.
fn content_type(name: &str) -> &'static str {
    match name.rsplit_once('.').map(|(_, ending)| ending) {
        Some("igs" | "iges") => "model/iges",
        Some("stp" | "step") => "model/step",
        Some("stl") => "model/stl",
        Some("3mf") => "model/3mf",
        Some("glb") => "model/gltf-binary",
        Some("e57") => "model/e57",
        Some("png") => "image/png",
        Some("json") => "application/json",
        Some("html") => "text/html; charset=utf-8",
        Some("pdf") => "application/pdf",
        Some("txt") => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(fields: &[(HeaderName, &'static str)]) -> HeaderMap {
        let fields = fields.iter().cloned();
        fields
            .map(|(name, value)| (name, HeaderValue::from_static(value)))
            .collect()
    }

    #[test]
    fn parts_are_understood_as_the_standard_has_them() {
        for (range, meant) in [
            ("bytes=0-9", Wanted::Part { first: 0, last: 9 }),
            (
                "bytes=90-",
                Wanted::Part {
                    first: 90,
                    last: 99,
                },
            ),
            (
                "bytes=-10",
                Wanted::Part {
                    first: 90,
                    last: 99,
                },
            ),
            ("bytes=100-", Wanted::Beyond),
            ("bytes=0-4, 8-9", Wanted::All),
            ("lines=1-2", Wanted::All),
            ("bytes=x", Wanted::All),
        ] {
            let fields = asked(&[(header::RANGE, range)]);
            assert_eq!(wanted(&fields, "\"a\"", 100).unwrap(), meant, "{range}");
        }
        let since = |known| asked(&[(header::RANGE, "bytes=0-9"), (header::IF_RANGE, known)]);
        let part = Wanted::Part { first: 0, last: 9 };
        assert_eq!(wanted(&since("\"a\""), "\"a\"", 100).unwrap(), part);
        let other = wanted(&since("\"b\""), "\"a\"", 100).unwrap();
        assert_eq!(other, Wanted::All, "it has changed meanwhile");
    }

    #[test]
    fn who_has_it_gets_nothing() {
        for (known, meant) in [
            ("\"a\"", true),
            ("W/\"a\"", true),
            ("\"b\", \"a\"", true),
            ("*", true),
            ("\"b\"", false),
        ] {
            let fields = asked(&[(header::IF_NONE_MATCH, known)]);
            assert_eq!(has(&fields, "\"a\"").unwrap(), meant, "{known}");
        }
        assert!(!has(&HeaderMap::new(), "\"a\"").unwrap());
    }
}
