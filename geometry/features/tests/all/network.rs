//! Networks: shipped ones are what their recipes make, files are read back, bad ones refused.

use features::class::Class;
use features::network::{Classifier, PUBLISHED, Recipe, SHIPPED, Teaching, train};
use features::patterns::table_2;
use range_image::Unmonitored;

/// The same recipe gives the same bytes on any machine, so that the files hide nothing.
#[test]
fn shipped_networks_are_what_their_recipes_make() {
    for (text, recipe) in [(SHIPPED, Recipe::SHIPPED), (PUBLISHED, Recipe::PUBLISHED)] {
        let (made, _) = train(&recipe, &[], &Unmonitored).unwrap();
        assert!(
            made.written() == text,
            "geometry/features/networks has another network; make it anew with `relief features train`"
        );
    }
    assert_eq!(Classifier::shipped().net().sizes(), [17, 30, 8]);
    assert_eq!(Classifier::published().net().sizes(), [9, 15, 6]);
}

#[test]
fn the_published_network_knows_its_six_rows_and_always_answers() {
    let published = Classifier::published();
    assert!(published.trained().has_converged);
    for pattern in table_2() {
        let verdict = published.classify(&pattern.attributes);
        assert_eq!(verdict.known(), Some(pattern.class.as_str()));
        assert!(verdict.score > 0.95, "{verdict:?}");
        let mut nonsense = pattern.attributes;
        nonsense.code.clear();
        assert!(!published.classify(&nonsense).is_unknown());
    }
}

#[test]
fn the_default_network_knows_the_rows_too_and_more() {
    let shipped = Classifier::shipped();
    for pattern in table_2() {
        let verdict = shipped.classify(&pattern.attributes);
        assert_eq!(verdict.known(), Some(pattern.class.as_str()), "{verdict:?}");
    }
    let names: Vec<&str> = Class::TAUGHT.iter().map(|own| own.as_str()).collect();
    assert_eq!(shipped.classes(), names);
}

#[test]
fn another_seed_is_another_network_and_the_same_seed_the_same() {
    let small = |seed: u64| {
        let recipe = Recipe {
            seed,
            teaching: Teaching::Drawn(30),
            ..Recipe::SHIPPED
        };
        train(&recipe, &[], &Unmonitored).unwrap().0
    };
    let first = small(5);
    assert_eq!(first, small(5));
    assert_ne!(first.net(), small(6).net());
    let text = first.written();
    let read = Classifier::read(&text).unwrap();
    assert_eq!(read, first);
    assert_eq!(read.written(), text);
}

#[test]
fn files_that_are_no_network_are_refused() {
    for (from, to, words) in [
        ("version = 1", "version = 2", "version 2"),
        ("relief-feature-network", "relief-machine", "relief-machine"),
        ("digits = 7", "digits = 8", "must be 11"),
        ("hidden = 15", "hidden = 14", "neuron 1 has 16 weights"),
        ("class = \"hole\"", "class = \"hull\"", "none of classes"),
        (
            "\"hole\", \"block\"",
            "\"hole\", \"hole\"",
            "names that differ",
        ),
        (
            "seed = 1",
            "seed = 1\nsalt = 2",
            "line 13: unknown field `salt`",
        ),
        ("seed = 1", "seed = -1", "recipe.seed"),
        ("4543212", "4543218", "digits are 1 to 5"),
        (
            "sense = \"concave\"",
            "sense = \"hollow\"",
            "concave or convex",
        ),
        (
            "hidden = [",
            "hidden = [ [nan, 0, 0, 0, 0, 0, 0, 0, 0, 0],",
            "weights",
        ),
        ("classes = [", "classes = ", "line 6"),
    ] {
        assert!(PUBLISHED.contains(from), "{from}");
        let error = Classifier::read(&PUBLISHED.replacen(from, to, 1)).unwrap_err();
        assert!(error.to_string().contains(words), "{words}: {error}");
    }
    let mut lines: Vec<&str> = PUBLISHED.lines().collect();
    let first = lines
        .iter()
        .position(|line| line.starts_with("    ["))
        .unwrap();
    lines[first] = "    [inf, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],";
    let error = Classifier::read(&lines.join("\n")).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("weight 0 of the hidden layer is not finite")
    );
    assert!(Classifier::read("").is_err());
    assert!(Classifier::read(&SHIPPED.replace("distance = ", "distance = -")).is_err());
}
