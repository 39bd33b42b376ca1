//! The machine, what is clamped on it, and its tools.

use crate::cutter::{Cutter, Kind};

/// Decimals that coordinates are written with.
pub const DECIMALS: std::ops::RangeInclusive<u8> = 3..=5;

/// The dialect of a control.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dialect {
    /// Fanuc and others that follow ISO 6983.
    Fanuc,
    /// LinuxCNC.
    LinuxCnc,
}

/// A box with edges along the axes: least and greatest x, y and z, millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cuboid {
    /// Along x.
    pub x_mm: [f64; 2],
    /// Along y.
    pub y_mm: [f64; 2],
    /// Along z.
    pub z_mm: [f64; 2],
}

impl Cuboid {
    /// Its limits by the axis' number.
    #[must_use]
    pub fn axis(&self, axis: usize) -> [f64; 2] {
        match axis {
            0 => self.x_mm,
            1 => self.y_mm,
            _ => self.z_mm,
        }
    }
}

/// Something that the tool must not touch.
#[derive(Debug, Clone, PartialEq)]
pub struct Fixture {
    /// What it is called in messages.
    pub name: String,
    /// Where it is, in the coordinates of the model.
    pub place: Cuboid,
}

/// How fast a spindle turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speed {
    /// Turns per minute.
    Rpm(f64),
    /// Speed of the cutting edge, metres per minute, at the cutter's full diameter.
    Surface(f64),
}

/// How fast a tool is fed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Feed {
    /// Millimetres per minute.
    PerMinute(f64),
    /// Chip load: millimetres per tooth.
    PerTooth(f64),
}

/// A tool in the machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Tool {
    /// Its number, which is that of its length offset as well.
    pub number: u32,
    /// What it is.
    pub cutter: Cutter,
    /// How many teeth it has.
    pub flutes: u32,
    /// How fast it turns.
    pub speed: Speed,
    /// How fast it is fed.
    pub feed: Feed,
    /// How fast it is fed downwards into material, millimetres per minute.
    pub plunge_mm_per_min: f64,
    /// Depth of a level of roughing, millimetres.
    pub step_down_mm: f64,
    /// Distance of passes of roughing, millimetres.
    pub step_over_mm: f64,
    /// Length of its cutting edges from the tip, millimetres, if that is known.
    pub cutting_length_mm: Option<f64>,
    /// How far its tip stands out of what holds it, millimetres, if that is known.
    pub reach_mm: Option<f64>,
}

/// A machine, set up for a part. Millimetres; all but the travel in the coordinates of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// What its control reads.
    pub dialect: Dialect,
    /// Number of the program, 1 to 9999.
    pub program: u32,
    /// Decimals of coordinates.
    pub decimals: u8,
    /// Where its axes can go, machine coordinates.
    pub travel: Cuboid,
    /// Machine coordinates of the model's origin, with the tool's length offset in effect.
    pub work_offset_mm: [f64; 3],
    /// Which work offset that is, 54 to 59 for G54 to G59.
    pub work_offset_code: u32,
    /// Speed of rapid moves.
    pub rapid_mm_per_min: f64,
    /// Greatest feed.
    pub max_feed_mm_per_min: f64,
    /// Acceleration of the axes, mm/s2; without it, times are those of instant changes of speed.
    pub acceleration_mm_per_s2: Option<f64>,
    /// Slowest and fastest spindle, turns per minute.
    pub spindle_rpm: [f64; 2],
    /// Whether coolant is wanted.
    pub coolant: bool,
    /// Height at which the tool may go anywhere.
    pub safe_z_mm: f64,
    /// The material.
    pub stock: Cuboid,
    /// What must not be touched.
    pub fixtures: Vec<Fixture>,
    /// Its tools.
    pub tools: Vec<Tool>,
}

