//! Readers of meshes, and writers of results.
#![cfg(feature = "formats")]
#![allow(clippy::unwrap_used, reason = "also in helpers of tests")]
#![allow(
    clippy::format_collect,
    clippy::format_push_string,
    clippy::case_sensitive_file_extension_comparisons,
    reason = "simple code matters more than speed here"
)]

mod abaqus;
mod disk;
mod fuzz;
mod gmsh;
mod lists;
mod load;
mod output;
mod polyhedra;
mod small;
mod split;
mod structured;
mod vtk;
mod write;
