//! Files over HTTP: the spool's and the journals.

use std::io;

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
    let what = format!("{result}/{file}");
    let file = blocking(context, move |service| {
        match service.spool.file(&result, &file) {
            Ok(Some(file)) => Ok(file),
            Ok(None) => Err(ServiceError::NotInSpool { what }),
            Err(source) => Err(ServiceError::Io { what, source }),
        }
    })
    .await?;
    download(file, &name).await
}

pub(super) async fn journal(
    State(context): State<Context>,
    Path(id): Path<String>,
) -> Result<Response, Refusal> {
    // By way of the record, so that only ids that were given out become paths.
    let file = blocking(context, move |service| {
        let scan = service.scan(&id)?;
        let path = service.journal_path(&scan.id);
        std::fs::File::open(&path).map_err(|source| match source.kind() {
            io::ErrorKind::NotFound => ServiceError::NothingKept {
                id: scan.id,
                why: "it has no journal".into(),
            },
            _ => ServiceError::Io {
                what: path.display().to_string(),
                source,
            },
        })
    })
    .await?;
    download(file, "journal.scan").await
}

/// Streams a file, which may be larger than memory.
async fn download(file: std::fs::File, name: &str) -> Result<Response, Refusal> {
    let file = tokio::fs::File::from_std(file);
    let metadata = file.metadata().await;
    let bytes = metadata
        .map_err(|source| ServiceError::Io {
            what: name.to_owned(),
            source,
        })?
        .len();
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
        Some("stl") => "model/stl",
        Some("3mf") => "model/3mf",
        Some("glb") => "model/gltf-binary",
        Some("e57") => "model/e57",
        Some("png") => "image/png",
        Some("json") => "application/json",
        Some("txt") => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}
