//! The classes of faults, at rates that a device can recover from.

use sim_scanner::fault::{FaultSpec, Strikes};

use crate::conditions::{CLOCK_JUMP, Conditions, HOST_SLEEP, HostFaults, LONG_SLEEP, PAUSE};
use crate::scene::Dice;

/// Who ends what a class of faults brings about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// Nobody: scans end by themselves.
    Nobody,
    /// A person: the scan stops with a cause that has these words in it.
    Person(&'static str),
}

/// A class of faults.
#[derive(Debug, Clone, Copy)]
pub struct Class {
    /// Its name, as the simulator's.
    pub name: &'static str,
    /// The rate, and of what.
    pub rate: f64,
    /// What the rate is per.
    pub per: &'static str,
    /// Who ends it.
    pub need: Need,
}

const fn class(name: &'static str, rate: f64, per: &'static str) -> Class {
    Class {
        name,
        rate,
        per,
        need: Need::Nobody,
    }
}

const fn person(name: &'static str, rate: f64, words: &'static str) -> Class {
    Class {
        name,
        rate,
        per: "column",
        need: Need::Person(words),
    }
}

/// All classes.
pub const CLASSES: [Class; 24] = [
    class("flip", 1e-4, "bit"),
    class("lose", 1e-3, "byte"),
    class("double", 1e-3, "byte"),
    class("garbage", 1e-3, "byte"),
    class("flood", 4e-4, "byte"),
    class("stall", 4e-4, "byte"),
    class("cut", 0.05, "frame"),
    class("replay", 0.05, "frame"),
    class("delay", 0.05, "frame"),
    class("reorder", 0.1, "frame"),
    class("reset", 0.06, "column"),
    class("babble", 1.0, "start"),
    class("table-stall", 0.06, "column"),
    class("over-temperature", 0.06, "column"),
    class(CLOCK_JUMP, 0.06, "column"),
    class("unplug", 0.06, "column"),
    class("wrong-serial", 0.06, "column"),
    class(HOST_SLEEP, 0.06, "column"),
    person(LONG_SLEEP, 0.06, "did not hear from this computer"),
    person("limit-switch", 0.06, "limit switch hit"),
    person("laser", 0.06, "laser fault"),
    person("interlock", 0.06, "interlock open"),
    person("move-part", 0.06, "has moved"),
    person(PAUSE, 0.06, "paused on request"),
];

impl Class {
    /// The class of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        CLASSES.iter().find(|class| class.name == name)
    }

    /// How often it struck.
    #[must_use]
    pub fn strikes(&self, strikes: &Strikes) -> u64 {
        strikes.of(self.name)
    }

    /// A scan under this class alone.
    #[must_use]
    pub fn alone(&self, seed: u64) -> Conditions {
        conditions(&[(self, self.rate)], seed)
    }
}

/// A scan under several classes, drawn from the seed, each at up to its rate.
#[must_use]
pub fn mix(seed: u64) -> (Conditions, Vec<&'static Class>) {
    let mut dice = Dice::new(seed, 1);
    let mut chosen = Vec::new();
    for class in &CLASSES {
        let share = if class.need == Need::Nobody { 0.3 } else { 0.1 };
        let rate = class.rate * 10.0_f64.powf(-2.0 * dice.uniform());
        if dice.uniform() < share {
            chosen.push((class, rate));
        }
    }
    let conditions = conditions(&chosen, seed);
    (
        conditions,
        chosen.into_iter().map(|(class, _)| class).collect(),
    )
}

#[allow(clippy::panic)] // A class of the table above that does nothing is a defect.
fn conditions(classes: &[(&Class, f64)], seed: u64) -> Conditions {
    let mut faults = FaultSpec::default();
    let mut host = HostFaults::default();
    let mut pause = 0.0;
    for (class, rate) in classes {
        let (line, device) = (&mut faults.line, &mut faults.device);
        let place = match class.name {
            "flip" => &mut line.flip,
            "lose" => &mut line.lose,
            "double" => &mut line.double,
            "garbage" => &mut line.garbage,
            "flood" => &mut line.flood,
            "stall" => &mut line.stall,
            "cut" => &mut line.cut,
            "replay" => &mut line.replay,
            "delay" => &mut line.delay,
            "reorder" => &mut line.reorder,
            "reset" => &mut device.reset,
            "babble" => {
                // Nothing babbles that does not start.
                device.reset = device.reset.max(0.02 * rate);
                &mut device.babble
            }
            "table-stall" => &mut device.table_stall,
            "over-temperature" => &mut device.over_temperature,
            CLOCK_JUMP => {
                device.clock_jump = *rate;
                &mut host.clock_jump
            }
            "unplug" => &mut device.unplug,
            "wrong-serial" => &mut device.wrong_serial,
            "limit-switch" => &mut device.limit_switch,
            "laser" => &mut device.laser,
            "interlock" => &mut device.interlock,
            "move-part" => &mut device.move_part,
            HOST_SLEEP => &mut host.sleep,
            LONG_SLEEP => &mut host.long_sleep,
            PAUSE => &mut pause,
            name => panic!("no fault is called {name}"),
        };
        *place = *rate;
    }
    faults.line.seed = seed;
    faults.device.seed = seed;
    Conditions {
        seed,
        faults,
        host,
        pause,
        careless: false,
        // Every other scan is on a line that nobody sees being pulled.
        feels_the_plug: seed.is_multiple_of(2),
    }
}
