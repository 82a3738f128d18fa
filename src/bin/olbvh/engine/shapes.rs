//! Which shapes the kernels have, and why.

use crate::common::{Common, Failure, Outcome};
use olbvh::gpu::DeviceReport;
use olbvh::kernels::{Row, Target};
use olbvh::tune::{Profile, Search, folder};
use std::path::{Path, PathBuf};

/// Where shapes come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The row of the device's kind.
    Kind,
    /// `--target NAME`.
    Row,
    /// `--target FILE`.
    File(PathBuf),
    /// The device's profile.
    Profile(PathBuf),
}

/// Shapes of the kernels, and where they come from.
#[derive(Clone, Debug)]
pub struct Shapes {
    /// The shapes.
    pub target: Target,
    /// Where they come from.
    pub origin: Origin,
}

impl Shapes {
    /// Those that were asked for, or else the device's profile, or else the row of its kind.
    pub fn of(common: &Common, device: &DeviceReport) -> Outcome<Self> {
        if let Some(wanted) = &common.target {
            return Self::wanted(wanted, device);
        }
        let kind = || Self { target: Row::of(device).target(&device.room), origin: Origin::Kind };
        let Some(folder) = folder().filter(|_| !common.no_profile) else { return Ok(kind()) };
        Ok(match Profile::find(&folder, device) {
            Search::Found(path, profile) => Self { target: profile.target, origin: Origin::Profile(path) },
            Search::Nothing => kind(),
            Search::Ignored(why) => {
                common.remark(why);
                kind()
            }
        })
    }

    /// A row by its name, or a profile by its file.
    fn wanted(wanted: &str, device: &DeviceReport) -> Outcome<Self> {
        match wanted.parse::<Row>() {
            Ok(row) => Ok(Self { target: row.target(&device.room), origin: Origin::Row }),
            // A name, misspelt.
            Err(error) if !wanted.contains(['.', '/', '\\']) && !Path::new(wanted).exists() => {
                Err(Failure::Usage(format!("{error}, or a file that `olbvh tune` saved")))
            }
            Err(_) => {
                let path = PathBuf::from(wanted);
                let target = Profile::read(&path).map_err(Failure::input)?.target;
                target.check(&device.room).map_err(|e| Failure::Usage(format!("{}: {e}", path.display())))?;
                Ok(Self { target, origin: Origin::File(path) })
            }
        }
    }
}

impl std::fmt::Display for Shapes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.origin {
            Origin::Kind => write!(f, "`{}`, for devices of this kind", self.target.name),
            Origin::Row => write!(f, "`{}`, as asked for", self.target.name),
            Origin::File(path) | Origin::Profile(path) => write!(f, "`{}`, from {}", self.target.name, path.display()),
        }
    }
}
