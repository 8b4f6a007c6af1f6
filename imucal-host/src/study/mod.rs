//! Studies: simulated comparisons whose answer is a table. One a file, seeded, each printed by one command.

pub mod coverage;
pub mod recovery;
pub mod trust;
pub mod units;
