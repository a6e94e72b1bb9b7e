//! Errors of the live view.

use std::io;
use std::net::SocketAddr;

use rig_data::DataError;
use rig_link::LinkError;

/// Reason why the live view could not start, or ended. Each text is a whole sentence.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// An address cannot be listened on.
    #[error(
        "{option} {address} cannot be used: {source}; choose another port, or 0 for any free one."
    )]
    Listen {
        /// The option of the command.
        option: &'static str,
        /// Address.
        address: SocketAddr,
        /// Error of the operating system.
        source: io::Error,
    },
    /// An address that other computers reach, without a token.
    #[error(
        "{option} {address} can be reached from other computers, who could move the rig; give --token TEXT, or listen on 127.0.0.1."
    )]
    Open {
        /// The option of the command.
        option: &'static str,
        /// Address.
        address: SocketAddr,
    },
    /// A token that is too short or has other characters.
    #[error(
        "--token must have at least {} characters, each a letter, a digit or one of - . _ ~, so that it can stand in an address.",
        super::access::SHORTEST_TOKEN
    )]
    Token,
    /// The server cannot run.
    #[error("The web server cannot run: {0}.")]
    Server(io::Error),
    /// The line to the rig.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// A recording.
    #[error(transparent)]
    Data(#[from] DataError),
}
