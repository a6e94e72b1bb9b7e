//! Requests that act at once: they do not wait until earlier ones have been prechecked.

use rig_shared::wire::message::{Request, RequestBody};

/// A request that ends a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UrgentBody {
    /// Switch the bridge off.
    Disarm,
    /// Come to rest under control.
    Stop,
}

/// A request that acts at once, with its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UrgentRequest {
    /// Number, repeated by the acknowledgement.
    pub id: u16,
    /// The request.
    pub body: UrgentBody,
}

impl UrgentRequest {
    /// Returns the request if it is urgent.
    pub fn from_request(request: &Request) -> Option<Self> {
        let body = match request.body {
            RequestBody::Disarm => UrgentBody::Disarm,
            RequestBody::Stop => UrgentBody::Stop,
            _ => return None,
        };
        Some(Self {
            id: request.id,
            body,
        })
    }
}

/// Returns true if a request must not be carried out after an urgent one that came later and overtook it: it would move
/// the rig again.
pub fn is_revoked(body: &RequestBody) -> bool {
    matches!(body, RequestBody::Arm | RequestBody::Start)
}