/// What does not hold together in a machine's description.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MachineError {
    /// A value outside of its limits.
    #[error("{key} = {value}: must be {must}")]
    Value {
        /// Name of the key.
        key: String,
        /// Its value.
        value: f64,
        /// What it must be.
        must: String,
    },
    /// Limits the wrong way round.
    #[error("{key} = [{}, {}]: the first must be less than the second", limits[0], limits[1])]
    Limits {
        /// Name of the key.
        key: String,
        /// Its value.
        limits: [f64; 2],
    },
    /// Two tools of one number.
    #[error("tools: number {0} is there twice")]
    Twice(u32),
    /// Two tools of one cutter: which is meant would be a guess.
    #[error("tools: numbers {} and {} both are {cutter}; leave one of them out", numbers[0], numbers[1])]
    SameCutter {
        /// Their numbers.
        numbers: [u32; 2],
        /// What both are.
        cutter: Cutter,
    },
    /// A tool that is asked for is not there.
    #[error("the machine has no tool {wanted}, only {there}: add it to its [[tools]]")]
    NoTool {
        /// What is asked for.
        wanted: Cutter,
        /// What there is.
        there: String,
    },
}

/// Least step of roughing.
const LEAST_STEP_MM: f64 = 0.01;

impl Machine {
    /// Whether all of it makes sense.
    ///
    /// # Errors
    /// [`MachineError`], naming the key.
    pub fn validate(&self) -> Result<(), MachineError> {
        let positive = |key: &str, value: f64| check(key, value, value > 0.0, "above 0");
        let within = |key: &str, value: f64, low: f64, high: f64| {
            let must = format!("{low} to {high}");
            check(key, value, (low..=high).contains(&value), &must)
        };
        within("program", f64::from(self.program), 1.0, 9999.0)?;
        let (low, high) = (*DECIMALS.start(), *DECIMALS.end());
        within(
            "decimals",
            f64::from(self.decimals),
            low.into(),
            high.into(),
        )?;
        cuboid("travel", &self.travel)?;
        for value in self.work_offset_mm {
            check("work_offset_mm", value, value.is_finite(), "finite")?;
        }
        within(
            "work_offset_code",
            f64::from(self.work_offset_code),
            54.0,
            59.0,
        )?;
        positive("rapid_mm_per_min", self.rapid_mm_per_min)?;
        positive("max_feed_mm_per_min", self.max_feed_mm_per_min)?;
        if let Some(acceleration) = self.acceleration_mm_per_s2 {
            positive("acceleration_mm_per_s2", acceleration)?;
        }
        limits("spindle_rpm", self.spindle_rpm)?;
        positive("spindle_rpm", self.spindle_rpm[0])?;
        check(
            "safe_z_mm",
            self.safe_z_mm,
            self.safe_z_mm.is_finite(),
            "finite",
        )?;
        cuboid("stock", &self.stock)?;
        for fixture in &self.fixtures {
            cuboid(&format!("fixture `{}`", fixture.name), &fixture.place)?;
        }
        for (k, tool) in self.tools.iter().enumerate() {
            if self.tools[..k]
                .iter()
                .any(|other| other.number == tool.number)
            {
                return Err(MachineError::Twice(tool.number));
            }
            let same = self.tools[..k]
                .iter()
                .find(|other| other.cutter == tool.cutter);
            if let Some(same) = same {
                return Err(MachineError::SameCutter {
                    numbers: [same.number, tool.number],
                    cutter: tool.cutter,
                });
            }
            self.validate_tool(tool)?;
        }
        Ok(())
    }

    fn validate_tool(&self, tool: &Tool) -> Result<(), MachineError> {
        let key = |name: &str| format!("tool {}: {name}", tool.number);
        let positive = |name: &str, value: f64| check(&key(name), value, value > 0.0, "above 0");
        let number = f64::from(tool.number);
        check(
            &key("number"),
            number,
            (1.0..=9999.0).contains(&number),
            "1 to 9999",
        )?;
        positive("flutes", f64::from(tool.flutes))?;
        positive("plunge_mm_per_min", tool.plunge_mm_per_min)?;
        for (name, step_mm) in [
            ("step_down_mm", tool.step_down_mm),
            ("step_over_mm", tool.step_over_mm),
        ] {
            check(
                &key(name),
                step_mm,
                step_mm >= LEAST_STEP_MM,
                "0.01 at least",
            )?;
        }
        for (name, length_mm) in [
            ("cutting_length_mm", tool.cutting_length_mm),
            ("reach_mm", tool.reach_mm),
        ] {
            positive(name, length_mm.unwrap_or(1.0))?;
        }
        if let (Some(cutting_mm), Some(reach_mm)) = (tool.cutting_length_mm, tool.reach_mm) {
            check(
                &key("reach_mm"),
                reach_mm,
                reach_mm >= cutting_mm,
                "cutting_length_mm at least",
            )?;
        }
        let most = 2.0 * tool.cutter.radius_mm();
        check(
            &key("step_over_mm"),
            tool.step_over_mm,
            tool.step_over_mm < most,
            &format!("less than the diameter, {most}"),
        )?;
        match tool.speed {
            Speed::Rpm(rpm) => positive("spindle_rpm", rpm)?,
            Speed::Surface(speed) => positive("surface_m_per_min", speed)?,
        }
        match tool.feed {
            Feed::PerMinute(feed) => positive("feed_mm_per_min", feed)?,
            Feed::PerTooth(load) => positive("chip_load_mm", load)?,
        }
        let [slowest, fastest] = self.spindle_rpm;
        // A surface speed may ask for more turns than the spindle reaches, but not for fewer than it
        // can do: those would be too fast for the cutter. A number of turns must be one that it can.
        if let Speed::Surface(speed) = tool.speed {
            let must = format!("so much that {slowest} turns a minute are not too fast for it");
            let is_slow = self.spindle_rpm(tool) < slowest;
            check(&key("surface_m_per_min"), speed, !is_slow, &must)?;
        }
        if let Speed::Rpm(rpm) = tool.speed {
            let must = format!("{slowest} to {fastest}, as the spindle can");
            check(
                &key("spindle_rpm"),
                rpm,
                (slowest..=fastest).contains(&rpm),
                &must,
            )?;
        }
        Ok(())
    }

