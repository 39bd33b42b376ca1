//! Taking over a changed configuration while the service runs.

use super::Config;

/// What became of a reload.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Reloaded {
    /// Sections that changed and hold from now on: for scans and reruns begun later.
    pub applied: Vec<&'static str>,
    /// Sections that changed but only hold after a restart.
    pub needs_restart: Vec<&'static str>,
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
                    outcome.applied.push(stringify!($section));
                }
            )*};
        }
        macro_rules! leave {
            ($($section:ident),*) => {$(
                if self.$section != new.$section {
                    outcome.needs_restart.push(stringify!($section));
                }
            )*};
        }
        take!(
            scan,
            journal,
            storage,
            regrid,
            segment,
            reconstruct,
            deliverables
        );
        leave!(service, http, scanner, queue);
        if self.log.level != new.log.level {
            merged.log.level.clone_from(&new.log.level);
            outcome.applied.push("log");
        }
        if self.log.format != new.log.format {
            outcome.needs_restart.push("log.format");
        }
        (merged, outcome)
    }
}
