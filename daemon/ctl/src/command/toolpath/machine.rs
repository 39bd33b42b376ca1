//! The machine's file.

use std::io::Read;
use std::path::Path;

use serde::Deserialize;
use toolpath::{Cuboid, Cutter, Dialect, Feed, Fixture, Machine, Speed, Tool};

use crate::failure::Failure;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MachineFile {
    dialect: DialectName,
    #[serde(default = "first_program")]
    program: u32,
    decimals: Option<u8>,
    safe_z_mm: f64,
    work_offset_mm: [f64; 3],
    #[serde(default = "first_offset")]
    work_offset_code: u32,
    rapid_mm_per_min: f64,
    max_feed_mm_per_min: f64,
    acceleration_mm_per_s2: Option<f64>,
    spindle_rpm: [f64; 2],
    #[serde(default)]
    coolant: bool,
    travel: Limits,
    stock: Limits,
    #[serde(default)]
    fixtures: Vec<FixtureTable>,
    tools: Vec<ToolTable>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum DialectName {
    Fanuc,
    LinuxCnc,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Limits {
    x_mm: [f64; 2],
    y_mm: [f64; 2],
    z_mm: [f64; 2],
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FixtureTable {
    name: String,
    x_mm: [f64; 2],
    y_mm: [f64; 2],
    z_mm: [f64; 2],
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ToolTable {
    number: u32,
    cutter: String,
    flutes: u32,
    spindle_rpm: Option<f64>,
    surface_m_per_min: Option<f64>,
    feed_mm_per_min: Option<f64>,
    chip_load_mm: Option<f64>,
    plunge_mm_per_min: f64,
    step_down_mm: Option<f64>,
    step_over_mm: Option<f64>,
    cutting_length_mm: Option<f64>,
    reach_mm: Option<f64>,
}

fn first_program() -> u32 {
    1
}

fn first_offset() -> u32 {
    54
}

/// Longest file that is read.
const MOST_BYTES: u64 = 1 << 20;

/// Reads and checks the machine's file.
pub(super) fn read(path: &Path) -> Result<Machine, Failure> {
    let name = path.display().to_string();
    let file = std::fs::File::open(path)
        .map_err(|error| Failure::at(format!("cannot read {name}"), &error))?;
    let mut text = String::new();
    file.take(MOST_BYTES + 1)
        .read_to_string(&mut text)
        .map_err(|error| Failure::at(format!("cannot read {name}"), &error))?;
    if text.len() as u64 > MOST_BYTES {
        return Err(Failure::Failed(format!(
            "{name}: is larger than 1 MiB, and no machine's file"
        )));
    }
    parse(&text).map_err(|why| Failure::Failed(format!("{name}: {why}")))
}

fn parse(text: &str) -> Result<Machine, String> {
    let file: MachineFile = toml::from_str(text).map_err(|error| error.to_string())?;
    let tools: Result<Vec<Tool>, String> = file.tools.iter().map(tool).collect();
    let dialect = match file.dialect {
        DialectName::Fanuc => Dialect::Fanuc,
        DialectName::LinuxCnc => Dialect::LinuxCnc,
    };
    // What controls of either kind take at least.
    let usual = match dialect {
        Dialect::Fanuc => 3,
        Dialect::LinuxCnc => 4,
    };
    let machine = Machine {
        dialect,
        program: file.program,
        decimals: file.decimals.unwrap_or(usual),
        travel: cuboid(&file.travel),
        work_offset_mm: file.work_offset_mm,
        work_offset_code: file.work_offset_code,
        rapid_mm_per_min: file.rapid_mm_per_min,
        max_feed_mm_per_min: file.max_feed_mm_per_min,
        acceleration_mm_per_s2: file.acceleration_mm_per_s2,
        spindle_rpm: file.spindle_rpm,
        coolant: file.coolant,
        safe_z_mm: file.safe_z_mm,
        stock: cuboid(&file.stock),
        fixtures: file.fixtures.into_iter().map(fixture).collect(),
        tools: tools?,
    };
    machine.validate().map_err(|error| error.to_string())?;
    Ok(machine)
}

fn cuboid(limits: &Limits) -> Cuboid {
    Cuboid {
        x_mm: limits.x_mm,
        y_mm: limits.y_mm,
        z_mm: limits.z_mm,
    }
}

fn fixture(table: FixtureTable) -> Fixture {
    Fixture {
        name: table.name,
        place: Cuboid {
            x_mm: table.x_mm,
            y_mm: table.y_mm,
            z_mm: table.z_mm,
        },
    }
}

fn tool(table: &ToolTable) -> Result<Tool, String> {
    let number = table.number;
    let cutter: Cutter = table
        .cutter
        .parse()
        .map_err(|error| format!("tool {number}: cutter: {error}"))?;
    let one_of = |names: &str| format!("tool {number}: give one of {names}");
    let speed = match (table.spindle_rpm, table.surface_m_per_min) {
        (Some(rpm), None) => Speed::Rpm(rpm),
        (None, Some(speed)) => Speed::Surface(speed),
        _ => return Err(one_of("spindle_rpm and surface_m_per_min")),
    };
    let feed = match (table.feed_mm_per_min, table.chip_load_mm) {
        (Some(feed), None) => Feed::PerMinute(feed),
        (None, Some(load)) => Feed::PerTooth(load),
        _ => return Err(one_of("feed_mm_per_min and chip_load_mm")),
    };
    let [step_down_mm, step_over_mm] = Tool::usual_steps_mm(&cutter);
    Ok(Tool {
        number,
        cutter,
        flutes: table.flutes,
        speed,
        feed,
        plunge_mm_per_min: table.plunge_mm_per_min,
        step_down_mm: table.step_down_mm.unwrap_or(step_down_mm),
        step_over_mm: table.step_over_mm.unwrap_or(step_over_mm),
        cutting_length_mm: table.cutting_length_mm,
        reach_mm: table.reach_mm,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXAMPLE: &str = include_str!("../../../../../config/machine.toml");

    #[test]
    fn the_example_is_a_machine() {
        let machine = parse(EXAMPLE).unwrap();
        assert_eq!(machine.dialect, Dialect::LinuxCnc);
        let ball = machine.tool(&"ball:6".parse().unwrap()).unwrap();
        assert_eq!((ball.number, ball.flutes), (1, 2));
        // 0.04 mm for each of two teeth at 12000 turns.
        assert_eq!(machine.feeds_mm_per_min(ball), [960.0, 300.0]);
        let flat = machine.tool(&"flat:10".parse().unwrap()).unwrap();
        // 250 m/min around 10 mm.
        assert_eq!(machine.spindle_rpm(flat), 7958.0);
        assert_eq!(flat.step_over_mm, 5.0);
    }

    #[test]
    fn what_is_wrong_is_told_by_its_key() {
        let told = |from: &str, to: &str| {
            assert!(EXAMPLE.contains(from), "{from}");
            parse(&EXAMPLE.replacen(from, to, 1)).unwrap_err()
        };
        for (from, to, expected) in [
            ("safe_z_mm", "save_z_mm", "unknown field `save_z_mm`"),
            (
                "dialect = \"linuxcnc\"",
                "dialect = \"heidenhain\"",
                "unknown variant `heidenhain`",
            ),
            (
                "\"ball:6\"",
                "\"ball\"",
                "tool 1: cutter: `ball` is no cutter",
            ),
            (
                "chip_load_mm = 0.04",
                "",
                "tool 1: give one of feed_mm_per_min",
            ),
            ("number = 2", "number = 1", "number 1 is there twice"),
            (
                "plunge_mm_per_min = 300",
                "plunge_mm_per_min = 0",
                "tool 1: plunge_mm_per_min = 0",
            ),
            (
                "plunge_mm_per_min = 300",
                "plunge_mm_per_min = 300\ncutting_length_mm = 20\nreach_mm = 15",
                "tool 1: reach_mm = 15: must be cutting_length_mm at least",
            ),
            (
                "spindle_rpm = 12000",
                "spindle_rpm = 90000",
                "6000 to 24000, as the spindle can",
            ),
        ] {
            let told = told(from, to);
            assert!(told.contains(expected), "{told}");
        }
    }
}
