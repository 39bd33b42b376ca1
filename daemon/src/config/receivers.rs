//! What the sections of all who are told have in common: `[[webhooks]]`, `[[mqtt]]`, `[[mail]]`,
//! `[[hooks]]` and `[[uploads]]`.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use relief_api::WebhookEvent;
use toml::de::{DeTable, DeValue};

use super::Config;
use super::load::line_and_column;
use crate::receivers::{
    FileError, check_broker_files, check_command, check_files, check_mail_files, check_upload_files,
};

/// When a message is tried again that was not taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Retry {
    /// After the first attempt; three times as long after each further one ...
    pub first: Duration,
    /// ... up to this.
    pub longest: Duration,
    /// For how long since it was made a message is tried ...
    pub lasting: Duration,
    /// ... and how often at least, whatever the clock was set to meanwhile.
    pub attempts: u32,
}

impl Default for Retry {
    fn default() -> Self {
        Self {
            first: Duration::from_secs(5),
            longest: Duration::from_secs(4 * 3_600),
            lasting: Duration::from_secs(24 * 3_600),
            attempts: 8,
        }
    }
}

pub(super) fn default_events() -> Vec<WebhookEvent> {
    use WebhookEvent as E;
    vec![E::ScanEnded, E::JobDone, E::JobFailed]
}

pub(super) fn default_timeout_ms() -> u32 {
    10_000
}

/// Each has a thread of its own; more are a mistake.
const MOST_RECEIVERS: usize = 16;

/// Where something is wrong, in bytes from the beginning of the text, and what.
type Fault = (usize, String);

/// What is wrong with a section: the key, and what.
pub(super) type KeyFault = (&'static str, String);

/// A section of the file.
struct Section<'a>(&'a DeTable<'a>);

impl Section<'_> {
    /// Where the value of a key stands.
    fn value(&self, name: &str) -> usize {
        let found = self.0.iter().find(|(key, _)| key.get_ref() == name);
        found.map_or(0, |(_, value)| value.span().start)
    }
}

/// A receiver, as its section has it.
struct Told<'a> {
    /// What it is, as in "webhook".
    what: &'static str,
    name: &'a str,
    /// What does not go together.
    keys: Result<(), KeyFault>,
    /// Looks at its files.
    files: Box<dyn Fn() -> Result<(), FileError> + 'a>,
}

/// All receivers with the names of their sections, in the order of the configuration.
fn all(config: &Config) -> Vec<(&'static str, Vec<Told<'_>>)> {
    let webhooks = config.webhooks.iter().map(|own| Told {
        what: "webhook",
        name: &own.name,
        keys: own.check(),
        files: Box::new(|| check_files(own)),
    });
    let brokers = config.mqtt.iter().map(|own| Told {
        what: "broker",
        name: &own.name,
        keys: own.check(),
        files: Box::new(|| check_broker_files(own)),
    });
    let mail = config.mail.iter().map(|own| Told {
        what: "mail",
        name: &own.name,
        keys: own.check(),
        files: Box::new(|| check_mail_files(own)),
    });
    let hooks = config.hooks.iter().map(|own| Told {
        what: "hook",
        name: &own.name,
        keys: own.check(),
        files: Box::new(|| check_command(own)),
    });
    let uploads = config.uploads.iter().map(|own| Told {
        what: "upload",
        name: &own.name,
        keys: own.check(),
        files: Box::new(|| check_upload_files(own)),
    });
    vec![
        ("webhooks", webhooks.collect()),
        ("mqtt", brokers.collect()),
        ("mail", mail.collect()),
        ("hooks", hooks.collect()),
        ("uploads", uploads.collect()),
    ]
}

/// Calls `check` with each receiver of a text that is a configuration, and its section.
fn each(
    text: &str,
    config: &Config,
    mut check: impl FnMut(&Told<'_>, &Section<'_>) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let Ok(sections) = DeTable::parse(text) else {
        // It has been read before.
        return Ok(());
    };
    for (name, all) in all(config) {
        let found = sections
            .get_ref()
            .iter()
            .find(|(key, _)| key.get_ref() == name);
        let Some(DeValue::Array(tables)) = found.map(|(_, value)| value.get_ref()) else {
            continue;
        };
        for (told, table) in all.iter().zip(tables.iter()) {
            if let DeValue::Table(keys) = table.get_ref() {
                check(told, &Section(keys))?;
            }
        }
    }
    Ok(())
}

/// Checks what must hold between the keys of a receiver, and between receivers of all kinds: the
/// API and the records know them by their names.
pub(super) fn check(text: &str, config: &Config) -> Result<(), Fault> {
    let mut names = BTreeMap::new();
    each(text, config, |told, section| {
        let at = section.value("name");
        if names.len() == MOST_RECEIVERS {
            return Err((
                at,
                format!("more than {MOST_RECEIVERS} receivers of messages are not possible"),
            ));
        }
        if let Some((what, earlier)) = names.insert(told.name.to_owned(), (told.what, at)) {
            let (line, _) = line_and_column(text, earlier);
            let name = told.name;
            return Err((
                at,
                format!("there is a {what} {name} in line {line} already: each has its own name"),
            ));
        }
        let keys = &told.keys;
        keys.clone()
            .map_err(|(key, message)| (section.value(key), message))
    })
}

/// Checks the files that receivers name.
pub(super) fn check_all_files(text: &str, config: &Config) -> Result<(), Fault> {
    each(text, config, |told, section| {
        (told.files)().map_err(|error| (section.value(error.key()), error.to_string()))
    })
}

