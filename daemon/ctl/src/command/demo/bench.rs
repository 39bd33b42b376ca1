//! The bench: a simulated scanner on a pseudo-terminal and a private service before it.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use reliefd::{Config, Daemon};
use sim_scanner::config::Object;
use sim_scanner::device::DeviceSettings;
use sim_scanner::endpoint::pty::{self, PtyServer};
use sim_scanner::line::LineFaults;
use sim_scanner::preset::{self, Overrides, Preset};
use sim_scanner::scene::{Body, Mesh, Scene};
use sim_scanner::source::Source;
use tempfile::TempDir;

use super::Args;
use crate::failure::Failure;
use crate::service::{Client, Endpoint};

/// Fast enough not to bore, slow enough to be watched.
const LINE_RATE_HZ: f64 = 60.0;

/// A simulated scanner and a private service. Everything it keeps lies in a temporary
/// directory, which goes when the bench goes.
pub(super) struct Bench {
    daemon: Daemon,
    scanner: PtyServer,
    kept: TempDir,
}

impl Bench {
    /// Sets everything up; the scanner then waits for a scan.
    pub(super) async fn set_up(args: &Args) -> Result<Self, Failure> {
        let source = source(args)?;
        let kept = tempfile::Builder::new()
            .prefix("relief-demo-")
            .tempdir()
            .map_err(|error| Failure::at("cannot make a temporary directory", &error))?;
        let device = DeviceSettings {
            line_rate_hz: Some(LINE_RATE_HZ),
            ..DeviceSettings::default()
        };
        let scanner = pty::serve(source, device, args.seed, &LineFaults::default(), None)
            .map_err(|error| Failure::at("cannot start the simulated scanner", &error))?;
        let mut config = Config::default();
        config.service.socket = kept.path().join("reliefd.sock");
        config.service.state_dir = kept.path().join("state");
        config.service.spool_dir = kept.path().join("spool");
        config.scanner.port = scanner.port().to_owned();
        let daemon = Daemon::start(config)
            .await
            .map_err(|error| Failure::at("cannot start the private service", &error))?;
        Ok(Self {
            daemon,
            scanner,
            kept,
        })
    }

    /// Speaks to the service.
    pub(super) fn client(&self) -> Client {
        Client::new(Endpoint::Socket(self.daemon.socket().to_owned()))
    }

    /// The pseudo-terminal between service and scanner.
    pub(super) fn port(&self) -> &Path {
        self.scanner.port()
    }

    /// Ends the service in good order, then the scanner, then removes what they kept.
    pub(super) async fn clear(self) {
        self.daemon.shutdown().await;
        drop(self.scanner);
        // A leftover in the temporary directory is not worth a failure.
        let _ = self.kept.close();
    }
}

/// The scanner of the paper before the object.
fn source(args: &Args) -> Result<Source, Failure> {
    let model = Preset::Paper;
    let scene = match preset::object(&args.object, model.material()) {
        Some(scene) => scene,
        None => Scene::new(
            vec![Body::Mesh(Box::new(mesh(&args.object)?))],
            model.material(),
        ),
    };
    let overrides = Overrides {
        noise_mm: args.noise_mm,
        outliers: args.outliers,
        mixed: args.mixed,
        dropouts: args.dropouts,
        glare: args.glare,
        glare_width_deg: args.glare_width_deg,
        ..Overrides::default()
    };
    let (scanner, proposed) = model
        .set_up(scene, &overrides, args.seed)
        .map_err(|error| Failure::Usage(error.to_string()))?;
    Ok(Source::Simulated {
        scanner: Box::new(scanner),
        proposed,
    })
}

fn mesh(object: &str) -> Result<Mesh, Failure> {
    if !object.to_ascii_lowercase().ends_with(".stl") {
        return Err(Failure::Usage(format!(
            "there is no object `{object}`; known are {} and files ending in .stl",
            Object::BUILT_IN.join(", ")
        )));
    }
    let file =
        File::open(object).map_err(|error| Failure::at(format!("cannot read {object}"), &error))?;
    Mesh::read_stl(&mut BufReader::new(file)).map_err(|error| Failure::at(object, &error))
}
