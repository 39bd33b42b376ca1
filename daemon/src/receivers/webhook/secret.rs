//! The secret of a webhook, and the signature that is made with it: that of the Standard
//! Webhooks specification (standardwebhooks.com), which receivers have libraries for.

use std::fmt;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;

use crate::receivers::files::{FileError, read_secret};

/// Begins every secret, so that one that has got about is recognised.
const PREFIX: &str = "whsec_";
/// Fewer bytes could be guessed, and more gain nothing: as the specification has it.
const BYTES: std::ops::RangeInclusive<usize> = 24..=64;

/// A secret, which never gets into messages.
#[derive(Clone)]
pub(super) struct Secret(Hmac<Sha256>);

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret(..)")
    }
}

impl Secret {
    /// Reads a secret from a file that is the service's own.
    pub(super) fn read(path: &Path) -> Result<Self, FileError> {
        let failed = |why: String| FileError {
            key: "secret_file",
            message: why,
        };
        let shown = path.display();
        let text = read_secret("secret_file", "secret", path)?;
        Self::parse(&text).map_err(|why| {
            failed(format!(
                "{shown} holds no secret: {why}. Make one with: (umask 077; echo \
                 \"{PREFIX}$(openssl rand -base64 32)\" > FILE)"
            ))
        })
    }

    /// The secret that is written so. What is wrong is told without it.
    fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let encoded = text
            .strip_prefix(PREFIX)
            .ok_or_else(|| format!("it does not begin with {PREFIX}"))?;
        let bytes = STANDARD
            .decode(encoded)
            .map_err(|_| format!("what follows {PREFIX} is no Base64"))?;
        if !BYTES.contains(&bytes.len()) {
            return Err(format!(
                "it has {} bytes, and {} to {} are needed",
                bytes.len(),
                BYTES.start(),
                BYTES.end()
            ));
        }
        Hmac::new_from_slice(&bytes)
            .map(Self)
            .map_err(|error| error.to_string())
    }

    /// The value of `webhook-signature` for a message that is sent at this time.
    pub(super) fn signature(&self, id: &str, unix_s: i64, body: &str) -> String {
        let mut mac = self.0.clone();
        mac.update(format!("{id}.{unix_s}.{body}").as_bytes());
        format!("v1,{}", STANDARD.encode(mac.finalize().into_bytes()))
    }
}

#[cfg(test)]
mod tests {
    use std::fs::{self, Permissions};
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    /// The example of the specification's own libraries, and one that Python's `hmac` signed:
    /// never to be changed, since receivers hold on to it.
    #[test]
    fn signatures_are_those_of_the_specification() {
        let secret = Secret::parse("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw\n").unwrap();
        assert_eq!(
            secret.signature(
                "msg_p5jXN8AQM9LWM0D4loKWxJek",
                1_614_265_330,
                r#"{"test": 2432232314}"#
            ),
            "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE="
        );
        let secret = Secret::parse(&format!("whsec_{}", STANDARD.encode([0xA5; 64]))).unwrap();
        assert_eq!(
            secret.signature("msg_1", 1_795_385_430, "{\"name\":\"\u{e4}\"}"),
            "v1,YQHuaJo+HT8Nm4d3GtLwzwaN366YE6CUFCEiBdx600s="
        );
    }

    #[test]
    fn a_secret_is_long_enough_and_never_shown() {
        let of = |bytes: usize| format!("whsec_{}", STANDARD.encode(vec![7; bytes]));
        for bytes in [24, 64] {
            let secret = Secret::parse(&of(bytes)).unwrap();
            assert_eq!(format!("{secret:?}"), "Secret(..)");
        }
        for (text, why) in [
            (of(23), "it has 23 bytes, and 24 to 64 are needed"),
            (of(65), "it has 65 bytes"),
            (STANDARD.encode([7; 32]), "does not begin with whsec_"),
            ("whsec_!hunter2".into(), "no Base64"),
            (String::new(), "does not begin with whsec_"),
        ] {
            let error = Secret::parse(&text).unwrap_err();
            assert!(error.contains(why), "{error}");
            assert!(!error.contains("hunter2"), "{error}");
        }
    }

    #[test]
    fn a_file_with_a_secret_is_the_services_own() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("secret");
        let refused = |path: &Path| Secret::read(path).unwrap_err().to_string();
        assert!(refused(&path).contains("cannot read the secret in"));
        assert!(refused(folder.path()).contains("is no file"));
        fs::write(&path, "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").unwrap();
        for (mode, right) in [(0o600, true), (0o400, true), (0o640, false), (0o604, false)] {
            fs::set_permissions(&path, Permissions::from_mode(mode)).unwrap();
            let read = Secret::read(&path);
            assert_eq!(read.is_ok(), right, "{mode:o}");
            if let Err(error) = read {
                let error = error.to_string();
                assert!(
                    error.contains(&format!("(mode 0{mode:o}): chmod 600")),
                    "{error}"
                );
            }
        }
        fs::set_permissions(&path, Permissions::from_mode(0o600)).unwrap();
        fs::write(&path, "hunter2").unwrap();
        let error = refused(&path);
        assert!(error.contains("openssl rand -base64 32"), "{error}");
        assert!(!error.contains("hunter2"), "{error}");
    }
}
