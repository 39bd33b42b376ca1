//! Lets programs that are not ours judge what the service sends: mosquitto, a broker, and OpenSSH's
//! server.

use anyhow::Result;

use crate::{apt, shell};

/// The tests that `cargo test` skips where there is no broker and no server of OpenSSH: messages and
/// states over TLS with a password, a broker that is away, a service that is killed; copies of
/// results by SFTP.
pub(crate) fn judge() -> Result<()> {
    apt::need(&[
        // Debian keeps the broker itself out of the path of those who are not root.
        ("mosquitto_passwd", "mosquitto"),
        ("mosquitto_sub", "mosquitto-clients"),
        ("sftp", "openssh-client"),
        ("sshd", "openssh-server"),
    ])?;
    // Else one that cannot be found would be no failure. The whole workspace, as it was built.
    let needed = ["RELIEF_NEEDS_BROKER", "RELIEF_NEEDS_SSHD"].map(|name| (name, "1".to_owned()));
    let words = ["test", "--release", "--workspace", "--test", "service"];
    let tests = ["--", "brokers", "uploads"];
    shell::run_with("cargo", &[&words[..], &tests[..]].concat(), &needed)
}
