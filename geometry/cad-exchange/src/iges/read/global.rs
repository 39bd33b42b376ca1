//! The Global section: delimiters, units, resolution, who made the file.

use super::error::ReadError;
use super::lines::{Lines, Section};
use super::values::{Delimiters, Value, declared_delimiters, next_value, parse_real};

/// Columns of a Global line that hold text.
const TEXT_COLUMNS: usize = 72;

/// What the reader needs of the Global section.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Global {
    pub(super) delimiters: Delimiters,
    /// Millimetres to a unit of the file, its model scale accounted for.
    pub(super) unit_mm: f64,
    pub(super) product: String,
    pub(super) timestamp: String,
    /// In units of the file; 0 where it is not given.
    pub(super) resolution: f64,
    pub(super) author: String,
    pub(super) organization: String,
}

/// Fields by their numbers in the standard.
struct Fields(Vec<Value>);

impl Fields {
    fn get(&self, number: usize) -> &Value {
        // The two delimiters have been taken already.
        self.0.get(number - 3).unwrap_or(&Value::Empty)
    }

    fn text(&self, number: usize) -> String {
        match self.get(number) {
            Value::Text(text) | Value::Word(text) => text.clone(),
            Value::Empty => String::new(),
        }
    }

    fn real(&self, number: usize, name: &'static str, default: f64) -> Result<f64, ReadError> {
        match self.get(number) {
            Value::Empty => Ok(default),
            Value::Word(word) | Value::Text(word) => {
                parse_real(word).ok_or_else(|| ReadError::Global {
                    field: number,
                    name,
                    reason: format!("{word:?} is not a number"),
                })
            }
        }
    }
}

impl Global {
    pub(super) fn read(lines: &Lines) -> Result<Self, ReadError> {
        let mut text = Vec::with_capacity(lines.count(Section::Global) * TEXT_COLUMNS);
        for line in 0..lines.count(Section::Global) {
            text.extend_from_slice(lines.columns(Section::Global, line, 0..TEXT_COLUMNS));
        }
        let (delimiters, taken) = declared_delimiters(&text)?;
        let mut rest = text.iter().skip(taken).copied();
        let mut fields = Fields(Vec::new());
        loop {
            let (value, last) = next_value(|| rest.next(), delimiters).map_err(|reason| {
                let field = fields.0.len() + 3;
                ReadError::Global {
                    field,
                    name: "one of its fields",
                    reason,
                }
            })?;
            fields.0.push(value);
            if last {
                break;
            }
        }
        let scale = fields.real(13, "model space scale", 1.0)?;
        if scale <= 0.0 {
            return Err(ReadError::Global {
                field: 13,
                name: "model space scale",
                reason: format!("{scale} is not above 0"),
            });
        }
        Ok(Self {
            delimiters,
            unit_mm: unit_mm(&fields)? / scale,
            product: fields.text(3),
            timestamp: fields.text(18),
            resolution: fields.real(19, "minimum resolution", 0.0)?,
            author: fields.text(21),
            organization: fields.text(22),
        })
    }
}

/// Millimetres to the unit of the file: by its flag, or by its name where the flag
/// leaves it to the name.
fn unit_mm(fields: &Fields) -> Result<f64, ReadError> {
    let name = fields.text(15).trim().to_ascii_uppercase();
    let flag = fields.real(14, "units flag", if name.is_empty() { 1.0 } else { 3.0 })?;
    let by_flag = match flag {
        1.0 => Some(25.4),
        2.0 => Some(1.0),
        4.0 => Some(304.8),
        5.0 => Some(1_609_344.0),
        6.0 => Some(1000.0),
        7.0 => Some(1e6),
        8.0 => Some(0.0254),
        9.0 => Some(0.001),
        10.0 => Some(10.0),
        11.0 => Some(25.4e-6),
        _ => None,
    };
    let by_name = match name.as_str() {
        "IN" | "INCH" | "INCHES" => Some(25.4),
        "MM" => Some(1.0),
        "FT" => Some(304.8),
        "MI" => Some(1_609_344.0),
        "M" => Some(1000.0),
        "KM" => Some(1e6),
        "MIL" => Some(0.0254),
        "UM" => Some(0.001),
        "CM" => Some(10.0),
        "UIN" => Some(25.4e-6),
        _ => None,
    };
    by_flag
        .or(by_name.filter(|_| flag == 3.0))
        .ok_or_else(|| ReadError::Global {
            field: 14,
            name: "units flag",
            reason: format!("flag {flag} with the name {name:?} is not a unit of length"),
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn global(text: &str) -> Result<Global, ReadError> {
        let mut file = String::new();
        for (k, chunk) in text.as_bytes().chunks(TEXT_COLUMNS).enumerate() {
            let chunk = std::str::from_utf8(chunk).unwrap();
            file.push_str(&format!("{chunk:<72}G{:7}\n", k + 1));
        }
        file.push_str(&format!("{:<72}T{:7}\n", "", 1));
        Global::read(&Lines::read(file.as_bytes()).unwrap())
    }

    fn with_units(units: &str) -> Result<Global, ReadError> {
        global(&format!(
            "1H,,1H;,4Hpart,6Hpart.x,3Hsys,1H1,32,38,6,308,15,4Hpart,{units},1,0.,\
             15H20261121.093000,0.0001,46.,8HAda, Eve,,11,0,,;"
        ))
    }

    #[test]
    fn fields() {
        let global = with_units("1.,2,2HMM").unwrap();
        assert_eq!(global.unit_mm, 1.0);
        assert_eq!(global.product, "part");
        assert_eq!(global.timestamp, "20261121.093000");
        assert_eq!(global.resolution, 1e-4);
        assert_eq!(global.author, "Ada, Eve");
        assert_eq!(global.organization, "");
    }

    #[test]
    fn units() {
        for (units, expected) in [
            ("1.,1,4HINCH", 25.4),
            ("1.,6,1HM", 1000.0),
            ("1.,3,2HCM", 10.0),
            ("1.,,2HMM", 1.0),
            (",,", 25.4),
            ("0.5,2,2HMM", 2.0),
        ] {
            assert_eq!(with_units(units).unwrap().unit_mm, expected, "{units}");
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (units, expected) in [
            ("1.,0,", "field 14 (units flag): flag 0"),
            ("1.,3,5HCUBIT", "the name \"CUBIT\""),
            (
                "x,2,2HMM",
                "field 13 (model space scale): \"x\" is not a number",
            ),
            ("0.,2,2HMM", "0 is not above 0"),
            ("1.,2,999HMM", "field 15"),
        ] {
            let error = with_units(units).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
        assert!(global(",,1Hx").is_err());
    }
}
