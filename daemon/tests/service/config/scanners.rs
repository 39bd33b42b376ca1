//! Several scanners in one file: told apart, and refused where they are one.

use std::path::Path;

use reliefd::Config;

use super::refused;

#[test]
fn several_scanners_are_told_apart_and_faults_with_their_lines() {
    let port = |name: &str| format!("[scanners.{name}]\nport = \"/dev/{name}\"\n");
    let config = Config::parse(
        &format!(
            "{}[scanners.left.scan]\nsamples = 64\n{}[scan]\nsamples = 32\npitch_mm = 2.0\n",
            port("left"),
            port("a-2_B")
        ),
        Path::new("relief.toml"),
    )
    .unwrap();
    let all = config.each_scanner();
    let told: Vec<(&str, String, String)> = all
        .iter()
        .map(|s| (s.name, s.section(), s.config.place()))
        .collect();
    let of = |name: &'static str| (name, format!("scanners.{name}"), format!("/dev/{name}"));
    assert_eq!(told, [of("a-2_B"), of("left")]);
    // What a scanner leaves out is as in [scan].
    let (left, other) = (config.scan_on("left"), config.scan_on("a-2_B"));
    assert_eq!((left.samples, left.pitch_mm), (Some(64), Some(2.0)));
    assert_eq!((other.samples, other.pitch_mm), (Some(32), Some(2.0)));
    let one = Config::parse("[scanner]\nname = \"mill\"\n", Path::new("c")).unwrap();
    assert_eq!(one.each_scanner()[0].name, "mill");
    assert_eq!(one.each_scanner()[0].section(), "scanner");
    assert_eq!(Config::default().each_scanner()[0].name, "scanner");

    let usb = |name: &str, serial: &str| {
        format!("[scanners.{name}]\ntransport = \"usb\"\nserial_number = \"{serial}\"\n")
    };
    let usb_config = usb("a", "1") + &usb("b", "2");
    assert!(Config::parse(&usb_config, Path::new("c")).is_ok());
    for (text, message) in [
        (
            format!("{}\n[scanner]\nport = \"p\"\n", port("left")),
            "line 4, column 2: there are both [scanner] and [scanners]: keep [scanner] for one \
             scanner, or give each of several a section [scanners.NAME]",
        ),
        (
            format!("[scanner]\n{}", port("left")),
            "line 2, column 2: there are both [scanner] and [scanners]: keep [scanner] for one \
             scanner, or give each of several a section [scanners.NAME]",
        ),
        (
            "[scanners]\n".into(),
            "line 1, column 2: no scanner has a name: give each a section, such as \
             [scanners.left]",
        ),
        (
            "[scanners]\nport = \"p\"\n".into(),
            "line 2, column 8: invalid type: string \"p\", expected a section with the keys of \
             a scanner, such as [scanners.left]",
        ),
        (
            "[scanners.\"../etc\"]\n".into(),
            "line 1, column 11: \"../etc\" is no name for a scanner: 1 to 32 letters (a to z, A \
             to Z), digits, `-` and `_` are possible, a letter or digit first",
        ),
        (
            "[scanners.-a]\n".into(),
            "line 1, column 11: \"-a\" is no name for a scanner: 1 to 32 letters (a to z, A to \
             Z), digits, `-` and `_` are possible, a letter or digit first",
        ),
        (
            "[scanner]\nname = \"\"\n".into(),
            "line 2, column 8: \"\" is no name for a scanner: 1 to 32 letters (a to z, A to Z), \
             digits, `-` and `_` are possible, a letter or digit first",
        ),
        (
            port("left") + "name = \"right\"\n",
            "line 3, column 1: the name of [scanners.left] is `left`: remove the key `name`",
        ),
        (
            port("left") + "baudd = 9600\n",
            "line 3, column 1: in [scanners.left] unknown key `baudd`; did you mean `baud`?",
        ),
        (
            port("left") + "vendor_id = 1\n",
            "line 3, column 1: `vendor_id` is for transport = \"usb\", but the transport is \
             \"serial\": remove it, or change the transport",
        ),
        (
            port("z") + "[scanners.a]\nbaud = 9600\nport = \"/dev//z\"\n",
            "line 5, column 1: [scanners.z], line 1, is on the port /dev//z too: each scanner has \
             its own",
        ),
        (
            "[scanners.a]\n[scanners.b]\n".into(),
            "line 2, column 11: [scanners.a], line 1, is on the port /dev/ttyUSB0 too: each \
             scanner has its own",
        ),
        (
            usb("a", "1") + &usb("b", "1"),
            "line 6, column 1: [scanners.a], line 1, has the serial number 1 too: each scanner \
             has its own",
        ),
        (
            port("a") + "serial_number = \"1\"\n" + &port("b") + "serial_number = \"1\"\n",
            "line 6, column 1: [scanners.a], line 1, has the serial number 1 too: each scanner \
             has its own",
        ),
        (
            usb("a", "1") + "[scanners.b]\ntransport = \"usb\"\n",
            "line 4, column 11: [scanners.a], line 1, has the same vendor and product number: \
             both need a serial_number, or each might take the other's scanner",
        ),
    ] {
        let refused = refused(&text);
        assert_eq!(refused, format!("relief.toml, {message}"), "{text}");
    }
    let long = "x".repeat(33);
    assert!(refused(&port(&long)).contains("is no name for a scanner"));
    assert!(Config::parse(&port(&long[1..]), Path::new("c")).is_ok());
}

#[test]
fn two_names_of_one_port_are_seen() {
    let folder = tempfile::tempdir().unwrap();
    let (port, link) = (folder.path().join("port"), folder.path().join("link"));
    std::fs::write(&port, "").unwrap();
    std::os::unix::fs::symlink(&port, &link).unwrap();
    let text = format!("[scanners.a]\nport = {port:?}\n[scanners.b]\nport = {link:?}\n");
    let file = folder.path().join("c.toml");
    std::fs::write(&file, text).unwrap();
    let refused = Config::load(&file).unwrap_err().to_string();
    assert!(
        refused.contains("line 4, column 1: [scanners.a], line 1,"),
        "{refused}"
    );
}
