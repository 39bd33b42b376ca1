//! The tables.

use std::collections::BTreeMap;

use shapes::Family;

use crate::compare::{Face, Found, Number};

const FREE_FORM: &str = "free-form";

fn name(found: &Found) -> &'static str {
    if found.is_unknown {
        "unknown"
    } else {
        found.family.map_or(FREE_FORM, Family::as_str)
    }
}

/// Whether a face is what it should be; `None` where there is no telling.
fn is_right(face: &Face) -> Option<bool> {
    let found = face.found.as_ref()?;
    face.real.family().map(|real| found.family == Some(real))
}

/// Every face that is not as it should be.
pub(crate) fn list(faces: &[Face]) {
    for face in faces {
        let found = face.found.as_ref().map_or("no region", name);
        if is_right(face) != Some(true) {
            println!(
                "{}, face {}, {} nodes: {}, found {found}",
                face.scene,
                face.label,
                face.nodes,
                face.real.name()
            );
        }
        for number in face.found.iter().flat_map(|found| &found.numbers) {
            let off = number.error / number.stated;
            if off.abs() > 3.0 {
                println!(
                    "{}, face {}, {} nodes: {} of the {} off by {:.4}, {off:.1} standard \
                     uncertainties; {}",
                    face.scene,
                    face.label,
                    face.nodes,
                    number.name,
                    face.real.name(),
                    number.error,
                    rests_on(face),
                );
            }
        }
    }
    println!();
}

fn rests_on(face: &Face) -> String {
    let known = face.found.as_ref().and_then(|found| found.rests_on);
    known.map_or_else(
        || "on nothing".into(),
        |(samples, rms_mm)| format!("{samples} samples, {rms_mm:.4} mm rms"),
    )
}

/// What faces are, and what was found; returns the share that is right, percent.
pub(crate) fn kinds(faces: &[Face]) -> f64 {
    let columns = Family::ALL.map(Family::as_str);
    let columns = columns.into_iter().chain([FREE_FORM, "unknown"]);
    let columns: Vec<&str> = columns.collect();
    println!(
        "| face is | faces | no region | {} | right, % |",
        columns.join(" | ")
    );
    println!("| --- {}|", "| --- ".repeat(columns.len() + 3));
    let mut by_real: BTreeMap<&str, Vec<&Face>> = BTreeMap::new();
    for face in faces {
        by_real.entry(face.real.name()).or_default().push(face);
    }
    for (real, faces) in &by_real {
        let found: Vec<&Found> = faces
            .iter()
            .filter_map(|face| face.found.as_ref())
            .collect();
        let counts = columns.iter().map(|column| {
            let count = found.iter().filter(|found| name(found) == *column).count();
            count.to_string()
        });
        println!(
            "| {real} | {} | {} | {} | {} |",
            faces.len(),
            faces.len() - found.len(),
            counts.collect::<Vec<_>>().join(" | "),
            share(faces.iter().copied()).map_or("-".into(), |share| format!("{share:.1}")),
        );
    }
    let all = share(faces.iter()).unwrap_or(0.0);
    println!("\nOf the faces with a kind and a region, {all:.1} % are found to be of it.\n");
    all
}

fn share<'a>(faces: impl Iterator<Item = &'a Face>) -> Option<f64> {
    let told: Vec<bool> = faces.filter_map(is_right).collect();
    let right = told.iter().filter(|right| **right).count();
    (!told.is_empty()).then(|| 100.0 * right as f64 / told.len() as f64)
}

/// How near numbers are to the truth, and how near they say they are.
pub(crate) fn numbers(faces: &[Face]) {
    println!(
        "| of | number | faces | rms error | median stated | rms error / stated | within 95 % \
         interval, % |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    let mut groups: BTreeMap<(&str, &str), Vec<&Number>> = BTreeMap::new();
    for face in faces.iter().filter(|face| is_right(face) == Some(true)) {
        for number in face.found.iter().flat_map(|found| &found.numbers) {
            let group = (face.real.name(), number.name);
            groups.entry(group).or_default().push(number);
        }
    }
    for ((real, name), numbers) in &groups {
        let rms = |value: &dyn Fn(&Number) -> f64| {
            let squares = numbers.iter().map(|number| value(number).powi(2));
            (squares.sum::<f64>() / numbers.len() as f64).sqrt()
        };
        let mut stated: Vec<f64> = numbers.iter().map(|number| number.stated).collect();
        stated.sort_by(f64::total_cmp);
        let within = numbers
            .iter()
            .filter(|number| number.error.abs() <= 1.96 * number.stated)
            .count();
        println!(
            "| {real} | {name} | {} | {:.5} | {:.5} | {:.2} | {:.1} |",
            numbers.len(),
            rms(&|number| number.error),
            stated[stated.len() / 2],
            rms(&|number| number.error / number.stated),
            100.0 * within as f64 / numbers.len() as f64,
        );
    }
}
