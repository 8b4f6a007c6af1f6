//! What can be wrong with a folder of sealed trials.

use std::{io, path::PathBuf};

use crate::{file::OutputError, simulator::SimulationError};

/// Why there are no trials; its text says what to do.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // The fields are those of each message.
pub enum TrialError {
    /// A file of the folder.
    #[error("{}: {cause}; check the folder", path.display())]
    File { path: PathBuf, cause: io::Error },
    /// The file of the set cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A set that is drawn otherwise.
    #[error(
        "{}: found a set drawn without these effects or with others, expected the same; choose another folder",
        path.display()
    )]
    OtherEffects { path: PathBuf },
    /// Files of a set, but not which one.
    #[error(
        "{}: found the file of a set without its set.json, expected both or none; choose another folder; nothing was changed",
        path.display()
    )]
    Headless { path: PathBuf },
    /// The folder holds another set.
    #[error(
        "{}: found the set of nonce {found}, expected {expected}; choose another folder, or leave the nonce out to go on with it",
        path.display()
    )]
    OtherSet { path: PathBuf, found: String, expected: String },
    /// The folder holds trials of another world.
    #[error(
        "{}: found trials of the world `{found}`, expected `{expected}`; choose another folder, or --world {found} to go on with it",
        path.display()
    )]
    OtherWorld { path: PathBuf, found: &'static str, expected: &'static str },
    /// A line that cannot be read, and is not the last.
    #[error("{}, line {line}: found {found}, expected a finished trial; remove the line and run again", path.display())]
    Damaged { path: PathBuf, line: usize, found: String },
    /// A label is not the one that was sealed.
    #[error("{case}: its label's hash is {found}, expected {sealed} as sealed; the set cannot be trusted")]
    Broken { case: String, found: String, sealed: String },
    /// A label without a seal.
    #[error("{case}: found no seal, expected one from before the diagnosis; the set cannot be trusted")]
    Unsealed { case: String },
    /// A case cannot be simulated.
    #[error("{case}: {cause}")]
    Simulation { case: String, cause: SimulationError },
}
