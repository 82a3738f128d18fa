//! Arguments that all subcommands share, and the exit codes of failures.

use clap::builder::{FalseyValueParser, NonEmptyStringValueParser};
use olbvh::error::Error;
use std::io::Write as _;
use std::process::ExitCode;

/// Environment variable that names a target.
const TARGET_VARIABLE: &str = "OLBVH_TARGET";

/// Arguments that all subcommands share.
#[derive(clap::Args)]
#[allow(clippy::struct_excessive_bools, reason = "each is a flag of its own")]
pub struct Common {
    /// Print one JSON object on standard output instead of text.
    #[arg(long, global = true, help_heading = "Global options")]
    pub json: bool,
    /// Device that computes: a part of its name or its number (`olbvh devices` lists them), or `cpu` for the reference
    /// implementation, which needs no Vulkan and is slower. Default: the best suitable Vulkan device.
    #[arg(long, global = true, help_heading = "Global options", value_name = "NAME|INDEX|cpu", value_parser = NonEmptyStringValueParser::new())]
    pub device: Option<String>,
    /// Tuning parameters of the kernels: portable, cpu, nvidia, amd, intel, apple, arm, qualcomm, or a file that `olbvh
    /// tune` saved. They affect speed only, never results. Default: what the environment variable `OLBVH_TARGET` names,
    /// otherwise the profile that `olbvh tune` saved for the device, otherwise the parameters for its kind of device.
    #[arg(long, global = true, help_heading = "Global options", value_name = "NAME|FILE", value_parser = NonEmptyStringValueParser::new())]
    pub target: Option<String>,
    /// Ignore the profile that `olbvh tune` saved for the device.
    #[arg(long, global = true, help_heading = "Global options", env = "OLBVH_NO_PROFILE", hide_env_values = true, value_parser = FalseyValueParser::new())]
    pub no_profile: bool,
    /// Print errors only: no progress bar, no remarks.
    #[arg(long, short, global = true, help_heading = "Global options", conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print what is being done, in detail.
    #[arg(long, short, global = true, help_heading = "Global options")]
    pub verbose: bool,
}

impl Common {
    /// Sends the library's log to standard error, as plain sentences.
    pub fn start_log(&self) {
        let level = match (self.quiet, self.verbose) {
            (true, _) => log::LevelFilter::Error,
            (_, true) => log::LevelFilter::Debug,
            _ => log::LevelFilter::Warn,
        };
        let line = |out: &mut env_logger::fmt::Formatter, record: &log::Record<'_>| match record.level() {
            log::Level::Error => writeln!(out, "error: {}", record.args()),
            log::Level::Warn => writeln!(out, "warning: {}", record.args()),
            _ => writeln!(out, "{}", record.args()),
        };
        env_logger::Builder::new().filter_level(level).format(line).init();
    }

    /// Whether `--device` selects the reference implementation.
    pub fn means_cpu(&self) -> bool {
        self.device.as_deref().is_some_and(|device| device.eq_ignore_ascii_case("cpu"))
    }

    /// The target that the user asks for, and what names it: `--target`, or else the environment variable if it is not
    /// empty.
    pub fn wanted_target(&self) -> Option<(String, &'static str)> {
        let given = self.target.clone().map(|target| (target, "--target"));
        given.or_else(|| Some((std::env::var(TARGET_VARIABLE).ok().filter(|target| !target.is_empty())?, TARGET_VARIABLE)))
    }

    /// Prints a remark on standard error, unless `--quiet` is given.
    pub fn remark(&self, message: impl std::fmt::Display) {
        if !self.quiet {
            output_line(&format!("{message}"));
        }
    }
}

/// Prints a line on standard error; a closed standard error is not a failure.
fn output_line(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Why the program ends; the numbers are exit codes.
#[derive(Debug)]
pub enum Failure {
    /// 1: any other failure.
    Failed(String),
    /// 2: wrong usage, that is invalid arguments.
    Usage(String),
    /// 3: an input file cannot be read or is invalid.
    Input(String),
    /// 4: no suitable device.
    Device(String),
    /// 0: standard output was closed by its reader.
    Closed,
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let message = match &error {
            Error::Memory { .. } => {
                format!(
                    "{error}; `locate`, `render`, `slice` and `overlap` take a mesh that does not fit in blocks, and in smaller blocks with a smaller --memory"
                )
            }
            Error::NoVulkan(_) => format!("{error}, or use the CPU (--device cpu)"),
            _ => error.to_string(),
        };
        match error {
            Error::Invalid(_) => Self::Usage(message),
            Error::File { .. } | Error::BadCells { .. } => Self::Input(message),
            Error::NoVulkan(_) | Error::NoDevice(_) | Error::SelfTest { .. } => Self::Device(message),
            _ => Self::Failed(message),
        }
    }
}

impl Failure {
    /// Converts an error that occurred while an input file was read.
    pub fn input(error: Error) -> Self {
        match error {
            Error::Io { .. } | Error::TooLarge(_) => Self::Input(error.to_string()),
            other => other.into(),
        }
    }

    /// Adds what the failure is about before its message.
    pub fn about(self, what: impl std::fmt::Display) -> Self {
        let before = |message: String| format!("{what}: {message}");
        match self {
            Self::Failed(message) => Self::Failed(before(message)),
            Self::Usage(message) => Self::Usage(before(message)),
            Self::Input(message) => Self::Input(before(message)),
            Self::Device(message) => Self::Device(before(message)),
            Self::Closed => Self::Closed,
        }
    }

    /// Prints the reason on standard error and returns the exit code.
    pub fn report(self) -> ExitCode {
        let code = match &self {
            Self::Closed => return ExitCode::SUCCESS,
            Self::Failed(_) => 1,
            Self::Usage(_) => 2,
            Self::Input(_) => 3,
            Self::Device(_) => 4,
        };
        output_line(&format!("olbvh: error: {self}"));
        ExitCode::from(code)
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Failed(message) | Self::Usage(message) | Self::Input(message) | Self::Device(message) => f.write_str(message),
            Self::Closed => f.write_str("standard output was closed"),
        }
    }
}

/// Result of a subcommand.
pub type Outcome<T = ()> = Result<T, Failure>;
