//! Transfer functions: from a field's value to colour and opacity.

use super::maps;
use crate::error::{Error, Result};

/// A piecewise-linear function from a place in the field's range, 0…1, to sRGB colour and opacity per
/// [`OPACITY_UNIT`](super::OPACITY_UNIT). Two points at one place make a step.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFunction {
    colors: Vec<(f32, [f32; 3])>,
    opacity: Option<Vec<(f32, f32)>>,
    range: Option<[f32; 2]>,
    /// Whether the places of colours and of opacities are values of the field; there is a range then.
    in_values: [bool; 2],
}

/// Name of the default map.
pub const DEFAULT_MAP: &str = "viridis";
/// The opacity if none is given and [`auto_opacity`](super::auto_opacity) has no data: faint where the field is low,
/// dense where it is high.
pub const DEFAULT_OPACITY: &[(f32, f32)] = &[(0.0, 0.04), (0.25, 0.08), (0.5, 0.18), (0.75, 0.38), (1.0, 0.7)];

/// The JSON form of a transfer function, as the help describes it.
pub const JSON_HELP: &str = concat!(
    r##"  {"map": "viridis", "opacity": [[0, 0.02], [0.6, 0.1], [1, 0.8]]}"##,
    "\n",
    r##"  {"colors": [[0, "#1a2a6c"], [0.5, [0.7, 0.1, 0.1]], [1, "#fdbb2d"]], "range": [20, 350]}"##,
    "\n\n",
    r##""map" names a colour map; instead, "colors" has a place and a colour for each point. "opacity" has a place and an opacity "##,
    r##"for each point. Places go from 0 to 1 over the range of the field or, with "positions": "values", are values of the "##,
    r##"field, which no range moves. Colours are sRGB. An opacity, from 0 to 1, is that of a layer as thick as 1/100 of the diagonal of the mesh's "##,
    r##"bounds; without "opacity", opacities are chosen so that rare values show through common ones. "range": [LO, HI] sets the "##,
    r##"values at places 0 and 1."##,
);

impl Default for TransferFunction {
    fn default() -> Self {
        Self::from_map(&maps::MAPS[0])
    }
}

impl TransferFunction {
    /// A function with the colours of a map and no opacities.
    pub fn from_map(map: &maps::ColorMap) -> Self {
        let colors = map.points.iter().map(|&(place, rgb)| (f32::from(place) / 255.0, from_hex(rgb))).collect();
        Self { colors, opacity: None, range: None, in_values: [false; 2] }
    }

    /// A built-in map by name, in upper or lower case; the suffix `_r` reverses it.
    ///
    /// # Errors
    /// [`Error::Invalid`] for an unknown name; the message lists the known ones.
    pub fn named(name: &str) -> Result<Self> {
        let lower = name.to_ascii_lowercase();
        let (base, reverse) = lower.strip_suffix("_r").map_or((lower.as_str(), false), |base| (base, true));
        let map = maps::find(base).ok_or_else(|| {
            let names: Vec<_> = maps::MAPS.iter().map(|map| map.name).collect();
            Error::Invalid(format!(
                "no colour map `{name}`; there are {} (each also reversed, as in viridis_r), or give a .json file",
                names.join(", ")
            ))
        })?;
        let mut function = Self::from_map(map);
        if reverse {
            function.colors.reverse();
            function.colors.iter_mut().for_each(|(place, _)| *place = 1.0 - *place);
        }
        Ok(function)
    }

    /// A function from colour and opacity points (places 0…1, ascending; channels 0…1).
    ///
    /// # Errors
    /// [`Error::Invalid`] if a list is empty, places descend, or a place or channel lies outside 0…1.
    pub fn new(colors: Vec<(f32, [f32; 3])>, opacity: Vec<(f32, f32)>) -> Result<Self> {
        check_colors(&colors, false)?;
        check_opacity(&opacity, false)?;
        Ok(Self { colors, opacity: Some(opacity), range: None, in_values: [false; 2] })
    }

    /// Replaces the opacities.
    ///
    /// # Errors
    /// As [`TransferFunction::new`].
    pub fn with_opacity(self, opacity: Vec<(f32, f32)>) -> Result<Self> {
        check_opacity(&opacity, false)?;
        Ok(Self { opacity: Some(opacity), in_values: [self.in_values[0], false], ..self })
    }

    /// Opacity points from text: one number for all places, or `PLACE:OPACITY,…` as in `0:0,0.5:0.1,1:0.8`.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the text has neither form.
    pub fn parse_opacity(text: &str) -> Result<Vec<(f32, f32)>> {
        let wrong = || {
            Error::Invalid(format!("`{text}` is no opacity; give one number from 0 to 1, or PLACE:OPACITY pairs such as 0:0,0.5:0.1,1:0.8"))
        };
        if let Ok(all) = text.trim().parse::<f32>() {
            return Ok(vec![(0.0, all), (1.0, all)]);
        }
        let pair = |part: &str| {
            let (place, opacity) = part.split_once(':')?;
            Some((place.trim().parse().ok()?, opacity.trim().parse().ok()?))
        };
        text.split(',').map(|part| pair(part).ok_or_else(wrong)).collect()
    }

