//! The colour legend of a picture, in a strip at its right side: which colour stands for which value.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use olbvh::render::{Background, PicturePlan};

/// Characters of a label, such as `-1234.567` or `-1.50e-12`.
const LABEL: usize = 9;
/// Gap between two labels, in parts of the height of a line.
const GAP: f64 = 1.5;

/// A legend of a size that suits the picture.
pub struct Legend {
    font: RasterHeight,
    /// Width and height of the whole picture.
    size: [u32; 2],
}

/// What a legend explains.
pub struct Explained<'a> {
    /// Name of the field.
    pub field: &'a str,
    /// Values at the two ends of the colours.
    pub range: [f32; 2],
    /// The colours, the background, and the values of iso-surfaces, if these are drawn.
    pub plan: &'a PicturePlan,
}

impl Legend {
    /// The legend of a picture of this size, with the largest letters that suit its height and leave half its width to
    /// the mesh. If there are none, the error is the smallest size that has room for a legend.
    pub fn new(size: [u32; 2]) -> Result<Self, [u32; 2]> {
        let with = |font| Self { font, size };
        let fonts = [(RasterHeight::Size32, 1400), (RasterHeight::Size24, 700), (RasterHeight::Size16, 128)];
        let found = fonts.into_iter().find(|&(font, height)| size[1] >= height && size[0] >= 2 * with(font).width());
        found.map(|(font, _)| with(font)).ok_or_else(|| [2 * with(RasterHeight::Size16).width(), 128])
    }

    /// Height of a line of text in pixels.
    fn line(&self) -> u32 {
        self.font.val() as u32
    }

    /// Width of a character.
    fn letter(&self) -> u32 {
        get_raster_width(FontWeight::Regular, self.font) as u32
    }

    /// Width of the strip: a margin of half a line at either side, the bar, which is a line wide, a tick, and labels.
    pub fn width(&self) -> u32 {
        self.line() * 2 + self.letter() * (LABEL as u32 + 1)
    }

    /// The picture with the legend beside `drawn`, which is narrower by [`Legend::width`]: four bytes per pixel, straight
    /// alpha.
    pub fn beside(&self, drawn: &[u8], of: &Explained<'_>) -> Vec<u8> {
        let ([width, height], strip, line) = (self.size, self.width(), self.line());
        let mut ink = Ink::new(self, &of.plan.background);
        let (left, bar) = (line / 2, (height * 3 / 5).max(4 * line));
        let top = (height - bar) / 2 + line;
        ink.text([left, top - 2 * line], &short(of.field, ((strip - line) / self.letter()) as usize));
        // Ends lie in the middle of the outermost rows, as values do in the table of colours.
        let last = of.plan.table.len() - 1;
        for y in 0..bar {
            let place = f64::from(bar - 1 - y) / f64::from(bar - 1);
            let [r, g, b, _] = of.plan.table[(place * last as f64).round() as usize];
            (left..left + line).for_each(|x| ink.set([x, top + y], [r, g, b, 1.0]));
        }
        let [lo, hi] = of.range.map(f64::from);
        let most = (f64::from(bar) / (GAP * 2.0 * f64::from(line))) as usize;
        let ticks = if of.plan.iso.is_empty() {
            ticks([lo, hi], most, f64::from(line) / f64::from(bar))
        } else {
            labelled(of.plan.iso.iter().map(|&v| f64::from(v)).collect())
        };
        let mut free = f64::INFINITY; // above the label below
        for (value, label) in ticks {
            let place = if lo < hi { (value - lo) / (hi - lo) } else { 0.5 };
            if !(0.0..=1.0).contains(&place) {
                continue;
            }
            let y = top + (f64::from(bar - 1) * (1.0 - place)).round() as u32;
            let begin = if of.plan.iso.is_empty() { left + line } else { left };
            (begin..left + line + self.letter() / 2).for_each(|x| ink.set([x, y], ink.colour));
            if f64::from(y) + f64::from(line) <= free {
                ink.text([left + line + self.letter(), y - line / 2], &label);
                free = f64::from(y);
            }
        }
        let inner = 4 * (width - strip) as usize;
        let rows = drawn.chunks_exact(inner).zip(ink.pixels.chunks_exact(4 * strip as usize));
        rows.flat_map(|(picture, legend)| picture.iter().chain(legend)).copied().collect()
    }
}

