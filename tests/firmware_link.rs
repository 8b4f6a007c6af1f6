//! The core on the microcontroller: it links without panic and allocator, fits, and computes what the host computes.

use firmware_example::{drill, fit};
use imucal_core::{
    link::FitModel,
    model::parameterisation::{FULL, UPPER_TRIANGULAR},
};
use imucal_tests::firmware::{BOARDS, Board, RISC_V, build, ready, run, run_with};
use imucal_tests::footprint;
use object::{Object, ObjectSection, ObjectSymbol};

/// Stack of the fits, bytes.
const STACK_BUDGET: u32 = 8 * 1024;

/// Instructions one corrected sample may take on a Cortex-M4F: 18 loads and stores, 12 operations, and a return.
const INSTRUCTIONS_A_SAMPLE: usize = 40;

#[test]
fn every_image_links_without_panic_or_allocator_and_runs() {
    if !ready() {
        return;
    }
    // With the key, so that the gate reaches the seals as well.
    let everywhere = [("gate", &["key"][..]), ("correct", &[]), ("integer", &[]), ("empty", &[])];
    for board in BOARDS.into_iter().chain([RISC_V]) {
        for (image, features) in everywhere {
            let output = run_with(board, image, features);
            assert_eq!(output.status.code(), Some(0), "{image} on {}: {output:?}", board.core);
        }
    }
    for board in BOARDS {
        let output = run(board, "cost");
        assert_eq!(output.status.code(), Some(0), "cost on {}: {output:?}", board.core);
        build(board, "coprocessor", &[]).unwrap_or_else(|refusal| panic!("{refusal}"));
    }
}

#[test]
fn each_end_of_a_run_is_reported_to_the_next_with_its_address() {
    if !ready() {
        return;
    }
    let ends = "0 power in nowhere\n1 fault in read\n2 stack overflow in nowhere\n";
    for board in BOARDS {
        // The micro:bit of QEMU has no watchdog.
        let watchdog = if board.machine == "microbit" { "" } else { "3 watchdog in hang\n" };
        let output = run(board, "restarts");
        let said = String::from_utf8(output.stdout).expect("the image writes text");
        assert_eq!((output.status.code(), said), (Some(0), format!("{ends}{watchdog}")), "{}", board.core);
    }
}

#[test]
fn a_deliberate_panic_does_not_link() {
    if !ready() {
        return;
    }
    // One of each architecture: the symbol that is missing is the core's, whatever the board.
    for board in [BOARDS[0], RISC_V] {
        let refusal =
            build(board, "gate", &["control-panic", "key"]).expect_err("the gate lets a panic through");
        assert!(
            refusal.contains("undefined symbol: imucal_a_panic_path_is_left"),
            "it failed for another reason:\n{refusal}"
        );
    }
}

#[test]
fn device_and_host_compute_the_same_bits() {
    let mut host = String::new();
    firmware_example::replay::write(&mut host).expect("a String takes every line");
    assert!(host.contains("encoded alike\nacc apply "), "{host}");
    if !ready() {
        return;
    }
    for board in BOARDS.into_iter().chain([RISC_V]) {
        assert_eq!(after_the_lines_of(&host, board, "replay"), "", "on {}", board.core);
    }
}

#[test]
fn an_intended_fault_of_one_ulp_in_one_sample_is_found() {
    if !ready() {
        return;
    }
    let mut host = String::new();
    firmware_example::replay::write(&mut host).expect("a String takes every line");
    let output = run_with(BOARDS[0], "replay", &["control-ulp"]);
    let device = String::from_utf8(output.stdout).expect("the image writes text");
    let differing: Vec<_> =
        host.lines().zip(device.lines()).filter(|(host, device)| host != device).collect();
    // One line of ten thousand samples for each sensor of the record.
    let sensors = host.lines().filter(|line| line.contains(" samples ")).count() / 10;
    assert_eq!(differing.len(), sensors, "{differing:?}");
    assert!(sensors * 100_000 >= 100_000);
}

/// What a sensor's true parameters are in a model's order; none where the sensor's inverse was fitted.
fn truth(model: FitModel) -> Option<Vec<f32>> {
    let truth = drill::sensor(model).truth;
    match model {
        FitModel::I14 => None,
        FitModel::K12 => Some(FULL.theta(&truth).iter().copied().collect()),
        _ => Some(UPPER_TRIANGULAR.theta(&truth).iter().copied().collect()),
    }
}

#[test]
fn the_fits_of_the_image_find_their_sensors() {
    let host = fits_of_the_host();
    let figures = |line: &str| -> Vec<f32> {
        let words = line.split_once(": ").expect("figures").1.split(' ');
        words.map(|word| f32::from_bits(u32::from_str_radix(word, 16).expect("bits"))).collect()
    };
    let lines: Vec<&str> = host.lines().collect();
    let (mut errors, mut fits, mut accepted) = (Vec::new(), 0, 0);
    for (at, line) in lines.iter().enumerate().filter(|(_, line)| line.contains(" searched ")) {
        fits += 1;
        accepted += u32::from(line.ends_with(" accepted"));
        let model = FitModel::ALL.into_iter().find(|model| line.starts_with(model.name())).expect("a model");
        let (theta, covariance) = (figures(lines[at + 2]), figures(lines[at + 3]));
        let Some(truth) = truth(model).filter(|_| line.ends_with(" accepted")) else { continue };
        for (k, (theta, truth)) in theta.iter().zip(truth).enumerate() {
            errors.push((theta - truth).abs() / covariance[k * (k + 3) / 2].sqrt());
        }
    }
    assert!(fits >= 4 * fit::SETS && accepted * 10 >= fits * 9, "{accepted} of {fits}");
    let beyond = errors.iter().filter(|error| **error > 3.0).count();
    assert!(errors.len() > 400 && beyond * 50 < errors.len(), "{beyond} of {} beyond 3 sigma", errors.len());
    assert!(errors.iter().all(|error| *error < 6.0), "{errors:?}");
    assert_eq!(host.matches("record decoded alike: 49 4d 55 43 ").count() as u32, fit::SETS);
}

