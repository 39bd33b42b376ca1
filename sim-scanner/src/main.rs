//! The simulated scanner as a program: offers itself on a pseudo-terminal or on USB, and serves
//! until ended.

use std::io::Write;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1, SIGUSR2};
use signal_hook::iterator::Signals;

use sim_scanner::Vec3;
use sim_scanner::config::{Object, SimConfig, SimError};
use sim_scanner::control::Control;
use sim_scanner::device::DeviceSettings;
use sim_scanner::endpoint::pty::PtyServer;
use sim_scanner::endpoint::usb::{Attachment, Personality, UsbServer};
use sim_scanner::fault::FaultSpec;
use sim_scanner::mount::Mount;
use sim_scanner::preset::{Overrides, Preset};
use sim_scanner::scene::artefacts::Artefact;
use sim_scanner::source::Source;

/// A simulated slide-table laser scanner on a pseudo-terminal or on USB.
///
/// With --pty it makes a pseudo-terminal, links it at LINK, and behaves on it like a scanner
/// on a serial port. With --usbip it is a USB device that hosts attach over the network
/// (`usbip attach -r HOST -b 1-1`), with --usb one of this machine. The signal USR1 pulls
/// the plug (of a pseudo-terminal: all bytes are lost), USR2 puts it back. It serves until it
/// is ended (Ctrl-C, or the TERM signal), when the link or device goes.
#[derive(Debug, Parser)]
#[command(name = "sim-scanner", version)]
struct Cli {
    #[command(flatten)]
    place: Place,

    /// How it shows itself on USB
    #[arg(long, value_enum, default_value = "vendor", conflicts_with = "pty")]
    usb_class: UsbClass,

    /// What stands on the table: house, cylinder, figure, groove; house-on-table,
    /// cylinder-on-table, house-before-plane, which have a background; sphere, spheres, ball-bar,
    /// step-gauge, plate, which are references; or an STL file in mm, which keeps its own
    /// coordinates
    #[arg(long, default_value = "house", value_name = "OBJECT|FILE.stl")]
    object: Object,

    /// Diameter of the reference's spheres, mm
    #[arg(long, value_name = "D", default_value_t = 25.4)]
    diameter_mm: f64,

