//! Roles, and servers by which jobs go elsewhere.

use std::fs::{Permissions, set_permissions, write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use rcgen::generate_simple_self_signed;
use reliefd::Config;

use super::refused;

#[test]
fn faults_of_roles_and_servers_are_told_with_a_way_out() {
    let server = "[nats]\nservers = [\"nats://10.0.0.5:4222\"]\n";
    for roles in [
        "\"acquire\", \"serve\"",
        "\"work\"",
        "\"work\", \"serve\"",
        "\"serve\"",
    ] {
        let text = format!("[service]\nroles = [{roles}]\n{server}");
        assert!(
            Config::parse(&text, Path::new("relief.toml")).is_ok(),
            "{text}"
        );
    }
    for (text, told) in [
        (
            "[service]\nroles = []\n",
            "without a role there is nothing to do",
        ),
        ("[service]\nroles = [\"wrok\"]\n", "did you mean `work`"),
        (
            "[service]\nroles = [\"acquire\", \"work\"]\n",
            "the role \"acquire\" needs \"serve\"",
        ),
        (
            "[service]\nroles = [\"acquire\", \"serve\"]\n",
            "without the role \"work\" nobody works on jobs",
        ),
        (
            "[service]\nroles = [\"work\"]\n",
            "the role \"work\" alone is for jobs of others",
        ),
        (
            "[nats]\nservers = [\"http://a\"]\n",
            "addresses of servers such as",
        ),
        (
            "[nats]\nservers = [\"nats://a:hunter2@b\"]\n",
            "holds a name or password",
        ),
        ("[nats]\nbench = \"a b\"\n", "`a b` is no name"),
        ("[nats]\nprefix = \"A\"\n", "\"A\" is no prefix"),
        ("[nats]\ndomain = \"a.b\"\n", "\"a.b\" is no domain"),
        ("[nats]\nreplicas = 2\n", "1, 3 or 5 are"),
        (
            "[nats]\ntools = [\"a-b\"]\n",
            "\"a-b\" is no name of a tool",
        ),
        ("[nats]\nsilence_s = 1\n", "2 to 3600 are"),
        (
            "[nats]\ntoken_file = \"t\"\n",
            "`token_file` is for `servers`",
        ),
    ] {
        let error = refused(text);
        assert!(error.contains(told), "{text}: {error}");
        assert!(!error.contains("hunter2"), "{error}");
    }
    let both = format!("{server}token_file = \"t\"\nnkey_file = \"n\"\n");
    assert!(refused(&both).contains("one of them is enough"));
    let plain = format!("{server}ca_file = \"c\"\n");
    assert!(refused(&plain).contains("`ca_file` is for tls"));
    let secure = server.replace("nats:", "tls:");
    for (keys, told) in [
        (
            "token_file = \"t\"\ncredentials_file = \"c\"",
            "`token_file` and `credentials_file`",
        ),
        ("certificate_file = \"c\"", "needs the `key_file`"),
        ("key_file = \"k\"", "needs its `certificate_file`"),
    ] {
        let error = refused(&format!("{secure}{keys}\n"));
        assert!(error.contains(told), "{keys}: {error}");
    }
    let plain = format!("{server}certificate_file = \"c\"\nkey_file = \"k\"\n");
    assert!(refused(&plain).contains("`certificate_file` is for tls"));
}

#[test]
fn files_of_servers_are_looked_at_and_told_with_a_way_out() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let own = generate_simple_self_signed(["bench".to_owned()]).unwrap();
    for (name, text) in [
        ("nothing", "nothing"),
        ("seed", "SUAKEYWITHOUTAJWT"),
        ("own.pem", &own.cert.pem()),
        ("own.key", &own.signing_key.serialize_pem()),
    ] {
        write(place(name), text).unwrap();
        set_permissions(place(name), Permissions::from_mode(0o600)).unwrap();
    }
    let told = |keys: &[(&str, &str)]| {
        let lines = keys
            .iter()
            .map(|(key, name)| format!("{key} = {:?}\n", place(name)));
        let lines: String = lines.collect();
        let text = format!("[nats]\nservers = [\"tls://a\"]\n{lines}");
        write(place("relief.toml"), text).unwrap();
        let file = place("relief.toml");
        Config::load(&file).expect("whoever is not the service need not read its secrets");
        match Config::load_with_files(&file) {
            Ok(_) => String::new(),
            Err(error) => error.to_string(),
        }
    };
    let sound = [("certificate_file", "own.pem"), ("key_file", "own.key")];
    assert_eq!(told(&sound), "");
    for (keys, why) in [
        (&[("token_file", "gone")][..], "cannot read the token in"),
        (&[("nkey_file", "nothing")], "as `nk -gen user` writes it"),
        (
            &[("credentials_file", "seed")],
            "as `nsc generate creds` writes",
        ),
        (&[("ca_file", "nothing")], "holds no PEM certificate"),
        (
            &[("certificate_file", "nothing"), sound[1]],
            "holds no PEM certificate",
        ),
        (
            &[sound[0], ("key_file", "own.pem")],
            "holds no PEM private key",
        ),
    ] {
        let told = told(keys);
        assert!(told.contains(why), "{keys:?}: {told}");
        assert!(told.contains("[nats]"), "{keys:?}: {told}");
    }
    set_permissions(place("own.key"), Permissions::from_mode(0o640)).unwrap();
    assert!(told(&sound).contains("may be used by others (mode 0640)"));
}
