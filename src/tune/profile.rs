//! Profiles: one file per device and driver, in the user's configuration folder.

use crate::error::{Error, Result};
use crate::formats::OutputFile;
use crate::gpu::{DeviceReport, Target};
use etcetera::BaseStrategy as _;
use serde::{Deserialize, Serialize};
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Milliseconds of a stage before and after tuning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gain {
    /// The stage; `all` for all of them.
    pub stage: String,
    /// Median before.
    pub before_ms: f64,
    /// Median after.
    pub after_ms: f64,
}

/// The best target found on a device, and the circumstances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// Name of the device.
    pub device: String,
    /// Driver and its version.
    pub driver: String,
    /// Subgroup size that it was tuned with.
    pub subgroup: u32,
    /// Version of this crate.
    pub version: String,
    /// Mesh that it was tuned with.
    pub mesh: String,
    /// The target.
    pub target: Target,
    /// What the target gained.
    pub gains: Vec<Gain>,
}

/// Result of the search for a device's profile.
#[derive(Debug)]
pub enum Search {
    /// The device's profile, with its path.
    Found(PathBuf, Box<Profile>),
    /// There is none.
    Nothing,
    /// There is one that cannot be used; the text says why and what to do.
    Ignored(String),
}

/// The folder of profiles: `olbvh` in `XDG_CONFIG_HOME` or `~/.config`, or in the system's equivalent; `None` without a
/// home.
pub fn folder() -> Option<PathBuf> {
    Some(etcetera::choose_base_strategy().ok()?.config_dir().join("olbvh"))
}

/// Reduces text to lower-case letters and digits, with everything else replaced by single hyphens.
fn slug(text: &str) -> String {
    let mapped: String = text.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect();
    mapped.split('-').filter(|part| !part.is_empty()).collect::<Vec<_>>().join("-")
}

impl Profile {
    /// The file name of a device's profile. A new driver has a new file, because it compiles kernels differently.
    pub fn file_name(device: &DeviceReport) -> String {
        format!("{}.{}.json", slug(&device.name), slug(&device.driver))
    }

    /// Reads a profile.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::File`] if the file cannot be read, is not a profile, or has a target that does not
    /// suit meshes of every size.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|source| Error::Io { path: path.into(), source })?;
        let wrong = |place: String, e: &dyn std::fmt::Display| {
            let message = format!("{e}; this is not a profile of this version of `olbvh tune`; remove it, or tune again");
            Error::File { path: path.into(), place, message }
        };
        let profile: Self = serde_json::from_str(&text).map_err(|e| wrong(format!("line {}: ", e.line()), &e))?;
        profile.target.check_scale().map_err(|e| wrong(String::new(), &e))?;
        Ok(profile)
    }

    /// Finds the profile of a device in a folder. A profile that is broken, belongs to another device, or does not suit
    /// this one is ignored, which costs only speed.
    pub fn find(folder: &Path, device: &DeviceReport) -> Search {
        let path = folder.join(Self::file_name(device));
        if !path.exists() {
            return Search::Nothing;
        }
        let usable = Self::read(&path).and_then(|profile| {
            let stale = |what: &str, of: &str, is: &str| Error::File {
                path: path.clone(),
                place: String::new(),
                message: format!("made for {what} `{of}`, this is `{is}`; remove it, or run `olbvh tune`"),
            };
            if profile.device != device.name {
                return Err(stale("the device", &profile.device, &device.name));
            }
            if profile.driver != device.driver {
                return Err(stale("the driver", &profile.driver, &device.driver));
            }
            profile.target.check(&device.room).map_err(|e| Error::File {
                path: path.clone(),
                place: String::new(),
                message: format!("{e}; remove it, or run `olbvh tune`"),
            })?;
            Ok(profile)
        });
        match usable {
            Ok(profile) => Search::Found(path, Box::new(profile)),
            Err(error) => Search::Ignored(format!("profile ignored: {error}")),
        }
    }

    /// Writes the profile, completely or not at all.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let fail = |source| Error::Io { path: path.into(), source };
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(fail)?;
        }
        let json = serde_json::to_string_pretty(self).map_err(|e| Error::Invalid(e.to_string()))?;
        let mut file = OutputFile::create(path)?;
        file.write_all(json.as_bytes()).and_then(|()| file.write_all(b"\n")).map_err(fail)?;
        file.commit()
    }
}

#[cfg(test)]
mod tests {
    use super::slug;

    #[test]
    fn names_of_files_are_plain() {
        assert_eq!(slug("llvmpipe (LLVM 15.0.6, 256 bits)"), "llvmpipe-llvm-15-0-6-256-bits");
        assert_eq!(slug("../Über/GPU"), "ber-gpu");
    }
}
