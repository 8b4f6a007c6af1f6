//! The memory map, and the linker scripts that go with it.
//!
//! Link arguments are given here rather than in `.cargo/config.toml`, because a RUSTFLAGS in the environment would
//! silently take the place of those.

use std::{env, fs, path::PathBuf};

/// A machine that stands for boards.
struct Machine {
    /// What the code asks for: the peripherals, and the map they lie in.
    cfgs: &'static [&'static str],
    /// Start of the target's name.
    target: &'static str,
    /// Starts of flash and RAM.
    origins: (u32, u32),
    /// Flash and RAM, KiB.
    sizes: (u32, u32),
    /// Of the RAM the stack, bytes. It lies at the start of RAM: one that is full leaves memory, which is a fault, and
    /// does not run into variables.
    stack: u32,
}

/// True of the machines; of the Arm ones no more than the nRF52840 and the micro:bit have without the record's pages.
const MACHINES: [Machine; 4] = [
    Machine {
        cfgs: &["cortex_m", "mps2", "an386"],
        target: "thumbv7em",
        origins: (0, 0x2000_0000),
        sizes: (1008, 256),
        stack: 16 * 1024,
    },
    // The secure side: it starts there, in SSRAM 1, and has SSRAM 2 for its RAM, below which is nothing.
    Machine {
        cfgs: &["cortex_m", "mps2", "an505"],
        target: "thumbv8m.main",
        origins: (0x1000_0000, 0x3800_0000),
        sizes: (1008, 256),
        stack: 16 * 1024,
    },
    Machine {
        cfgs: &["cortex_m", "microbit"],
        target: "thumbv6m",
        origins: (0, 0x2000_0000),
        sizes: (252, 16),
        stack: 14 * 1024,
    },
    // All of it is RAM, which QEMU loads the image into.
    Machine {
        cfgs: &["virt"],
        target: "riscv32",
        origins: (0x8000_0000, 0x8010_0000),
        sizes: (1024, 256),
        stack: 16 * 1024,
    },
];

/// Images whose variables leave less for the stack on the micro:bit.
const SMALL_STACKS: [(&str, u32); 3] = [("coprocessor", 6992), ("fit", 9 * 1024), ("cost", 7808)];

/// Features of the images of an nRF52840.
const NORDIC: [&str; 3] = ["NRF52840", "EMBASSY", "RTIC"];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=src/bin");
    println!("cargo:rustc-check-cfg=cfg(cortex_m, mps2, an386, an505, microbit, nordic, virt)");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let target = env::var("TARGET").expect("cargo sets TARGET");
    let machine = MACHINES.iter().find(|machine| target.starts_with(machine.target));
    let machine = machine.expect("a target that a machine stands for");
    for cfg in machine.cfgs {
        println!("cargo:rustc-cfg={cfg}");
    }
    let is = |cfg| machine.cfgs.contains(&cfg);
    let has = |feature: &str| env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
    if is("microbit") || NORDIC.into_iter().any(has) {
        println!("cargo:rustc-cfg=nordic");
    }
    for entry in fs::read_dir("src/bin").expect("there are images") {
        let path = entry.expect("it can be read").path();
        let image = path.file_stem().and_then(|stem| stem.to_str()).expect("a name");
        let small = SMALL_STACKS.iter().find(|(name, _)| is("microbit") && *name == image);
        let stack = small.map_or(machine.stack, |(_, bytes)| *bytes);
        let folder = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR")).join(image);
        fs::create_dir_all(&folder).expect("OUT_DIR is writable");
        fs::write(folder.join("memory.x"), memory(machine, stack)).expect("OUT_DIR is writable");
        println!("cargo:rustc-link-arg-bin={image}=-L{}", folder.display());
    }
    if is("virt") {
        // The start-up code of Cortex-M asks for it by itself.
        println!("cargo:rustc-link-arg-bins=-Tmemory.x");
    }
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=--nmagic");
    for (feature, image) in
        [("LOG", "log"), ("NRF52840", "nrf52840"), ("EMBASSY", "embassy"), ("RTIC", "rtic")]
    {
        if has(feature) {
            println!("cargo:rustc-link-arg-bin={image}=-Tdefmt.x");
        }
    }
}

/// The linker's script of a machine's memory, of which so many bytes are stack.
fn memory(machine: &Machine, stack: u32) -> String {
    let Machine { origins: (flash, ram), sizes: (flash_size, ram_size), .. } = machine;
    let variables = 1024 * ram_size - stack;
    let regions = format!(
        "MEMORY
{{
  FLASH : ORIGIN = {flash:#010x}, LENGTH = {flash_size}K
  STACK : ORIGIN = {ram:#010x}, LENGTH = {stack}
  RAM   : ORIGIN = {ram:#010x} + {stack}, LENGTH = {variables}
}}
_stack_end = ORIGIN(STACK);
_stack_start = ORIGIN(STACK) + LENGTH(STACK);
"
    );
    if machine.cfgs.contains(&"cortex_m") {
        return regions;
    }
    // The names that the start-up code of RISC-V has for them.
    let places = [
        ("TEXT", "FLASH"),
        ("RODATA", "FLASH"),
        ("DATA", "RAM"),
        ("BSS", "RAM"),
        ("HEAP", "RAM"),
        ("STACK", "STACK"),
    ];
    let aliases = places.map(|(section, region)| format!("REGION_ALIAS(\"REGION_{section}\", {region});\n"));
    regions + &aliases.concat()
}
