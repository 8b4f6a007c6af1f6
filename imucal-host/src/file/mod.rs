//! Files: read within limits, and written as whole sets or not at all.
//!
//! A plain file is written as a part in its target's folder and renamed onto it; links are followed, modes are kept.
//! What is no plain file (`/dev/null`, `/dev/stdout`, a FIFO) is written through. No other module opens a file to
//! replace it.

pub mod digest;
pub mod limits;
pub mod metered;
pub mod output_error;
pub mod output_set;
mod part;
pub mod target;

pub use self::limits::{Limits, ReadFault};
pub use self::output_error::OutputError;
pub use self::output_set::{Output, OutputSet};
pub use self::part::{Abandoned, abandon_parts};
pub use self::target::Target;
