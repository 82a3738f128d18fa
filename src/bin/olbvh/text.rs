//! Formatting of text for people.

use olbvh::blocks::Cost;
use std::fmt::Write as _;

/// Longest label to which values are aligned; a longer label shifts only its own value.
const ALIGNED: usize = 40;

/// Sections of labelled, aligned values.
#[derive(Default)]
pub struct Page {
    rows: Vec<(String, String)>,
}

impl Page {
    /// Adds a heading.
    pub fn section(&mut self, title: &str) {
        self.rows.push((title.to_owned(), String::new()));
    }

    /// Adds a labelled value.
    pub fn row(&mut self, label: impl std::fmt::Display, value: impl std::fmt::Display) {
        self.rows.push((format!("  {label}"), value.to_string()));
    }
}

impl std::fmt::Display for Page {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let valued = self.rows.iter().filter(|row| !row.1.is_empty());
        let width = valued.map(|row| row.0.chars().count()).filter(|&n| n <= ALIGNED).max().unwrap_or(0);
        for (label, value) in &self.rows {
            if value.is_empty() { writeln!(f, "{label}")? } else { writeln!(f, "{label:<width$}  {value}")? }
        }
        Ok(())
    }
}

/// Formats 12290298 as 12,290,298.
pub fn grouped(n: impl Into<u64>) -> String {
    let digits = n.into().to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i) % 3 == 0 {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Formats a count with its noun: `1 point`, `2 points`.
pub fn counted(n: u64, what: &str) -> String {
    format!("{} {what}{}", grouped(n), if n == 1 { "" } else { "s" })
}

/// Formats bytes in the largest binary unit that gives a value of at least 1.
pub fn bytes(n: u64) -> String {
    let units = ["B", "KiB", "MiB", "GiB", "TiB"];
    let mut value = n as f64;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < units.len() {
        value /= 1024.0;
        unit += 1;
    }
    if unit == 0 { format!("{n} B") } else { format!("{value:.2} {}", units[unit]) }
}

/// Rounds to eight significant digits, which leaves out what single precision adds to numbers such as 0.1.
pub fn number(x: f64) -> f64 {
    format!("{x:.7e}").parse().unwrap_or(x)
}

/// Rounds as [`number`] does, or to as many more digits as it takes for different numbers to stay different.
pub fn told_apart<const N: usize>(of: [f64; N]) -> [f64; N] {
    let distinct = |of: &[f64; N]| {
        let mut sorted = *of;
        sorted.sort_by(f64::total_cmp);
        sorted.windows(2).filter(|pair| pair[0] < pair[1]).count()
    };
    let rounded = |digits: usize| of.map(|x| format!("{x:.digits$e}").parse().unwrap_or(x));
    (7..16).map(rounded).find(|rounded| distinct(rounded) == distinct(&of)).unwrap_or(of)
}

/// The number with the fewest digits that is `x` in single precision: 0.4 rather than 0.4000000059604645.
pub fn single(x: f32) -> f64 {
    format!("{x:e}").parse().unwrap_or(x.into())
}

/// Formats a duration in a readable unit.
pub fn milliseconds(ms: f64) -> String {
    match ms {
        _ if ms >= 60_000.0 => format!("{:.1} min", ms / 60_000.0),
        _ if ms >= 1000.0 => format!("{:.2} s", ms / 1000.0),
        _ => format!("{ms:.1} ms"),
    }
}

/// Text, to be appended, that says how many blocks a mesh was split into; empty if it was not split.
pub fn in_blocks(took: &Cost) -> String {
    let Cost { trees, peak, build_seconds, .. } = *took;
    if trees > 1 {
        format!("; {trees} blocks within {}, built in {}", bytes(peak), milliseconds(build_seconds * 1e3))
    } else {
        String::new()
    }
}

/// Joins values with a separator such as ` × `.
pub fn joined<T: std::fmt::Display>(values: &[T], separator: &str) -> String {
    let mut text = String::new();
    for (i, value) in values.iter().enumerate() {
        let _ = write!(text, "{}{value}", if i == 0 { "" } else { separator });
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn different_numbers_stay_different() {
        assert_eq!(told_apart([0.1f32.into(), 1e9, 1e9, 3.0]), [0.1, 1e9, 1e9, 3.0]);
        assert_eq!(told_apart([1e9, 1e9 + 0.001, 1e9 + 29.5]), [1e9, 1_000_000_000.001, 1_000_000_029.5]);
    }

    #[test]
    fn a_long_label_moves_its_own_value_only() {
        let mut page = Page::default();
        page.row("cells", 7);
        page.row("points", 8);
        page.row("x".repeat(70_000), 9);
        let lines: Vec<String> = page.to_string().lines().map(str::to_owned).collect();
        assert_eq!(lines[..2], ["  cells   7", "  points  8"]);
        assert!(lines[2].ends_with("x  9"), "{}", &lines[2][69_990..]);
    }

    #[test]
    fn numbers_read_well() {
        assert_eq!([grouped(0u32), grouped(999u32), grouped(1000u32), grouped(12_290_298u32)], ["0", "999", "1,000", "12,290,298"]);
        assert_eq!([counted(0, "point"), counted(1, "point"), counted(1200, "point")], ["0 points", "1 point", "1,200 points"]);
        assert_eq!([f64::from(0.1f32), 5_123_456.75, -7e6].map(|x| number(x).to_string()), ["0.1", "5123456.8", "-7000000"]);
        let singles = [0.4, 1e-5, -16_777_216.0, f32::MAX, f32::MIN_POSITIVE, 1e-45];
        assert_eq!(singles.map(single), [0.4, 1e-5, -16_777_216.0, 3.402_823_5e38, 1.175_494_4e-38, 1e-45]);
        assert!(singles.iter().all(|&x| single(x) as f32 == x) && single(f32::NAN).is_nan());
        assert_eq!([bytes(12), bytes(1536), bytes(3 << 30)], ["12 B", "1.50 KiB", "3.00 GiB"]);
        assert_eq!([milliseconds(1.26), milliseconds(2345.0), milliseconds(90_000.0)], ["1.3 ms", "2.35 s", "1.5 min"]);
    }
}
