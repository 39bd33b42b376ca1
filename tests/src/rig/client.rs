//! A client of the HTTP API that shares nothing with the command line's.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};
use http_body_util::{BodyExt, Full};
use hyper::body::{Bytes, Incoming};
use hyper::{Method, Request, Response, header};
use hyper_util::rt::TokioIo;
use relief_api::{Problem, path};
use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::net::UnixStream;

use super::Events;

/// Asks a service on its Unix socket; one connection for each request.
#[derive(Debug, Clone)]
pub struct Client {
    socket: PathBuf,
}

/// A whole reply.
#[derive(Debug)]
pub struct Reply {
    /// HTTP status.
    pub status: u16,
    /// Media type.
    pub content_type: String,
    /// The body.
    pub body: Bytes,
}

/// The service's own words of refusal.
#[derive(Debug, Clone)]
pub struct Refused(pub Problem);

impl std::fmt::Display for Refused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({}): {}", self.0.kind, self.0.status, self.0)
    }
}

impl std::error::Error for Refused {}

impl Client {
    /// A client of the service at this socket.
    #[must_use]
    pub fn new(socket: &Path) -> Self {
        Self {
            socket: socket.to_owned(),
        }
    }

    /// Asks for a document.
    ///
    /// # Errors
    /// [`Refused`] when the service refuses; anything else means that it misbehaves.
    pub async fn get<T: DeserializeOwned>(&self, path: &str) -> Result<T> {
        self.request(Method::GET, path, None).await?.json()
    }

    /// Posts a document and reads the one that comes back.
    ///
    /// # Errors
    /// As [`Client::get`].
    pub async fn post<T: DeserializeOwned>(&self, path: &str, body: &impl Serialize) -> Result<T> {
        let body = serde_json::to_vec(body)?;
        self.request(Method::POST, path, Some(body)).await?.json()
    }

    /// Posts nothing and reads the document that comes back.
    ///
    /// # Errors
    /// As [`Client::get`].
    pub async fn ask<T: DeserializeOwned>(&self, path: &str) -> Result<T> {
        self.request(Method::POST, path, None).await?.json()
    }

    /// The bytes of a file.
    ///
    /// # Errors
    /// As [`Client::get`].
    pub async fn download(&self, path: &str) -> Result<Bytes> {
        let reply = self.request(Method::GET, path, None).await?;
        Ok(reply.success()?.body)
    }

    /// Listens to the service's events from now on.
    ///
    /// # Errors
    /// As [`Client::get`].
    pub async fn events(&self) -> Result<Events> {
        let response = self.send(Method::GET, path::EVENTS, None).await?;
        anyhow::ensure!(response.status() == 200, "events: {}", response.status());
        Ok(Events::new(response.into_body()))
    }

    /// Sends a request and reads the whole reply, whatever it says.
    ///
    /// # Errors
    /// When the service does not speak HTTP.
    pub async fn request(
        &self,
        method: Method,
        path: &str,
        body: Option<Vec<u8>>,
    ) -> Result<Reply> {
        let response = self.send(method, path, body).await?;
        let status = response.status().as_u16();
        let content_type = response
            .headers()
            .get(header::CONTENT_TYPE)
            .and_then(|value| value.to_str().ok())
            .unwrap_or_default()
            .to_owned();
        let body = response.into_body().collect().await?.to_bytes();
        Ok(Reply {
            status,
            content_type,
            body,
        })
    }

    async fn send(
        &self,
        method: Method,
        path: &str,
        body: Option<Vec<u8>>,
    ) -> Result<Response<Incoming>> {
        let stream = UnixStream::connect(&self.socket)
            .await
            .with_context(|| format!("cannot connect to {}", self.socket.display()))?;
        let (mut sender, connection) =
            hyper::client::conn::http1::handshake(TokioIo::new(stream)).await?;
        // Ends with the reply; its own errors come out there.
        tokio::spawn(connection);
        let mut request = Request::builder()
            .method(method)
            .uri(path)
            .header(header::HOST, "localhost");
        if body.is_some() {
            request = request.header(header::CONTENT_TYPE, "application/json");
        }
        let request = request.body(Full::new(Bytes::from(body.unwrap_or_default())))?;
        Ok(sender.send_request(request).await?)
    }
}

impl Reply {
    /// The reply, unless it is a refusal.
    ///
    /// # Errors
    /// [`Refused`].
    pub fn success(self) -> Result<Self> {
        if (200..300).contains(&self.status) {
            return Ok(self);
        }
        let problem: Problem = serde_json::from_slice(&self.body)
            .with_context(|| format!("{}: {:?}", self.status, self.body))?;
        Err(anyhow!(Refused(problem)))
    }

    fn json<T: DeserializeOwned>(self) -> Result<T> {
        let reply = self.success()?;
        serde_json::from_slice(&reply.body).with_context(|| format!("{:?}", reply.body))
    }
}
