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
    r##"field. Colours are sRGB. An opacity, from 0 to 1, is that of a layer as thick as 1/100 of the diagonal of the mesh's "##,
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
        Self { colors, opacity: None, range: None }
    }

    /// A built-in map by name; the suffix `_r` reverses it.
    ///
    /// # Errors
    /// [`Error::Invalid`] for an unknown name; the message lists the known ones.
    pub fn named(name: &str) -> Result<Self> {
        let (base, reverse) = name.strip_suffix("_r").map_or((name, false), |base| (base, true));
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
        check("colour", colors.iter().map(|(place, c)| (*place, &c[..])))?;
        check("opacity", opacity.iter().map(|(place, a)| (*place, std::slice::from_ref(a))))?;
        Ok(Self { colors, opacity: Some(opacity), range: None })
    }

    /// Replaces the opacities.
    ///
    /// # Errors
    /// As [`TransferFunction::new`].
    pub fn with_opacity(self, opacity: Vec<(f32, f32)>) -> Result<Self> {
        Ok(Self { range: self.range, ..Self::new(self.colors, opacity)? })
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

    /// Whether the function has opacities; if not, they are chosen for the field.
    pub fn has_opacity(&self) -> bool {
        self.opacity.is_some()
    }

    /// The values of places 0 and 1, if the function fixes them.
    pub fn range(&self) -> Option<[f32; 2]> {
        self.range
    }

    /// Colour and opacity at place `x`, 0…1.
    pub fn at(&self, x: f32) -> [f32; 4] {
        let [r, g, b] = interpolate(&self.colors, x, |a, b, t| [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * t));
        [r, g, b, interpolate(self.opacity.as_deref().unwrap_or(DEFAULT_OPACITY), x, |a, b, t| a + (b - a) * t)]
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

/// Checks that the places ascend within 0…1 and that the channels lie in 0…1.
fn check<'a>(what: &str, points: impl Iterator<Item = (f32, &'a [f32])>) -> Result<()> {
    let mut last = None;
    for (place, channels) in points {
        if let Some(bad) = std::iter::once(&place).chain(channels).find(|v| !(0.0..=1.0).contains(*v)) {
            return Err(Error::Invalid(format!("transfer function: {what} point at {place}: {bad} lies outside 0 to 1")));
        }
        if last.is_some_and(|last| place < last) {
            return Err(Error::Invalid(format!(
                "transfer function: places of {what} points must ascend, but {place} follows a larger one"
            )));
        }
        last = Some(place);
    }
    last.map(|_| ()).ok_or_else(|| Error::Invalid(format!("transfer function: no {what} points")))
}

/// 0xRRGGBB as channels.
fn from_hex(rgb: u32) -> [f32; 3] {
    [16, 8, 0].map(|shift| (rgb >> shift & 255) as f32 / 255.0)
}

/// Parses `#rrggbb`, with or without the `#`.
pub fn parse_color(text: &str) -> Option<[f32; 3]> {
    let digits = text.trim().trim_start_matches('#');
    (digits.len() == 6).then(|| u32::from_str_radix(digits, 16).ok()).flatten().map(from_hex)
}

#[cfg(feature = "formats")]
mod json {
    use super::{DEFAULT_OPACITY, Error, Result, TransferFunction, parse_color};

    /// A colour as written in the file.
    #[derive(serde::Deserialize)]
    #[serde(untagged)]
    enum Color {
        Hex(String),
        Channels([f32; 3]),
    }

    /// The meaning of places.
    #[derive(Clone, Copy, Default, PartialEq, serde::Deserialize)]
    #[serde(rename_all = "lowercase")]
    enum Positions {
        #[default]
        Fractions,
        Values,
    }

    /// The content of the file.
    #[derive(serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct File {
        map: Option<String>,
        colors: Option<Vec<(f32, Color)>>,
        opacity: Option<Vec<(f32, f32)>>,
        range: Option<[f32; 2]>,
        #[serde(default)]
        positions: Positions,
    }

    impl TransferFunction {
        /// A function from its JSON form ([`JSON_HELP`](super::JSON_HELP)).
        ///
        /// # Errors
        /// [`Error::Invalid`] with the line of a syntax error, or as [`TransferFunction::new`].
        pub fn from_json(text: &str) -> Result<Self> {
            let file: File = serde_json::from_str(text).map_err(|e| Error::Invalid(format!("transfer function: {e}")))?;
            let mut colors = match (file.map, file.colors) {
                (Some(map), None) => Self::named(&map)?.colors,
                (None, Some(colors)) => colors.into_iter().map(|(place, color)| Ok((place, channels(color)?))).collect::<Result<_>>()?,
                _ => return Err(Error::Invalid("transfer function: needs either \"map\" or \"colors\"".into())),
            };
            let mut opacity = file.opacity;
            let mut range = file.range;
            if file.positions == Positions::Values {
                // Places given as values are rescaled to the range that they span together, or to the given range.
                let places = || colors.iter().map(|c| c.0).chain(opacity.iter().flatten().map(|o| o.0));
                let [lo, hi] = range.unwrap_or_else(|| [places().fold(f32::MAX, f32::min), places().fold(f32::MIN, f32::max)]);
                for place in colors.iter_mut().map(|c| &mut c.0).chain(opacity.iter_mut().flatten().map(|o| &mut o.0)) {
                    *place = (*place - lo) / (hi - lo);
                }
                range = Some([lo, hi]);
            }
            if let Some([lo, hi]) = range.filter(|[lo, hi]| !(lo < hi && (hi - lo).is_finite())) {
                return Err(Error::Invalid(format!(
                    "transfer function: a range from {lo} to {hi}; LO must be below HI in \"range\": [LO, HI]"
                )));
            }
            let known = opacity.is_some();
            let function = Self::new(colors, opacity.unwrap_or_else(|| DEFAULT_OPACITY.to_vec()))?;
            Ok(Self { range, opacity: function.opacity.filter(|_| known), ..function })
        }
    }

    fn channels(color: Color) -> Result<[f32; 3]> {
        match color {
            Color::Channels(channels) => Ok(channels),
            Color::Hex(text) => {
                parse_color(&text).ok_or_else(|| Error::Invalid(format!("transfer function: `{text}` is no colour such as #1a2a6c")))
            }
        }
    }
}

#[cfg(test)]
mod tests;
