//! What the core's parts take on a device: instructions counted by QEMU, stack by paint. Prints the README's table:
//! `cargo test -p imucal-tests --test device_cost -- --nocapture`.

use std::collections::HashMap;

use imucal_tests::firmware::{BOARDS, SHIFT, announce, counted, ready};

/// Frequency of the images' stopwatch, Hz: of mps2-an386, and of the micro:bit.
const STOPWATCH: [f64; 2] = [25e6, 16e6];
/// Iterations of the swarm's search.
const SEARCH: f64 = 300.0;

/// Instructions and stack of one part.
#[derive(Clone, Copy, Debug)]
struct Part {
    instructions: f64,
    count: f64,
    stack: f64,
}

/// Lines `NAME ticks N for M stack S`.
fn parts(lines: &str, frequency: f64) -> HashMap<String, Part> {
    let per_instruction = frequency * f64::from(1u32 << SHIFT) * 1e-9;
    let part = |line: &str| {
        let (name, rest) = line.split_once(" ticks ")?;
        let mut words = rest.split(' ');
        let mut next = || words.by_ref().find_map(|word| word.parse::<f64>().ok());
        let part = Part { instructions: next()? / per_instruction, count: next()?, stack: next()? };
        Some((name.to_owned(), part))
    };
    lines.lines().filter_map(part).collect()
}

#[test]
fn every_part_stays_within_its_instructions_and_its_stack() {
    if !ready() {
        return;
    }
    let [m4, m0] = [0, 1].map(|k| parts(&counted(BOARDS[k], "cost"), STOPWATCH[k]));
    announce(
        "profile firmware (opt-level s); instructions by QEMU's -icount, stack below the caller by paint",
    );
    announce(&format!("{:<44} {:>12} {:>7} {:>12} {:>7}", "", "Cortex-M4F", "stack", "Cortex-M0", "stack"));
    let row = |what: &str, name: &str, per: fn(&Part) -> f64| {
        let (a, b) = (&m4[name], &m0[name]);
        let many = |part: &Part| format!("{:.0}", part.instructions / per(part));
        announce(&format!("{what:<44} {:>12} {:>7} {:>12} {:>7}", many(a), a.stack, many(b), b.stack));
    };
    let each: fn(&Part) -> f64 = |part| part.count;
    let whole: fn(&Part) -> f64 = |_| 1.0;
    row("decode a record", "decode", whole);
    row("correct a sample", "apply", each);
    row("correct a sample, temperature as before", "apply_at", each);
    row("correct a sample of another temperature", "apply_at_moving", each);
    row("the same by hand, without a library", "apply_by_hand", each);
    for (model, what) in [("T9", "rests"), ("I14", "poses"), ("E9", "samples"), ("K12", "turns of 12 blocks")]
    {
        let (a, b) = (m4[&format!("whole fit of {model}")].count, m0[&format!("whole fit of {model}")].count);
        let name = if a == b { format!("{model}, {a} {what}") } else { format!("{model}, {a} ({b}) {what}") };
        row(&format!("{name}: an iteration"), &format!("one iteration of {model}"), whole);
        row(&format!("{name}: the fit"), &format!("whole fit of {model}"), whole);
        row(&format!("{name}: judgement"), &format!("judgement of {model}"), whole);
    }
    row("swarm: a particle's block", "particle", each);
    row("swarm: a slice", "swarm_slice", whole);

    let cost = |name: &str| m4[name].instructions;
    // A sample's, whether its temperature is that of the sample before or not.
    for name in ["apply_at", "apply_at_moving"] {
        assert!(m4[name].instructions / m4[name].count <= 60.0, "{name}: {:?}", m4[name]);
        assert!(m0[name].instructions / m0[name].count <= 2_000.0, "{name}: {:?}", m0[name]);
    }
    assert!(cost("apply") / m4["apply"].count <= 40.0);
    assert!(cost("whole fit of T9") <= 3e6 && cost("whole fit of I14") <= 6e6);
    // 40 particles over 1000 blocks.
    assert_eq!(m4["swarm_iteration"].count, 40_000.0);
    let search = cost("swarm_iteration") * SEARCH;
    announce(&format!(
        "swarm: 40 particles, 300 iterations, 1000 blocks: {:.2} G on the Cortex-M4F",
        search * 1e-9
    ));
    assert!(search <= 3e9);
    // A millisecond at 100 MHz.
    assert!(cost("swarm_slice") <= 1e5, "{}", cost("swarm_slice"));
    for (name, part) in m4.iter().chain(&m0) {
        assert!(part.stack <= 8192.0, "{name}: {part:?}");
    }
}
