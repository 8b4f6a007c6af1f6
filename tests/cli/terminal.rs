//! What a terminal shows: width, colours, help, completions, pages of the manual, how much is printed.

use imucal_tests::{program, program::Ended};

use super::{Folder, estimating_noise, imucal};

/// Columns of a terminal as it opens.
const COLUMNS: usize = 80;

fn with(folder: &Folder, variables: &[(&str, &str)], line: &str) -> Ended {
    program::run(env!("CARGO_BIN_EXE_imucal-under-test"), variables, &folder.arguments(line))
}

/// Lines of a report that are wider than a terminal; what holds a path may be.
fn wide(ended: &Ended, folder: &Folder) -> Vec<String> {
    let path = folder.path("").display().to_string();
    let is_wide = |line: &&str| line.chars().count() > COLUMNS && !line.contains(path.trim_end_matches('/'));
    ended.out.lines().filter(is_wide).map(str::to_owned).collect()
}

#[test]
fn reports_fit_a_terminal_of_eighty_columns() {
    let folder = Folder::with_calibration();
    estimating_noise::still(&folder, 60_000, |_, _, _| true);
    let lines = [
        "calibrate small.csv --compare",
        "inspect cal.toml",
        "inspect cal.bin",
        "compare cal.toml cal.bin",
        "check small.csv --calibration cal.toml",
        "verify small.csv --calibration cal.toml",
        "diagnose small.csv",
        "diagnose --list",
        "noise still.csv",
        "capture small.csv",
    ];
    for line in lines {
        let ended = folder.run(line);
        assert!(!ended.out.is_empty(), "{line}: {ended:#?}");
        let wide = wide(&ended, &folder);
        assert!(wide.is_empty(), "{line}: {wide:#?}");
    }
}

#[test]
fn help_fits_too_and_each_command_shows_an_example() {
    let top = imucal(&["--help"]).with(0).out;
    let commands: Vec<&str> = top
        .lines()
        .skip_while(|line| *line != "Commands:")
        .skip(1)
        .take_while(|line| !line.is_empty())
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect();
    assert!(commands.len() >= 18, "{commands:?}");
    for command in commands {
        let help = imucal(&[command, "--help"]).with(0).out;
        assert!(help.contains("Example"), "{command} shows no example: {help}");
        let before = help.split("Example").next().unwrap_or_default();
        let wide: Vec<&str> = before
            .lines()
            .filter(|line| line.chars().count() > COLUMNS && !line.starts_with("Usage:"))
            .collect();
        assert!(wide.is_empty(), "{command}: {wide:#?}");
    }
}

#[test]
fn answers_are_coloured_where_colours_are_shown_and_nowhere_else() {
    let folder = Folder::with_recording();
    let line = "calibrate small.csv";
    assert!(!folder.run(line).with(0).out.contains('\u{1b}'));
    let forced = with(&folder, &[("CLICOLOR_FORCE", "1")], line).with(0).out;
    assert!(forced.contains("\u{1b}[32maccepted"), "{forced}");
    let error = with(&folder, &[("CLICOLOR_FORCE", "1")], "calibrate missing.csv").with(2).err;
    assert!(error.contains("\u{1b}[31merror"), "{error}");
    let without = with(&folder, &[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")], line).with(0).out;
    assert!(!without.contains('\u{1b}'), "{without}");
}

#[test]
fn quiet_prints_documents_and_errors_only_and_verbose_each_stage() {
    let folder = Folder::with_recording();
    let quiet = folder.run("calibrate small.csv --quiet --out cal.toml").with(0);
    assert_eq!((quiet.out.as_str(), quiet.err.as_str()), ("", ""));
    assert!(folder.path("cal.toml").exists());
    let json = folder.run("calibrate small.csv -q --json -").with(0).out;
    assert!(json.starts_with('{') && json.contains("imucal-calibration/1"), "{json}");
    assert!(folder.run("calibrate missing.csv --quiet").with(2).err.contains("missing.csv"));
    let verbose = folder.run("calibrate small.csv --verbose").with(0);
    assert!(verbose.err.contains("imucal: stage: 0.0 s: checking the samples"), "{}", verbose.err);
    folder.run("calibrate small.csv --quiet --verbose").with(2);
}

#[test]
fn completions_and_manual_pages_name_every_command_and_option() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let text = imucal(&["manual", "--completions", shell]).with(0).out;
        assert!(text.contains("calibrate") && text.contains("accept-suspect"), "{shell}: {text}");
    }
    let folder = Folder::new();
    let pages = folder.path("man");
    imucal(&["manual".as_ref(), "--pages".as_ref(), pages.as_os_str()]).with(0).printing(&["pages"]);
    let names = super::names(&pages);
    for page in ["imucal.1", "imucal-calibrate.1", "imucal-diagnose.1", "imucal-manual.1"] {
        assert!(names.iter().any(|name| name == page), "{names:?}");
    }
    let page = std::fs::read_to_string(pages.join("imucal-calibrate.1")).expect("a page");
    assert!(page.starts_with(".ie") || page.contains(".TH IMUCAL"), "{page}");
    assert!(page.contains("accept\\-suspect"), "{page}");
    imucal(&["manual".as_ref(), "--pages".as_ref(), pages.as_os_str()]).with(2).telling(&["--force"]);
}
