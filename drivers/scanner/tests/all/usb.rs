//! What the USB transport says on any machine; on a kernel with devices it is tried by
//! `cargo xtask vm usb`.

use scanner_driver::transport::usb::list;
use scanner_driver::{Scanner, ScannerError, UsbScanner, UsbSettings};

#[test]
fn a_scanner_that_is_not_there_is_told_with_what_is() {
    // Numbers that no maker has.
    let settings = UsbSettings {
        vendor_id: 0xffff,
        product_id: 0xffff,
        serial: Some("NONE".into()),
        ..UsbSettings::default()
    };
    let scanner = UsbScanner::open(settings).unwrap();
    let error = scanner.identify().unwrap_err();
    assert!(matches!(error, ScannerError::NotOnUsb { .. }), "{error}");
    let text = error.to_string();
    assert!(
        text.contains("no scanner ffff:ffff, serial NONE on USB"),
        "{text}"
    );
    assert!(text.contains("There is: "), "{text}");
}

#[test]
fn devices_are_listed_in_order_and_without_hubs() {
    let devices = list().unwrap();
    assert!(devices.is_sorted_by_key(|device| device.node.clone()));
    for device in devices {
        assert!(device.node.starts_with("/dev/bus/usb"), "{device}");
    }
}
