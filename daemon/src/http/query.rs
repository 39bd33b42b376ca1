//! Queries of requests.

use axum::extract::{FromRequestParts, Query};
use axum::http::StatusCode;
use axum::http::request::Parts;
use relief_api::{MAX_LIMIT, MAX_NODES, Part};
use serde::de::DeserializeOwned;

use super::problem::Refusal;

/// A query, whose faults are told like any other problem.
pub(super) struct Params<T>(pub(super) T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequestParts<S> for Params<T> {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refusal> {
        let query = Query::<T>::from_request_parts(parts, state).await;
        query
            .map(|Query(params)| Self(params))
            .map_err(|rejection| wrong_query(rejection.body_text()))
    }
}

/// The query does not say what it must.
pub(super) fn wrong_query(detail: impl Into<String>) -> Refusal {
    Refusal::new(StatusCode::BAD_REQUEST, "wrong-query", detail, None)
}

/// How many entries of a list at most.
pub(super) fn limit(part: &Part) -> Result<Option<usize>, Refusal> {
    bounded(part.limit, "limit", MAX_LIMIT)
}

/// How many nodes of an image at most.
pub(super) fn most_nodes(asked: Option<u32>) -> Result<usize, Refusal> {
    let nodes = bounded(asked, "most_nodes", MAX_NODES)?;
    Ok(nodes.unwrap_or(relief_api::DEFAULT_NODES as usize))
}

fn bounded(asked: Option<u32>, name: &str, most: u32) -> Result<Option<usize>, Refusal> {
    match asked {
        Some(number) if !(1..=most).contains(&number) => Err(wrong_query(format!(
            "`{name}` is {number}, but must be from 1 to {most}"
        ))),
        asked => Ok(asked.map(|number| number as usize)),
    }
}
