//! The rig while it runs: a web page that shows and commands it, and its numbers for Foxglove, Lichtblick and
//! PlotJuggler.
//!
//! One thread owns the line to the rig (`live_rig`); a second one serves all clients (`server`, `foxglove`,
//! `plotjuggler`). Between them is the `hub`: a bounded ring of packets that overwrites the oldest, so that a slow
//! client never delays the line. It is told how many samples it has missed.
//!
//! `access` decides who may connect. `packet` and `status` hold what is sent, `recording` writes CSV files,
//! `motion` reads trajectories, and `page` is the web page.

mod access;
mod error;
mod foxglove;
mod guarded;
mod hub;
mod live_rig;
mod motion;
mod packet;
mod page;
mod plotjuggler;
mod recording;
mod serve;
mod server;
mod status;

pub use access::token_is_usable;
pub use error::LiveError;
pub use live_rig::{RigSettings, Surroundings};
pub use motion::Motion;
pub use serve::{Addresses, Listeners};
