//! A device on USB, without hardware: over USB/IP.
//!
//! Either a server that any host attaches to (`usbip attach -r HOST -b 1-1`), or straight
//! into this machine's `vhci_hcd`. The host sees a real USB device: transfers wait for data,
//! are cancelled, endpoints halt, and the plug can be pulled at any time.
//!
//! `wire` is what goes over the connection, `descriptors` what the device says of itself,
//! `function` what it does with transfers, `worker` the thread that joins all this to the
//! device.

mod connection;
mod descriptors;
mod function;
mod vhci;
mod wire;
mod worker;

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use thiserror::Error;

pub use descriptors::Personality;
pub use vhci::VhciError;

use crate::control::{Control, Shared};
use crate::device::{Device, DeviceSettings};
use crate::line::LineFaults;
use crate::source::Source;
use descriptors::Descriptors;
use function::Function;
use worker::Worker;

/// Where the device is offered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Attachment {
    /// To whoever connects to this address and asks for it, one host at a time.
    Network(SocketAddr),
    /// To this machine, through its `vhci_hcd`; needs root.
    ThisMachine,
}

/// Why a USB device cannot be offered.
#[derive(Debug, Error)]
pub enum UsbError {
    /// The address cannot be listened on.
    #[error("cannot listen on {address}: {source}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// Why not.
        source: io::Error,
    },
    /// This machine does not take the device.
    #[error(transparent)]
    Vhci(#[from] VhciError),
    /// The thread that serves cannot be started.
    #[error("cannot start serving: {0}")]
    Thread(#[source] io::Error),
}

/// A device that is served until this is dropped, when its plug is pulled.
#[derive(Debug)]
pub struct UsbServer {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    address: Option<SocketAddr>,
}

/// Offers a device on USB.
///
/// # Errors
/// [`UsbError`] says what stands in the way.
pub fn serve(
    source: Source,
    settings: DeviceSettings,
    seed: u64,
    faults: &LineFaults,
    personality: Personality,
    attachment: Attachment,
) -> Result<UsbServer, UsbError> {
    let descriptors = Descriptors::new(personality, &settings.model, &settings.serial);
    let (listener, address) = match attachment {
        Attachment::Network(address) => {
            let failed = |source| UsbError::Listen { address, source };
            let listener = TcpListener::bind(address).map_err(failed)?;
            listener.set_nonblocking(true).map_err(failed)?;
            let address = listener.local_addr().map_err(failed)?;
            (Some(listener), Some(address))
        }
        Attachment::ThisMachine => (None, None),
    };
    let (waker, woken) = UnixStream::pair().map_err(UsbError::Thread)?;
    waker.set_nonblocking(true).map_err(UsbError::Thread)?;
    woken.set_nonblocking(true).map_err(UsbError::Thread)?;
    let device = Device::new(source, settings, seed, Duration::ZERO);
    let shared = Shared::new(device, waker, Instant::now());
    let mut worker = Worker::new(
        woken,
        Arc::clone(&shared),
        Function::new(descriptors),
        faults,
        listener,
    );
    if attachment == Attachment::ThisMachine {
        // The first time here, so that whoever started this learns why it does not work.
        worker.attach_to_this_machine()?;
    }
    let mut server = UsbServer {
        shared,
        thread: None,
        address,
    };
    let thread = std::thread::Builder::new()
        .name("sim-scanner".into())
        .spawn(move || worker.run())
        .map_err(UsbError::Thread)?;
    server.thread = Some(thread);
    Ok(server)
}

impl UsbServer {
    /// The address at which hosts may attach the device, if it is offered on the network.
    #[must_use]
    pub fn address(&self) -> Option<SocketAddr> {
        self.address
    }

    /// A hand on the device.
    #[must_use]
    pub fn control(&self) -> Control {
        Control::new(Arc::clone(&self.shared))
    }
}

impl Drop for UsbServer {
    fn drop(&mut self) {
        self.shared.lock().ended = true;
        self.shared.wake();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        self.shared.notify();
    }
}
