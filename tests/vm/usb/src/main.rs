//! Both drivers against USB devices on a real kernel: this program is the init of a virtual
//! machine that `cargo xtask vm usb` boots.
//!
//! The devices are the simulator's (through `vhci_hcd`, by a pair of sockets or over the
//! network) and, so that our idea of USB is held against somebody else's, the kernel's own
//! gadgets (through `dummy_hcd`). Whatever the way, a scan must bring the columns that it
//! brings in memory, to the bit.

mod boot;
mod checks;
mod client;
mod gadget;
mod memory;
mod scan;
mod throughput;

use std::process::ExitCode;
use std::time::Instant;

use checks::Check;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(role) = arguments.get(1).filter(|_| std::process::id() != 1) {
        return client::run(role, arguments.get(2).map(String::as_str));
    }
    if std::process::id() != 1 {
        eprintln!("this is the init of a virtual machine: run `cargo xtask vm usb`");
        return ExitCode::from(2);
    }
    let failed = match boot::boot() {
        Ok(()) => run_all(),
        Err(error) => {
            println!("FAILED  boot: {error:#}");
            1
        }
    };
    // The host looks for this line: without it, the machine has not come to its end.
    println!("GUEST-FAILED {failed}");
    boot::power_off()
}

/// Runs every check, whatever became of the one before; gives the number of failures.
fn run_all() -> usize {
    let mut failed = 0;
    let mut checks: Vec<Check> = Vec::new();
    if !boot::is_asked_for(throughput::ASKED_FOR) {
        checks.extend(checks::bulk::CHECKS);
        checks.extend(checks::serial::CHECKS);
        checks.extend(checks::network::CHECKS);
        checks.extend(checks::gadgets::CHECKS);
        // From here on udev runs, and changes what the checks before rely on.
        checks.extend(checks::udev::CHECKS);
    }
    checks.push(("throughput", throughput::table));
    for (name, check) in checks {
        let start = Instant::now();
        match check() {
            Ok(()) => println!("ok      {name} ({:.1} s)", start.elapsed().as_secs_f64()),
            Err(error) => {
                failed += 1;
                println!("FAILED  {name}: {error:#}");
            }
        }
    }
    failed
}
