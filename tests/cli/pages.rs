//! `--html`: the pages of results, as a browser lays them out.

use imucal_tests::browser;

use super::{Folder, batching, estimating_noise};

/// Widths of a telephone and of a wide screen, px.
const WIDTHS: [u32; 2] = [390, 1400];
/// Largest page, bytes.
const LARGEST: usize = 300_000;

/// The page says these things, is short, and nothing in it overlaps or reaches beyond its place.
pub(super) fn is_laid_out(folder: &Folder, name: &str, drawings: usize, says: &[&str]) {
    let page = folder.text(name);
    assert!(page.len() <= LARGEST, "{name}: {} bytes", page.len());
    for words in says {
        assert!(page.contains(words), "{name} does not say `{words}`");
    }
    for foreign in ["http:", "https:", "<script", "url(", "@import", "<link", " src="] {
        assert!(!page.contains(foreign), "{name} holds {foreign}");
    }
    let Some(program) = browser::program() else { return };
    for width in WIDTHS {
        let found = browser::layout(&program, &page, width);
        assert_eq!(found.drawings, drawings, "{name}: {found:#?}");
        assert!(found.labels >= 4 * drawings, "{name}: {found:#?}");
        assert!(found.taken <= width, "{name}: {found:#?}");
        assert!(
            found.overlaps.is_empty() && found.outside.is_empty() && found.collisions.is_empty(),
            "{name}: {found:#?}"
        );
    }
}

#[test]
fn the_page_of_a_calibration_holds_what_a_certificate_needs() {
    let folder = Folder::with_recording();
    folder.run("calibrate small.csv --html page.html").with(0);
    let recording = folder.bytes("small.csv");
    let hash: String = {
        use sha2::{Digest, Sha256};
        Sha256::digest(&recording).iter().map(|byte| format!("{byte:02x}")).collect()
    };
    is_laid_out(
        &folder,
        "page.html",
        7,
        &[
            "calibrated and accepted",
            "k = 2",
            "gain_xx",
            "bias_z",
            "Coverage",
            &hash,
            env!("CARGO_PKG_VERSION"),
        ],
    );
}

#[test]
fn the_page_of_a_refusal_says_why_and_what_to_do() {
    let folder = Folder::with_recording();
    let head: Vec<String> = folder.text("small.csv").lines().take(400).map(str::to_owned).collect();
    folder.write("short.csv", head.join("\n") + "\n");
    folder.write("short.toml", folder.text("small.toml"));
    folder.run("calibrate short.csv --html page.html").with(1);
    let page = folder.text("page.html");
    assert!(page.contains("verdict bad") && page.contains("To do: "), "{page}");
}

#[test]
fn the_page_of_a_noise_estimate_shows_the_deviations() {
    let folder = Folder::new();
    estimating_noise::still(&folder, 60_000, |_, _, _| true);
    folder.run("noise still.csv --html page.html").with(0);
    is_laid_out(&folder, "page.html", 2, &["N white", "95 % interval", "averaging time"]);
}

#[test]
fn the_page_of_a_comparison_shows_what_has_moved() {
    let folder = Folder::with_calibration();
    folder.run("compare cal.toml cal.bin --html page.html").with(0);
    is_laid_out(&folder, "page.html", 3, &["No parameter has moved", "Drift of the gyroscope", "gain_zz"]);
}

#[test]
fn the_page_of_a_batch_shows_how_its_units_spread() {
    let folder = batching::units(9);
    folder.write("in.d/broken.csv", "no header");
    folder.run("batch in.d --out out.d --html page.html").with(2);
    let says = [
        "10 recordings: 9 calibrated",
        "Not calibrated",
        "accelerometer by T9 from counts: 9 units",
        "offset_z",
    ];
    is_laid_out(&folder, "page.html", 3, &says);
    // A page of an earlier batch is the batch's own; any other file is not.
    folder.run("batch in.d --out out.d --html page.html").with(2).telling(&["already done"]);
    folder.write("mine.html", "<title>mine</title>");
    folder.run("batch in.d --out out.d --html mine.html").with(2).telling(&["mine.html", "--force"]);
    assert_eq!(folder.text("mine.html"), "<title>mine</title>");
}

#[test]
fn the_demo_writes_a_page_with_calibration_and_diagnosis() {
    let folder = Folder::new();
    let out = folder.path("out");
    super::imucal(&["demo".as_ref(), "--out".as_ref(), out.as_os_str()]).with(0);
    std::fs::rename(out.join("demo.html"), folder.path("demo.html")).expect("the demo's page");
    let says = [
        "acc.scale_cubic",
        "From the gap to the noise",
        "The gap of each channel",
        "What the acc follows",
        "Rests and motions",
    ];
    is_laid_out(&folder, "demo.html", 9, &says);
}

#[test]
fn a_page_replaces_no_file_unasked() {
    let folder = Folder::with_recording();
    folder.write("page.html", "mine");
    folder.run("calibrate small.csv --html page.html").with(2).telling(&["page.html", "--force"]);
    assert_eq!(folder.text("page.html"), "mine");
    folder.run("calibrate small.csv --html small.csv").with(2).telling(&["small.csv"]);
}