#[test]
fn device_and_host_fit_search_and_pack_to_the_same_bits() {
    if !ready() {
        return;
    }
    let host = fits_of_the_host();
    for board in BOARDS {
        let stack = after_the_lines_of(&host, board, "fit");
        let figures: Vec<u32> = stack.split(' ').filter_map(|word| word.parse().ok()).collect();
        let [used, there] = figures[..] else { panic!("{}: {stack:?}", board.core) };
        assert!(used < there, "{}: the stack has left its memory", board.core);
        assert!(used <= STACK_BUDGET, "{}: {used} B of stack", board.core);
    }
    assert_eq!(after_the_lines_of(&host, RISC_V, "fit"), "", "on {}", RISC_V.core);
}

fn fits_of_the_host() -> String {
    let mut host = String::new();
    let mut memory = fit::FitMemory::new();
    fit::write(&mut host, &mut memory).expect("a String takes every line");
    host
}

/// What an image writes after the lines that it shares with the host.
fn after_the_lines_of(host: &str, board: Board, image: &str) -> String {
    let output = run(board, image);
    assert_eq!(output.status.code(), Some(0), "{image} on {}: {output:?}", board.core);
    let device = String::from_utf8(output.stdout).expect("the image writes text");
    let differing = host.lines().zip(device.lines()).find(|(host, device)| host != device);
    assert_eq!(differing, None, "host and {} differ", board.core);
    device.strip_prefix(host).expect("as many lines as the host").to_owned()
}

#[test]
fn the_images_of_the_real_board_link_with_their_log() {
    if !ready() {
        return;
    }
    for image in ["nrf52840", "embassy", "rtic"] {
        let elf = build(BOARDS[0], image, &[image]).unwrap_or_else(|refusal| panic!("{refusal}"));
        let bytes = std::fs::read(elf).expect("the image can be read");
        let file = object::File::parse(&*bytes).expect("an ELF file");
        // What a debugger looks for in RAM, and the texts that defmt leaves in the file.
        assert!(file.symbol_by_name("_SEGGER_RTT").is_some(), "{image} has no RTT");
        let texts = file.section_by_name(".defmt").map_or(0, |section| section.size());
        assert!(texts > 0, "{image} says nothing");
    }
}

#[test]
fn a_sample_costs_at_most_forty_instructions_on_a_cortex_m4f() {
    if !ready() {
        return;
    }
    let bytes = footprint::elf(BOARDS[0], "correct");
    let file = object::File::parse(&*bytes).expect("an ELF file");
    let apply = file
        .symbols()
        .find(|symbol| symbol.name().is_ok_and(|name| name.contains("7correct5apply")))
        .expect("`correct::apply` is not inlined");
    let text = file.section_by_name(".text").expect("there is code");
    // The lowest bit of a function's address says Thumb.
    let code = text.data_range(apply.address() & !1, apply.size()).ok().flatten().expect("its code");
    let count = straight_line_instructions(code).expect("no branch but the return");
    assert!(count <= INSTRUCTIONS_A_SAMPLE, "{count} instructions");
}

/// Number of Thumb instructions; `None` if one of them branches, for then a number of bytes says nothing.
///
/// Encodings: ARMv7-M Architecture Reference Manual, A5.1 to A5.3.
fn straight_line_instructions(code: &[u8]) -> Option<usize> {
    let mut halves = code.chunks_exact(2).map(|half| u16::from_le_bytes([half[0], half[1]]));
    let mut count = 0;
    while let Some(first) = halves.next() {
        let wide = first >> 11 >= 0b11101;
        let branches = if wide {
            let second = halves.next()?;
            first >> 11 == 0b11110 && second & 0x8000 != 0
        } else {
            let conditional = first & 0xF000 == 0xD000;
            let unconditional = first & 0xF800 == 0xE000;
            let compare_and_branch = first & 0xF500 == 0xB100;
            conditional || unconditional || compare_and_branch
        };
        if branches {
            return None;
        }
        count += 1;
    }
    Some(count)
}

#[test]
fn loops_are_not_taken_for_straight_lines() {
    let add_return = [0x40, 0x18, 0x70, 0x47]; // adds r0, r0, r1; bx lr
    assert_eq!(straight_line_instructions(&add_return), Some(2));
    let wide_return = [0x00, 0xEE, 0x20, 0x0A, 0x70, 0x47]; // vmla.f32 s0, s0, s1; bx lr
    assert_eq!(straight_line_instructions(&wide_return), Some(2));
    let looping = [0x40, 0x18, 0xFD, 0xD1, 0x70, 0x47]; // adds; bne; bx lr
    assert_eq!(straight_line_instructions(&looping), None);
    let calling = [0x00, 0xF0, 0x00, 0xF8, 0x70, 0x47]; // bl; bx lr
    assert_eq!(straight_line_instructions(&calling), None);
}
