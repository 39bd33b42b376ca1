//! What must hold between the scanners of a file: their names, and that no two are one.

use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

use super::load::line_and_column;
use super::value::check_scanner_name;
use super::{Config, NamedScanner, Transport};

/// Where something is wrong, in bytes from the beginning of the text, and what.
type Fault = (usize, String);

/// Checks the sections `[scanner]` and `[scanners.NAME]` of a text that is a configuration.
/// `port` gives the port that is meant by a path.
pub(super) fn check(
    text: &str,
    config: &Config,
    port: &dyn Fn(&Path) -> PathBuf,
) -> Result<(), Fault> {
    let Ok(sections) = DeTable::parse(text) else {
        // It has been read before.
        return Ok(());
    };
    let sections = sections.get_ref();
    let one = Section::find(sections, "scanner");
    let several = Section::find(sections, "scanners");
    if let (Some(one), Some(several)) = (&one, &several) {
        return Err((
            one.at.max(several.at),
            "there are both [scanner] and [scanners]: keep [scanner] for one scanner, or give \
             each of several a section [scanners.NAME]"
                .into(),
        ));
    }
    if let Some(one) = one {
        other_transport(&one, config.scanner.transport)?;
    }
    let Some(several) = several else {
        return Ok(());
    };
    let configured = config.each_scanner();
    if config.scanners.is_empty() {
        return Err((
            several.at,
            "no scanner has a name: give each a section, such as [scanners.left]".into(),
        ));
    }
    let mut found = Vec::new();
    for scanner in configured {
        let Some(section) = Section::find(several.keys, scanner.name) else {
            continue;
        };
        check_scanner_name(scanner.name).map_err(|message| (section.at, message))?;
        if let Some(at) = section.key("name") {
            let name = scanner.name;
            return Err((
                at,
                format!("the name of [scanners.{name}] is `{name}`: remove the key `name`"),
            ));
        }
        other_transport(&section, scanner.config.transport)?;
        found.push((scanner, section));
    }
    // In the order of the file, so that the later one is told of the earlier.
    found.sort_by_key(|(_, section)| section.at);
    for (index, later) in found.iter().enumerate() {
        for earlier in &found[..index] {
            apart(text, earlier, later, port)?;
        }
    }
    Ok(())
}

/// A section of the file.
struct Section<'a> {
    /// Where its name stands.
    at: usize,
    keys: &'a DeTable<'a>,
}

impl<'a> Section<'a> {
    fn find(parent: &'a DeTable<'a>, name: &str) -> Option<Self> {
        let (key, value) = parent.iter().find(|(key, _)| key.get_ref() == name)?;
        match value.get_ref() {
            DeValue::Table(keys) => Some(Self {
                at: key.span().start,
                keys,
            }),
            _ => None,
        }
    }

    /// Where a key stands, if it is there.
    fn key(&self, name: &str) -> Option<usize> {
        let found = self.keys.iter().find(|(key, _)| key.get_ref() == name);
        found.map(|(key, _)| key.span().start)
    }
}

/// Refuses keys that belong to the other way of attaching a scanner: they would do nothing.
fn other_transport(section: &Section<'_>, transport: Transport) -> Result<(), Fault> {
    const SERIAL: [&str; 2] = ["port", "baud"];
    const USB: [&str; 2] = ["vendor_id", "product_id"];
    let (of_the_other, other, own): (&[&str], _, _) = match transport {
        Transport::Serial => (&USB, "usb", "serial"),
        Transport::Usb => (&SERIAL, "serial", "usb"),
    };
    let given = of_the_other
        .iter()
        .find_map(|key| Some((section.key(key)?, key)));
    let Some((at, key)) = given else {
        return Ok(());
    };
    Err((
        at,
        format!(
            "`{key}` is for transport = \"{other}\", but the transport is \"{own}\": remove it, \
             or change the transport"
        ),
    ))
}

type Found<'a> = (NamedScanner<'a>, Section<'a>);

/// Refuses two sections that lead to the same scanner.
fn apart(
    text: &str,
    (earlier, before): &Found<'_>,
    (later, section): &Found<'_>,
    port: &dyn Fn(&Path) -> PathBuf,
) -> Result<(), Fault> {
    let (one, other) = (earlier.config, later.config);
    if one.transport != other.transport {
        return Ok(());
    }
    let (line, _) = line_and_column(text, before.at);
    let beside = format!("[{}], line {line},", earlier.section());
    let alike = |serial: &str| {
        format!("{beside} has the serial number {serial} too: each scanner has its own")
    };
    let (key, message) = match one.transport {
        Transport::Serial => {
            // `Path` takes no notice of doubled and trailing slashes.
            if port(&one.port) == port(&other.port) {
                let at = other.port.display();
                let message = format!("{beside} is on the port {at} too: each scanner has its own");
                ("port", message)
            } else {
                match (&one.serial_number, &other.serial_number) {
                    (Some(one), Some(other)) if one == other => ("serial_number", alike(one)),
                    _ => return Ok(()),
                }
            }
        }
        Transport::Usb => {
            if (one.vendor_id, one.product_id) != (other.vendor_id, other.product_id) {
                return Ok(());
            }
            let message = match (&one.serial_number, &other.serial_number) {
                (Some(one), Some(other)) if one != other => return Ok(()),
                (Some(serial), Some(_)) => alike(serial),
                _ => format!(
                    "{beside} has the same vendor and product number: both need a serial_number, \
                     or each might take the other's scanner"
                ),
            };
            ("serial_number", message)
        }
    };
    Err((section.key(key).unwrap_or(section.at), message))
}
