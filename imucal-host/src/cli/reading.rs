//! How much of a file a command reads.

use clap::Args;

use crate::file::{Limits, limits::Size};

/// Limits of what is read, which only something else than a recording or a very long one exceeds.
#[derive(Args, Clone, Copy, Debug)]
pub(super) struct Reading {
    /// Most that a recording may come to, decompressed or in memory, such as 4G; a manifest or a calibration may come
    /// to a 1024th of it, or to 1M
    #[arg(long, value_name = "SIZE", default_value = "1G", help_heading = "Limits of reading")]
    max_size: Size,
    /// Most columns that a recording may have; a line may be 64 bytes long for each
    #[arg(long, value_name = "N", default_value_t = Limits::default().columns, help_heading = "Limits of reading")]
    max_columns: usize,
}

impl Reading {
    /// The limits.
    pub(super) fn limits(self) -> Limits {
        Limits { size: self.max_size.0, columns: self.max_columns }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        reading: Reading,
    }

    #[test]
    fn without_options_the_limits_are_the_default() {
        let read = |arguments: &[&str]| Command::parse_from(arguments).reading.limits();
        assert_eq!(read(&["imucal"]), Limits::default());
        let raised = Limits { size: 4 << 30, columns: 2000 };
        assert_eq!(read(&["imucal", "--max-size", "4G", "--max-columns", "2000"]), raised);
    }
}
