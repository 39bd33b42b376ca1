//! The sections of surfaces and NC programs in the configuration.

use std::path::Path;

use deliverables::features::FeatureNetwork;
use relief_api::SettingOverrides;
use reliefd::Config;
use reliefd::config::{MachineChoice, OverrideError, Processing};
use serde_json::{Value, json};

const PUBLISHED: &str = include_str!("../../../geometry/features/networks/published.toml");
const MACHINE: &str = include_str!("../../../config/machine.toml");
const ALL: &str = "[deliverables.surface]\ntolerance_mm = 0.1\n[deliverables.skin]\n\
     tolerance_mm = 0.2\nmethod = \"jo\"\nevery_mm = 2.0\n[deliverables.toolpath]\n\
     machine = \"mill/machine.toml\"\ntool = \"ball:6\"\nrough = \"flat:10\"\nof = \"surface\"\n";

/// What a configuration beside a machine's file comes to.
fn read(text: &str, machine: &str) -> Result<Config, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("mill")).unwrap();
    std::fs::write(folder.path().join("mill/machine.toml"), machine).unwrap();
    let file = folder.path().join("relief.toml");
    std::fs::write(&file, text).unwrap();
    Config::load_with_files(&file).map_err(|error| error.to_string())
}

#[test]
fn the_machine_is_read_from_the_folder_of_the_configuration_and_kept_with_the_settings() {
    let config = read(ALL, MACHINE).unwrap();
    let further = config.deliverables.further().unwrap();
    assert_eq!(further.surface.unwrap().tolerance_mm, 0.1);
    let skin = further.skin.unwrap();
    assert_eq!(
        (skin.settings.method, skin.every_mm),
        (skin::Method::Jo, Some(2.0))
    );
    let milled = further.toolpath.unwrap();
    assert_eq!(milled.of, deliverables::MillOf::Surface);
    assert_eq!(milled.machine.safe_z_mm, 30.0);
    assert_eq!(milled.settings.rough.unwrap().to_string(), "flat:10");

    // As it stands in the header of a scan's journal.
    let kept = serde_json::to_vec(&config.processing()).unwrap();
    let kept: Processing = serde_json::from_slice(&kept).unwrap();
    assert_eq!(kept, config.processing());
    assert!(matches!(
        kept.deliverables.toolpath.unwrap().machine,
        Some(MachineChoice::Read(_))
    ));

    // A machine that has changed is a change of the configuration.
    let moved = MACHINE.replace("safe_z_mm = 30.0", "safe_z_mm = 40.0");
    let (config, outcome) = config.reloaded(&read(ALL, &moved).unwrap());
    assert_eq!(outcome.applied, ["deliverables"]);
    let further = config.deliverables.further().unwrap();
    assert_eq!(further.toolpath.unwrap().machine.safe_z_mm, 40.0);
    // Without a section there is nothing.
    assert_eq!(
        Config::default().deliverables.further().unwrap(),
        deliverables::Further::default()
    );
}

