//! Selection of the target, that is of the tuning parameters of the kernels.

use crate::arguments::named;
use crate::common::{Common, Failure, Outcome};
use olbvh::gpu::{DeviceClass, DeviceReport, Target};
use olbvh::tune::{Profile, Search, folder};
use std::path::{Path, PathBuf};

/// Where a target comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The built-in row for the device's kind.
    Kind,
    /// The built-in row that `--target` or `OLBVH_TARGET` names.
    Row,
    /// The file that `--target` or `OLBVH_TARGET` names.
    File(PathBuf),
    /// The profile that was saved for the device.
    Profile(PathBuf),
}

/// A target and where it comes from.
#[derive(Clone, Debug)]
pub struct Shapes {
    /// The tuning parameters of the kernels.
    pub target: Target,
    /// Where it comes from.
    pub origin: Origin,
}

impl Shapes {
    /// The target that `--target` or `OLBVH_TARGET` names; without either, the device's profile, or else the built-in
    /// row for its kind.
    pub fn of(common: &Common, device: &DeviceReport) -> Outcome<Self> {
        if let Some((wanted, named_by)) = common.wanted_target() {
            return Wanted::read(&wanted).and_then(|wanted| wanted.on(device)).map_err(|failure| failure.about(named_by));
        }
        let kind = || Self { target: DeviceClass::of(device).target(&device.room), origin: Origin::Kind };
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

    /// Checks that what `--target` or `OLBVH_TARGET` names exists, whatever the device.
    pub fn check(common: &Common) -> Outcome {
        let Some((wanted, named_by)) = common.wanted_target() else { return Ok(()) };
        Wanted::read(&wanted).map(drop).map_err(|failure| failure.about(named_by))
    }
}

/// A target that was asked for.
enum Wanted {
    /// A built-in row.
    Row(DeviceClass),
    /// The target of a profile in a file.
    File(PathBuf, Target),
}

impl Wanted {
    /// The built-in row with this name, or the profile in this file.
    fn read(wanted: &str) -> Outcome<Self> {
        match named::<DeviceClass>(wanted) {
            Ok(row) => Ok(Self::Row(row)),
            // This is a misspelt name, not a file.
            Err(error) if !wanted.contains(['.', '/', '\\']) && !Path::new(wanted).exists() => {
                Err(Failure::Usage(format!("{error}, or a file that `olbvh tune` saved")))
            }
            Err(_) => Ok(Self::File(wanted.into(), Profile::read(Path::new(wanted)).map_err(Failure::input)?.target)),
        }
    }

    /// The target on a device, which must have room for it.
    fn on(self, device: &DeviceReport) -> Outcome<Shapes> {
        match self {
            Self::Row(row) => Ok(Shapes { target: row.target(&device.room), origin: Origin::Row }),
            Self::File(path, target) => {
                target.check(&device.room).map_err(|e| Failure::Usage(format!("{}: {e}", path.display())))?;
                Ok(Shapes { target, origin: Origin::File(path) })
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
