//! USB devices made by this kernel's gadget drivers, on its loopback controller: an idea of
//! USB that shares no code with the simulator's.

use std::fs::{self, File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use scanner_protocol::usb::{INTERFACE, VENDOR_ID};

const GADGETS: &str = "/sys/kernel/config/usb_gadget";
const CONTROLLER: &str = "dummy_udc.0";

/// A gadget with one function; it is unplugged when this is dropped.
pub(crate) struct Gadget {
    home: PathBuf,
}

impl Gadget {
    /// A gadget that is not plugged in yet.
    pub(crate) fn new(name: &str, product_id: u16, serial: &str, function: &str) -> Result<Self> {
        let home = Path::new(GADGETS).join(name);
        let make = |path: &str| {
            let path = home.join(path);
            fs::create_dir_all(&path).with_context(|| format!("cannot make {}", path.display()))
        };
        make("strings/0x409")?;
        fs::write(home.join("idVendor"), format!("{VENDOR_ID:#06x}"))?;
        fs::write(home.join("idProduct"), format!("{product_id:#06x}"))?;
        fs::write(home.join("strings/0x409/serialnumber"), serial)?;
        fs::write(home.join("strings/0x409/product"), "Gadget")?;
        make("configs/c.1")?;
        make(&format!("functions/{function}"))?;
        std::os::unix::fs::symlink(
            home.join("functions").join(function),
            home.join("configs/c.1").join(function),
        )?;
        Ok(Self { home })
    }

    pub(crate) fn plug_in(&self) -> Result<()> {
        fs::write(self.home.join("UDC"), CONTROLLER).context("the controller refuses the gadget")
    }

    pub(crate) fn unplug(&self) -> Result<()> {
        Ok(fs::write(self.home.join("UDC"), "\n")?)
    }
}

impl Drop for Gadget {
    fn drop(&mut self) {
        // It may be unplugged already.
        let _ = self.unplug();
    }
}

/// The files of a gadget whose function is in user space.
pub(crate) struct Endpoints {
    /// Must stay open for as long as the function is to be there.
    pub(crate) control: File,
    pub(crate) from_host: File,
    pub(crate) to_host: File,
}

/// Describes the scanner's interface to a FunctionFS instance of this name.
pub(crate) fn function_in_user_space(name: &str) -> Result<Endpoints> {
    const DESCRIPTORS_V2: u32 = 3;
    const STRINGS: u32 = 2;
    const HAS_FULL_AND_HIGH_SPEED: u32 = 3;
    let place = format!("/tmp/{name}");
    fs::create_dir_all(&place)?;
    rustix::mount::mount(
        name,
        place.as_str(),
        "functionfs",
        rustix::mount::MountFlags::empty(),
        None,
    )
    .context("cannot mount functionfs")?;
    let at = |file: &str| {
        let path = format!("{place}/{file}");
        OpenOptions::new()
            .read(true)
            .write(true)
            .open(&path)
            .with_context(|| format!("cannot open {path}"))
    };
    let interface = |packet: u16| {
        let [low, high] = packet.to_le_bytes();
        let mut out = vec![9, 4, 0, 0, 2];
        out.extend([INTERFACE.class, INTERFACE.subclass, INTERFACE.protocol, 0]);
        out.extend([7, 5, 0x01, 2, low, high, 0]);
        out.extend([7, 5, 0x82, 2, low, high, 0]);
        out
    };
    let body = [interface(64), interface(512)].concat();
    let mut descriptors = Vec::new();
    for word in [
        DESCRIPTORS_V2,
        20 + body.len() as u32,
        HAS_FULL_AND_HIGH_SPEED,
        3,
        3,
    ] {
        descriptors.extend(word.to_le_bytes());
    }
    descriptors.extend(body);
    let mut control = at("ep0")?;
    control.write_all(&descriptors).context("descriptors")?;
    let strings: Vec<u8> = [STRINGS, 16, 0, 0]
        .iter()
        .flat_map(|word| word.to_le_bytes())
        .collect();
    control.write_all(&strings).context("strings")?;
    Ok(Endpoints {
        control,
        from_host: at("ep1")?,
        to_host: at("ep2")?,
    })
}

/// Carries bytes from one file to another, in pieces, until either ends. The thread is left
/// to itself.
pub(crate) fn pump<R: Read + Send + 'static, W: Write + Send + 'static>(
    mut from: R,
    mut to: W,
    piece: usize,
) {
    std::thread::spawn(move || {
        let mut buffer = vec![0; piece];
        while let Ok(count) = from.read(&mut buffer) {
            let bytes = buffer.get(..count).unwrap_or_default();
            if count == 0 || to.write_all(bytes).is_err() {
                return;
            }
        }
    });
}
