//! `imucal blind`: a set of sealed trials from draw to table.

use super::{Folder, imucal};

const SET: &str = "blind --healthy 2 --cases 2 --nonce b11d";

#[test]
fn a_set_is_run_scored_gone_on_with_and_scored_again() {
    let folder = Folder::new();
    let first = folder.run(&format!("{SET} --out set.d --jobs 2")).with(0).printing(&[
        "Set of nonce 000",
        "2 healthy and 2 afflicted recordings",
        "false alarm on healthy recordings",
        "outside the catalogue, flagged, λ > 800",
        "Time of a diagnosis",
    ]);
    assert_eq!(first.err, "");
    // Nothing is left to do, so that the times are the same too.
    assert_eq!(folder.run("blind --healthy 2 --cases 2 --out set.d").with(0).out, first.out);
    assert_eq!(folder.run("blind --score set.d").with(0).out, first.out);
    let seals = String::from_utf8(folder.bytes("set.d/seals.jsonl")).unwrap();
    assert_eq!(seals.lines().count(), 4);
    folder.run("blind --out set.d --nonce b11e").with(2).telling(&["found the set of nonce 000", "b11e"]);
}

#[test]
fn one_case_is_written_for_a_closer_look() {
    let folder = Folder::new();
    folder
        .run("blind --nonce b11d --open afflicted-0000 --out case.d")
        .with(0)
        .printing(&["afflicted-0000.csv.gz"]);
    let label = String::from_utf8(folder.bytes("case.d/afflicted-0000.label.json")).unwrap();
    assert!(label.contains("lambda_beside"), "{label}");
    assert!(!folder.bytes("case.d/afflicted-0000.toml").is_empty());
}

#[test]
fn what_is_no_case_no_nonce_and_no_set_is_said() {
    imucal(&["blind", "--nonce", "xyz"]).with(2).telling(&["`xyz` is no nonce"]);
    imucal(&["blind", "--nonce", "1", "--open", "ill-1"]).with(2).telling(&["there is no case `ill-1`"]);
    imucal(&["blind", "--score", "there-is-no-such-folder"]).with(2).telling(&["found no folder"]);
}