#[test]
fn what_cannot_be_is_told_by_section_and_key() {
    for (from, to, told) in [
        (
            "tolerance_mm = 0.1",
            "tolerence_mm = 0.1",
            "line 2, column 1: in [deliverables.surface] unknown key `tolerence_mm`; did you mean \
             `tolerance_mm`?",
        ),
        (
            "tolerance_mm = 0.1",
            "knots = \"optimal\"",
            "section [deliverables.surface]: the key `tolerance_mm` is missing: give it, such as \
             tolerance_mm = 0.05",
        ),
        (
            "tolerance_mm = 0.2",
            "tolerance_mm = 0.2\ndegree = 6",
            "section [deliverables.skin]: degree: the degree across sections must be 1 to 5",
        ),
        (
            "tolerance_mm = 0.2",
            "tolerance_mm = -0.2",
            "line 4, column 16: -0.2 is out of range: a positive number is needed",
        ),
        (
            "\"ball:6\"",
            "\"ball\"",
            "line 9, column 8: `ball` is no cutter",
        ),
        (
            "rough = \"flat:10\"",
            "scallop_mm = 2.0",
            "section [deliverables.toolpath]: scallop_mm = 2: must be less than half the radius",
        ),
        (
            "tool = \"ball:6\"",
            "",
            "section [deliverables.toolpath]: the key `tool` is missing",
        ),
        (
            "machine = \"mill/machine.toml\"",
            "",
            "section [deliverables.toolpath]: the key `machine` is missing",
        ),
        (
            "rough = \"flat:10\"",
            "pitch_mm = 20.0",
            "section [deliverables.toolpath]: pitch_mm = 20: must be 0.001 to 10",
        ),
        (
            "[deliverables.surface]\ntolerance_mm = 0.1",
            "",
            "section [deliverables.toolpath]: of = \"surface\" mills the surface of \
             [deliverables.surface], which is off",
        ),
        (
            "mill/machine.toml",
            "mill/other.toml",
            "section [deliverables.toolpath]: machine: cannot read",
        ),
        (
            "\"ball:6\"",
            "\"ball:7\"",
            "section [deliverables.toolpath]: tool: ",
        ),
        (
            "\"flat:10\"",
            "\"flat:12\"",
            "section [deliverables.toolpath]: rough: ",
        ),
    ] {
        assert!(ALL.contains(from), "{from}");
        let message = read(&ALL.replacen(from, to, 1), MACHINE).unwrap_err();
        assert!(message.contains(told), "{to}: {message}");
    }
    // A file that is there, and is wrong, is named.
    let wrong = MACHINE.replace("safe_z_mm", "save_z_mm");
    let message = read(ALL, &wrong).unwrap_err();
    for told in [
        "relief.toml, section [deliverables.toolpath]: machine: ",
        "mill/machine.toml: ",
        "unknown field `save_z_mm`",
    ] {
        assert!(message.contains(told), "{message}");
    }
}

#[test]
fn a_scan_may_choose_otherwise() {
    let own = |settings: &[(&str, Value)]| -> SettingOverrides {
        let settings = settings.iter();
        settings
            .map(|(key, value)| ((*key).to_owned(), value.clone()))
            .collect()
    };
    let configured = read(ALL, MACHINE).unwrap().processing();
    let chosen = own(&[
        ("deliverables.skin", json!("off")),
        ("deliverables.surface.fair_mm", json!(0.05)),
        ("deliverables.toolpath.tool", json!("bull:10:2")),
    ]);
    let changed = configured.with_overrides(&chosen).unwrap().deliverables;
    assert_eq!(changed.skin, None);
    let further = changed.further().unwrap();
    assert_eq!(further.surface.unwrap().fair_mm, Some(0.05));
    let milled = further.toolpath.unwrap();
    assert_eq!(milled.settings.finish.to_string(), "bull:10:2");
    assert_eq!(milled.machine.safe_z_mm, 30.0);

    // A section of its own, in any order of keys, with the machine's content.
    let machine: Value = toml::from_str(MACHINE).unwrap();
    let chosen = own(&[
        ("deliverables.toolpath.machine", machine),
        ("deliverables.toolpath.tool", json!("ball:6")),
    ]);
    let plain = Processing::default();
    let made = plain.with_overrides(&chosen).unwrap().deliverables;
    assert!(made.further().unwrap().toolpath.is_some());

    for (settings, told) in [
        (
            own(&[("deliverables.toolpath.tool", json!("ball:7"))]),
            "setting `deliverables.toolpath`: tool: ",
        ),
        (
            own(&[("deliverables.toolpath.machine", json!("/etc/passwd"))]),
            "setting `deliverables.toolpath.machine`: a machine's file is read with the \
             configuration",
        ),
        (
            own(&[("deliverables.skin", json!("on"))]),
            "setting `deliverables.skin`: `on` is neither a section nor \"off\"",
        ),
        (
            own(&[("deliverables.surface.tolerance", json!(1))]),
            "did you mean `tolerance_mm`?",
        ),
    ] {
        let refused = configured
            .with_overrides(&settings)
            .unwrap_err()
            .to_string();
        assert!(refused.contains(told), "{refused}");
    }
    assert!(
        Path::new("/etc/passwd").exists(),
        "or the refusal tells nothing"
    );
}

