//! Enums whose variants have names.

/// Implements the names of an enum's variants, as the command line and reports use them.
macro_rules! named {
    ($type:ident, $what:literal, [$($variant:ident = $name:literal),+ $(,)?]) => {
        impl $type {
            /// Every variant, in order.
            pub const EVERY: [Self; [$($name),+].len()] = [$(Self::$variant),+];

            /// The name used on the command line and in reports.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name),+
                }
            }
        }

        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl std::str::FromStr for $type {
            type Err = $crate::Error;

            fn from_str(name: &str) -> $crate::Result<Self> {
                let found = Self::EVERY.into_iter().find(|v| v.name().eq_ignore_ascii_case(name));
                let known = || Self::EVERY.map(Self::name).join(", ");
                found.ok_or_else(|| $crate::Error::Invalid(format!("unknown {} `{name}`; known are {}", $what, known())))
            }
        }
    };
}

pub(crate) use named;