    /// The tool with a cutter.
    ///
    /// # Errors
    /// [`MachineError::NoTool`]
    pub fn tool(&self, cutter: &Cutter) -> Result<&Tool, MachineError> {
        let found = self.tools.iter().find(|tool| tool.cutter == *cutter);
        found.ok_or_else(|| {
            let names: Vec<String> = self.tools.iter().map(|t| t.cutter.to_string()).collect();
            MachineError::NoTool {
                wanted: *cutter,
                there: if names.is_empty() {
                    "none at all".to_owned()
                } else {
                    names.join(", ")
                },
            }
        })
    }

    /// Turns per minute of a tool, within what the spindle can.
    #[must_use]
    pub fn spindle_rpm(&self, tool: &Tool) -> f64 {
        let rpm = match tool.speed {
            Speed::Rpm(rpm) => rpm,
            Speed::Surface(m_per_min) => {
                let round_mm = core::f64::consts::TAU * tool.cutter.radius_mm();
                1000.0 * m_per_min / round_mm
            }
        };
        // Slower than asked for harms no cutter.
        let [_, fastest] = self.spindle_rpm;
        rpm.min(fastest).round()
    }

    /// Feeds of a tool, millimetres per minute: along the surface, and downwards into material.
    #[must_use]
    pub fn feeds_mm_per_min(&self, tool: &Tool) -> [f64; 2] {
        let feed = match tool.feed {
            Feed::PerMinute(feed) => feed,
            Feed::PerTooth(load_mm) => load_mm * f64::from(tool.flutes) * self.spindle_rpm(tool),
        };
        [feed, tool.plunge_mm_per_min].map(|feed| feed.min(self.max_feed_mm_per_min))
    }
}

impl Tool {
    /// A tool with steps in proportion to its diameter.
    #[must_use]
    pub fn usual_steps_mm(cutter: &Cutter) -> [f64; 2] {
        let diameter = 2.0 * cutter.radius_mm();
        let over = match cutter.kind() {
            Kind::Ball => 0.3,
            Kind::Flat | Kind::Bull => 0.5,
        };
        [0.2 * diameter, over * diameter]
    }
}

fn check(key: &str, value: f64, holds: bool, must: &str) -> Result<(), MachineError> {
    if holds && value.is_finite() {
        return Ok(());
    }
    Err(MachineError::Value {
        key: key.to_owned(),
        value,
        must: must.to_owned(),
    })
}

fn limits(key: &str, limits: [f64; 2]) -> Result<(), MachineError> {
    if limits[0] < limits[1] && limits.iter().all(|limit| limit.is_finite()) {
        return Ok(());
    }
    Err(MachineError::Limits {
        key: key.to_owned(),
        limits,
    })
}

fn cuboid(key: &str, place: &Cuboid) -> Result<(), MachineError> {
    for (axis, name) in ["x_mm", "y_mm", "z_mm"].iter().enumerate() {
        limits(&format!("{key}.{name}"), place.axis(axis))?;
    }
    Ok(())
}