    /// Where a reference stands in the measuring volume: the centre of each sphere, or the middle
    /// of a gauge or plate, mm
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true)]
    at_mm: Vec<Vec3>,

    /// How a step gauge or plate is turned about x and about y, degrees
    #[arg(long, value_name = "A,B", value_parser = tilt, allow_hyphen_values = true, default_value = "0,0")]
    tilt_deg: (f64, f64),

    /// How the head is mounted against what the device announces, as key=value,...:
    /// angle-offset-deg, angle-scale (a share), range-offset-mm, range-scale, camera-y-mm,
    /// camera-z-mm, plane-about-y-deg, plane-about-z-deg (of the laser plane), table-y-deg,
    /// table-z-deg, table-scale.
    /// Example: angle-offset-deg=0.5,angle-scale=0.005,camera-z-mm=2
    #[arg(
        long,
        default_value = "",
        hide_default_value = true,
        value_name = "SPEC",
        allow_hyphen_values = true
    )]
    mount: Mount,

    /// The scanner to imitate
    #[arg(long, value_enum, default_value = "paper")]
    preset: PresetName,

    /// Send a recorded scan (text, PLY; plain or gzip) instead of measuring an object
    #[arg(long, value_name = "FILE", conflicts_with_all = ["object", "preset"])]
    replay: Option<PathBuf>,

    /// Columns of the proposed scan
    #[arg(long, value_name = "N")]
    columns: Option<u32>,

    /// Samples per column of the proposed scan
    #[arg(long, value_name = "N")]
    samples: Option<u32>,

    /// Distance between the columns of the proposed scan, mm
    #[arg(long, value_name = "P")]
    pitch_mm: Option<f64>,

    /// Seed of noise, outliers and dropouts
    #[arg(long, default_value_t = 1, value_name = "N")]
    seed: u64,

    /// Range noise at normal incidence (1 sigma), mm
    #[arg(long, value_name = "S")]
    noise_mm: Option<f64>,

    /// Probability of an outlier anywhere in the range window
    #[arg(long, value_name = "P")]
    outliers: Option<f64>,

    /// Probability of an outlier before the surface
    #[arg(long, value_name = "P")]
    outliers_one_sided: Option<f64>,

    /// Probability that a run of 3 to 8 outliers starts at a sample
    #[arg(long, value_name = "P")]
    outlier_clusters: Option<f64>,

    /// Probability that a sample whose spot lies on a step edge is mixed
    #[arg(long, value_name = "P")]
    mixed: Option<f64>,

    /// Probability of a lost sample at normal incidence
    #[arg(long, value_name = "P")]
    dropouts: Option<f64>,

    /// Probability of a lost sample where the object's gloss mirrors the beam at the sensor
    #[arg(long, value_name = "P", requires = "glare_width_deg")]
    glare: Option<f64>,

    /// Angle between mirrored beam and sensor over which that fades (1 sigma), degrees
    #[arg(long, value_name = "D", requires = "glare")]
    glare_width_deg: Option<f64>,

    /// Range (or y and z) per count, mm [paper: 0.1]
    #[arg(long, value_name = "C")]
    range_count_mm: Option<f64>,

    /// Distance of the camera from the object's middle, mm [paper: 750]
    #[arg(long, value_name = "D")]
    standoff_mm: Option<f64>,

    /// Scatter of the table's stops, which the encoder reports (1 sigma), mm
    #[arg(long, value_name = "S")]
    jitter_mm: Option<f64>,

    /// Play of the table when it travels backwards, mm
    #[arg(long, value_name = "B")]
    backlash_mm: Option<f64>,

    /// Show the table's top just below the object
    #[arg(long)]
    table_plane: bool,

    /// Show a plane this far behind the object, mm
    #[arg(long, value_name = "D")]
    back_plane_mm: Option<f64>,

    /// Columns per second; 0 or max for as fast as the host grants credit
    #[arg(long, default_value = "max", value_name = "HZ", value_parser = line_rate)]
    line_rate: LineRate,

    /// Speed of the table on its way, mm/s; 0 for at once
    #[arg(long, default_value_t = 200.0, value_name = "V")]
    table_speed: f64,

    /// Give each scan noise of its own; otherwise equal scans are equal to the bit
    #[arg(long)]
    fresh_noise: bool,

    /// Serial number that the device reports
    #[arg(long, default_value = "SIM-0001", value_name = "TEXT")]
    serial: String,

    /// Faults, as key=value,...: on the line flip (rate per bit), lose, double, garbage, flood
    /// and stall (per byte), stall-ms, cut, replay, delay and reorder (per frame), delay-ms, to
    /// (host, device or both); in the device reset, table-stall, limit-switch,
    /// over-temperature, laser, interlock, move-part, clock-jump, unplug and wrong-serial
    /// (rate per column), babble (per start), move-mm, hold-ms; and seed.
    /// Example: flip=1e-5,reset=0.001,seed=7
    #[arg(
        long,
        default_value = "",
        hide_default_value = true,
        value_name = "SPEC"
    )]
    faults: FaultSpec,
}

/// Where the scanner is offered: exactly one.
#[derive(Debug, Clone, clap::Args)]
#[group(required = true, multiple = false)]
struct Place {
    /// Where to link a pseudo-terminal; a link that is there is replaced
    #[arg(long, value_name = "LINK")]
    pty: Option<PathBuf>,

    /// Address at which to offer a USB device to USB/IP hosts, such as 127.0.0.1:3240; nobody
    /// is asked for a password
    #[arg(long, value_name = "ADDR")]
    usbip: Option<SocketAddr>,

