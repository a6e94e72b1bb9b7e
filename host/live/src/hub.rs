//! What the thread of the line and the thread of the clients exchange. Neither waits for the other.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

use tokio::sync::{broadcast, oneshot, watch};

use super::packet::Packet;

/// Packets kept for slow clients: 10 s at 25 packets a second.
const PACKETS: usize = 256;
/// Orders that wait for the line.
const ORDERS: usize = 16;

/// What a client asks of the rig, stop apart.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Action {
    Arm,
    /// Start the loaded motion; `shifted`: also if the link is not at its start.
    Start {
        shifted: bool,
    },
    Disarm,
    ClearFault,
    /// Load a trajectory file.
    Load {
        name: String,
        text: String,
    },
    /// Begin or end a recording.
    Record(bool),
}

/// A refused order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Refused {
    pub text: String,
    /// True if the order would be carried out with `shifted`.
    pub shift: bool,
}

impl<T: Into<String>> From<T> for Refused {
    fn from(text: T) -> Self {
        Self {
            text: text.into(),
            shift: false,
        }
    }
}

/// The answer to an order: a sentence.
pub(crate) type Answer = Result<String, Refused>;

/// An action with the place for its answer.
pub(crate) struct Order {
    pub action: Action,
    pub answer: oneshot::Sender<Answer>,
}

/// The exchange between line and clients.
pub(crate) struct Hub {
    packets: broadcast::Sender<Arc<Packet>>,
    status: watch::Sender<Arc<str>>,
    orders: SyncSender<Order>,
    /// Stop has its own place: it waits behind nothing.
    stops: AtomicU64,
    viewers: AtomicUsize,
    hello: watch::Sender<Arc<str>>,
}

impl Hub {
    /// Creates a hub, and the orders for the line.
    pub(crate) fn new() -> (Arc<Self>, Receiver<Order>) {
        let (orders, received) = sync_channel(ORDERS);
        let hub = Self {
            packets: broadcast::Sender::new(PACKETS),
            status: watch::Sender::new(Arc::from("")),
            orders,
            stops: AtomicU64::new(0),
            viewers: AtomicUsize::new(0),
            hello: watch::Sender::new(Arc::from("")),
        };
        (Arc::new(hub), received)
    }

    /// Sends a packet to all clients. The oldest packet is overwritten for those who are behind.
    pub(crate) fn publish(&self, packet: Packet) {
        // Without a client there is nobody to miss it.
        let _nobody = self.packets.send(Arc::new(packet));
    }

    pub(crate) fn packets(&self) -> broadcast::Receiver<Arc<Packet>> {
        self.packets.subscribe()
    }

    pub(crate) fn set_status(&self, text: String) {
        self.status.send_replace(Arc::from(text));
    }

    pub(crate) fn status(&self) -> watch::Receiver<Arc<str>> {
        self.status.subscribe()
    }

    /// Sets the first message to every client: what does not change.
    pub(crate) fn set_hello(&self, text: String) {
        self.hello.send_replace(Arc::from(text));
    }

    /// Returns the first message, as soon as the rig has greeted.
    pub(crate) async fn hello(&self) -> Arc<str> {
        let mut hello = self.hello.subscribe();
        match hello.wait_for(|text| !text.is_empty()).await {
            Ok(text) => text.clone(),
            Err(_) => Arc::from(""),
        }
    }

    pub(crate) fn stop(&self) {
        self.stops.fetch_add(1, Ordering::SeqCst);
    }

    /// Returns how often stop was asked for.
    pub(crate) fn stops(&self) -> u64 {
        self.stops.load(Ordering::SeqCst)
    }

    /// Counts a page that has opened; it counts as closed when the result is dropped.
    pub(crate) fn viewer(self: &Arc<Self>) -> Viewer {
        self.viewers.fetch_add(1, Ordering::SeqCst);
        Viewer(self.clone())
    }

    pub(crate) fn viewers(&self) -> usize {
        self.viewers.load(Ordering::SeqCst)
    }

    /// Gives an order to the line and returns the answer.
    pub(crate) async fn ask(&self, action: Action) -> Answer {
        let (answer, result) = oneshot::channel();
        match self.orders.try_send(Order { action, answer }) {
            Ok(()) => result
                .await
                .unwrap_or_else(|_| Err("The line to the rig has ended.".into())),
            Err(TrySendError::Full(_)) => {
                Err("Too many orders wait for the rig; try again in a moment.".into())
            }
            Err(TrySendError::Disconnected(_)) => Err("The line to the rig has ended.".into()),
        }
    }
}

/// A page that is open.
pub(crate) struct Viewer(Arc<Hub>);

impl Drop for Viewer {
    fn drop(&mut self) {
        self.0.viewers.fetch_sub(1, Ordering::SeqCst);
    }
}
