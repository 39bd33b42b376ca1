//! What the device says of itself while the host gets to know it (USB 2.0, chapter 9; CDC
//! PSTN 1.2 for the serial port).

use scanner_protocol::usb::{
    INTERFACE, InterfaceClass, PRODUCT_ID_CDC_ACM, PRODUCT_ID_VENDOR, VENDOR_ID,
};

/// How the device shows itself on USB.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Personality {
    /// An interface of the vendor's own class, with a bulk endpoint each way.
    #[default]
    Vendor,
    /// A serial port (CDC-ACM).
    CdcAcm,
}

/// Bulk endpoint from the host.
pub(super) const BULK_OUT: u8 = 0x01;
/// Bulk endpoint to the host.
pub(super) const BULK_IN: u8 = 0x81;
/// Endpoint of a serial port's notifications.
pub(super) const NOTIFY_IN: u8 = 0x82;

/// Value of the only configuration.
pub(super) const CONFIGURATION: u8 = 1;

/// Packet size of bulk endpoints at high speed: no other is allowed.
const BULK_PACKET: u16 = 512;

const CDC_CONTROL: InterfaceClass = InterfaceClass {
    class: 0x02,
    subclass: 0x02,
    // No modem commands: whoever tries them all the same is to blame.
    protocol: 0x00,
};
const CDC_DATA: InterfaceClass = InterfaceClass {
    class: 0x0a,
    subclass: 0x00,
    protocol: 0x00,
};

const DEVICE: u8 = 1;
const CONFIGURATION_TYPE: u8 = 2;
const STRING: u8 = 3;
const INTERFACE_TYPE: u8 = 4;
const ENDPOINT: u8 = 5;
const CS_INTERFACE: u8 = 0x24;

const BULK: u8 = 2;
const INTERRUPT: u8 = 3;

const LANGUAGE_ENGLISH_US: u16 = 0x0409;

/// Longest string: a descriptor's length is one byte, and a letter takes two.
const MAX_LETTERS: usize = 126;

/// All descriptors of a device.
#[derive(Debug, Clone)]
pub(super) struct Descriptors {
    pub(super) personality: Personality,
    pub(super) interfaces: Vec<InterfaceClass>,
    device: Vec<u8>,
    configuration: Vec<u8>,
    strings: [String; 3],
}

impl Descriptors {
    pub(super) fn new(personality: Personality, product: &str, serial: &str) -> Self {
        let interfaces = match personality {
            Personality::Vendor => vec![INTERFACE],
            Personality::CdcAcm => vec![CDC_CONTROL, CDC_DATA],
        };
        Self {
            personality,
            device: device(personality),
            configuration: configuration(personality),
            interfaces,
            strings: ["Relief".into(), product.into(), serial.into()],
        }
    }

    pub(super) fn product_id(&self) -> u16 {
        match self.personality {
            Personality::Vendor => PRODUCT_ID_VENDOR,
            Personality::CdcAcm => PRODUCT_ID_CDC_ACM,
        }
    }

    /// The descriptor of this type and index, if there is one.
    pub(super) fn get(&self, kind: u8, index: u8) -> Option<Vec<u8>> {
        match (kind, index) {
            (DEVICE, 0) => Some(self.device.clone()),
            (CONFIGURATION_TYPE, 0) => Some(self.configuration.clone()),
            (STRING, 0) => {
                let mut languages = vec![4, STRING];
                languages.extend(LANGUAGE_ENGLISH_US.to_le_bytes());
                Some(languages)
            }
            (STRING, index) => self.strings.get(usize::from(index) - 1).map(|text| {
                let letters: Vec<u16> = text.encode_utf16().take(MAX_LETTERS).collect();
                let mut string = vec![(2 + 2 * letters.len()) as u8, STRING];
                string.extend(letters.iter().flat_map(|letter| letter.to_le_bytes()));
                string
            }),
            _ => None,
        }
    }
}

fn device(personality: Personality) -> Vec<u8> {
    const USB_2_0: u16 = 0x0200;
    const RELEASE_1_0: u16 = 0x0100;
    let (class, product) = match personality {
        // Each interface says what it is.
        Personality::Vendor => (0x00, PRODUCT_ID_VENDOR),
        Personality::CdcAcm => (CDC_CONTROL.class, PRODUCT_ID_CDC_ACM),
    };
    let mut device = vec![18, DEVICE];
    device.extend(USB_2_0.to_le_bytes());
    device.extend([class, 0, 0, 64]);
    device.extend(VENDOR_ID.to_le_bytes());
    device.extend(product.to_le_bytes());
    device.extend(RELEASE_1_0.to_le_bytes());
    device.extend([1, 2, 3, 1]);
    device
}

