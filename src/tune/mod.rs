//! Which shapes of the kernels are fastest on the device at hand: a search over the table of tunables, and the profile that later runs find.
//!
//! ```text
//! tunables   what can be changed, and in which steps
//! workload   what is timed: stage 0, two constructions, every query; and whether its answers are the expected ones, byte for byte
//! search     one tunable after the other: verified, then timed in turns with the best so far
//! profile    a file per device and driver in the user's configuration folder
//! ```

mod profile;
mod search;
mod tunables;
mod workload;

pub use profile::{Gain, Profile, Search, folder};
pub use search::{Event, Tuned, Work, tune};
pub use tunables::{TUNABLES, Tunable};
pub use workload::Workload;
