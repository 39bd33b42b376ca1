//! Tokens over HTTP: on the socket only, since whoever bears a token could otherwise make
//! more of them, and keep one when it is taken back.

use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::Json;
use relief_api::{CreateToken, NewToken, Token, TokenList, path};

use super::openapi::Problems;
use super::problem::{Body, Refusal};
use super::{Context, blocking};

/// The tokens, oldest first. On the socket only.
#[utoipa::path(get, path = path::TOKENS, tag = "tokens", operation_id = "list_tokens",
    responses((status = 200, body = TokenList)))]
pub(super) async fn list(State(context): State<Context>) -> Json<TokenList> {
    Json(TokenList {
        tokens: context.service.tokens.list(),
    })
}

/// Makes a token. On the socket only.
#[utoipa::path(post, path = path::TOKENS, tag = "tokens", operation_id = "create_token",
    request_body = CreateToken,
    responses((status = 201, body = NewToken), (status = 409, response = Problems)))]
pub(super) async fn create(
    State(context): State<Context>,
    Body(request): Body<CreateToken>,
) -> Result<(StatusCode, Json<NewToken>), Refusal> {
    let token = blocking(context, move |service| {
        Ok(service.tokens.create(&request.name)?)
    })
    .await?;
    tracing::info!(name = token.name, "a token was made");
    Ok((StatusCode::CREATED, Json(token)))
}

/// Takes a token back. On the socket only.
#[utoipa::path(post, path = path::TOKEN_REVOKE, tag = "tokens", operation_id = "revoke_token", params(("token" = String, Path, description = "Name of the token")),
    responses((status = 200, body = Token), (status = 404, response = Problems)))]
pub(super) async fn revoke(
    State(context): State<Context>,
    Path(name): Path<String>,
) -> Result<Json<Token>, Refusal> {
    let token = blocking(context, move |service| Ok(service.tokens.revoke(&name)?)).await?;
    tracing::info!(name = token.name, "a token was revoked");
    Ok(Json(token))
}

/// The answer on a loopback address.
pub(super) async fn only_on_the_socket() -> Refusal {
    Refusal::new(
        StatusCode::FORBIDDEN,
        "only-on-the-socket",
        "tokens are made, listed and revoked on the service's socket only",
        Some("use `relief token` on the service's machine, without --url"),
    )
}