/// The colour of lines and letters in a picture of this height: black or white, whichever is seen on the background.
pub fn ink(background: &Background, height: u32) -> [f32; 4] {
    let [r, g, b, alpha] = background.pixel([0.0; 4], height / 2, height).map(f32::from);
    let dark = alpha > 0.0 && 0.3 * r + 0.6 * g + 0.1 * b < 110.0;
    let shade = if dark { 1.0 } else { 0.0 };
    [shade, shade, shade, 1.0]
}

/// The strip while it is drawn.
struct Ink<'a> {
    legend: &'a Legend,
    background: &'a Background,
    pixels: Vec<u8>,
    /// Colour of text.
    colour: [f32; 4],
}

impl<'a> Ink<'a> {
    fn new(legend: &'a Legend, background: &'a Background) -> Self {
        let (width, height) = (legend.width(), legend.size[1]);
        let pixels = (0..height).flat_map(|y| (0..width).flat_map(move |_| background.pixel([0.0; 4], y, height))).collect();
        Self { legend, background, pixels, colour: ink(background, height) }
    }

    /// Sets a pixel to a colour of this opacity (straight alpha) over the background.
    fn set(&mut self, [x, y]: [u32; 2], [r, g, b, a]: [f32; 4]) {
        let (width, height) = (self.legend.width(), self.legend.size[1]);
        if x < width && y < height {
            let at = 4 * (y as usize * width as usize + x as usize);
            self.pixels[at..at + 4].copy_from_slice(&self.background.pixel([r * a, g * a, b * a, a], y, height));
        }
    }

    /// Writes a line whose upper left corner is at `at`.
    fn text(&mut self, at: [u32; 2], text: &str) {
        for (i, letter) in (0..).zip(text.chars()) {
            let raster = |letter| get_raster(letter, FontWeight::Regular, self.legend.font);
            let Some(raster) = raster(letter).or_else(|| raster('?')) else { continue };
            for (y, row) in (0..).zip(raster.rows()) {
                for (x, &strength) in (0..).zip(row).filter(|(_, strength)| **strength > 0) {
                    let [r, g, b, _] = self.colour;
                    self.set([at[0] + i * self.legend.letter() + x, at[1] + y], [r, g, b, f32::from(strength) / 255.0]);
                }
            }
        }
    }
}

/// A name in at most `most` characters. What is left out is in the middle, where two dots stand for it: the ends tell the
/// components of a vector from each other.
fn short(name: &str, most: usize) -> String {
    let n = name.chars().count();
    if n <= most {
        return name.into();
    }
    let kept = most.saturating_sub(2);
    let tail = kept.div_ceil(3);
    name.chars().take(kept - tail).chain("..".chars()).chain(name.chars().skip(n - tail)).collect()
}

/// Whether the values of a range cannot be told apart.
fn is_single([lo, hi]: [f64; 2]) -> bool {
    hi - lo <= lo.abs().max(hi.abs()) * 1e-6
}

/// About `most` round values within a range, ascending: multiples of 1, 2 or 5 times a power of ten, and that step.
fn marks([lo, hi]: [f64; 2], most: usize) -> (Vec<f64>, f64) {
    if is_single([lo, hi]) {
        return (vec![lo], f64::INFINITY);
    }
    let rough = (hi - lo) / most.max(2) as f64;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|&step| step >= rough).unwrap_or(rough);
    // A hair beyond the ends, since multiples are rounded.
    let [first, last] = [(lo / step - 1e-6).ceil(), (hi / step + 1e-6).floor()];
    ((0..=(last - first) as u32).map(|i| (first + f64::from(i)) * step).collect(), step)
}

/// The ends of a range and about `most` round values between, ascending, with their labels. Labels are at least `gap`
/// apart from those of the ends, as a part of the range.
fn ticks([lo, hi]: [f64; 2], most: usize, gap: f64) -> Vec<(f64, String)> {
    let (mut between, step) = marks([lo, hi], most);
    if is_single([lo, hi]) {
        return labelled(between);
    }
    let near = (hi - lo) * gap;
    between.retain(|v| v - lo >= near && hi - v >= near);
    // Three digits of the range.
    let unit = 10f64.powf((hi - lo).log10().floor() - 2.0);
    let ends = Need::of(&[lo, hi].map(|v| (v / unit).round() * unit), f64::INFINITY);
    let inner = Need::of(&between, step);
    let Some([ends, inner]) = Need::digits([ends, inner]) else {
        // What is added to the lower end.
        let higher: Vec<f64> = between.into_iter().chain([hi]).collect();
        let need = Need::of(&higher.iter().map(|value| value - lo).collect::<Vec<_>>(), step);
        let [digits] = Need::digits([need]).unwrap_or([need.powers()]);
        let labelled = higher.into_iter().map(|value| (value, format!("+{}", label(value - lo, digits))));
        return [(lo, label(lo, ends.powers()))].into_iter().chain(labelled).collect();
    };
    let mut all: Vec<_> = between.into_iter().map(|value| (value, label(value, inner))).collect();
    all.insert(0, (lo, label(lo, ends)));
    all.push((hi, label(hi, ends)));
    all
}

