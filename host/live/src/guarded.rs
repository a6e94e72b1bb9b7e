//! What both servers share: the hub, and the rule for every request.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::access::Access;
use super::hub::Hub;

/// The state of a server.
#[derive(Clone)]
pub(crate) struct Guarded {
    pub hub: Arc<Hub>,
    pub access: Access,
}

/// Refuses requests that [`Access`] does not allow.
pub(crate) async fn guard(State(app): State<Guarded>, request: Request, next: Next) -> Response {
    match app.access.check(request.uri(), request.headers()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    }
}
