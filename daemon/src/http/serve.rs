//! Connections: how many, and how long one may keep the service waiting.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::serve::Listener;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;

use super::problem::too_many_connections;
use super::stall::Stalling;
use crate::config::HttpConfig;

/// Bytes of a request line with all header fields. Ours take a few hundred.
const MAX_HEAD_BYTES: usize = 16 * 1024;
/// Header fields of a request.
const MAX_HEADERS: usize = 64;

/// Connections beyond the limit that are still told why; beyond these, they are just closed.
const MOST_TURNED_AWAY: usize = 16;
/// How long a connection that is turned away may take to hear it.
const FAREWELL: Duration = Duration::from_secs(1);

/// Answers whoever connects, until the service stops and all connections have ended.
pub(crate) async fn serve<L>(
    mut listener: L,
    app: Router,
    limits: Arc<HttpConfig>,
    stop: CancellationToken,
) where
    L: Listener,
    L::Addr: std::fmt::Debug,
{
    let places = Arc::new(Semaphore::new(limits.connections));
    let doors = Arc::new(Semaphore::new(MOST_TURNED_AWAY));
    let mut connections = JoinSet::new();
    loop {
        let (stream, _) = tokio::select! {
            accepted = listener.accept() => accepted,
            Some(_) = connections.join_next(), if !connections.is_empty() => continue,
            () = stop.cancelled() => break,
        };
        if let Ok(place) = Arc::clone(&places).try_acquire_owned() {
            let (app, limits, stop) = (app.clone(), Arc::clone(&limits), stop.clone());
            connections.spawn(answer(stream, place, app, limits, stop));
        } else if let Ok(door) = Arc::clone(&doors).try_acquire_owned() {
            tracing::warn!(limit = limits.connections, "too many connections");
            connections.spawn(turn_away(stream, door, limits.connections));
        }
    }
    drop(listener);
    while connections.join_next().await.is_some() {}
}

async fn answer<S>(
    stream: S,
    _place: OwnedSemaphorePermit,
    app: Router,
    limits: Arc<HttpConfig>,
    stop: CancellationToken,
) where
    S: AsyncRead + AsyncWrite + Send + Unpin + 'static,
{
    let stream = TokioIo::new(Stalling::new(stream, limits.stall_timeout()));
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        // Counts from the end of the last reply, so that idle connections end as well.
        .header_read_timeout(limits.request_timeout())
        .max_headers(MAX_HEADERS)
        .max_buf_size(MAX_HEAD_BYTES)
        .serve_connection(stream, TowerToHyperService::new(app));
    let mut connection = std::pin::pin!(connection);
    let ended = tokio::select! {
        ended = connection.as_mut() => ended,
        () = stop.cancelled() => {
            connection.as_mut().graceful_shutdown();
            connection.await
        }
    };
    if let Err(error) = ended {
        let cause = std::error::Error::source(&error).map(ToString::to_string);
        tracing::debug!(%error, cause, "a connection was cut");
    }
}

/// Says why, whatever is asked, and closes.
async fn turn_away<S>(mut stream: S, _door: OwnedSemaphorePermit, limit: usize)
where
    S: AsyncRead + AsyncWrite + Send + Unpin,
{
    let farewell = async {
        stream.write_all(&too_many_connections(limit)).await?;
        stream.shutdown().await?;
        // What was sent meanwhile is taken off: closing on unread bytes would reset the
        // connection, and the reply might be lost with it.
        let mut rest = Vec::new();
        (&mut stream)
            .take(MAX_HEAD_BYTES as u64)
            .read_to_end(&mut rest)
            .await
    };
    // Who does not listen is not waited for.
    let _ = tokio::time::timeout(FAREWELL, farewell).await;
}
