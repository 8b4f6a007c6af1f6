//! What the core's parts take on a device: instructions counted by QEMU, flash and RAM by section, stack by paint and
//! by analysis. Prints the table of `imucal-host/docs/devices.md`: `cargo test -p imucal-tests --test device_cost -- --nocapture`.

use std::collections::HashMap;

use firmware_example::{
    fitting::{self, Fitting},
    standalone::{POSES, Standalone},
};
use imucal_core::session::{alignment::AlignmentFit, temperature::WarmthFit};
use imucal_tests::call_stack::CallGraph;
use imucal_tests::coprocessor::painted_stack;
use imucal_tests::firmware::{MEASURED, SHIFT, announce, counted, ready};
use imucal_tests::footprint::{self, Footprint};

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

/// Flash that reading a record and correcting samples may take, bytes: of the board with a floating-point unit, and
/// of the other, which brings its arithmetic along. Of them 2.7 KiB judge the record's figures.
const FLASH: [u64; 2] = [9 * 1024, 11 * 1024];
/// The same in integers, of which the part of a reading of the thermometer is in `f64`, and in software.
const FLASH_IN_INTEGERS: [u64; 2] = [14 * 1024, 15 * 1024];
/// Instructions of an observer's sample, and of a session's, which also looks for clipping and at the thermometer.
const OBSERVED: f64 = 400.0;
const OF_SESSION: f64 = 500.0;
/// Instructions of a sample in integers.
const IN_INTEGERS: f64 = 200.0;
/// Flash that reading a record, correcting, and fitting, judging and packing every model may take on the board with a
/// floating-point unit, bytes.
const FLASH_WITH_FITS: u64 = 52 * 1024;
/// RAM of a fit of 64 rests, and of a swarm of 40 in twelve parameters without its blocks, bytes.
const RAM: [usize; 2] = [4096, 8192];
/// Stack, bytes; and no image may need more than it has.
const STACK: u32 = 8 * 1024;