fn configuration(personality: Personality) -> Vec<u8> {
    const SELF_POWERED: u8 = 0xc0;
    const MILLIAMPERES_100: u8 = 50;
    let mut body = Vec::new();
    let bulk = |body: &mut Vec<u8>| {
        endpoint(body, BULK_OUT, BULK, BULK_PACKET, 0);
        endpoint(body, BULK_IN, BULK, BULK_PACKET, 0);
    };
    let interfaces = match personality {
        Personality::Vendor => {
            interface(&mut body, 0, 2, INTERFACE);
            bulk(&mut body);
            1
        }
        Personality::CdcAcm => {
            interface(&mut body, 0, 1, CDC_CONTROL);
            // Header (CDC 1.10); no call management; line coding and state; union.
            body.extend([5, CS_INTERFACE, 0x00, 0x10, 0x01]);
            body.extend([5, CS_INTERFACE, 0x01, 0x00, 0x01]);
            body.extend([4, CS_INTERFACE, 0x02, 0x02]);
            body.extend([5, CS_INTERFACE, 0x06, 0x00, 0x01]);
            endpoint(&mut body, NOTIFY_IN, INTERRUPT, 16, 9);
            interface(&mut body, 1, 2, CDC_DATA);
            bulk(&mut body);
            2
        }
    };
    let length = 9 + body.len() as u16;
    let mut whole = vec![9, CONFIGURATION_TYPE];
    whole.extend(length.to_le_bytes());
    whole.extend([interfaces, CONFIGURATION, 0, SELF_POWERED, MILLIAMPERES_100]);
    whole.extend(body);
    whole
}

fn interface(to: &mut Vec<u8>, number: u8, endpoints: u8, class: InterfaceClass) {
    to.extend([9, INTERFACE_TYPE, number, 0, endpoints]);
    to.extend([class.class, class.subclass, class.protocol, 0]);
}

fn endpoint(to: &mut Vec<u8>, address: u8, kind: u8, packet: u16, interval: u8) {
    to.extend([7, ENDPOINT, address, kind]);
    to.extend(packet.to_le_bytes());
    to.push(interval);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_add_up() {
        for personality in [Personality::Vendor, Personality::CdcAcm] {
            let all = Descriptors::new(personality, "Scanner", "1");
            let device = all.get(DEVICE, 0).expect("there is one");
            assert_eq!(device.len(), 18);
            let whole = all.get(CONFIGURATION_TYPE, 0).expect("there is one");
            assert_eq!(
                usize::from(u16::from_le_bytes([whole[2], whole[3]])),
                whole.len()
            );
            // One descriptor after the other, to the end and no further.
            let (mut at, mut interfaces, mut endpoints, mut announced) = (0, 0, 0, 0);
            while at < whole.len() {
                match whole[at + 1] {
                    INTERFACE_TYPE => {
                        interfaces += 1;
                        announced += whole[at + 4];
                    }
                    ENDPOINT => endpoints += 1,
                    _ => {}
                }
                at += usize::from(whole[at]);
            }
            assert_eq!(at, whole.len());
            assert_eq!(interfaces, whole[4]);
            assert_eq!(usize::from(interfaces), all.interfaces.len());
            assert_eq!(endpoints, announced);
        }
    }

    #[test]
    fn strings_are_utf16_and_cut_to_what_a_descriptor_holds() {
        let all = Descriptors::new(Personality::Vendor, &"x".repeat(400), "SN-1");
        assert_eq!(
            all.get(STRING, 3).expect("the serial number"),
            [10, 3, b'S', 0, b'N', 0, b'-', 0, b'1', 0]
        );
        let product = all.get(STRING, 2).expect("the product");
        assert_eq!((product.len(), product[0]), (254, 254));
        assert_eq!(all.get(STRING, 0), Some(vec![4, 3, 9, 4]));
        assert_eq!(all.get(STRING, 4), None);
        assert_eq!(all.get(15, 0), None);
    }
}
