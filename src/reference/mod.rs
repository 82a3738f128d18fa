//! The reference implementation of every stage and query, in plain safe Rust; files name the kernels they are twins of.
//! It is the oracle of the tests, documents the algorithms, and runs `--device cpu`. It does not depend on Vulkan.

pub mod assign;
pub(crate) mod best_owner;
pub mod boundary;
pub mod brute;
pub mod build;
pub(crate) mod codes;
pub mod corners;
pub mod depth;
pub(crate) mod leaf_walk;
pub mod leaves;
pub(crate) mod levels;
pub mod locate;
pub(crate) mod marks;
pub mod nearest;
pub mod overlap;
pub mod quarters;
pub mod ranges;
pub mod separate;
pub mod slabs;
pub mod slice;
pub(crate) mod sort;
pub mod splits;
pub mod tet;
pub mod traverse;
mod validate;
pub mod vertices;
pub mod volume;
pub mod walk;
