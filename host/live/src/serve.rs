//! The addresses of the live view, and the thread that serves them.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;

use rig_link::{LossReport, Port, Session};
use tokio::sync::oneshot;

use super::access::{Access, Origins, token_is_usable};
use super::error::LiveError;
use super::hub::Hub;
use super::live_rig::{RigSettings, Surroundings, run};
use super::{foxglove, plotjuggler, server};

/// Where the live view is served, and to whom.
#[derive(Clone, Debug)]
pub struct Addresses {
    /// The page.
    pub listen: SocketAddr,
    /// The token that every request needs.
    pub token: Option<String>,
    /// The Foxglove WebSocket server.
    pub foxglove: Option<SocketAddr>,
    /// Receiver of JSON over UDP.
    pub plotjuggler: Option<SocketAddr>,
}

/// The open addresses, before the rig is contacted.
pub struct Listeners {
    addresses: Addresses,
    page: TcpListener,
    foxglove: Option<TcpListener>,
}

impl Listeners {
    /// Opens the addresses.
    ///
    /// # Errors
    /// An address in use, one that is open to other computers without a token, or a token that cannot be used.
    pub fn open(mut addresses: Addresses) -> Result<Self, LiveError> {
        if let Some(token) = &addresses.token
            && !token_is_usable(token)
        {
            return Err(LiveError::Token);
        }
        let closed = addresses.token.is_some();
        let page = listen("--listen", &mut addresses.listen, closed)?;
        let foxglove = match &mut addresses.foxglove {
            Some(address) => Some(listen("--foxglove", address, closed)?),
            None => None,
        };
        Ok(Self {
            addresses,
            page,
            foxglove,
        })
    }

    /// Returns the addresses with the ports that were found for 0.
    pub fn addresses(&self) -> &Addresses {
        &self.addresses
    }

    /// Shows and commands the rig of `session` until the program is asked to end.
    ///
    /// # Errors
    /// A failed line, or a recording that cannot be written.
    pub fn run<P: Port>(
        self,
        session: &mut Session<P>,
        settings: RigSettings,
        surroundings: &dyn Surroundings,
    ) -> Result<LossReport, LiveError> {
        let (hub, orders) = Hub::new();
        let (end, ended) = oneshot::channel::<()>();
        let clients = hub.clone();
        let thread = std::thread::Builder::new()
            .name("clients".to_owned())
            .spawn(move || self.serve(clients, ended))
            .map_err(LiveError::Server)?;
        let result = run(session, settings, &hub, &orders, surroundings);
        drop(end);
        match thread.join() {
            Ok(Err(error)) => result.and(Err(LiveError::Server(error))),
            _ => result,
        }
    }

    /// Serves all clients on this thread until `ended`.
    fn serve(self, hub: Arc<Hub>, ended: oneshot::Receiver<()>) -> io::Result<()> {
        let Self {
            addresses,
            page,
            foxglove,
        } = self;
        let access = |origins| Access {
            token: addresses.token.clone(),
            origins,
        };
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .build()?;
        runtime.block_on(async {
            if let Some(listener) = foxglove {
                let listener = tokio::net::TcpListener::from_std(listener)?;
                let app = foxglove::app(hub.clone(), access(Origins::Local));
                tokio::spawn(async move { axum::serve(listener, app).await });
            }
            if let Some(address) = addresses.plotjuggler {
                tokio::spawn(plotjuggler::send(hub.clone(), address));
            }
            let listener = tokio::net::TcpListener::from_std(page)?;
            let app = server::app(hub, access(Origins::Own));
            tokio::select! {
                served = async { axum::serve(listener, app).await } => served,
                _ = ended => Ok(()),
            }
        })
    }
}

/// Opens an address and puts the port that was found for 0 into it.
fn listen(
    option: &'static str,
    address: &mut SocketAddr,
    closed: bool,
) -> Result<TcpListener, LiveError> {
    if !closed && !address.ip().is_loopback() {
        return Err(LiveError::Open {
            option,
            address: *address,
        });
    }
    let failed = |source| LiveError::Listen {
        option,
        address: *address,
        source,
    };
    let listener = TcpListener::bind(*address).map_err(failed)?;
    listener.set_nonblocking(true).map_err(failed)?;
    *address = listener.local_addr().map_err(failed)?;
    Ok(listener)
}
