//! What is checked, in this order.

mod hooks;
mod life;
mod package;
mod service;
mod webhooks;
mod worker;

use anyhow::Result;

use crate::bench::Bench;

pub(crate) struct Check {
    pub(crate) name: &'static str,
    pub(crate) takes_long: bool,
    pub(crate) run: fn(&mut Bench) -> Result<()>,
}

const fn check(name: &'static str, run: fn(&mut Bench) -> Result<()>) -> Check {
    Check {
        name,
        takes_long: false,
        run,
    }
}

const fn long(name: &'static str, run: fn(&mut Bench) -> Result<()>) -> Check {
    Check {
        name,
        takes_long: true,
        run,
    }
}

pub(crate) fn all() -> [Check; 21] {
    [
        check("package: installed, enabled, started", package::install),
        check("service: in its sandbox", service::sandbox),
        check(
            "scanner: plugged in for the first time, under the running service",
            life::first_plug,
        ),
        check(
            "devices: the scanner's alone, from inside the sandbox",
            service::devices,
        ),
        check("scan: through the sandbox, to the CAD file", life::scan),
        check("journal: fields of their own", service::journal),
        check(
            "killed in mid-scan: started anew, the scan goes on",
            life::killed,
        ),
        check(
            "hung in mid-scan: laser off, the watchdog fires, the scan goes on",
            life::hung,
        ),
        check("cable pulled in mid-scan, and put back", life::cable),
        check(
            "stopped in mid-scan: laser off, columns kept",
            life::stopped,
        ),
        check("socket: a client starts the service", service::activation),
        long(
            "socket: a loopback address, and no network",
            service::loopback,
        ),
        long(
            "webhooks: a closed network is told of, network.conf opens it",
            webhooks::drop_in,
        ),
        long(
            "hooks and uploads: confined within the sandbox",
            hooks::confined,
        ),
        long(
            "worker: a job goes to it by way of a NATS server",
            worker::elsewhere,
        ),
        long(
            "configuration: read again; unsound, not tried again",
            service::configuration,
        ),
        check(
            "scanner with an interface of its own: scan, cable pulled and put back",
            life::bulk,
        ),
        check(
            "package: upgraded in mid-scan, state kept",
            package::upgrade,
        ),
        long(
            "package: removed and installed again, state kept",
            package::reinstall,
        ),
        check("package: purged, nothing left", package::purge),
        long("package: installed anew after the purge", package::install),
    ]
}
