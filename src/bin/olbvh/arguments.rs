//! Parsers of argument values that several subcommands share.

use olbvh::error::Error;

/// Parses a named value; the error message holds only what is wrong with it.
pub fn named<T: std::str::FromStr<Err = Error>>(text: &str) -> Result<T, String> {
    text.parse().map_err(message)
}

/// What is wrong with a value, without the words that this is an invalid argument.
pub fn message(error: Error) -> String {
    if let Error::Invalid(message) = error { message } else { error.to_string() }
}

/// Parses three finite numbers, `X,Y,Z`.
pub fn vector(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|n| n.trim().parse().ok().filter(|n: &f64| n.is_finite())).collect();
    numbers.and_then(|n| n.try_into().ok()).ok_or_else(|| "three numbers, such as 1,0,0.5".into())
}

/// Parses a range `LO:HI`. A range of a single value is refused, because it has no places in between.
pub fn range(text: &str) -> Result<[f32; 2], String> {
    let finite = |text: &str| text.trim().parse().ok().filter(|x: &f32| x.is_finite());
    match text.split_once(':').map(|(lo, hi)| (finite(lo), finite(hi))) {
        Some((Some(lo), Some(hi))) if lo < hi => Ok([lo, hi]),
        Some((Some(_), Some(_))) => Err("LO must be below HI in a range LO:HI, such as 20:350".into()),
        _ => Err("a range is LO:HI, two finite numbers such as 20:350".into()),
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
        for (wrong, why) in
            [("3:1", "LO must be below"), ("1:1", "LO must be below"), ("1", "two finite"), ("1:inf", "two finite"), ("a:b", "two finite")]
        {
            assert!(range(wrong).is_err_and(|message| message.contains(why)), "{wrong}");
        }
    }
}