/// Refuses certificates of authorities where none are looked at.
pub(super) fn check_ca_file(
    ca_file: Option<&Path>,
    is_secure: bool,
    scheme: &str,
) -> Result<(), KeyFault> {
    match ca_file {
        Some(_) if !is_secure => Err((
            "ca_file",
            format!("`ca_file` is for {scheme}, but `url` is not: remove it, or change the url"),
        )),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_of_brokers_and_mails_are_told_with_their_line_and_a_way_out() {
        let path = Path::new("relief.toml");
        let broker = "[[mqtt]]\nname = \"hall\"\nurl = \"mqtts://lab.example\"\n";
        let mail = "[[mail]]\nname = \"lab\"\nserver = \"lab.example\"\n\
                    from = \"a@lab.example\"\nto = [\"b@lab.example\"]\n";
        for sound in [broker, mail, &format!("{broker}{mail}")] {
            assert!(Config::parse(sound, path).is_ok(), "{sound}");
        }
        for (text, line, told) in [
            (
                broker.replace("mqtts:", "https:"),
                3,
                "\"https://lab.example\" begins with neither mqtt:// nor mqtts://",
            ),
            (
                broker.replace("lab.example", "a:hunter2@lab.example"),
                3,
                "use `username` and `password_file`",
            ),
            (
                format!("{broker}topic_prefix = \"a/#\"\n"),
                4,
                "without `+` and `#`",
            ),
            (
                format!("{broker}topic_prefix = \"/a\"\n"),
                4,
                "nothing that topics can begin with",
            ),
            (
                format!("{broker}password_file = \"p\"\n"),
                4,
                "is for a `username`",
            ),
            (
                format!("{}ca_file = \"c\"\n", broker.replace("mqtts:", "mqtt:")),
                4,
                "`ca_file` is for mqtts",
            ),
            (
                format!("{broker}events = [\"tea\"]\n"),
                4,
                "there is no event `tea`",
            ),
            (
                format!("{broker}topics = 1\n"),
                4,
                "in [mqtt] unknown key `topics`",
            ),
            (
                format!("{broker}{}", mail.replace("\"lab\"", "\"hall\"")),
                5,
                "there is a broker hall in line 2 already",
            ),
            (format!("{mail}security = \"none\"\n"), 6, "in plain text"),
            (
                format!("{mail}username = \"a\"\n"),
                6,
                "needs a `password_file`",
            ),
            (
                format!("{mail}password_file = \"p\"\n"),
                6,
                "is for a `username`",
            ),
            (mail.replace("b@lab", "b lab"), 5, "is no address of a mail"),
            (mail.replace("[\"b@lab.example\"]", "[]"), 5, "0 addresses"),
            (
                mail.replace("\"lab.example\"", "\"lab.example:25\""),
                3,
                "the port as `port`",
            ),
            (
                format!(
                    "{}security = \"none\"\nca_file = \"c\"\n",
                    mail.replace("\"lab.example\"", "\"localhost\"")
                ),
                7,
                "`ca_file` is for TLS",
            ),
            (
                "[service]\npublic_url = \"https://a:hunter2@lab.example\"\n".to_owned(),
                2,
                "without a name or password",
            ),
        ] {
            let error = Config::parse(&text, path).unwrap_err().to_string();
            assert!(
                error.starts_with(&format!("relief.toml, line {line}, ")),
                "{error}"
            );
            assert!(error.contains(told), "{error}");
            assert!(!error.contains("hunter2"), "{error}");
        }
    }

    #[test]
    fn faults_of_uploads_are_told_with_their_line_and_a_way_out() {
        let path = Path::new("relief.toml");
        let share = "[[uploads]]\nname = \"a\"\nto = \"folder\"\nfolder = \"/mnt\"\n";
        let sftp = "[[uploads]]\nname = \"b\"\nto = \"sftp\"\nfolder = \"x\"\nuser = \"u\"\n\
                    identity_file = \"i\"\nknown_hosts_file = \"k\"\nhost = \"h\"\n";
        assert!(Config::parse(&format!("{share}{sftp}"), path).is_ok());
        for (text, line, told) in [
            (
                share.replace("folder = ", "# "),
                3,
                "an upload to folder needs `folder`",
            ),
            (share.replace("/mnt", "mnt"), 4, "is to be a whole path"),
            (
                format!("{share}bucket = \"b\"\n"),
                5,
                "`bucket` is for s3, not for folder",
            ),
            (
                format!("{share}files = [\"[a\"]\n"),
                5,
                "is no pattern of names",
            ),
            (format!("{share}files = []\n"), 5, "nothing goes there"),
            (
                share.replace("\"folder\"", "\"s3\""),
                4,
                "`folder` is for folder and sftp",
            ),
            (
                sftp.replace("\"h\"", "\"-oProxyCommand=sh\""),
                8,
                "no `-` first",
            ),
            (
                sftp.replace("host = \"h\"\n", ""),
                3,
                "an upload to sftp needs `host`",
            ),
            (
                format!("{share}endpoint = \"https://a:b@s\"\n"),
                5,
                "no address of an object store",
            ),
        ] {
            let error = Config::parse(&text, path).unwrap_err().to_string();
            assert!(error.contains(&format!("line {line},")), "{text}: {error}");
            assert!(error.contains(told), "{text}: {error}");
        }
    }
}
