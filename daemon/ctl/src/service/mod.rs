//! The service as its clients see it: HTTP over a Unix socket or loopback.

mod endpoint;
mod events;
mod token;

use std::time::Duration;

use http_body_util::{BodyExt, Full, Limited};
use hyper::body::{Bytes, Incoming};
use hyper::{Method, Request, Response, StatusCode, header};
use hyper_util::rt::TokioIo;
use relief_api::Problem;
use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpStream, UnixStream};
use tokio::time::timeout;

pub(crate) use endpoint::{Endpoint, EndpointArgs};
pub(crate) use events::Events;

/// How long to wait for a connection and for the head of a reply.
const PATIENCE: Duration = Duration::from_secs(30);
/// JSON replies are small; a larger one is not from our service.
const MAX_JSON_BYTES: usize = 64 << 20;

/// What can go wrong between here and the service.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ServiceError {
    #[error(
        "no service answers at {endpoint} ({source}); is reliefd running? `relief doctor` looks \
         into it"
    )]
    Unreachable {
        endpoint: Endpoint,
        source: std::io::Error,
    },
    #[error("the service at {endpoint} does not answer within {} s", PATIENCE.as_secs())]
    Silent { endpoint: Endpoint },
    #[error("the connection to {endpoint} broke: {detail}")]
    Broken { endpoint: Endpoint, detail: String },
    #[error("what answers at {endpoint} does not seem to be reliefd: {detail}")]
    NotOurs { endpoint: Endpoint, detail: String },
    #[error("{0}")]
    Refused(Problem),
}

/// Asks the service; one connection per request, since a command asks only a few.
#[derive(Debug, Clone)]
pub(crate) struct Client {
    endpoint: Endpoint,
}

impl Client {
    pub(crate) fn new(endpoint: Endpoint) -> Self {
        Self { endpoint }
    }

    pub(crate) async fn get<T: DeserializeOwned>(&self, path: &str) -> Result<T, ServiceError> {
        let response = self
            .send(Method::GET, path, Bytes::new(), "application/json")
            .await?;
        self.json(response).await
    }

    pub(crate) async fn post<T: DeserializeOwned>(
        &self,
        path: &str,
        body: &impl Serialize,
    ) -> Result<T, ServiceError> {
        let body = serde_json::to_vec(body).map_err(|error| self.broken(&error))?;
        let response = self
            .send(Method::POST, path, body.into(), "application/json")
            .await?;
        self.json(response).await
    }

    /// Hands the bytes of a file to `take` as they come in.
    pub(crate) async fn download<E: From<ServiceError>>(
        &self,
        path: &str,
        mut take: impl FnMut(&[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut response = self.send(Method::GET, path, Bytes::new(), "*/*").await?;
        while let Some(frame) = response.frame().await {
            let frame = frame.map_err(|error| self.broken(&error))?;
            if let Some(data) = frame.data_ref() {
                take(data)?;
            }
        }
        Ok(())
    }

    /// Listens to the service's events.
    pub(crate) async fn events(&self) -> Result<Events, ServiceError> {
        let path = relief_api::path::EVENTS;
        let response = self
            .send(Method::GET, path, Bytes::new(), "text/event-stream")
            .await?;
        Ok(Events::new(self.endpoint.clone(), response.into_body()))
    }

    /// Sends a request and gives the reply's head, or the service's own words of refusal.
    async fn send(
        &self,
        method: Method,
        path: &str,
        body: Bytes,
        accept: &str,
    ) -> Result<Response<Incoming>, ServiceError> {
        let asked = async {
            match &self.endpoint {
                Endpoint::Socket(path_of_socket) => {
                    let stream = UnixStream::connect(path_of_socket).await;
                    self.exchange(stream, method, path, body, accept).await
                }
                Endpoint::Loopback { address, .. } => {
                    let stream = TcpStream::connect((address.host.as_str(), address.port)).await;
                    self.exchange(stream, method, path, body, accept).await
                }
            }
        };
        let response = timeout(PATIENCE, asked)
            .await
            .map_err(|_| ServiceError::Silent {
                endpoint: self.endpoint.clone(),
            })??;
        if response.status().is_success() {
            return Ok(response);
        }
        Err(self.refusal(response).await)
    }

    async fn exchange<S: AsyncRead + AsyncWrite + Unpin + Send + 'static>(
        &self,
        stream: std::io::Result<S>,
        method: Method,
        path: &str,
        body: Bytes,
        accept: &str,
    ) -> Result<Response<Incoming>, ServiceError> {
        let stream = stream.map_err(|source| ServiceError::Unreachable {
            endpoint: self.endpoint.clone(),
            source,
        })?;
        let (mut sender, connection) = hyper::client::conn::http1::handshake(TokioIo::new(stream))
            .await
            .map_err(|error| self.broken(&error))?;
        // The connection ends by itself when the reply has been read or dropped; its own
        // errors come out at the reply.
        tokio::spawn(connection);
        let mut request = Request::builder();
        if let Endpoint::Loopback {
            token: Some(token), ..
        } = &self.endpoint
        {
            request = request.header(header::AUTHORIZATION, token.header());
        }
        let request = request
            .method(method)
            .uri(path)
            .header(header::HOST, self.endpoint.host())
            .header(header::ACCEPT, accept)
            .header(header::CONTENT_TYPE, "application/json")
            .header(
                header::USER_AGENT,
                concat!("relief/", env!("CARGO_PKG_VERSION")),
            )
            .body(Full::new(body))
            .map_err(|error| self.broken(&error))?;
        sender
            .send_request(request)
            .await
            .map_err(|error| self.broken(&error))
    }

    async fn json<T: DeserializeOwned>(
        &self,
        response: Response<Incoming>,
    ) -> Result<T, ServiceError> {
        let bytes = self.collected(response).await?;
        serde_json::from_slice(&bytes).map_err(|error| ServiceError::NotOurs {
            endpoint: self.endpoint.clone(),
            detail: format!("its reply cannot be read ({error})"),
        })
    }

    async fn collected(&self, response: Response<Incoming>) -> Result<Bytes, ServiceError> {
        let body = Limited::new(response.into_body(), MAX_JSON_BYTES);
        let collected = body.collect().await.map_err(|error| self.broken(&error))?;
        Ok(collected.to_bytes())
    }

    async fn refusal(&self, response: Response<Incoming>) -> ServiceError {
        let status = response.status();
        let bytes = match self.collected(response).await {
            Ok(bytes) => bytes,
            Err(error) => return error,
        };
        match serde_json::from_slice::<Problem>(&bytes) {
            Ok(problem) => ServiceError::Refused(problem),
            Err(_) => ServiceError::NotOurs {
                endpoint: self.endpoint.clone(),
                detail: unexplained(status),
            },
        }
    }

    fn broken(&self, error: &dyn std::fmt::Display) -> ServiceError {
        ServiceError::Broken {
            endpoint: self.endpoint.clone(),
            detail: error.to_string(),
        }
    }
}

fn unexplained(status: StatusCode) -> String {
    format!("it refused with {status} and gave no reason")
}
