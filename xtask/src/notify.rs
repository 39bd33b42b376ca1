//! Lets a broker that is not ours, mosquitto, and its client judge what the service publishes.

use anyhow::Result;

use crate::{apt, shell};

/// The tests that `cargo test` skips where there is no broker: messages and states over TLS with a
/// password, a broker that is away, a service that is killed.
pub(crate) fn judge() -> Result<()> {
    apt::need(&[
        // Debian keeps the broker itself out of the path of those who are not root.
        ("mosquitto_passwd", "mosquitto"),
        ("mosquitto_sub", "mosquitto-clients"),
    ])?;
    // Else a broker that cannot be found would be no failure. The whole workspace, as it was built.
    let needed = [("RELIEF_NEEDS_BROKER", "1".to_owned())];
    let words = ["test", "--release", "--workspace", "--test", "service"];
    shell::run_with("cargo", &[&words[..], &["brokers"]].concat(), &needed)
}
