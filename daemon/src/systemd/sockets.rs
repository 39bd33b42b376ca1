//! Sockets that were bound before this process began: by systemd, for `reliefd.socket`.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::os::unix::net::UnixListener;
use std::path::PathBuf;

use listenfd::ListenFd;

use crate::config::ServiceConfig;
use crate::http::{ListenError, bind_loopback, bind_socket, check_handed_over};

/// What was handed over cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum InheritError {
    /// Neither kind of socket.
    #[error(
        "socket {number} of those handed over by systemd is no listening stream: reliefd.socket \
         may have ListenStream= only"
    )]
    NotAStream {
        /// Which one, from 1.
        number: usize,
    },
    /// More than one Unix socket.
    #[error(
        "systemd handed over two Unix sockets: reliefd.socket may have one ListenStream= with a path"
    )]
    SecondUnix,
    /// More than one address.
    #[error(
        "systemd handed over two addresses: reliefd.socket may have one ListenStream= with an address"
    )]
    SecondTcp,
    /// The API is not for other machines.
    #[error(
        "systemd handed over a socket on {address}: the API is offered on this machine's \
         loopback addresses only; mend ListenStream= in reliefd.socket"
    )]
    NotLoopback {
        /// The address.
        address: SocketAddr,
    },
    /// The system refuses.
    #[error("cannot use a socket handed over by systemd: {0}")]
    System(#[from] io::Error),
}

/// Sockets on which the API is offered in place of those of the configuration.
#[derive(Debug, Default)]
pub struct Inherited {
    pub(crate) unix: Option<(UnixListener, PathBuf)>,
    pub(crate) tcp: Option<TcpListener>,
}

/// Where the API is offered.
#[derive(Debug)]
pub(crate) struct Offered {
    pub(crate) unix: tokio::net::UnixListener,
    pub(crate) socket: PathBuf,
    pub(crate) socket_is_ours: bool,
    pub(crate) tcp: Option<tokio::net::TcpListener>,
    pub(crate) listen: Option<SocketAddr>,
}

impl Inherited {
    /// Takes what was handed over to this process (LISTEN_FDS, LISTEN_PID). A second call
    /// finds nothing.
    ///
    /// # Errors
    /// Any [`InheritError`].
    pub fn take() -> Result<Self, InheritError> {
        let mut handed = ListenFd::from_env();
        let mut inherited = Self::default();
        for index in 0..handed.len() {
            if let Ok(Some(unix)) = handed.take_unix_listener(index) {
                inherited.add_unix(unix)?;
            } else if let Ok(Some(tcp)) = handed.take_tcp_listener(index) {
                inherited.add_tcp(tcp)?;
            } else {
                return Err(InheritError::NotAStream { number: index + 1 });
            }
        }
        Ok(inherited)
    }

    /// What was handed over, and for the rest what the configuration asks for.
    pub(crate) async fn or_bind(self, config: &ServiceConfig) -> Result<Offered, ListenError> {
        let wanted = &config.socket;
        let (unix, socket, socket_is_ours) = match self.unix {
            Some((unix, path)) => {
                if path != *wanted {
                    tracing::warn!(
                        socket = %path.display(), configured = %wanted.display(),
                        "the API's socket is that of reliefd.socket, not service.socket"
                    );
                }
                check_handed_over(&path, config)?;
                let unix = tokio::net::UnixListener::from_std(unix);
                let unix = unix.map_err(|source| ListenError::Socket {
                    path: path.clone(),
                    source,
                })?;
                (unix, path, false)
            }
            None => (bind_socket(config).await?, wanted.clone(), true),
        };
        let tcp = match (self.tcp, config.listen) {
            (Some(tcp), _) => Some(inherited_tcp(tcp)?),
            (None, Some(address)) => Some(bind_loopback(address).await?),
            (None, None) => None,
        };
        let listen = tcp.as_ref().and_then(|tcp| tcp.local_addr().ok());
        Ok(Offered {
            unix,
            socket,
            socket_is_ours,
            tcp,
            listen,
        })
    }

    fn add_unix(&mut self, unix: UnixListener) -> Result<(), InheritError> {
        if self.unix.is_some() {
            return Err(InheritError::SecondUnix);
        }
        unix.set_nonblocking(true)?;
        let address = unix.local_addr()?;
        let path = address.as_pathname().map(PathBuf::from);
        self.unix = Some((unix, path.unwrap_or_default()));
        Ok(())
    }

    fn add_tcp(&mut self, tcp: TcpListener) -> Result<(), InheritError> {
        if self.tcp.is_some() {
            return Err(InheritError::SecondTcp);
        }
        let address = tcp.local_addr()?;
        if !address.ip().to_canonical().is_loopback() {
            return Err(InheritError::NotLoopback { address });
        }
        tcp.set_nonblocking(true)?;
        self.tcp = Some(tcp);
        Ok(())
    }
}

fn inherited_tcp(tcp: TcpListener) -> Result<tokio::net::TcpListener, ListenError> {
    let address = tcp.local_addr();
    let failed = |source| ListenError::Address {
        // One that was handed over has an address.
        address: address.unwrap_or_else(|_| SocketAddr::from(([127, 0, 0, 1], 0))),
        source,
    };
    tokio::net::TcpListener::from_std(tcp).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_loopback_addresses_and_one_of_each_kind() {
        let mut inherited = Inherited::default();
        let open = TcpListener::bind("0.0.0.0:0").unwrap();
        let error = inherited.add_tcp(open).unwrap_err();
        assert!(error.to_string().contains("0.0.0.0"), "{error}");
        for expected in [true, false] {
            let local = TcpListener::bind("127.0.0.1:0").unwrap();
            assert_eq!(inherited.add_tcp(local).is_ok(), expected);
        }
        let folder = tempfile::tempdir().unwrap();
        for (name, expected) in [("first", true), ("second", false)] {
            let unix = UnixListener::bind(folder.path().join(name)).unwrap();
            assert_eq!(inherited.add_unix(unix).is_ok(), expected);
        }
        let (_, path) = inherited.unix.unwrap();
        assert_eq!(path, folder.path().join("first"));
    }

    #[test]
    fn nothing_is_handed_over_to_a_process_of_its_own() {
        let inherited = Inherited::take().unwrap();
        assert!(inherited.unix.is_none() && inherited.tcp.is_none());
    }
}
