//! The plain twin of every stage and query, in safe Rust with the same stems as the kernels: the oracle of the tests, the
//! documentation of the algorithms, and the engine of `--device cpu`. Knows no Vulkan.

pub mod assign;
pub mod boundary;
pub mod brute;
pub mod build;
pub mod candidates;
pub mod codes;
pub mod depth;
pub mod grid;
pub mod leaf_walk;
pub mod leaves;
pub mod levels;
pub mod locate;
pub mod marks;
pub mod order;
pub mod overlap;
pub mod quarters;
pub mod ranges;
pub mod separate;
pub mod slice;
pub mod sort;
pub mod splits;
pub mod tet;
pub mod traverse;
pub mod vertices;
pub mod volume;
pub mod walk;
