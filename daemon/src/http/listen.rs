//! Where the API is offered.

use std::io;
use std::net::SocketAddr;
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::path::{Path, PathBuf};

use nix::unistd::Group;
use tokio::net::{TcpListener, UnixListener, UnixSocket};

use crate::config::ServiceConfig;

/// Connections that may wait to be taken.
const BACKLOG: u32 = 128;

/// The API cannot be offered.
#[derive(Debug, thiserror::Error)]
pub enum ListenError {
    /// Another service is there.
    #[error("another reliefd answers on {}: stop it, or set service.socket to another path", path.display())]
    InUse {
        /// The socket.
        path: PathBuf,
    },
    /// Something else is there.
    #[error("{} exists and is no socket: set service.socket to another path", path.display())]
    NotASocket {
        /// The path.
        path: PathBuf,
    },
    /// The system refuses the socket.
    #[error(
        "cannot make the socket {}: {source}; its folder must exist and be writable for the \
         user of reliefd",
        path.display()
    )]
    Socket {
        /// The socket.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// There is no such group.
    #[error(
        "there is no group {group} (service.socket_group): make it (groupadd --system {group}), \
         or name one that is there"
    )]
    NoSuchGroup {
        /// The group.
        group: String,
    },
    /// The group cannot be given the socket.
    #[error(
        "cannot give the socket {} to the group {group} (service.socket_group): {source}; make \
         the user of reliefd a member of that group (usermod --append --groups {group} USER), \
         then start it anew",
        path.display()
    )]
    Group {
        /// The socket.
        path: PathBuf,
        /// The group.
        group: String,
        /// What the system says.
        source: io::Error,
    },
    /// The unit that this process runs in has no network.
    #[error(
        "cannot listen on {address}: reliefd.service has no network; remove service.listen and \
         let reliefd.socket listen there (drop-in loopback.conf, see the operator's guide)"
    )]
    NoNetwork {
        /// The address.
        address: SocketAddr,
    },
    /// The system refuses the address.
    #[error("cannot listen on {address}: {source}; set service.listen to a free port")]
    Address {
        /// The address.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
}

/// Makes the socket, in place of one that a dead service left behind.
pub(crate) async fn bind_socket(config: &ServiceConfig) -> Result<UnixListener, ListenError> {
    let path = config.socket.as_path();
    let failed = |source| ListenError::Socket {
        path: path.to_owned(),
        source,
    };
    let group = config.socket_group.as_deref().map(find_group).transpose()?;
    if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    make_room(path).await?;
    let socket = UnixSocket::new_stream().map_err(failed)?;
    socket.bind(path).map_err(failed)?;
    // Before anybody can connect: until it listens, the socket refuses everyone.
    if let Some(group) = group {
        std::os::unix::fs::chown(path, None, Some(group.gid.as_raw())).map_err(|source| {
            ListenError::Group {
                path: path.to_owned(),
                group: group.name,
                source,
            }
        })?;
    }
    let mode = std::fs::Permissions::from_mode(config.socket_mode);
    std::fs::set_permissions(path, mode).map_err(failed)?;
    socket.listen(BACKLOG).map_err(failed)
}

fn find_group(name: &str) -> Result<Group, ListenError> {
    // A directory of users that does not answer is no reason to let others in, or to guess.
    Group::from_name(name)
        .ok()
        .flatten()
        .ok_or_else(|| ListenError::NoSuchGroup { group: name.into() })
}

/// Removes a socket behind which nobody is; refuses whatever else is there.
async fn make_room(path: &Path) -> Result<(), ListenError> {
    let failed = |source| ListenError::Socket {
        path: path.to_owned(),
        source,
    };
    match path.symlink_metadata() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(failed(error)),
        Ok(metadata) if !metadata.file_type().is_socket() => {
            return Err(ListenError::NotASocket {
                path: path.to_owned(),
            });
        }
        Ok(_) => {}
    }
    match tokio::net::UnixStream::connect(path).await {
        // Only a refusal proves that nobody is behind it.
        Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => {
            std::fs::remove_file(path).map_err(failed)
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(failed(error)),
        Ok(_) => Err(ListenError::InUse {
            path: path.to_owned(),
        }),
    }
}

/// Listens on a loopback address; the configuration has refused all others.
pub(crate) async fn bind_loopback(address: SocketAddr) -> Result<TcpListener, ListenError> {
    TcpListener::bind(address).await.map_err(|source| {
        match rustix::io::Errno::from_io_error(&source) {
            Some(rustix::io::Errno::AFNOSUPPORT) => ListenError::NoNetwork { address },
            _ => ListenError::Address { address, source },
        }
    })
}
