//! Formatting of tables, for a terminal and as Markdown, and of the numbers in them.

use std::fmt::Write as _;

/// A table: the first column is text, the others are right-aligned.
pub(super) struct Table {
    pub title: String,
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// Appends the table with aligned columns, for a terminal.
    pub fn text(&self, out: &mut String) {
        let Self { title, header, rows } = self;
        let width = |c: usize| rows.iter().chain([header]).filter_map(|r| r.get(c)).map(|cell| cell.chars().count()).max().unwrap_or(0);
        // `write!` accepts no larger width.
        let widths: Vec<usize> = (0..header.len()).map(|c| width(c).min(usize::from(u16::MAX))).collect();
        let _ = writeln!(out, "\n{title}");
        for row in std::iter::once(header).chain(rows) {
            let mut line = format!("  {:<1$}", row[0], widths[0]);
            for (cell, &w) in row.iter().zip(&widths).skip(1) {
                let _ = write!(line, "  {cell:>w$}");
            }
            let _ = writeln!(out, "{}", line.trim_end());
        }
    }

    /// Appends the table as a section of Markdown.
    pub fn markdown(&self, out: &mut String) {
        let Self { title, header, rows } = self;
        let _ = writeln!(out, "\n## {title}\n\n| {} |\n|---|{}", header.join(" | "), "---:|".repeat(header.len() - 1));
        for row in rows {
            let _ = writeln!(out, "| {} |", row.join(" | "));
        }
    }
}

/// Formats a number with at least two, usually three, significant digits.
pub(super) fn number(x: f64) -> String {
    match x.abs() {
        a if !a.is_finite() => "–".into(),
        a if a >= 99.95 => format!("{x:.0}"),
        a if a >= 9.995 => format!("{x:.1}"),
        a if a >= 0.0995 || a == 0.0 => format!("{x:.2}"),
        a if a >= 1e-3 => format!("{x:.4}"),
        _ => format!("{x:.1e}"),
    }
}

pub(super) fn mebibytes(bytes: u64) -> String {
    number(bytes as f64 / f64::from(1 << 20))
}

pub(super) fn text_of(cells: &[&str]) -> Vec<String> {
    cells.iter().map(|&c| c.to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_are_short() {
        let shown = [0.0, 0.000_12, 0.012_34, 0.5, 9.994, 9.996, 99.94, 99.96, 12_345.6, f64::NAN].map(number);
        assert_eq!(shown, ["0.00", "1.2e-4", "0.0123", "0.50", "9.99", "10.0", "99.9", "100", "12346", "–"]);
    }
}
