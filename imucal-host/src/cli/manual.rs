//! `imucal manual`: completions for shells, and pages of the manual.

use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::{
    Cli, Ending,
    output::{self, say},
    overwrite::{Overwrite, Planned},
};

#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  imucal manual --completions bash > ~/.local/share/bash-completion/completions/imucal\n  imucal manual \
                  --pages ~/.local/share/man/man1"
)]
pub(super) struct Arguments {
    /// Print completions for this shell
    #[arg(long, value_name = "SHELL", required_unless_present = "pages")]
    completions: Option<Shell>,
    /// Write a page for the program and for each command into this folder
    #[arg(long, value_name = "FOLDER")]
    pages: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    if let Some(shell) = arguments.completions {
        let mut text = Vec::new();
        clap_complete::generate(shell, &mut Cli::command(), "imucal", &mut text);
        output::document(&String::from_utf8_lossy(&text))?;
    }
    let Some(folder) = &arguments.pages else { return Ok(Ending::Done) };
    std::fs::create_dir_all(folder).with_context(|| {
        format!("{}: found no folder and cannot make one; give another --pages", folder.display())
    })?;
    let pages: Vec<(PathBuf, Vec<u8>)> =
        pages()?.into_iter().map(|(name, page)| (folder.join(name), page)).collect();
    let planned: Vec<Planned> = pages.iter().map(|(path, _)| Planned::new(path)).collect();
    let mut files = arguments.overwrite.plan(&[], &planned)?;
    for (path, page) in &pages {
        files.add(path, page)?;
    }
    files.commit()?;
    say!("{}: {} pages", folder.display(), pages.len());
    Ok(Ending::Done)
}

/// The page of the program and of each of its commands, by file name.
fn pages() -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let mut program = Cli::command();
    program.build();
    let render = |command: &clap::Command, name: String| -> anyhow::Result<(String, Vec<u8>)> {
        let mut page = Vec::new();
        clap_mangen::Man::new(command.clone()).title(name.to_uppercase()).render(&mut page)?;
        Ok((format!("{name}.1"), page))
    };
    let mut pages = vec![render(&program, "imucal".to_owned())?];
    for command in program.get_subcommands().filter(|command| command.get_name() != "help") {
        let name = format!("imucal-{}", command.get_name());
        // Its synopsis names it as it is called.
        let called = command.clone().bin_name(format!("imucal {}", command.get_name()));
        pages.push(render(&called, name)?);
    }
    Ok(pages)
}
