//! Files over HTTP: the spool's and the journals.

use std::io;

use axum::extract::{Extension, Path, State};
use axum::http::HeaderMap;
use axum::response::{Json, Response};
use relief_api::{Job, SpoolEntry, path};

use super::download::{Download, DownloadHeaders, download};
use super::guard::{Asker, ON_SOCKET};
use super::openapi::Problems;
use super::problem::Refusal;
use super::{Context, blocking};
use crate::error::ServiceError;

/// What is in a result's folder.
#[utoipa::path(get, path = path::SPOOL, tag = "results", operation_id = "get_result",
    params(("result" = String, Path, description = "Name of the folder: the scan's id, or a rerun's own")),
    responses((status = 200, body = SpoolEntry), (status = 404, response = Problems)))]
pub(super) async fn entry(
    State(context): State<Context>,
    Path(result): Path<String>,
) -> Result<Json<SpoolEntry>, Refusal> {
    blocking(context, move |service| service.spool_entry(&result))
        .await
        .map(Json)
}

/// Notes that the sender has a result whole: it may go before those that nobody has. Asking again
/// changes nothing.
#[utoipa::path(post, path = path::SPOOL_ACK, tag = "results", operation_id = "acknowledge_result",
    params(("result" = String, Path, description = "Name of the folder")),
    responses((status = 200, body = Job, description = "The job that made it, with who has it since when"),
        (status = 404, response = Problems), (status = 409, response = Problems)))]
pub(super) async fn acknowledge(
    State(context): State<Context>,
    Path(result): Path<String>,
    asker: Option<Extension<Asker>>,
) -> Result<Json<Job>, Refusal> {
    let by = asker.map_or_else(|| ON_SOCKET.to_owned(), |Extension(Asker(name))| name);
    blocking(context, move |service| service.acknowledge(&result, &by))
        .await
        .map(Json)
}

/// A file of a result. Ranges and conditional requests are understood.
#[utoipa::path(get, path = path::SPOOL_FILE, tag = "results", operation_id = "get_result_file",
    params(("result" = String, Path, description = "Name of the folder"),
        ("file" = String, Path, description = "Name of the file"), DownloadHeaders),
    responses(Download, (status = 404, response = Problems), (status = 416, response = Problems)))]
pub(super) async fn file(
    State(context): State<Context>,
    headers: HeaderMap,
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
    download(file, &name, &headers).await
}

/// The raw columns that are kept of a scan. Ranges and conditional requests are understood.
#[utoipa::path(get, path = path::SCAN_JOURNAL, tag = "scans", operation_id = "get_scan_journal",
    params(("scan" = String, Path, description = "Id of the scan"), DownloadHeaders),
    responses(Download, (status = 404, response = Problems), (status = 409, response = Problems),
        (status = 416, response = Problems)))]
pub(super) async fn journal(
    State(context): State<Context>,
    headers: HeaderMap,
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
    download(file, "journal.scan", &headers).await
}
