//! The web page: files that are built into the program.

mod assets;

use std::sync::LazyLock;

use axum::Router;
use axum::extract::Path;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use sha2::{Digest, Sha256};

use super::problem::{Refusal, no_such_path};
use assets::{ASSETS, Asset, INDEX};

/// Nothing comes from elsewhere, and nothing is run that is not a file of ours.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; \
                      img-src 'self' blob: data:; connect-src 'self'; manifest-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Names each file's content.
static ETAGS: LazyLock<Vec<(&str, String)>> = LazyLock::new(|| {
    let all = ASSETS.iter().chain([&INDEX]);
    all.map(|asset| (asset.name, etag(asset))).collect()
});

fn etag(asset: &Asset) -> String {
    let digest = deliverables::hexadecimal(&Sha256::digest(asset.bytes));
    format!("\"{}\"", &digest[..32])
}

/// The page, and what it is made of.
pub(super) fn router() -> Router {
    Router::new()
        .route("/", get(index))
        .route("/assets/{*name}", get(asset))
}

async fn index(headers: HeaderMap) -> Response {
    sent(&INDEX, &headers)
}

async fn asset(Path(name): Path<String>, headers: HeaderMap) -> Result<Response, Refusal> {
    match ASSETS.iter().find(|asset| asset.name == name) {
        Some(asset) => Ok(sent(asset, &headers)),
        None => Err(no_such_path(axum::http::Uri::from_static("/assets")).await),
    }
}

fn sent(asset: &Asset, asked: &HeaderMap) -> Response {
    let etag = ETAGS.iter().find(|(name, _)| *name == asset.name);
    let etag = etag.map_or("", |(_, etag)| etag);
    let headers = [
        (header::ETAG, etag),
        // Asked for again each time, and sent again only after an upgrade.
        (header::CACHE_CONTROL, "no-cache"),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CONTENT_TYPE, asset.media_type()),
    ];
    let known = asked.get(header::IF_NONE_MATCH);
    if known.is_some_and(|known| known.as_bytes() == etag.as_bytes()) {
        return (StatusCode::NOT_MODIFIED, headers).into_response();
    }
    (headers, asset.bytes).into_response()
}