    /// Plug a USB device into this machine; needs root and the kernel's module vhci-hcd
    #[arg(long)]
    usb: bool,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum UsbClass {
    /// An interface of its own, with bulk endpoints
    Vendor,
    /// A serial port
    CdcAcm,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum PresetName {
    /// 240 columns by 256 samples, 0.1 mm counts, from 750 mm
    Paper,
    /// Columns 0.25 mm apart, samples 1.4 mm apart
    Cyberware,
    /// Samples 0.147 mm apart, from close by
    Rf627,
}

#[derive(Debug, Clone, Copy)]
struct LineRate(Option<f64>);

/// Numbers between commas.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let parsed: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let numbers: [f64; N] = parsed.ok()?.try_into().ok()?;
    numbers
        .iter()
        .all(|number| number.is_finite())
        .then_some(numbers)
}

fn place(text: &str) -> Result<Vec3, String> {
    numbers(text)
        .map(Vec3::from_array)
        .ok_or_else(|| "give x, y and z in mm, as in 10,-20,5".into())
}

fn tilt(text: &str) -> Result<(f64, f64), String> {
    numbers(text)
        .map(|[a, b]| (a, b))
        .filter(|(a, b)| a.abs() <= 60.0 && b.abs() <= 60.0)
        .ok_or_else(|| "give two angles of at most 60 degrees, as in 5,-3".into())
}

fn line_rate(text: &str) -> Result<LineRate, String> {
    if text == "max" {
        return Ok(LineRate(None));
    }
    match text.parse::<f64>() {
        Ok(0.0) => Ok(LineRate(None)),
        Ok(rate) if (0.001..=1e6).contains(&rate) => Ok(LineRate(Some(rate))),
        _ => Err("give columns per second (0.001 to 1000000), or 0 or max".into()),
    }
}

impl Cli {
    fn config(self) -> SimConfig {
        SimConfig {
            object: self.replay.map_or(self.object, Object::Recording),
            preset: match self.preset {
                PresetName::Paper => Preset::Paper,
                PresetName::Cyberware => Preset::Cyberware,
                PresetName::Rf627 => Preset::Rf627,
            },
            overrides: Overrides {
                columns: self.columns,
                samples: self.samples,
                pitch_mm: self.pitch_mm,
                range_count_mm: self.range_count_mm,
                standoff_mm: self.standoff_mm,
                noise_mm: self.noise_mm,
                outliers: self.outliers,
                outliers_one_sided: self.outliers_one_sided,
                outlier_clusters: self.outlier_clusters,
                mixed: self.mixed,
                dropouts: self.dropouts,
                glare: self.glare,
                glare_width_deg: self.glare_width_deg,
                jitter_mm: self.jitter_mm,
                backlash_mm: self.backlash_mm,
                mount: self.mount,
            },
            artefact: Artefact {
                diameter_mm: self.diameter_mm,
                at_mm: self.at_mm,
                tilt_deg: self.tilt_deg,
            },
            seed: self.seed,
            device: DeviceSettings {
                serial: self.serial,
                line_rate_hz: self.line_rate.0,
                table_speed_mm_s: if self.table_speed > 0.0 {
                    self.table_speed
                } else {
                    f64::INFINITY
                },
                fresh_noise: self.fresh_noise,
                feels_the_plug: self.place.pty.is_none(),
                mishaps: self.faults.device,
                ..DeviceSettings::default()
            },
            line: self.faults.line,
            table_plane: self.table_plane,
            back_plane_mm: self.back_plane_mm,
            stains: Vec::new(),
        }
    }
}

/// Prints a line. Whoever started the program may have stopped listening; that ends nothing.
macro_rules! say {
    ($($argument:tt)*) => {
        let _ = writeln!(std::io::stdout(), $($argument)*);
    };
}

/// What serves, until it is dropped.
enum Server {
    Pty(PtyServer),
    Usb(UsbServer),
}

impl Server {
    fn control(&self) -> Control {
        match self {
            Self::Pty(server) => server.control(),
            Self::Usb(server) => server.control(),
        }
    }
}

fn serve(
    place: &Place,
    class: UsbClass,
    config: &SimConfig,
    source: Source,
) -> Result<Server, SimError> {
    let personality = match class {
        UsbClass::Vendor => Personality::Vendor,
        UsbClass::CdcAcm => Personality::CdcAcm,
    };
    let usb = |attachment| {
        config
            .serve_usb(source.clone(), personality, attachment)
            .map(Server::Usb)
    };
    match (&place.pty, place.usbip) {
        (Some(link), _) => config.serve_with(source, Some(link)).map(Server::Pty),
        (None, Some(address)) => usb(Attachment::Network(address)),
        (None, None) => usb(Attachment::ThisMachine),
    }
}

fn run(cli: Cli) -> Result<(), String> {
    // Before the link is made, so that a signal never leaves it behind.
    let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP, SIGUSR1, SIGUSR2])
        .map_err(|error| format!("cannot wait for signals: {error}"))?;
    let (place, class) = (cli.place.clone(), cli.usb_class);
    let config = cli.config();
    let source = config.source().map_err(|error| error.to_string())?;
    let server =
        serve(&place, class, &config, source.clone()).map_err(|error| error.to_string())?;
    describe(&config, &source);
    describe_place(&place, &server);
    say!("serving until ended (Ctrl-C)");
    for signal in signals.forever() {
        match signal {
            SIGUSR1 => server.control().unplug(),
            SIGUSR2 => server.control().replug(),
            _ => break,
        }
    }
    drop(server);
    say!("ended");
    Ok(())
}

