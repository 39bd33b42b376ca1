//! The machine's file.

use std::io::Read;
use std::path::Path;

use serde::{Deserialize, Serialize};
use toolpath::{Cuboid, Cutter, Dialect, Feed, Fixture, Machine, Speed, Tool};

/// A machine as its file has it: the keys of `config/machine.toml`. Lengths in millimetres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MachineFile {
    dialect: DialectName,
    #[serde(default = "first_program")]
    program: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    decimals: Option<u8>,
    safe_z_mm: f64,
    work_offset_mm: [f64; 3],
    #[serde(default = "first_offset")]
    work_offset_code: u32,
    rapid_mm_per_min: f64,
    max_feed_mm_per_min: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
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

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum DialectName {
    Fanuc,
    LinuxCnc,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Limits {
    x_mm: [f64; 2],
    y_mm: [f64; 2],
    z_mm: [f64; 2],
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FixtureTable {
    name: String,
    x_mm: [f64; 2],
    y_mm: [f64; 2],
    z_mm: [f64; 2],
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ToolTable {
    number: u32,
    cutter: String,
    flutes: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    spindle_rpm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    surface_m_per_min: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    feed_mm_per_min: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    chip_load_mm: Option<f64>,
    plunge_mm_per_min: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    step_down_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
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

/// A machine's file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MachineFileError {
    /// It cannot be read.
    #[error("cannot read {name}: {source}")]
    Read {
        /// The file.
        name: String,
        /// Why not.
        source: std::io::Error,
    },
    /// It is something else.
    #[error("{name}: is larger than 1 MiB, and no machine's file")]
    Long {
        /// The file.
        name: String,
    },
    /// A key or value that cannot be.
    #[error("{name}: {why}")]
    Wrong {
        /// The file.
        name: String,
        /// Which, and what to do.
        why: String,
    },
}

impl MachineFile {
    /// Reads and checks a machine's file.
    ///
    /// # Errors
    /// Any [`MachineFileError`].
    pub fn read(path: &Path) -> Result<Self, MachineFileError> {
        let name = path.display().to_string();
        let mut text = String::new();
        let read = std::fs::File::open(path)
            .and_then(|file| file.take(MOST_BYTES + 1).read_to_string(&mut text));
        if let Err(source) = read {
            return Err(MachineFileError::Read { name, source });
        }
        if text.len() as u64 > MOST_BYTES {
            return Err(MachineFileError::Long { name });
        }
        Self::parse(&text).map_err(|why| MachineFileError::Wrong { name, why })
    }

    fn parse(text: &str) -> Result<Self, String> {
        let file: Self = toml::from_str(text).map_err(|error| error.to_string())?;
        file.machine()?;
        Ok(file)
    }

    /// The machine.
    ///
    /// # Errors
    /// The key whose value cannot be, and what it must be.
    pub fn machine(&self) -> Result<Machine, String> {
        let tools: Result<Vec<Tool>, String> = self.tools.iter().map(tool).collect();
        let dialect = match self.dialect {
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
            program: self.program,
            decimals: self.decimals.unwrap_or(usual),
            travel: cuboid(&self.travel),
            work_offset_mm: self.work_offset_mm,
            work_offset_code: self.work_offset_code,
            rapid_mm_per_min: self.rapid_mm_per_min,
            max_feed_mm_per_min: self.max_feed_mm_per_min,
            acceleration_mm_per_s2: self.acceleration_mm_per_s2,
            spindle_rpm: self.spindle_rpm,
            coolant: self.coolant,
            safe_z_mm: self.safe_z_mm,
            stock: cuboid(&self.stock),
            fixtures: self.fixtures.iter().map(fixture).collect(),
            tools: tools?,
        };
        machine.validate().map_err(|error| error.to_string())?;
        Ok(machine)
    }
}

fn cuboid(limits: &Limits) -> Cuboid {
    Cuboid {
        x_mm: limits.x_mm,
        y_mm: limits.y_mm,
        z_mm: limits.z_mm,
    }
}

fn fixture(table: &FixtureTable) -> Fixture {
    Fixture {
        name: table.name.clone(),
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

    const EXAMPLE: &str = include_str!("../../../../config/machine.toml");

    #[test]
    fn the_example_is_a_machine() {
        let file = MachineFile::parse(EXAMPLE).unwrap();
        let machine = file.machine().unwrap();
        assert_eq!(machine.dialect, Dialect::LinuxCnc);
        let ball = machine.tool(&"ball:6".parse().unwrap()).unwrap();
        assert_eq!((ball.number, ball.flutes), (1, 2));
        // 0.04 mm for each of two teeth at 12000 turns.
        assert_eq!(machine.feeds_mm_per_min(ball), [960.0, 300.0]);
        let flat = machine.tool(&"flat:10".parse().unwrap()).unwrap();
        // 250 m/min around 10 mm.
        assert_eq!(machine.spindle_rpm(flat), 7958.0);
        assert_eq!(flat.step_over_mm, 5.0);
        // As it is kept with a scan.
        let kept = serde_json::to_value(&file).unwrap();
        assert_eq!(serde_json::from_value::<MachineFile>(kept).unwrap(), file);
    }

    #[test]
    fn what_is_wrong_is_told_by_its_key() {
        let told = |from: &str, to: &str| {
            assert!(EXAMPLE.contains(from), "{from}");
            MachineFile::parse(&EXAMPLE.replacen(from, to, 1)).unwrap_err()
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
