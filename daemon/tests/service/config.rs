use std::path::Path;

use reliefd::Config;

fn refused(text: &str) -> String {
    Config::parse(text, Path::new("relief.toml"))
        .unwrap_err()
        .to_string()
}

#[test]
fn faults_are_told_with_their_line_and_a_way_out() {
    for (text, message) in [
        (
            "[service]\nsocket = \"s\"\n\n[regrid]\n# M\nneigbours = 30\n",
            "relief.toml, line 6, column 1: in [regrid] unknown key `neigbours`; did you mean \
             `neighbours`?",
        ),
        (
            "[regird]\npitch_mm = 1\n",
            "relief.toml, line 1, column 2: unknown key `regird`; did you mean `regrid`?",
        ),
        (
            "[scanner]\nport = \"/dev/ttyS0\"\nbaud = 9\n",
            "relief.toml, line 3, column 8: 9 is out of range: 1200 to 12000000 bits per second \
             are possible",
        ),
        (
            "[scanner]\ntransport = \"seriel\"\n",
            "relief.toml, line 2, column 13: unknown value `seriel`; did you mean `serial`?",
        ),
        (
            "[scanner]\ntransport = \"usb\"\nport = \"/dev/ttyUSB0\"\n",
            "relief.toml, section [scanner]: `port` is for transport = \"serial\", but the \
             transport is \"usb\": remove it, or change the transport",
        ),
        (
            "[scanner]\nvendor_id = 0x1209\n",
            "relief.toml, section [scanner]: `vendor_id` is for transport = \"usb\", but the \
             transport is \"serial\": remove it, or change the transport",
        ),
        (
            "[scanner]\ntransport = \"usb\"\nserial_number = \"\"\n",
            "relief.toml, line 3, column 17: the serial number is empty: leave the key out to \
             take any scanner",
        ),
        (
            "[scanner]\ntransport = \"usb\"\nserial = \"1\"\n",
            "relief.toml, line 3, column 1: in [scanner] unknown key `serial`; known are: \
             transport, port, baud, vendor_id, product_id, serial_number, request_timeout_ms, \
             request_attempts, motion_timeout_ms, column_timeout_ms, dead_man_ms, credits, \
             resume, resume_unattended_s",
        ),
        (
            "[service]\nlisten = \"0.0.0.0:80\"\n",
            "relief.toml, line 2, column 10: 0.0.0.0:80 can be reached from other machines, and \
             tokens go over it in plain text: use a loopback address such as \"127.0.0.1:80\"",
        ),
        (
            "[service]\nsocket_mode = \"0666\"\n",
            "relief.toml, line 2, column 15: \"0666\" is out of range: \"0660\" (the service's \
             user and the group) and \"0600\" (its user alone) are possible, since who may use \
             the socket may turn the laser on",
        ),
        (
            "[service]\nsocket_group = \"\"\n",
            "relief.toml, line 2, column 16: \"\" is no name of a group",
        ),
        (
            "[http]\nconnections = 0\n",
            "relief.toml, line 2, column 15: 0 is out of range: 1 to 1024 are possible",
        ),
        (
            "[http]\nstall_timeout_ms = 99\n",
            "relief.toml, line 2, column 20: 99 is out of range: 100 to 600000 ms are possible",
        ),
        (
            "[service]\nlisten = \"localhost\"\n",
            "relief.toml, line 2, column 10: \"localhost\" is no address with a port, such as \
             \"127.0.0.1:7437\"",
        ),
        (
            "[regrid]\npitch_mm = 0.0\n",
            "relief.toml, line 2, column 12: 0 is out of range: a positive number is needed",
        ),
        (
            "[deliverables]\nentities = 144\n",
            "relief.toml, line 2, column 12: 144 is no surface entity that can be written: use \
             114 or 128",
        ),
        (
            "[segment]\nclusters = 0\n",
            "relief.toml, section [segment]: clusters is 0, but must be 1 to 1000",
        ),
        (
            "[log]\nlevel = \"loud=quiet=\"\n",
            "relief.toml, line 2, column 9: \"loud=quiet=\" is no log level: use error, warn, \
             info, debug or trace, or a filter such as \"info,reliefd=debug\"",
        ),
    ] {
        assert_eq!(refused(text), message);
    }
    let kind = refused("[queue]\nworkers = \"two\"\n");
    assert!(
        kind.starts_with("relief.toml, line 2, column 11: invalid type"),
        "{kind}"
    );
    let syntax = refused("[queue]\nworkers = \n");
    assert!(syntax.starts_with("relief.toml, line 2"), "{syntax}");
    let missing = Config::load(Path::new("no/such.toml")).unwrap_err();
    assert_eq!(
        missing.to_string(),
        "cannot read the configuration no/such.toml: No such file or directory (os error 2)"
    );
}

