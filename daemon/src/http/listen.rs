//! Where the API is offered.

use std::io;
use std::net::SocketAddr;
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
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
    /// A socket that was handed over lets in users whom the configuration keeps out.
    #[error(
        "the socket {} of reliefd.socket has mode {found:04o}, and service.socket_mode is \
         {wanted:04o}: set SocketMode={wanted:04o} in `systemctl edit reliefd.socket`, then \
         `systemctl restart reliefd.socket`",
        path.display()
    )]
    TooOpen {
        /// The socket.
        path: PathBuf,
        /// Its mode.
        found: u32,
        /// That of the configuration.
        wanted: u32,
    },
    /// A socket that was handed over lets in another group.
    #[error(
        "the socket {} of reliefd.socket is another group's than {group} (service.socket_group): \
         set SocketGroup={group} in `systemctl edit reliefd.socket`, then `systemctl restart \
         reliefd.socket`",
        path.display()
    )]
    OtherGroup {
        /// The socket.
        path: PathBuf,
        /// That of the configuration.
        group: String,
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

/// A socket that was handed over must let in nobody whom the configuration keeps out: its mode and
/// group are those of reliefd.socket, whatever the configuration says.
pub(crate) fn check_handed_over(path: &Path, config: &ServiceConfig) -> Result<(), ListenError> {
    /// Who may write to a socket may connect.
    const MAY_CONNECT: u32 = 0o222;
    const GROUP_MAY_CONNECT: u32 = 0o020;
    let metadata = path.symlink_metadata();
    let metadata = metadata.map_err(|source| ListenError::Socket {
        path: path.to_owned(),
        source,
    })?;
    let found = metadata.mode() & 0o7777;
    if found & MAY_CONNECT & !config.socket_mode != 0 {
        return Err(ListenError::TooOpen {
            path: path.to_owned(),
            found,
            wanted: config.socket_mode,
        });
    }
    if let Some(name) = &config.socket_group
        && found & GROUP_MAY_CONNECT != 0
        && find_group(name)?.gid.as_raw() != metadata.gid()
    {
        return Err(ListenError::OtherGroup {
            path: path.to_owned(),
            group: name.clone(),
        });
    }
    Ok(())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_socket_that_was_handed_over_lets_in_nobody_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("reliefd.sock");
        let _socket = std::os::unix::net::UnixListener::bind(&path).unwrap();
        let own = Group::from_gid(nix::unistd::getegid()).unwrap().unwrap();
        let other = ["root", "daemon"]
            .into_iter()
            .find(|name| *name != own.name);
        let check = |mode, wanted, group: Option<&str>| {
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            let config = ServiceConfig {
                socket_mode: wanted,
                socket_group: group.map(str::to_owned),
                ..ServiceConfig::default()
            };
            check_handed_over(&path, &config).map_err(|error| error.to_string())
        };
        assert_eq!(check(0o660, 0o660, None), Ok(()));
        assert_eq!(check(0o600, 0o660, other), Ok(()), "no group is let in");
        // As it is bound without more ado: readers cannot connect.
        assert_eq!(check(0o755, 0o600, None), Ok(()));
        assert_eq!(check(0o660, 0o660, Some(&own.name)), Ok(()));
        let error = check(0o660, 0o600, None).unwrap_err();
        assert!(error.contains("SocketMode=0600"), "{error}");
        assert!(check(0o666, 0o660, None).is_err());
        let error = check(0o660, 0o660, other).unwrap_err();
        let cure = format!("SocketGroup={}", other.unwrap());
        assert!(error.contains(&cure), "{error}");
    }
}
