//! What a configuration is refused for, and what holds without one.

mod fleet;
mod reload;
mod scanners;

use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use reliefd::Config;
use reliefd::config::{DiscoveryConfig, HookConfig, HttpConfig, NatsConfig, WebhookConfig};

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
            "relief.toml, line 3, column 1: `port` is for transport = \"serial\", but the \
             transport is \"usb\": remove it, or change the transport",
        ),
        (
            "[scanner]\nvendor_id = 0x1209\n",
            "relief.toml, line 2, column 1: `vendor_id` is for transport = \"usb\", but the \
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
             name, transport, port, baud, vendor_id, product_id, serial_number, request_timeout_ms, \
             request_attempts, motion_timeout_ms, column_timeout_ms, dead_man_ms, credits, \
             resume, resume_unattended_s, calibration, calibration_days, scan",
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
            "[discovery]\nport = 65536\n",
            "relief.toml, line 2, column 8: 65536 is out of range: 1 to 65535 are possible",
        ),
        (
            "[discovery]\nname = \"a\\tb\"\n",
            "relief.toml, line 2, column 8: \"a\\tb\" is no name to be announced: up to 63 bytes \
             in one line are possible",
        ),
        (
            "[discovery]\nannounce = true\n",
            "relief.toml, section [discovery]: announce = true needs the name of a reverse proxy \
             in http.hosts: the service itself can be reached on this machine alone",
        ),
        (
            "[storage]\nacknowledged = \"remove\"\nacknowledged_days = 7\n",
            "relief.toml, section [storage]: acknowledged = \"remove\" leaves nothing for \
             acknowledged_days to keep: leave out one of them",
        ),
        (
            "[storage]\nunacknowledged = \"kept\"\n",
            "relief.toml, line 2, column 18: unknown value `kept`; did you mean `keep`?",
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
             114, 128, 190 or 186",
        ),
        (
            "[deliverables]\nstep_units = \"inches\"\n",
            "relief.toml, line 2, column 14: unknown value `inches`; did you mean `inch`?",
        ),
        (
            "[deliverables]\npage = [\"htm\"]\n",
            "relief.toml, line 2, column 9: unknown value `htm`; did you mean `html`?",
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
    let webhook = |keys: &str| format!("[[webhooks]]\nname = \"lab\"\n{keys}");
    let whole = "url = \"https://lab.example/\"\nsecret_file = \"s\"\n";
    for (keys, message) in [
        (
            "url = \"https://lab.example/\"\n".to_owned(),
            "relief.toml, line 1, column 1: the key `secret_file` is missing",
        ),
        (
            whole.replace("https:", "ftp:"),
            "relief.toml, line 3, column 7: \"ftp://lab.example\" begins with neither http:// \
             nor https://: a URL such as \"https://lab.example/relief\" is needed",
        ),
        (
            whole.replace("lab.example/", "a:hunter2@lab.example/T0?hunter2"),
            "relief.toml, line 3, column 7: \"https://...@lab.example/...\" holds a name or \
             password, which the receiver is not told and others would see: a URL such as \
             \"https://lab.example/relief\" is needed",
        ),
        (
            whole.replace("lab.example", "a:hunter/2@lab.example"),
            "relief.toml, line 3, column 7: \"https://.../...\" has no number for its port: a URL \
             such as \"https://lab.example/relief\" is needed",
        ),
        (
            whole.replace("lab.example", "lab example"),
            "relief.toml, line 3, column 7: \"...\" is no URL: a URL such as \
             \"https://lab.example/relief\" is needed",
        ),
        (
            whole.replace("https://lab.example/", "/relief"),
            "relief.toml, line 3, column 7: \"...\" begins with neither http:// nor \
             https://: a URL such as \"https://lab.example/relief\" is needed",
        ),
        (
            format!("{whole}event = []\n"),
            "relief.toml, line 5, column 1: in [webhooks] unknown key `event`; did you mean \
             `events`?",
        ),
        (
            format!("{whole}events = []\n"),
            "relief.toml, line 5, column 10: without events nothing is told: choose from \
             scan-ended, scan-paused, job-done, job-failed, scanner-trouble, interlock, disk-low, \
             or remove the section",
        ),
        (
            format!("{whole}events = [\"job-done\", \"scan\"]\n"),
            "relief.toml, line 5, column 10: there is no event `scan`; known are: scan-ended, \
             scan-paused, job-done, job-failed, scanner-trouble, interlock, disk-low",
        ),
        (
            format!("{whole}events = [\"test\"]\n"),
            "relief.toml, line 5, column 10: there is no event `test`; known are: scan-ended, \
             scan-paused, job-done, job-failed, scanner-trouble, interlock, disk-low",
        ),
        (
            format!("{whole}timeout_ms = 30000\n"),
            "relief.toml, line 5, column 14: 30000 is out of range: 100 to 25000 ms are possible",
        ),
        (
            format!("{}ca_file = \"c\"\n", whole.replace("https:", "http:")),
            "relief.toml, line 5, column 11: `ca_file` is for https, but `url` is not: remove it, \
             or change the url",
        ),
        (
            format!("{whole}[[webhooks]]\nname = \"lab\"\n{whole}"),
            "relief.toml, line 6, column 8: there is a webhook lab in line 2 already: each has \
             its own name",
        ),
        (
            format!("{whole}[[webhooks]]\nname = \"a b\"\n{whole}"),
            "relief.toml, line 6, column 8: \"a b\" is no name for a webhook: 1 to 32 letters \
             (a to z, A to Z), digits, `-` and `_` are possible, a letter or digit first",
        ),
    ] {
        assert_eq!(refused(&webhook(&keys)), message);
    }
    let many: String = (1..=17)
        .map(|number| format!("[[webhooks]]\nname = \"lab-{number}\"\n{whole}"))
        .collect();
    assert_eq!(
        refused(&many),
        "relief.toml, line 66, column 8: more than 16 receivers of messages are not possible"
    );
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
fn files_of_webhooks_are_looked_at_where_asked_for_and_told_with_their_line() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let file = place("relief.toml");
    let write = |name: &str, text: &str, mode: u32| {
        std::fs::write(place(name), text).unwrap();
        std::fs::set_permissions(place(name), std::fs::Permissions::from_mode(mode)).unwrap();
    };
    let text = format!(
        "[[webhooks]]\nname = \"lab\"\nurl = \"https://lab.example/\"\nsecret_file = {:?}\n\
         ca_file = {:?}\n",
        place("secret"),
        place("ca.pem"),
    );
    write("relief.toml", &text, 0o644);
    let refused = || Config::load_with_files(&file).unwrap_err().to_string();
    // Whoever is not the service need not be able to read its secrets.
    assert_eq!(Config::load(&file).unwrap().webhooks[0].name, "lab");
    let line =
        |line: usize, column: usize| format!("{}, line {line}, column {column}: ", file.display());
    let told = refused();
    assert!(told.starts_with(&line(4, 15)), "{told}");
    assert!(
        told.contains("install -m 600 -o relief -g relief"),
        "{told}"
    );
    let secret = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw\n";
    write("secret", secret, 0o644);
    let told = refused();
    assert!(told.starts_with(&line(4, 15)), "{told}");
    assert!(
        told.contains("may be used by others (mode 0644): chmod 600"),
        "{told}"
    );
    write("secret", secret, 0o600);
    let told = refused();
    assert!(told.starts_with(&line(5, 11)), "{told}");
    assert!(told.contains("cannot read the certificates in"), "{told}");
    std::fs::create_dir(place("ca.pem")).unwrap();
    let told = refused();
    assert!(told.starts_with(&line(5, 11)), "{told}");
    assert!(told.contains("is no file"), "{told}");
    std::fs::remove_dir(place("ca.pem")).unwrap();
    let own = rcgen::generate_simple_self_signed(["lab.example".to_owned()]).unwrap();
    write("ca.pem", &own.cert.pem(), 0o644);
    let config = Config::load_with_files(&file).unwrap();
    assert_eq!(config.webhooks, Config::load(&file).unwrap().webhooks);
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
            Some(section) if section.starts_with('[') && section.ends_with(']') => section,
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

    let two = folder.join("two-scanners.toml");
    let places = |config: &Config| -> Vec<(String, String)> {
        let all = config.each_scanner();
        all.iter()
            .map(|one| (one.name.to_owned(), one.config.place()))
            .collect()
    };
    let expected = [
        ("left", "/dev/relief/scanner-000123"),
        ("right", "USB 1209:0001, serial 000124"),
    ]
    .map(|(name, place)| (name.to_owned(), place.to_owned()));
    assert_eq!(places(&Config::load(&two).unwrap()), expected);
    let two = in_force(&two);
    assert_eq!(places(&two), expected);
    assert_eq!(two.scan_on("left").x_first_mm, Some(-60.0));
    assert_eq!(two.scan_on("right").x_first_mm, None);
    assert_eq!(two.scan_on("right").pitch_mm, Some(0.5));

    let all = in_force(&folder.join("serial.toml"));
    assert_eq!(all.each_scanner()[0].name, "scanner");
    assert_eq!(all.regrid.neighbours, Some(49));
    assert_eq!(all.journal, Config::default().journal);
    assert_eq!(all.queue, Config::default().queue);
    let http = Config::default().http;
    assert_eq!(all.http.hosts, ["bench.lab.example"]);
    assert_eq!(
        all.http,
        HttpConfig {
            hosts: all.http.hosts.clone(),
            ..http
        }
    );
    assert_eq!(
        all.service.socket_mode,
        Config::default().service.socket_mode
    );
    assert_eq!(all.log, Config::default().log);
    let storage = Config::default().storage;
    assert_eq!(all.storage.acknowledged, storage.acknowledged);
    assert_eq!(all.storage.unacknowledged, storage.unacknowledged);
    let nats = NatsConfig {
        servers: vec!["tls://nats.lab.example:4222".into()],
        bench: Some("bench-7".to_owned().try_into().unwrap()),
        token_file: Some("/etc/relief/nats.token".into()),
        certificate_file: Some("/etc/relief/nats.pem".into()),
        key_file: Some("/etc/relief/nats.key".into()),
        ca_file: Some("/etc/relief/ca.pem".into()),
        domain: Some("hub".into()),
        hand_over: Some(8),
        needs: ["gpu".to_owned()].into(),
        tools: ["gpu".to_owned()].into(),
        memory_mib: Some(8192),
        ..NatsConfig::default()
    };
    assert_eq!(all.nats, nats);
    assert_eq!(all.service.roles, Config::default().service.roles);
    let discovery = DiscoveryConfig {
        name: Some("Relief on bench".into()),
        ..DiscoveryConfig::default()
    };
    assert_eq!(all.discovery, discovery);
    let mut webhook = WebhookConfig::new(
        "lab",
        "https://lab.example/relief",
        "/etc/relief/lab.secret",
    );
    webhook.ca_file = Some("/etc/relief/lab-ca.pem".into());
    assert_eq!(all.webhooks, [webhook]);
    let check = ["/usr/local/bin/check-part", "--strict"];
    assert_eq!(all.hooks, [HookConfig::new("check", &check)]);
    let further = all.deliverables.further().unwrap();
    assert_eq!(further.surface.unwrap().placement.as_str(), "optimal");
    assert_eq!(further.skin.unwrap().settings, skin::Settings::new(0.1));
    let machine = all.deliverables.unread_machine();
    assert_eq!(machine, Some(Path::new("machine.toml")));
    let defaults = Config::default().processing().pipeline_settings(0.5, 0.5);
    let mut shown = all.processing().pipeline_settings(0.5, 0.5);
    shown.regrid.roi = defaults.regrid.roi;
    assert_eq!(
        shown, defaults,
        "the values shown as defaults are the defaults"
    );
}
