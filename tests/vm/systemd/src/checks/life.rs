//! A hard life: scans, and what may come between.

use std::fs;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use rustix::process::{Pid, Signal, kill_process};
use sim_scanner::endpoint::usb::Personality;

use crate::bench::{
    Bench, COLUMNS, PORT, SERIAL_PORTS, is_over, ready, relief, replaced, scan as scan_of, text,
    wait_for_path,
};
use crate::system::{
    SERVICE, SOCKET, id_of, knows_device, number, owner, property, systemctl, wait,
};

const CONFIGURATION: &str = "/etc/relief/reliefd.toml";

/// The service is not started anew between this and the first scan: it must be able to use a
/// port of a kind that no device had when it started.
pub(super) fn first_plug(bench: &mut Bench) -> Result<()> {
    configure()?;
    bench.plug_in(Personality::CdcAcm)?;
    wait_for_path(PORT, true)?;
    let device = owner(PORT)?;
    ensure!(
        (device.0, device.2) == (0o660, id_of("/etc/group", "relief")?),
        "{device:?}"
    );
    for kind in SERIAL_PORTS {
        ensure!(knows_device(kind)?, "{kind} is unknown to the kernel");
    }
    ready().map(drop)
}

fn configure() -> Result<()> {
    let configuration = fs::read_to_string(CONFIGURATION)?
        .replace("\"/dev/ttyUSB0\"", &format!("{PORT:?}"))
        // An emulated machine may have little of its host.
        .replace("# request_timeout_ms = 300", "request_timeout_ms = 1000")
        .replace("# dead_man_ms = 2000", "dead_man_ms = 5000");
    ensure!(configuration.contains(PORT));
    fs::write(CONFIGURATION, configuration)?;
    systemctl(&["restart", SERVICE])?;
    Ok(())
}

pub(super) fn scan(bench: &mut Bench) -> Result<()> {
    let told = relief(&["scan", "--name", "house", "--wait"])?;
    ensure!(told["scan"]["state"] == "complete", "{told}");
    ensure!(told["job"]["state"] == "done", "{told}");
    bench.first = Some(text(&told["scan"]["id"])?);
    ensure!(!bench.control()?.snapshot().laser_on, "the laser is on");
    bench.first_is_kept()
}

pub(super) fn killed(bench: &mut Bench) -> Result<()> {
    let id = bench.amid_a_scan("killed")?;
    let (pid, restarts) = (number("MainPID")?, number("NRestarts")?);
    signal(pid, Signal::KILL)?;
    let dark = bench.laser_goes_off()?;
    let took = replaced(pid, restarts)?;
    println!(
        "        laser off after {}, anew after {}",
        s(dark),
        s(took)
    );
    bench.first_is_kept()?;
    goes_on(bench, &id)
}

pub(super) fn hung(bench: &mut Bench) -> Result<()> {
    let id = bench.amid_a_scan("hung")?;
    let (pid, restarts) = (number("MainPID")?, number("NRestarts")?);
    signal(pid, Signal::STOP)?;
    // By the scanner itself, long before systemd takes notice.
    let dark = bench.laser_goes_off()?;
    ensure!(number("MainPID")? == pid, "it was replaced already");
    let took = replaced(pid, restarts)?;
    println!(
        "        laser off after {}, anew {} later",
        s(dark),
        s(took)
    );
    let said = crate::system::journal(&["--unit", SERVICE, "_PID=1"])?;
    let fired = |entry: &serde_json::Value| {
        let message = entry["MESSAGE"].as_str().unwrap_or_default();
        message.contains("Watchdog timeout")
    };
    ensure!(
        said.iter().any(fired),
        "systemd does not tell of its watchdog"
    );
    bench.first_is_kept()?;
    goes_on(bench, &id)
}

/// A scan that was cut short goes on by itself, to its end.
fn goes_on(bench: &Bench, id: &str) -> Result<()> {
    wait("the scan that was under way comes to an end", || {
        Ok(is_over(&scan_of(id)?))
    })?;
    let scan = scan_of(id)?;
    ensure!(
        scan["state"] == "complete" && scan["columns"] == COLUMNS,
        "it did not go on: {scan}"
    );
    bench.laser_goes_off()?;
    Ok(())
}

pub(super) fn cable(bench: &mut Bench) -> Result<()> {
    pulled_and_put_back(bench, "cable")?;
    let told = relief(&["scan", "--name", "after", "--wait"])?;
    ensure!(told["scan"]["columns"] == COLUMNS, "{told}");
    Ok(())
}

/// From here on the scanner has an interface of its own: no driver of the kernel's, and another
/// kind of device node that the sandbox must let through.
pub(super) fn bulk(bench: &mut Bench) -> Result<()> {
    let configuration = fs::read_to_string(CONFIGURATION)?;
    let bulk = configuration
        .replace("transport = \"serial\"", "transport = \"usb\"")
        // Of a serial port alone, and refused with any other.
        .replace("\nport =", "\n# port =")
        .replace("\nbaud =", "\n# baud =");
    ensure!(!bulk.contains(&format!("\nport = {PORT:?}")));
    fs::write(CONFIGURATION, bulk)?;
    systemctl(&["restart", SERVICE])?;
    let gone = relief(&["status"])?;
    ensure!(gone["scanner"]["link"] != "ready", "{gone}");
    bench.plug_in(Personality::Vendor)?;
    wait_for_path(PORT, false)?;
    ready()?;
    let told = relief(&["scan", "--name", "house", "--wait"])?;
    ensure!(told["job"]["state"] == "done", "{told}");
    let id = text(&told["scan"]["id"])?;
    ensure!(
        bench.picture_of(&id)? == bench.picture_of(bench.first()?)?,
        "it measured otherwise than over the serial port"
    );
    pulled_and_put_back(bench, "bulk")
}

/// The cable is pulled in the midst of a scan, and put back.
fn pulled_and_put_back(bench: &Bench, name: &str) -> Result<()> {
    let id = bench.amid_a_scan(name)?;
    let (pid, restarts) = (number("MainPID")?, number("NRestarts")?);
    bench.control()?.unplug();
    bench.laser_goes_off()?;
    wait("the service notices", || {
        let status = relief(&["status"])?;
        Ok(status["scanner"]["link"] != "scanning")
    })?;
    ensure!(scan_of(&id)?["columns"].as_u64() > Some(0));
    bench.control()?.replug();
    goes_on(bench, &id)?;
    ready()?;
    ensure!(
        (number("MainPID")?, number("NRestarts")?) == (pid, restarts),
        "it was replaced"
    );
    Ok(())
}

pub(super) fn stopped(bench: &mut Bench) -> Result<()> {
    let id = bench.amid_a_scan("stopped")?;
    systemctl(&["stop", SOCKET, SERVICE])?;
    ensure!(!bench.control()?.snapshot().laser_on, "the laser is on");
    ensure!(property("Result")? == "success", "{}", property("Result")?);
    systemctl(&["start", SERVICE])?;
    bench.first_is_kept()?;
    let scan = scan_of(&id)?;
    ensure!(is_over(&scan), "{scan}");
    ensure!(scan["columns"].as_u64() > Some(0), "{scan}");
    Ok(())
}

fn signal(pid: u32, signal: Signal) -> Result<()> {
    let pid = i32::try_from(pid).ok().and_then(Pid::from_raw);
    Ok(kill_process(pid.context("no process")?, signal)?)
}

fn s(time: Duration) -> String {
    format!("{:.1} s", time.as_secs_f64())
}
