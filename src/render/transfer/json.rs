//! Transfer functions from JSON files.

use super::{Error, Result, TransferFunction, check_colors, check_opacity, parse_color};
use serde_json::Value;
use serde_json::error::Category;

/// The meaning of places.
#[derive(Clone, Copy, Default, PartialEq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
enum Positions {
    #[default]
    Fractions,
    Values,
}

/// The content of the file. Lists are values here, so that a message can name the point that is wrong.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields, expecting = "a JSON object such as {\"map\": \"viridis\"}")]
struct File {
    map: Option<String>,
    colors: Option<Vec<Value>>,
    opacity: Option<Vec<Value>>,
    range: Option<Value>,
    #[serde(default)]
    positions: Positions,
}

impl TransferFunction {
    /// A function from its JSON form ([`JSON_HELP`](super::JSON_HELP)).
    ///
    /// # Errors
    /// [`Error::Invalid`] with the line of a syntax error, or with the point that is wrong; or as
    /// [`TransferFunction::new`].
    pub fn from_json(text: &str) -> Result<Self> {
        let file: File = serde_json::from_str(text).map_err(|e| Error::Invalid(explain(text, &e)))?;
        let opacity = file.opacity.map(|points| points.iter().enumerate().map(opacity_point).collect::<Result<Vec<_>>>()).transpose()?;
        let mut range = file.range.as_ref().map(range_of).transpose()?;
        let colors = match (file.map, file.colors) {
            (Some(map), None) if file.positions == Positions::Fractions => Self::named(&map)?.colors,
            (Some(_), None) => {
                return Err(invalid("\"positions\": \"values\" needs \"colors\"; the places of a \"map\" are fractions of the range"));
            }
            (None, Some(colors)) => colors.iter().enumerate().map(color_point).collect::<Result<Vec<_>>>()?,
            (None, None) => return Err(invalid("neither \"map\" nor \"colors\" is given")),
            (Some(_), Some(_)) => return Err(invalid("both \"map\" and \"colors\" are given; leave one of them out")),
        };
        let in_values = file.positions == Positions::Values;
        check_colors(&colors, in_values)?;
        opacity.as_ref().map_or(Ok(()), |opacity| check_opacity(opacity, in_values))?;
        if in_values {
            // By default, the range that they span together.
            let values = || colors.iter().map(|c| c.0).chain(opacity.iter().flatten().map(|o| o.0));
            range = range.or_else(|| Some([values().fold(f32::MAX, f32::min), values().fold(f32::MIN, f32::max)]));
        }
        if let Some([lo, hi]) = range.filter(|[lo, hi]| !(lo < hi && (hi - lo).is_finite())) {
            return Err(Error::Invalid(format!("the range from {lo} to {hi} is empty; its first value must be below the second")));
        }
        let in_values = [in_values, in_values && opacity.is_some()];
        Ok(Self { colors, opacity, range, in_values })
    }
}

fn invalid(message: &str) -> Error {
    Error::Invalid(message.into())
}

/// Says what is wrong with a file, and in which line.
fn explain(text: &str, error: &serde_json::Error) -> String {
    let place = format!("line {}, column {}", error.line(), error.column());
    let message = error.to_string();
    let message = message.rsplit_once(" at line ").map_or(message.as_str(), |(message, _)| message);
    match error.classify() {
        Category::Eof if text.trim().is_empty() => {
            "the file is empty; a transfer function is a JSON object such as {\"map\": \"viridis\"}".into()
        }
        Category::Eof => format!("{place}: the file ends in the middle of the JSON object"),
        Category::Syntax => format!("{place}: not valid JSON: {message}"),
        Category::Data | Category::Io => format!("{place}: {message}"),
    }
}

/// The value as it stands in the file, cut short.
fn shown(value: &Value) -> String {
    let text = value.to_string();
    if text.chars().count() > 60 { text.chars().take(60).chain(['…']).collect() } else { text }
}

fn number(value: &Value) -> Option<f32> {
    value.as_f64().map(|x| x as f32)
}

/// A colour point of the file, by its number from 0.
fn color_point((i, point): (usize, &Value)) -> Result<(f32, [f32; 3])> {
    let wrong = || {
        let point = shown(point);
        Error::Invalid(format!(
            "point {} of \"colors\" is {point}, not [PLACE, COLOUR] such as [0.5, \"#1a2a6c\"] or [0.5, [0.1, 0.2, 0.4]]",
            i + 1
        ))
    };
    let Some([place, color]) = point.as_array().map(Vec::as_slice) else { return Err(wrong()) };
    let color = match color {
        Value::String(text) => parse_color(text),
        Value::Array(channels) => match channels.as_slice() {
            [r, g, b] => number(r).zip(number(g)).zip(number(b)).map(|((r, g), b)| [r, g, b]),
            _ => None,
        },
        _ => None,
    };
    number(place).zip(color).ok_or_else(wrong)
}

/// An opacity point of the file, by its number from 0.
fn opacity_point((i, point): (usize, &Value)) -> Result<(f32, f32)> {
    let pair = point.as_array().map(Vec::as_slice);
    let pair = if let Some([place, opacity]) = pair { number(place).zip(number(opacity)) } else { None };
    pair.ok_or_else(|| {
        Error::Invalid(format!("point {} of \"opacity\" is {}, not [PLACE, OPACITY] such as [0.5, 0.1]", i + 1, shown(point)))
    })
}

fn range_of(range: &Value) -> Result<[f32; 2]> {
    let pair = if let Some([lo, hi]) = range.as_array().map(Vec::as_slice) { number(lo).zip(number(hi)) } else { None };
    pair.map(<[f32; 2]>::from).ok_or_else(|| Error::Invalid(format!("\"range\" is {}, not [LO, HI] such as [0, 100]", shown(range))))
}
