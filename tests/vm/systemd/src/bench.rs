//! The bench: a simulated scanner that is plugged in, and what is done with it through `relief`.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use sim_scanner::config::SimConfig;
use sim_scanner::control::Control;
use sim_scanner::endpoint::usb::{Attachment, Personality, UsbServer};
use sim_scanner::preset::Overrides;

use crate::system::{self, LIMIT, SERVICE, number, run, try_run, wait};

/// The name that the udev rules give the scanner.
pub(crate) const PORT: &str = "/dev/relief/scanner-SIM-0001";

/// Kinds of USB serial ports that the service may use, as `/proc/devices` names them.
pub(crate) const SERIAL_PORTS: [&str; 2] = ["ttyACM", "ttyUSB"];

pub(crate) const COLUMNS: u32 = 40;
const SAMPLES: u32 = 48;

/// Slow enough for things to happen in the midst of a scan, on any machine.
const LINE_RATE_HZ: f64 = 6.0;

/// Of a scan in whose midst something is to happen.
const COLUMNS_BEFORE: u64 = 5;

pub(crate) struct Bench {
    /// None until it is first plugged in.
    server: Option<UsbServer>,
    /// The first whole scan, which must survive everything.
    pub(crate) first: Option<String>,
}

impl Bench {
    /// A machine to which no scanner was ever connected.
    pub(crate) fn new() -> Result<Self> {
        for kind in SERIAL_PORTS {
            ensure!(!system::knows_device(kind)?, "the kernel knows {kind}");
        }
        Ok(Self {
            server: None,
            first: None,
        })
    }

    /// Plugs the scanner in, in place of the one that is, if any.
    pub(crate) fn plug_in(&mut self, personality: Personality) -> Result<()> {
        self.server = None;
        let mut config = SimConfig {
            overrides: Overrides {
                columns: Some(COLUMNS),
                samples: Some(SAMPLES),
                ..Overrides::default()
            },
            seed: 1,
            ..SimConfig::default()
        };
        config.device.line_rate_hz = Some(LINE_RATE_HZ);
        let source = config.source()?;
        let server = config.serve_usb(source, personality, Attachment::ThisMachine)?;
        self.server = Some(server);
        Ok(())
    }

    pub(crate) fn control(&self) -> Result<Control> {
        let server = self.server.as_ref();
        Ok(server.context("the scanner is not plugged in")?.control())
    }

    pub(crate) fn first(&self) -> Result<&str> {
        self.first.as_deref().context("there is no first scan")
    }

    /// A scan is begun, and has some columns on disk; its identity.
    pub(crate) fn amid_a_scan(&self, name: &str) -> Result<String> {
        ready()?;
        let told = relief(&["scan", "--name", name])?;
        let id = text(&told["scan"]["id"])?;
        wait("columns of a new scan", || {
            let scan = scan(&id)?;
            ensure!(!is_over(&scan), "it is over: {scan}");
            Ok(scan["columns"].as_u64() >= Some(COLUMNS_BEFORE))
        })?;
        ensure!(
            self.control()?.snapshot().laser_on,
            "a scan without its laser"
        );
        Ok(id)
    }

    /// The laser goes off; the time that took.
    pub(crate) fn laser_goes_off(&self) -> Result<Duration> {
        let control = self.control()?;
        wait("the laser goes off", || Ok(!control.snapshot().laser_on))
    }

    /// The first scan is still there, whole.
    pub(crate) fn first_is_kept(&self) -> Result<()> {
        self.picture_of(self.first()?).map(drop)
    }

    /// The picture of a scan's heights, in a result that is whole and has a CAD file.
    pub(crate) fn picture_of(&self, id: &str) -> Result<Vec<u8>> {
        let scan = scan(id)?;
        ensure!(scan["state"] == "complete", "{scan}");
        ensure!(scan["columns"] == COLUMNS, "{scan}");
        let out = Path::new("/tmp/fetched");
        if out.exists() {
            std::fs::remove_dir_all(out)?;
        }
        // Holds each file against the manifest.
        run("relief", &["fetch", id, "--output", "/tmp/fetched"])?;
        ensure!(out.join("house.igs").exists(), "no CAD file");
        Ok(std::fs::read(out.join("range.png"))?)
    }
}

/// What a command of `relief` tells.
pub(crate) fn relief(arguments: &[&str]) -> Result<Value> {
    let words = [arguments, &["--json"]].concat();
    let out = run("relief", &words)?;
    serde_json::from_str(&out).with_context(|| out.clone())
}

pub(crate) fn text(value: &Value) -> Result<String> {
    let text = value.as_str().with_context(|| format!("{value}"))?;
    Ok(text.to_owned())
}

pub(crate) fn scan(id: &str) -> Result<Value> {
    let list = relief(&["scans"])?;
    list["scans"]
        .as_array()
        .and_then(|scans| scans.iter().find(|scan| scan["id"] == id))
        .cloned()
        .with_context(|| format!("the scan {id} is not listed"))
}

pub(crate) fn is_over(scan: &Value) -> bool {
    scan["ended_at"].is_string()
}

/// Waits until the service has the scanner, and nothing else to do with it.
pub(crate) fn ready() -> Result<Value> {
    let mut status = Value::Null;
    wait("the scanner is ready", || {
        let (well, out, err) = try_run("relief", &["status", "--json"])?;
        if !well {
            bail!("{err}");
        }
        status = serde_json::from_str(&out).with_context(|| out.clone())?;
        Ok(status["scanner"]["link"] == "ready" && status["scan"].is_null())
    })?;
    Ok(status)
}

/// Waits until systemd has put another process in this one's place.
pub(crate) fn replaced(pid: u32, restarts: u32) -> Result<Duration> {
    let took = wait("systemd starts the service anew", || {
        Ok(number("NRestarts")? > restarts && system::is_active(SERVICE)?)
    })?;
    ensure!(number("MainPID")? != pid, "it is the same process");
    Ok(took)
}

/// Waits until a path is there, or is not.
pub(crate) fn wait_for_path(path: &str, there: bool) -> Result<()> {
    let what = format!(
        "{path} {} within {LIMIT:?}",
        if there { "comes" } else { "goes" }
    );
    wait(&what, || Ok(system::exists(path) == there)).map(drop)
}