/// A network of the user's own is read with the configuration and kept with each scan.
#[test]
fn features_are_told_by_the_network_that_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("relief.toml");
    let load = |text: &str| {
        std::fs::write(&file, text).unwrap();
        Config::load_with_files(&file).map_err(|error| error.to_string())
    };
    let text = "[deliverables]\nfeatures = true\nfeatures_network = \"own.toml\"\n";
    let refused = load(text).unwrap_err();
    assert!(
        refused.contains("features_network: cannot read"),
        "{refused}"
    );
    std::fs::write(folder.path().join("own.toml"), "kind = \"soup\"\n").unwrap();
    let refused = load(text).unwrap_err();
    for told in [
        "section [deliverables]: features_network: ",
        "own.toml is no network: ",
    ] {
        assert!(refused.contains(told), "{refused}");
    }
    std::fs::write(folder.path().join("own.toml"), PUBLISHED).unwrap();
    let config = load(text).unwrap();
    let told = config.deliverables.further().unwrap().features;
    assert_eq!(told, Some(FeatureNetwork::read(PUBLISHED).unwrap()));
    assert_ne!(told, Some(FeatureNetwork::default()));

    // With a scan it stands with its content, and needs no file.
    let kept = serde_json::to_vec(&config.processing()).unwrap();
    let kept: Processing = serde_json::from_slice(&kept).unwrap();
    assert_eq!(kept, config.processing());
    assert_eq!(kept.deliverables.further().unwrap().features, told);

    // Others over the network: by name those that are built in, and any by its content.
    let own = |value: Value| -> SettingOverrides {
        [("deliverables.features_network".to_owned(), value)].into()
    };
    let told_by = |value: Value| {
        let made = config.processing().with_overrides(&own(value))?;
        Ok(made.deliverables.further().unwrap().features)
    };
    let default = told_by(json!("default")).unwrap_or_else(|e: OverrideError| panic!("{e}"));
    assert_eq!(default, Some(FeatureNetwork::default()));
    let by_content = told_by(json!({ "content": PUBLISHED })).unwrap();
    assert_eq!(by_content, told);
    for (value, why) in [
        (
            json!("/etc/passwd"),
            "a network's file is read with the configuration",
        ),
        (json!({ "content": "soup" }), "line 1"),
        (json!(3), "\"default\", \"published\""),
    ] {
        let refused = told_by(value).unwrap_err().to_string();
        assert!(refused.contains(why), "{refused}");
    }
    // Where features are off, no network makes them.
    let off = load("[deliverables]\nfeatures_network = \"published\"\n").unwrap();
    assert_eq!(off.deliverables.further().unwrap().features, None);
}

/// Changes to features are of one scan.
#[test]
fn features_are_changed_for_one_scan_where_they_are_asked_for() {
    let edit = json!([{ "id": 1, "type": "slot", "depth": 5.5 }]);
    let alone: SettingOverrides = [("deliverables.edit".to_owned(), edit.clone())].into();
    let plain = read("", MACHINE).unwrap();
    let refused = plain.processing().with_overrides(&alone).unwrap_err();
    assert!(
        refused.to_string().contains("set features = true"),
        "{refused}"
    );
    let mut both = alone;
    both.insert("deliverables.features".to_owned(), true.into());
    let made = plain.processing().with_overrides(&both).unwrap();
    let edits = made.deliverables.further().unwrap().edits;
    assert_eq!(edits.len(), 1);
    let own = edits[0].edit();
    assert_eq!((own.id, own.class.as_deref()), (1, Some("slot")));
    assert_eq!(own.dimensions_mm["depth"], 5.5);
    // As it stands with the job, and comes back.
    assert_eq!(serde_json::to_value(&edits).unwrap(), edit);

    let for_all = "[deliverables]\nfeatures = true\nedit = [{ id = 1, depth = 5.5 }]\n";
    let refused = read(for_all, MACHINE).unwrap_err();
    assert!(refused.contains("of one scan"), "{refused}");
}
