//! The installed package where systemd is PID 1: `cargo xtask vm systemd` boots a small Debian
//! that runs this program as a unit of its own.
//!
//! The scanner is the simulator, plugged into the guest's kernel as a USB serial port, so that
//! udev, the unit's sandbox and the driver all see a real device. Each check builds on what the
//! ones before have left, as one day of a bench follows the other.

mod bench;
mod checks;
mod system;

use std::process::ExitCode;
use std::time::{Duration, Instant};

use rustix::system::{RebootCommand, reboot};

use bench::Bench;

fn main() -> ExitCode {
    if !std::path::Path::new("/packages/relief.deb").exists() {
        eprintln!("this runs in a virtual machine: `cargo xtask vm systemd`");
        return ExitCode::from(2);
    }
    let arguments: Vec<String> = std::env::args().collect();
    let short = arguments.iter().any(|argument| argument == "--short");
    let only = arguments
        .iter()
        .position(|argument| argument == "--only")
        .and_then(|at| arguments.get(at + 1));
    let failed = match Bench::new() {
        Ok(mut bench) => run_all(&mut bench, short, only.map(String::as_str)),
        Err(error) => {
            println!("FAILED  bench: {error:#}");
            1
        }
    };
    // The host looks for this line: without it, the machine has not come to its end.
    println!("GUEST-FAILED {failed}");
    // Without a moment's pause the last line may be lost in the serial port.
    std::thread::sleep(Duration::from_millis(500));
    let ended = reboot(RebootCommand::PowerOff);
    println!("the machine does not end: {ended:?}");
    ExitCode::FAILURE
}

/// How many checks come first that all others build on: installed, in its sandbox, plugged in.
const BASIS: usize = 3;

/// Runs every check, whatever became of the one before; gives the number of failures. With `only`,
/// those by whose name it is a word, and those that all build on.
fn run_all(bench: &mut Bench, short: bool, only: Option<&str>) -> usize {
    let mut failed = 0;
    for (number, check) in checks::all().into_iter().enumerate() {
        let is_left_out = match only {
            Some(only) => number >= BASIS && !check.name.contains(only),
            None => short && check.takes_long,
        };
        if is_left_out {
            continue;
        }
        let start = Instant::now();
        let outcome = (check.run)(bench);
        let took = start.elapsed().as_secs_f64();
        match outcome {
            Ok(()) => println!("ok      {} ({took:.1} s)", check.name),
            Err(error) => {
                failed += 1;
                println!("FAILED  {} ({took:.1} s): {error:#}", check.name);
                println!("{}", system::recent_log());
            }
        }
    }
    failed
}