/// Values with labels that tell them apart.
fn labelled(values: Vec<f64>) -> Vec<(f64, String)> {
    let need = Need::of(&values, f64::INFINITY);
    let [digits] = Need::digits([need]).unwrap_or([need.powers()]);
    values.into_iter().map(|value| (value, label(value, digits))).collect()
}

/// How labels are written: in fixed notation with so many digits after the point, or in powers of ten with so many.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Digits {
    Fixed(usize),
    Powers(usize),
}

/// What labels must show.
#[derive(Clone, Copy)]
struct Need {
    /// Power of ten of the largest value.
    order: i32,
    /// Power of ten that tells values apart.
    behind: i32,
    /// Characters of the largest exponent.
    exponent: usize,
    /// Whether a value is negative.
    signs: bool,
}

impl Need {
    /// What tells values apart that are at least `step` apart, and from each other.
    fn of(values: &[f64], step: f64) -> Self {
        let largest = values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let signs = values.iter().any(|v| *v < 0.0);
        if largest == 0.0 {
            return Self { order: 0, behind: 0, exponent: 1, signs };
        }
        let apart = values.windows(2).map(|v| v[1] - v[0]).filter(|d| *d > 0.0).fold(largest.min(step), f64::min);
        let power = |x: f64| (x.log10() + 1e-9).floor() as i32;
        let (order, least) = (power(largest), power(apart));
        // Values that are not round, such as those of iso-surfaces, need more digits than their order.
        let whole = |power: i32| values.iter().map(|v| v / 10f64.powi(power)).all(|x| (x - x.round()).abs() < 1e-4);
        let behind = (order - 6..=least).rev().find(|&power| whole(power));
        let behind = behind.unwrap_or(least - 2).max(order - 6);
        let exponent = values.iter().filter(|v| **v != 0.0).map(|v| power(v.abs()).to_string().len()).max().unwrap_or(1);
        Self { order, behind, exponent, signs }
    }

    /// Digits of values in one notation: in powers of ten where fixed notation takes too many characters. `None`: there is no
    /// room for what tells them apart.
    fn digits<const N: usize>(needs: [Self; N]) -> Option<[Digits; N]> {
        let most = needs.iter().map(|need| need.characters()).max().unwrap_or(0);
        let told = needs.iter().all(|need| matches!(need.powers(), Digits::Powers(n) if n >= need.places()));
        match most {
            _ if most < LABEL || most == LABEL && !told => Some(needs.map(|need| Digits::Fixed(need.decimals()))),
            _ if told => Some(needs.map(Self::powers)),
            _ => None,
        }
    }

    /// Digits behind the point in fixed notation.
    fn decimals(self) -> usize {
        self.behind.min(0).unsigned_abs() as usize
    }

    /// Characters of the largest value in fixed notation.
    fn characters(self) -> usize {
        let decimals = self.decimals();
        1 + self.order.max(0) as usize + decimals + usize::from(decimals > 0) + usize::from(self.signs)
    }

    /// Digits behind the point in powers of ten.
    fn places(self) -> usize {
        (self.order - self.behind).max(0) as usize
    }

    /// In powers of ten, with as many digits as there is room for.
    fn powers(self) -> Digits {
        let room = LABEL.saturating_sub("1.e".len() + self.exponent + usize::from(self.signs));
        Digits::Powers(self.places().min(room))
    }
}

