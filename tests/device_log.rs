//! The device's log: defmt frames over semihosting, decoded by the symbols of the image that wrote them.

use imucal_tests::firmware::{MEASURED, build, decoded, ready, run_with};

#[test]
fn the_log_of_a_fit_is_decoded_on_the_host() {
    if !ready() {
        return;
    }
    for board in MEASURED {
        let output = run_with(board, "log", &["log"]);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let image = build(board, "log", &["log"]).expect("it was built");
        let log = decoded(&image, &output.stdout);
        for part in [
            "info record of 00300017",
            "warn an erased page: BadMagic",
            "stopped: false",
            "info T9 of 40 rests: Step, None",
            "TooFewObservations { have: 8, need: 10 }",
        ] {
            assert!(log.contains(part), "`{part}` is missing on {}:\n{log}", board.core);
        }
    }
}