    /// Whether the function has opacities. If not, [`super::Prepared`] chooses them for the field; in other plans
    /// they rise from 0.04 to 0.7.
    pub fn has_opacity(&self) -> bool {
        self.opacity.is_some()
    }

    /// The values of places 0 and 1, if the function fixes them.
    pub fn range(&self) -> Option<[f32; 2]> {
        self.range
    }

    /// The function with these values at places 0 and 1. Where places are values of the field, it keeps its colours and
    /// opacities at them.
    #[must_use]
    pub fn over(&self, [lo, hi]: [f64; 2]) -> Self {
        let mut function = Self { range: Some([lo as f32, hi as f32]), in_values: [false; 2], ..self.clone() };
        // A range of a single value has that value in its middle.
        let (lo, width) = if hi > lo { (lo, hi - lo) } else { (lo - 0.5, 1.0) };
        let place = |value: &mut f32| *value = ((f64::from(*value) - lo) / width) as f32;
        if self.in_values[0] {
            function.colors.iter_mut().for_each(|(value, _)| place(value));
        }
        if self.in_values[1] {
            function.opacity.iter_mut().flatten().for_each(|(value, _)| place(value));
        }
        function
    }

    /// Colour and opacity at place `x`, 0…1.
    pub fn at(&self, x: f32) -> [f32; 4] {
        let [color, opacity] = self.in_values.map(|in_values| match self.range {
            Some([lo, hi]) if in_values => (f64::from(lo) + f64::from(x) * (f64::from(hi) - f64::from(lo))) as f32,
            _ => x,
        });
        let [r, g, b] = interpolate(&self.colors, color, |a, b, t| [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * t));
        [r, g, b, interpolate(self.opacity.as_deref().unwrap_or(DEFAULT_OPACITY), opacity, |a, b, t| a + (b - a) * t)]
    }
}

/// The value at `x`, interpolated between two points; outside of all points that of the first or the last one. Of
/// several points at one place the last one counts.
fn interpolate<T: Copy>(points: &[(f32, T)], x: f32, mix: impl Fn(T, T, f32) -> T) -> T {
    let next = points.partition_point(|&(place, _)| place <= x).clamp(1, points.len().max(2) - 1);
    let (a, b) = (points[next - 1], points[next.min(points.len() - 1)]);
    let width = b.0 - a.0;
    let t = if width > 0.0 { ((x - a.0) / width).clamp(0.0, 1.0) } else { f32::from(u8::from(x >= b.0)) };
    mix(a.1, b.1, t)
}

fn check_colors(colors: &[(f32, [f32; 3])], in_values: bool) -> Result<()> {
    check("colours", in_values, colors.iter().map(|(place, c)| (*place, &c[..])))
}

fn check_opacity(opacity: &[(f32, f32)], in_values: bool) -> Result<()> {
    check("opacities", in_values, opacity.iter().map(|(place, a)| (*place, std::slice::from_ref(a))))
}

/// Checks that the places ascend, within 0…1 unless they are values of the field, and that the channels lie in 0…1.
fn check<'a>(what: &str, in_values: bool, points: impl Iterator<Item = (f32, &'a [f32])>) -> Result<()> {
    let wrong = |why: String| Err(Error::Invalid(format!("{what} of a transfer function: {why}")));
    let place_is = if in_values { "the field's value" } else { "place" };
    let mut last = None;
    for (place, channels) in points {
        if !in_values && !(0.0..=1.0).contains(&place) {
            return wrong(format!("the place {place} lies outside 0 to 1"));
        }
        if !place.is_finite() {
            return wrong(format!("{place_is} {place} is beyond single precision"));
        }
        if let Some(bad) = channels.iter().find(|v| !(0.0..=1.0).contains(*v)) {
            return wrong(format!("at {place_is} {place}, the value {bad} lies outside 0 to 1"));
        }
        if let Some(last) = last.filter(|&last| place < last) {
            return wrong(format!("{} must ascend, but {place} follows {last}", if in_values { "values" } else { "places" }));
        }
        last = Some(place);
    }
    last.map_or_else(|| wrong("there are none".into()), |_| Ok(()))
}

/// 0xRRGGBB as channels.
fn from_hex(rgb: u32) -> [f32; 3] {
    [16, 8, 0].map(|shift| (rgb >> shift & 255) as f32 / 255.0)
}

/// Parses `#rrggbb` or `#rgb`, with or without the `#`.
pub fn parse_color(text: &str) -> Option<[f32; 3]> {
    let digits = text.trim();
    let digits: Vec<u32> = digits.strip_prefix('#').unwrap_or(digits).chars().map(|c| c.to_digit(16)).collect::<Option<_>>()?;
    let byte = match digits[..] {
        [r, g, b] => [17 * r, 17 * g, 17 * b],
        [r, s, g, h, b, c] => [16 * r + s, 16 * g + h, 16 * b + c],
        _ => return None,
    };
    Some(byte.map(|byte| byte as f32 / 255.0))
}

#[cfg(feature = "formats")]
mod json;
#[cfg(test)]
mod tests;