fn label(value: f64, digits: Digits) -> String {
    let text = match digits {
        Digits::Fixed(n) => format!("{value:.n$}"),
        Digits::Powers(n) => format!("{value:.n$e}"),
    };
    let mantissa = text.split('e').next().unwrap_or_default();
    if mantissa.contains(|c: char| ('1'..='9').contains(&c)) {
        return text;
    }
    if matches!(digits, Digits::Powers(_)) { "0".into() } else { mantissa.trim_start_matches('-').into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(range: [f64; 2]) -> Vec<String> {
        let (marks, step) = marks(range, 6);
        let [digits] = Need::digits([Need::of(&marks, step)]).unwrap();
        marks.into_iter().map(|v| label(v, digits)).collect()
    }

    #[test]
    fn marks_are_round_and_labels_short() {
        assert_eq!(labels([20.0, 95.0]), ["20", "40", "60", "80"]);
        assert_eq!(labels([-1.0, 1.0]), ["-1.0", "-0.5", "0.0", "0.5", "1.0"]);
        assert_eq!(labels([0.0, 0.25]), ["0.00", "0.05", "0.10", "0.15", "0.20", "0.25"]);
        assert_eq!(labels([1e8, 3e8]), ["1.0e8", "1.5e8", "2.0e8", "2.5e8", "3.0e8"]);
        assert_eq!(labels([-2e-9, 1e-9]), ["-2.0e-9", "-1.5e-9", "-1.0e-9", "-5.0e-10", "0", "5.0e-10", "1.0e-9"]);
        assert_eq!(labels([7.0, 7.0]), ["7"]);
        for (lo, hi) in [(1e-30, 1e-29), (-3e37, 3e37), (1000.0, 1000.01), (0.0, 0.0), (-7.5, 123_456.0)] {
            assert!(labels([lo, hi]).iter().all(|l| !l.is_empty() && l.len() <= LABEL), "{:?}", labels([lo, hi]));
        }
    }

    #[test]
    fn the_ends_of_the_range_are_labelled() {
        let labels = |lo, hi| ticks([lo, hi], 6, 0.06).into_iter().map(|(_, label)| label).collect::<Vec<_>>();
        assert_eq!(labels(20.0, 95.0), ["20", "40", "60", "80", "95"]);
        assert_eq!(labels(0.0, 36.683_71), ["0.0", "10", "20", "30", "36.7"]);
        assert_eq!(labels(-1.0, 1.0), ["-1", "-0.5", "0.0", "0.5", "1"]);
        assert_eq!(labels(-1e-17, 1e-3), ["0.000", "0.0002", "0.0004", "0.0006", "0.0008", "0.001"]);
        assert_eq!(labels(7.0, 7.0), ["7"]);
        assert_eq!(ticks([20.0, 95.0], 1, 0.2).len(), 3);
    }

    /// Of any range wider than a millionth, labels ascend, as numbers too, and are none too long.
    #[test]
    fn labels_tell_values_apart() {
        let labels = |lo, hi| ticks([lo, hi], 6, 0.1).into_iter().map(|(_, label)| label).collect::<Vec<_>>();
        assert_eq!(ticks([1.0, 1.0002], 2, 0.3).into_iter().map(|t| t.1).collect::<Vec<_>>(), ["1.0000", "1.0001", "1.0002"]);
        assert_eq!(labels(1e8, 1.0001e8).first().unwrap(), "1.0000e8");
        for base in [1.0, 2.0, 10.0, 0.5, 101_325.0, 1e8, 1e-3, 7e12, 3.3e-9] {
            for width in [2e-5, 1e-4, 2e-4, 1e-3, 0.1, 1.0, 1e4] {
                for sign in [1.0, -1.0] {
                    let range = if sign > 0.0 { [base, base * (1.0 + width)] } else { [-base * (1.0 + width), -base] };
                    let all = labels(range[0], range[1]);
                    // Those with a plus are added to the first one.
                    let first = usize::from(all[1].starts_with('+'));
                    let numbers: Vec<f64> = all[first..].iter().map(|label| label.parse().unwrap()).collect();
                    let fits = all.iter().all(|label| label.len() <= LABEL);
                    assert!(numbers.is_sorted_by(|a, b| a < b) && fits, "{range:?}: {all:?}");
                }
            }
        }
    }

    #[test]
    fn iso_values_keep_their_digits() {
        let values = [0.125, 40.0];
        assert_eq!(Need::digits([Need::of(&values, f64::INFINITY)]), Some([Digits::Fixed(3)]));
        assert_eq!(short("temperature", 20), "temperature");
        assert_eq!(["displacement.x", "displacement.y"].map(|name| short(name, 12)), ["displa..nt.x", "displa..nt.y"]);
    }
}
