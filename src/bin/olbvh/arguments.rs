//! Parsers of argument values that several subcommands share.

use olbvh::error::Error;

/// Parses a named value; the error message holds only what is wrong with it.
pub fn named<T: std::str::FromStr<Err = Error>>(text: &str) -> Result<T, String> {
    text.parse().map_err(|e| if let Error::Invalid(message) = e { message } else { e.to_string() })
}

/// Parses three finite numbers, `X,Y,Z`.
pub fn vector(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|n| n.trim().parse().ok().filter(|n: &f64| n.is_finite())).collect();
    numbers.and_then(|n| n.try_into().ok()).ok_or_else(|| "three numbers, such as 1,0,0.5".into())
}

/// Parses a range `LO:HI`.
pub fn range(text: &str) -> Result<[f32; 2], String> {
    let numbers = text.split_once(':').map(|(lo, hi)| (lo.trim().parse::<f32>(), hi.trim().parse::<f32>()));
    match numbers {
        Some((Ok(lo), Ok(hi))) if lo <= hi && lo.is_finite() && hi.is_finite() => Ok([lo, hi]),
        _ => Err("a range is LO:HI, such as 20:350".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn junk_is_no_number() {
        assert_eq!(vector(" 1, -0.5,2e3"), Ok([1.0, -0.5, 2000.0]));
        for wrong in ["1,0", "1,0,0,foo", "1,inf,0,0", "1,nan,0", "", "1,0,0,0"] {
            assert!(vector(wrong).is_err(), "{wrong}");
        }
        assert_eq!(range("-1:2.5"), Ok([-1.0, 2.5]));
        assert!(["3:1", "1", "1:inf", "a:b"].iter().all(|wrong| range(wrong).is_err()));
    }
}
