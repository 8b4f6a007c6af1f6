//! `imucal device watch`

use std::path::PathBuf;

use clap::Args;
use imucal_core::watch::{self, MAX_LEN};

use super::Place;
use crate::{
    cli::{
        Ending, output,
        overwrite::{Overwrite, Planned},
        refuse,
    },
    diagnosis::watched::Watched,
    report,
};

#[derive(Args, Debug)]
pub(super) struct Arguments {
    #[command(flatten)]
    place: Place,
    /// Write the summary, for `imucal inspect` and `imucal diagnose --watch`
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let outputs: Vec<Planned> = arguments.out.iter().map(Planned::new).collect();
    let mut files = arguments.overwrite.plan(&arguments.place.files(), &outputs)?;
    let Some(summary) = arguments.place.open()?.watch()? else {
        return Ok(refuse(
            &"nothing was watched yet: that needs a record in use, and samples of its sensors",
        ));
    };
    output::text(&report::watch::watched(&Watched::of(&summary, &[])))?;
    if let Some(path) = &arguments.out {
        let mut page = [0; MAX_LEN];
        files.add(path, watch::encode(&summary, &mut page)?)?;
    }
    files.commit()?;
    Ok(Ending::Done)
}
