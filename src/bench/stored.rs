//! Result files, as far as their comparison needs them.

use super::measure::Spread;
use crate::error::{Error, Result};
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// The part of a file that is read; results of other versions may contain more or less.
#[derive(Deserialize)]
pub(super) struct Stored {
    pub meshes: Vec<StoredMesh>,
    pub copy: Option<StoredCopy>,
    /// Ignored, because it follows from the figures.
    #[serde(rename = "scaling")]
    _scaling: Option<IgnoredAny>,
    #[serde(flatten)]
    pub facts: BTreeMap<String, Value>,
}

#[derive(Deserialize)]
pub(super) struct StoredCopy {
    pub bytes: u64,
    pub repetitions: u32,
    pub command_ms: Spread,
    pub kernel_ms: Spread,
}

#[derive(Deserialize)]
pub(super) struct StoredMesh {
    pub name: String,
    pub tets: u64,
    pub points: u64,
    pub structures: Vec<StoredStructure>,
}

#[derive(Deserialize)]
pub(super) struct StoredStructure {
    pub name: String,
    pub memory: StoredMemory,
    pub figures: Vec<StoredFigure>,
}

#[derive(Deserialize)]
pub(super) struct StoredMemory {
    pub total: u64,
}

#[derive(Deserialize)]
pub(super) struct StoredFigure {
    pub quantity: String,
    pub repetitions: u32,
    pub device_ms: Option<Spread>,
    pub wall_ms: Spread,
    pub items: Option<u64>,
}

/// Reads a result file.
pub(super) fn read(path: &Path) -> Result<Stored> {
    let text = std::fs::read_to_string(path).map_err(|source| Error::Io { path: path.into(), source })?;
    serde_json::from_str(&text).map_err(|e| Error::File {
        path: path.into(),
        place: format!("line {}: ", e.line()),
        message: format!("{e}; it must be results that `olbvh bench -o FILE.json` wrote"),
    })
}

/// Collects every leaf of a JSON object under its path, for example `device.name`; lists are leaves.
pub(super) fn leaves(prefix: &str, value: &Value, out: &mut BTreeMap<String, Value>) {
    if let Value::Object(members) = value {
        for (name, member) in members {
            leaves(&if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") }, member, out);
        }
    } else {
        out.insert(prefix.to_owned(), value.clone());
    }
}