fn describe_place(place: &Place, server: &Server) {
    match server {
        Server::Pty(server) => {
            let link = place.pty.as_deref().unwrap_or(server.port());
            say!("port    {} -> {}", link.display(), server.port().display());
        }
        Server::Usb(server) => match server.address() {
            Some(address) => {
                say!(
                    "usb     usbip attach -r {} -b 1-1 (port {})",
                    address.ip(),
                    address.port()
                );
            }
            None => {
                say!("usb     plugged into this machine");
            }
        },
    }
}

fn describe(config: &SimConfig, source: &Source) {
    say!("object  {}", config.object);
    say!(
        "device  {}, serial {}",
        config.device.model,
        config.device.serial
    );
    match source {
        Source::Simulated { .. } => {
            say!("preset  {}, seed {}", config.preset.name(), config.seed);
        }
        Source::Replay(replay) => {
            say!(
                "points  {} in {} columns",
                replay.points(),
                replay.columns()
            );
        }
    }
    let plan = source.proposed();
    let calibration = source.calibration();
    let pitch_mm = f64::from(plan.pitch_counts) * f64::from(calibration.table_count_pm) / 1e9;
    say!(
        "plan    {} columns {pitch_mm:.3} mm apart, {} samples each",
        plan.columns,
        plan.samples
    );
}

fn main() -> ExitCode {
    match run(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("sim-scanner: {error}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn the_contract_of_the_program_is_understood() {
        let cli = Cli::try_parse_from([
            "sim-scanner",
            "--pty",
            "link",
            "--object",
            "cylinder",
            "--columns",
            "60",
            "--samples",
            "64",
            "--pitch-mm",
            "0.5",
            "--seed",
            "9",
            "--noise-mm",
            "0.05",
            "--outliers",
            "0.01",
            "--mixed",
            "0.2",
            "--dropouts",
            "0.01",
            "--glare",
            "0.9",
            "--glare-width-deg",
            "2",
            "--line-rate",
            "0",
            "--faults",
            "flip=1e-5,seed=7",
        ])
        .expect("as in the contract");
        let config = cli.config();
        assert_eq!(config.object, Object::BuiltIn("cylinder".into()));
        assert_eq!(config.device.line_rate_hz, None);
        assert_eq!(config.line.seed, 7);
        assert!(config.source().is_ok());
    }

    #[test]
    fn a_usb_device_is_offered_on_the_network_or_to_this_machine() {
        let cli = |words: &[&str]| {
            Cli::try_parse_from(["sim-scanner"].iter().chain(words)).expect("as in the contract")
        };
        let network = cli(&["--usbip", "127.0.0.1:3240", "--usb-class", "cdc-acm"]);
        assert_eq!(network.place.usbip, "127.0.0.1:3240".parse().ok());
        assert!(matches!(network.usb_class, UsbClass::CdcAcm));
        let here = cli(&["--usb"]);
        assert!(here.place.usb && matches!(here.usb_class, UsbClass::Vendor));
    }

    #[test]
    fn wrong_usage_is_refused() {
        for wrong in [
            &["sim-scanner"][..],
            &["sim-scanner", "--pty", "l", "--usb"],
            &["sim-scanner", "--pty", "l", "--usb-class", "cdc-acm"],
            &["sim-scanner", "--usbip", "3240"],
            &["sim-scanner", "--pty", "l", "--line-rate", "fast"],
            &["sim-scanner", "--pty", "l", "--faults", "flip"],
            &["sim-scanner", "--pty", "l", "--glare", "1"],
            &[
                "sim-scanner",
                "--pty",
                "l",
                "--replay",
                "a",
                "--object",
                "b",
            ],
        ] {
            assert!(Cli::try_parse_from(wrong).is_err(), "{wrong:?}");
        }
    }
}