#[test]
fn what_is_no_configuration_takes_neither_memory_nor_time() {
    let endless = Config::load(Path::new("/dev/zero")).unwrap_err();
    assert_eq!(
        endless.to_string(),
        "/dev/zero has more than 1048576 bytes, and is no configuration"
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c.toml");
    std::fs::write(&path, b"a = \"\xff\"").unwrap();
    let binary = Config::load(&path).unwrap_err().to_string();
    assert!(binary.contains("utf-8"), "{binary}");
    // As deep and as long as a file may be.
    for text in [
        format!("a = {}", "[".repeat(500_000)),
        format!("a = {}", "{a=".repeat(300_000)),
        "a.".repeat(500_000),
        "[a]\n".repeat(250_000),
        format!("[log]\nlevel = \"{}\"", "a=b,".repeat(200_000)),
    ] {
        let message = refused(&text);
        assert!(message.starts_with("relief.toml, line"), "{message:.200}");
        assert!(message.len() < 1_100, "{} bytes", message.len());
    }
}

/// An example with every key that is commented out put in force: nothing is refused.
fn in_force(path: &Path) -> Config {
    let text = std::fs::read_to_string(path).unwrap();
    let all: String = text
        .lines()
        .map(|line| match line.strip_prefix("# ") {
            Some(key) if key.split_once(" = ").is_some_and(|(k, _)| !k.contains(' ')) => key,
            _ => line,
        })
        .flat_map(|line| [line, "\n"])
        .collect();
    assert_ne!(all, text);
    Config::parse(&all, path).unwrap()
}

#[test]
fn the_examples_are_sound_and_show_the_defaults() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config");
    let serial = Config::load(&folder.join("serial.toml")).unwrap();
    assert_eq!(serial, Config::default());
    let simulator = Config::load(&folder.join("simulator.toml")).unwrap();
    assert_eq!(simulator.scanner.port, Path::new("relief-demo/scanner"));

    let usb = Config::load(&folder.join("usb.toml")).unwrap();
    assert_eq!(usb.scanner.place(), "USB 1209:0001");
    let named = in_force(&folder.join("usb.toml"));
    assert_eq!(named.scanner.place(), "USB 1209:0001, serial 000123");
    assert_eq!(
        named.scanner.usb().link,
        Config::default().scanner.usb().link
    );

    let all = in_force(&folder.join("serial.toml"));
    assert_eq!(all.regrid.neighbours, Some(49));
    assert_eq!(all.journal, Config::default().journal);
    assert_eq!(all.queue, Config::default().queue);
    assert_eq!(all.http, Config::default().http);
    assert_eq!(
        all.service.socket_mode,
        Config::default().service.socket_mode
    );
    assert_eq!(all.log, Config::default().log);
    let defaults = Config::default().processing().pipeline_settings(0.5, 0.5);
    let mut shown = all.processing().pipeline_settings(0.5, 0.5);
    shown.regrid.roi = defaults.regrid.roi;
    assert_eq!(
        shown, defaults,
        "the values shown as defaults are the defaults"
    );
}

#[test]
fn a_reload_says_what_holds_and_what_needs_a_restart() {
    let parse = |text: &str| Config::parse(text, Path::new("relief.toml")).unwrap();
    let old = parse("");
    let new = parse(
        "[regrid]\nseed = 7\n[log]\nlevel = \"debug\"\n[scanner]\nbaud = 9600\n\
         [deliverables]\nauthor = \"A\"\n",
    );
    let (merged, outcome) = old.reloaded(&new);
    assert_eq!(outcome.applied, ["regrid", "deliverables", "log"]);
    assert_eq!(outcome.needs_restart, ["scanner"]);
    assert_eq!(merged.regrid.seed, Some(7));
    assert_eq!(merged.scanner, old.scanner);
    assert_eq!(old.reloaded(&old).1, reliefd::config::Reloaded::default());
}
