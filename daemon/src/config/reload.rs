//! Taking over a changed configuration while the service runs.

use super::{Config, ScannerConfig};

/// What became of a reload.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Reloaded {
    /// Sections that changed and hold from now on: for what begins later.
    pub applied: Vec<String>,
    /// Sections that changed but only hold after a restart.
    pub needs_restart: Vec<String>,
}

impl Config {
    /// This configuration with those sections of `new` that may change in service.
    #[must_use]
    pub fn reloaded(&self, new: &Self) -> (Self, Reloaded) {
        let mut merged = self.clone();
        let mut outcome = Reloaded::default();
        macro_rules! take {
            ($($section:ident),*) => {$(
                if self.$section != new.$section {
                    merged.$section = new.$section.clone();
                    outcome.applied.push(stringify!($section).to_owned());
                }
            )*};
        }
        macro_rules! leave {
            ($($section:ident),*) => {$(
                if self.$section != new.$section {
                    outcome.needs_restart.push(stringify!($section).to_owned());
                }
            )*};
        }
        take!(
            scan,
            journal,
            storage,
            regrid,
            segment,
            fill,
            reconstruct,
            deliverables,
            webhooks,
            mqtt,
            mail,
            hooks,
            uploads
        );
        leave!(service, http, discovery, queue, nats, traces);
        merged.scanner = reloaded_scanner("scanner", &self.scanner, &new.scanner, &mut outcome);
        for (name, scanner) in &self.scanners {
            let section = format!("scanners.{name}");
            match new.scanners.get(name) {
                Some(new) => {
                    let scanner = reloaded_scanner(&section, scanner, new, &mut outcome);
                    merged.scanners.insert(name.clone(), scanner);
                }
                None => outcome.needs_restart.push(section),
            }
        }
        for name in new.scanners.keys() {
            if !self.scanners.contains_key(name) {
                outcome.needs_restart.push(format!("scanners.{name}"));
            }
        }
        if self.log.level != new.log.level {
            merged.log.level.clone_from(&new.log.level);
            outcome.applied.push("log".to_owned());
        }
        if self.log.format != new.log.format {
            outcome.needs_restart.push("log.format".to_owned());
        }
        (merged, outcome)
    }
}

/// A scanner stays attached as it is; what it measures may change.
fn reloaded_scanner(
    section: &str,
    old: &ScannerConfig,
    new: &ScannerConfig,
    outcome: &mut Reloaded,
) -> ScannerConfig {
    let merged = ScannerConfig {
        scan: new.scan,
        ..old.clone()
    };
    if merged != *old {
        outcome.applied.push(format!("{section}.scan"));
    }
    if merged != *new {
        outcome.needs_restart.push(section.to_owned());
    }
    merged
}
