//! Files over HTTP: the spool's and the journals.

use std::path::PathBuf;

use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::header;
use axum::response::{IntoResponse, Json, Response};
use relief_api::SpoolEntry;
use tokio_util::io::ReaderStream;

use super::problem::Refusal;
use super::{Context, blocking};
use crate::error::ServiceError;

pub(super) async fn entry(
    State(context): State<Context>,
    Path(result): Path<String>,
) -> Result<Json<SpoolEntry>, Refusal> {
    blocking(context, move |service| {
        service
            .spool
            .entry(&result)?
            .ok_or(ServiceError::NotInSpool { what: result })
    })
    .await
    .map(Json)
}

pub(super) async fn file(
    State(context): State<Context>,
    Path((result, file)): Path<(String, String)>,
) -> Result<Response, Refusal> {
    let name = file.clone();
    let path = blocking(context, move |service| {
        service
            .spool
            .file(&result, &file)
            .ok_or_else(|| ServiceError::NotInSpool {
                what: format!("{result}/{file}"),
            })
    })
    .await?;
    download(path, &name).await
}

pub(super) async fn journal(
    State(context): State<Context>,
    Path(id): Path<String>,
) -> Result<Response, Refusal> {
    // By way of the record, so that only ids that were given out become paths.
    let path = blocking(context, move |service| {
        let scan = service.scan(&id)?;
        let path = service.journal_path(&scan.id);
        if path.is_file() {
            Ok(path)
        } else {
            Err(ServiceError::NothingKept {
                id: scan.id,
                why: "it has no journal".into(),
            })
        }
    })
    .await?;
    let name = path
        .file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default();
    download(path, &name).await
}

/// Streams a file, which may be larger than memory.
async fn download(path: PathBuf, name: &str) -> Result<Response, Refusal> {
    let io = |source| {
        Refusal::from(ServiceError::Io {
            what: path.display().to_string(),
            source,
        })
    };
    let file = tokio::fs::File::open(&path).await.map_err(io)?;
    let bytes = file.metadata().await.map_err(io)?.len();
    // The length is promised before; a journal that grows meanwhile must not exceed it.
    let reader = tokio::io::AsyncReadExt::take(file, bytes);
    let headers = [
        (header::CONTENT_TYPE, content_type(name).to_owned()),
        (header::CONTENT_LENGTH, bytes.to_string()),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff".to_owned()),
    ];
    Ok((headers, Body::from_stream(ReaderStream::new(reader))).into_response())
}

/// Media type by the file's ending; those of the registered types that we write.
fn content_type(name: &str) -> &'static str {
    match name.rsplit_once('.').map(|(_, ending)| ending) {
        Some("igs" | "iges") => "model/iges",
        Some("stp" | "step") => "model/step",
        Some("png") => "image/png",
        Some("json") => "application/json",
        Some("txt") => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}
