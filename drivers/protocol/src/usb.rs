//! How a scanner shows itself on USB. `docs/protocol.md` says the same in words.

/// Vendor number of scanners whose maker has none of their own: pid.codes, whose first
/// product numbers are for testing.
pub const VENDOR_ID: u16 = 0x1209;

/// Product number of a scanner with the interface of [`INTERFACE`].
pub const PRODUCT_ID_VENDOR: u16 = 0x0001;

/// Product number of a scanner that is a serial port (CDC-ACM).
pub const PRODUCT_ID_CDC_ACM: u16 = 0x0002;

/// What marks an interface whose bulk endpoints carry the frames of this crate.
pub const INTERFACE: InterfaceClass = InterfaceClass {
    class: 0xff,
    subclass: 0x53,
    protocol: 0x01,
};

/// The three numbers by which USB tells sorts of interfaces apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InterfaceClass {
    /// 0xff: the vendor's own.
    pub class: u8,
    /// Among the vendor's own: scanners.
    pub subclass: u8,
    /// Among scanners: what goes over the endpoints.
    pub protocol: u8,
}

impl core::fmt::Display for InterfaceClass {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(
            f,
            "{:02x}/{:02x}/{:02x}",
            self.class, self.subclass, self.protocol
        )
    }
}
