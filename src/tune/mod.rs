//! Search for the target (the tuning parameters of the kernels) that is fastest on the device at hand, and the profile
//! in which later runs find it.
//!
//! ```text
//! tunables   what can be changed, and in which steps
//! workload   what is timed (stage 0, two constructions, every query), and the answers that must be equal byte for byte
//! search     one tunable after the other: verified, then timed in turns with the best so far
//! profile    one file per device and driver in the user's configuration folder
//! ```

mod profile;
mod search;
mod tunables;
mod workload;

pub use profile::{Gain, Profile, Search, folder};
pub use search::{Event, Tuned, Work, tune};
pub use tunables::{TUNABLES, Tunable};
pub use workload::Workload;
