//! Keeping a device awake.
//!
//! The kernel may suspend a device in which nothing goes on, and many firmwares do not
//! come back from that. A udev rule switches it off; here it is made sure of.

use std::path::Path;

const CONTROL: &str = "power/control";

/// Whether the kernel may put the device to sleep.
pub(super) fn may_sleep(sysfs: &Path) -> bool {
    std::fs::read_to_string(sysfs.join(CONTROL)).is_ok_and(|control| control.trim() == "auto")
}

/// Forbids sleep, if this user may; the interface's claim keeps the device awake as well, so
/// that this matters between two programs only.
pub(super) fn keep_awake(sysfs: &Path) {
    if !may_sleep(sysfs) {
        return;
    }
    match std::fs::write(sysfs.join(CONTROL), "on") {
        Ok(()) => tracing::debug!(device = %sysfs.display(), "autosuspend switched off"),
        Err(error) => tracing::debug!(
            device = %sysfs.display(), %error,
            "autosuspend stays on: the udev rules for scanners are not installed"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_that_may_sleep_is_kept_awake() {
        let folder = std::env::temp_dir().join(format!("relief-power-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("power")).unwrap();
        let control = folder.join(CONTROL);
        std::fs::write(&control, "auto\n").unwrap();
        assert!(may_sleep(&folder));
        keep_awake(&folder);
        assert!(!may_sleep(&folder));
        assert_eq!(std::fs::read_to_string(&control).unwrap(), "on");
        std::fs::remove_dir_all(&folder).unwrap();
        // Gone, as after an unplugging: nothing to keep awake, and no harm done.
        keep_awake(&folder);
        assert!(!may_sleep(&folder));
    }
}
