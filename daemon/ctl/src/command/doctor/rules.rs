//! The udev rules that let the service use scanners on USB.

use std::fs;
use std::path::Path;

use super::finding::Finding;

const CHECK: &str = "udev rules";

/// Where udev looks, the most important first.
const FOLDERS: [&str; 4] = [
    "/etc/udev/rules.d",
    "/run/udev/rules.d",
    "/usr/lib/udev/rules.d",
    "/lib/udev/rules.d",
];

const OURS: &str = "60-relief-scanner.rules";

/// Whether rules are installed that know a device of these numbers.
pub(super) fn check(vendor_id: u16, product_id: u16) -> Finding {
    look(&FOLDERS.map(Path::new), vendor_id, product_id)
}

fn look(folders: &[&Path], vendor_id: u16, product_id: u16) -> Finding {
    let numbers = format!("{vendor_id:04x}:{product_id:04x}");
    if !folders.iter().any(|folder| folder.join(OURS).exists()) {
        return Finding::doubtful(
            CHECK,
            format!(
                "{OURS} is not installed: only root may use {numbers}, unless other rules say so"
            ),
            "copy 60-relief-scanner.rules and 90-relief-scanner.rules to /etc/udev/rules.d, and plug \
             the scanner in anew",
        );
    }
    let knows = |line: &str| {
        let rule = line.trim().to_ascii_lowercase();
        !rule.starts_with('#')
            && rule.contains(&format!("{{idvendor}}==\"{vendor_id:04x}\""))
            && rule.contains("group=")
            && rule
                .split("{idproduct}==\"")
                .nth(1)
                .and_then(|rest| rest.split('"').next())
                .is_some_and(|list| list.split('|').any(|p| p == format!("{product_id:04x}")))
    };
    let file = folders
        .iter()
        .filter_map(|folder| fs::read_dir(folder).ok())
        .flat_map(|entries| entries.flatten())
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "rules"))
        .find(|path| fs::read_to_string(path).is_ok_and(|text| text.lines().any(knows)));
    match file {
        Some(file) => Finding::good(CHECK, format!("{} knows {numbers}", file.display())),
        None => Finding::doubtful(
            CHECK,
            format!("they are installed, but none gives {numbers} to a group"),
            format!(
                "copy the lines of {OURS} with this scanner's numbers to \
                 /etc/udev/rules.d/61-scanner.rules, and plug it in anew"
            ),
        ),
    }
}

#[cfg(test)]
mod tests {
    use scanner_driver::protocol::usb::{PRODUCT_ID_CDC_ACM, PRODUCT_ID_VENDOR, VENDOR_ID};

    use super::super::finding::Grade;
    use super::*;

    fn ours(name: &str) -> String {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../systemd");
        fs::read_to_string(folder.join(name)).unwrap()
    }

    #[test]
    fn rules_are_missing_or_know_the_scanner_or_another() {
        let folder = tempfile::tempdir().unwrap();
        let folders = [Path::new("/nowhere"), folder.path()];
        let missing = look(&folders, VENDOR_ID, PRODUCT_ID_VENDOR);
        assert_eq!(missing.grade, Grade::Doubtful);
        assert!(missing.remedy.unwrap().contains("90-relief-scanner.rules"));

        fs::write(folder.path().join(OURS), ours(OURS)).unwrap();
        for product in [PRODUCT_ID_VENDOR, PRODUCT_ID_CDC_ACM] {
            let found = look(&folders, VENDOR_ID, product);
            assert_eq!(found.grade, Grade::Good, "{}", found.found);
            assert!(found.found.contains(OURS), "{}", found.found);
        }
        let other = look(&folders, 0xcafe, 1);
        assert_eq!(other.grade, Grade::Doubtful);
        assert!(other.found.contains("cafe:0001"), "{}", other.found);
        let line = "SUBSYSTEM==\"usb\", ATTR{idVendor}==\"CAFE\", ATTR{idProduct}==\"0001\", GROUP=\"relief\"";
        fs::write(folder.path().join("61-scanner.rules"), line).unwrap();
        assert_eq!(look(&folders, 0xcafe, 1).grade, Grade::Good);
    }

    /// The rules, the code and the page for firmware authors must not drift apart.
    #[test]
    fn the_rules_are_for_the_numbers_of_the_protocol() {
        let (vendor, both) = (
            format!("{{idVendor}}==\"{VENDOR_ID:04x}\""),
            format!("{{idProduct}}==\"{PRODUCT_ID_VENDOR:04x}|{PRODUCT_ID_CDC_ACM:04x}\""),
        );
        let rules = ours(OURS);
        let lines = || rules.lines().filter(|line| line.contains("idVendor"));
        assert_eq!(
            lines().filter(|line| line.contains(&vendor)).count(),
            lines().count()
        );
        let find =
            |wanted: [&str; 2]| lines().find(|line| wanted.iter().all(|part| line.contains(part)));
        assert!(find([&both, "ATTR{power/control}=\"on\""]).is_some());
        assert!(find([&both, "ENV{ID_MM_DEVICE_IGNORE}=\"1\""]).is_some());
        for (subsystem, product) in [("usb", PRODUCT_ID_VENDOR), ("tty", PRODUCT_ID_CDC_ACM)] {
            let product = format!("{{idProduct}}==\"{product:04x}\"");
            let subsystem = format!("SUBSYSTEM==\"{subsystem}\"");
            let line = find([&product, &subsystem]).unwrap();
            for part in ["GROUP=\"relief\"", "MODE=\"0660\"", "TAG+=\"uaccess\""] {
                assert!(line.contains(part), "{line}");
            }
        }
        let late = ours("90-relief-scanner.rules");
        assert!(
            late.lines()
                .any(|line| line.contains(&vendor) && line.contains(&both))
        );
        // What udev would only complain about in its log.
        for line in rules.lines().chain(late.lines()) {
            assert_eq!(line.matches('"').count() % 2, 0, "{line}");
        }
    }
}