#[test]
fn every_part_stays_within_its_instructions_flash_ram_and_stack() {
    if !ready() {
        return;
    }
    let costs = [0, 1].map(|k| parts(&counted(MEASURED[k], "cost"), STOPWATCH[k]));
    let flash = Flash::measured();
    let ram = [size_of::<fitting::Memory<64, 0, 0, 0, 0>>() + size_of::<Fitting<'_, 0, 0, 0, 0, 0>>()]
        .into_iter()
        .chain([size_of::<fitting::Memory<0, 0, 0, 0, 40>>()]);
    let ram: Vec<usize> = ram.collect();
    let stack = MEASURED.map(|board| CallGraph::of(&footprint::elf(board, "coprocessor")));
    let painted = MEASURED.map(painted_stack);

    print_costs(&costs);
    let [m4, m0] = &costs;
    announce("");
    announce(&format!("{:<46} {:>12} {:>20}", "bytes over an empty image", "Cortex-M4F", "Cortex-M0"));
    let both = |what: &str, [a, b]: [u64; 2]| announce(&format!("{what:<46} {a:>12} {b:>20}"));
    both("flash: decode and correct", flash.correct);
    both("flash: decode and correct in integers", flash.integer);
    announce(&format!("{:<46} {:>12}", "flash: and fit, judge and pack every model", flash.fits));
    announce(&format!("{:<46} {:>12}", "flash: a session that stores, and no host", flash.standalone));
    both("flash: the co-processor, link and drivers", flash.whole);
    both("RAM: the co-processor and room for its fits", flash.ram);
    announce(&format!("{:<46} {:>12}", "RAM: of them T9 of 64 rests", ram[0]));
    let session = size_of::<Standalone>();
    announce(&format!("{:<46} {session:>12}", "RAM: of them a session"));
    let warmth = size_of::<WarmthFit<POSES>>();
    announce(&format!("{:<46} {warmth:>12}", "RAM: of them its terms of temperature"));
    let alignment = size_of::<AlignmentFit>();
    announce(&format!("{:<46} {alignment:>12}", "RAM: of them its magnetometer's alignment"));
    announce(&format!("{:<46} {:>12}", "RAM: of them a swarm of 40 in 12 parameters", ram[1]));
    let depths = stack.map(|graph| graph.depth("main"));
    both("stack: the co-processor, by analysis", [0, 1].map(|k| depths[k].bytes.into()));
    both("stack: after fits, search, storing, by paint", painted.map(Into::into));
    let room = MEASURED.map(|board| footprint::stack(board, "coprocessor"));
    both("stack: room for it, and then a fault", room.map(Into::into));

    check_costs(m4, m0);
    assert!(flash.correct.iter().zip(FLASH).all(|(used, budget)| *used <= budget), "{:?}", flash.correct);
    let within = flash.integer.iter().zip(FLASH_IN_INTEGERS).all(|(used, budget)| *used <= budget);
    assert!(within, "{:?}", flash.integer);
    assert!(flash.fits <= FLASH_WITH_FITS, "{}", flash.fits);
    // By the host's pointers, which are wider.
    assert!(session <= 12 * 1024, "{session}");
    assert!(warmth <= 2560 && alignment <= 1024, "{warmth} {alignment}");
    assert!(ram.iter().zip(RAM).all(|(used, budget)| *used <= budget), "{ram:?}");
    for ((depth, painted), room) in depths.iter().zip(painted).zip(room) {
        let most = STACK.min(room);
        assert!(painted <= depth.bytes && depth.bytes <= most, "{painted} B of {room} used, {depth:#?}");
    }
}

#[test]
fn a_sample_in_integers_calls_no_function_and_so_no_arithmetic_in_software() {
    if ready() {
        for board in MEASURED {
            let graph = CallGraph::of(&footprint::elf(board, "integer"));
            let sample = graph.depth("correct17apply_in_integers");
            assert_eq!(sample.chain.len(), 1, "{sample:#?}");
            assert!(!graph.indirect().contains(&sample.chain[0].0.as_str()), "{sample:#?}");
            // Where there is one to be called, it is seen to be: the temperature's part is in `f64`.
            let main = graph.depth("main");
            assert!(main.chain.len() > 2, "{main:#?}");
        }
    }
}

#[test]
fn only_the_gauge_of_the_stack_is_called_through_a_pointer() {
    if ready() {
        for board in MEASURED {
            let graph = CallGraph::of(&footprint::elf(board, "coprocessor"));
            assert!(graph.indirect().len() <= 1, "{:?}", graph.indirect());
        }
    }
}

/// Flash and RAM over an empty image, bytes, of each board.
struct Flash {
    correct: [u64; 2],
    integer: [u64; 2],
    fits: u64,
    standalone: u64,
    whole: [u64; 2],
    ram: [u64; 2],
}

impl Flash {
    fn measured() -> Self {
        let empty = MEASURED.map(|board| Footprint::of(board, "empty"));
        let over = |k: usize, image: &str| {
            let footprint = Footprint::of(MEASURED[k], image);
            (footprint.flash - empty[k].flash, footprint.ram - empty[k].ram)
        };
        let whole = [0, 1].map(|k| over(k, "coprocessor"));
        Self {
            correct: [0, 1].map(|k| over(k, "correct").0),
            integer: [0, 1].map(|k| over(k, "integer").0),
            fits: over(0, "fits").0,
            standalone: over(0, "standalone").0,
            whole: whole.map(|(flash, _)| flash),
            ram: whole.map(|(_, ram)| ram),
        }
    }
}

type Costs = HashMap<String, Part>;

fn print_costs([m4, m0]: &[Costs; 2]) {
    announce(
        "profile firmware (opt-level s); instructions by QEMU's -icount, stack below the caller by paint",
    );
    announce(&format!("{:<46} {:>12} {:>7} {:>12} {:>7}", "", "Cortex-M4F", "stack", "Cortex-M0", "stack"));
    let row = |what: &str, name: &str, per: fn(&Part) -> f64| {
        let (a, b) = (&m4[name], &m0[name]);
        let many = |part: &Part| format!("{:.0}", part.instructions / per(part));
        announce(&format!("{what:<46} {:>12} {:>7} {:>12} {:>7}", many(a), a.stack, many(b), b.stack));
    };
    let each: fn(&Part) -> f64 = |part| part.count;
    let whole: fn(&Part) -> f64 = |_| 1.0;
    row("decode a record", "decode", whole);
    row("correct a sample", "apply", each);
    row("correct a sample, temperature as before", "apply_at", each);
    row("correct a sample of another temperature", "apply_at_moving", each);
    row("the same by hand, without a library", "apply_by_hand", each);
    row("correct a sample in integers", "apply_in_integers", each);
    row("another temperature for samples in integers", "set_temperature", each);
    for (what, name) in [
        ("add two numbers, in software", "add"),
        ("the same by the compiler's function", "add_by_compiler"),
        ("multiply two numbers, in software", "multiply"),
        ("the same by the compiler's function", "multiply_by_compiler"),
    ] {
        let part = &m0[name];
        announce(&format!("{what:<46} {:>33.0} {:>7}", part.instructions / part.count, part.stack));
    }
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
    for (what, name) in [
        ("observers of rests and turns: a sample at rest", "observers_rest"),
        ("observers of rests and turns: one in a turn", "observers_turn"),
        ("session: a sample at rest", "session_rest"),
        ("session: a sample in a turn", "session_turn"),
        ("session: a sample of the field at rest", "session_field_rest"),
        ("session: a sample of the field in a turn", "session_field_turn"),
        ("session: the longest slice of a fit", "session_slice"),
        ("session: what to do next", "session_guide"),
        ("session: longest slice of its alignment", "session_alignment_slice"),
        ("session: all of its alignment", "session_alignment"),
        ("session: alignment applied, with errors", "session_align"),
        ("session: longest slice of its temperature terms", "session_warmth_slice"),
        ("session: all temperature terms of 38 rests", "session_warmth"),
    ] {
        let part = &m4[name];
        announce(&format!("{what:<46} {:>12.0} {:>7}", part.instructions / part.count, part.stack));
    }
    let search = m4["swarm_iteration"].instructions * SEARCH;
    announce(&format!(
        "swarm: 40 particles, 300 iterations, 1000 blocks: {:.2} G on the Cortex-M4F",
        search * 1e-9
    ));
}

fn check_costs(m4: &Costs, m0: &Costs) {
    let cost = |name: &str| m4[name].instructions;
    // A sample's, whether its temperature is that of the sample before or not.
    for name in ["apply_at", "apply_at_moving"] {
        assert!(m4[name].instructions / m4[name].count <= 60.0, "{name}: {:?}", m4[name]);
        assert!(m0[name].instructions / m0[name].count <= 2_000.0, "{name}: {:?}", m0[name]);
    }
    assert!(cost("apply") / m4["apply"].count <= 40.0);
    for costs in [m4, m0] {
        let integers = &costs["apply_in_integers"];
        assert!(integers.instructions / integers.count <= IN_INTEGERS, "{integers:?}");
    }
    // An observer's sample, of the inertial sensors and of the field, over a rest and a turn.
    for (name, most) in [
        ("observers_rest", OBSERVED),
        ("observers_turn", OBSERVED),
        ("session_field_rest", OBSERVED),
        ("session_field_turn", OBSERVED),
        ("session_rest", OF_SESSION),
        ("session_turn", OF_SESSION),
    ] {
        assert!(m4[name].instructions / m4[name].count <= most, "{name}: {:?}", m4[name]);
    }
    assert!(cost("whole fit of T9") <= 3e6 && cost("whole fit of I14") <= 6e6);
    // 40 particles over 1000 blocks.
    assert_eq!(m4["swarm_iteration"].count, 40_000.0);
    let search = cost("swarm_iteration") * SEARCH;
    assert!(search <= 3e9);
    // A millisecond at 100 MHz.
    assert!(cost("swarm_slice") <= 1e5, "{}", cost("swarm_slice"));
    for (name, part) in m4.iter().chain(m0) {
        assert!(part.stack <= 8192.0, "{name}: {part:?}");
    }
}
