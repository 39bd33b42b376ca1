//! What the service has from systemd, and tells it. Everywhere else this does nothing.

mod sockets;
mod watchdog;

pub use sockets::{InheritError, Inherited};
pub use watchdog::Health;

use sd_notify::NotifyState;

/// Tells systemd that the service is ready.
pub fn ready() {
    tell(&[NotifyState::Ready]);
}

/// Tells systemd that the configuration is being read again; [`ready`] ends that.
pub fn reloading() {
    match NotifyState::monotonic_usec_now() {
        Ok(now) => tell(&[NotifyState::Reloading, now]),
        Err(error) => tracing::debug!(%error, "no clock for systemd"),
    }
}

/// Tells systemd that the service comes to its end.
pub fn stopping() {
    tell(&[NotifyState::Stopping, NotifyState::Status("stopping")]);
}

/// Feeds systemd's watchdog for as long as the service is well, and keeps `systemctl status`
/// up to date. Never returns; meant for a task of the runtime that serves the API.
pub async fn keep_alive(health: Health) {
    let watchdog = sd_notify::watchdog_enabled();
    watchdog::run(watchdog::interval(watchdog), move || health.look(), tell).await;
}

fn tell(states: &[NotifyState<'_>]) {
    // Without systemd there is nobody to tell, and that is no error.
    if let Err(error) = sd_notify::notify(states) {
        tracing::debug!(%error, "cannot tell systemd");
    }
}
