//! The memory map, and the linker scripts that go with it.
//!
//! Link arguments are given here rather than in `.cargo/config.toml`, because a RUSTFLAGS in the environment would
//! silently take the place of those.

use std::{env, fs, path::PathBuf};

/// The machines that stand for boards: cfg, start of the target's name, flash and RAM, KiB, and of the RAM the stack,
/// bytes. True of the machines, and no more than the nRF52840 and the micro:bit have beside the record's pages.
///
/// The stack lies at the start of RAM: one that is full leaves memory, which is a fault, and does not run into variables.
const MACHINES: [(&str, &str, u32, u32, u32); 2] =
    [("mps2", "thumbv7em", 1008, 256, 16 * 1024), ("microbit", "thumbv6m", 252, 16, 14 * 1024)];
/// Images whose variables leave less for the stack on the micro:bit.
const SMALL_STACKS: [(&str, u32); 3] = [("coprocessor", 6992), ("fit", 9 * 1024), ("cost", 7808)];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=src/bin");
    println!("cargo:rustc-check-cfg=cfg(mps2, microbit, nordic)");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let target = env::var("TARGET").expect("cargo sets TARGET");
    let machine = MACHINES.into_iter().find(|(_, start, ..)| target.starts_with(start));
    let (cfg, _, flash, ram, stack) = machine.expect("a target that a machine stands for");
    println!("cargo:rustc-cfg={cfg}");
    if cfg == "microbit" || env::var_os("CARGO_FEATURE_NRF52840").is_some() {
        println!("cargo:rustc-cfg=nordic");
    }
    for entry in fs::read_dir("src/bin").expect("there are images") {
        let path = entry.expect("it can be read").path();
        let image = path.file_stem().and_then(|stem| stem.to_str()).expect("a name");
        let small = SMALL_STACKS.iter().find(|(name, _)| cfg == "microbit" && *name == image);
        let stack = small.map_or(stack, |(_, bytes)| *bytes);
        let folder = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR")).join(image);
        fs::create_dir_all(&folder).expect("OUT_DIR is writable");
        fs::write(folder.join("memory.x"), memory(flash, ram, stack)).expect("OUT_DIR is writable");
        println!("cargo:rustc-link-arg-bin={image}=-L{}", folder.display());
    }
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=--nmagic");
    if env::var_os("CARGO_FEATURE_LOG").is_some() {
        println!("cargo:rustc-link-arg-bin=log=-Tdefmt.x");
    }
}

/// The linker's script of a memory, KiB of flash and RAM and bytes of stack.
fn memory(flash: u32, ram: u32, stack: u32) -> String {
    let variables = 1024 * ram - stack;
    format!(
        "MEMORY
{{
  FLASH : ORIGIN = 0x00000000, LENGTH = {flash}K
  STACK : ORIGIN = 0x20000000, LENGTH = {stack}
  RAM   : ORIGIN = 0x20000000 + {stack}, LENGTH = {variables}
}}
_stack_end = ORIGIN(STACK);
_stack_start = ORIGIN(STACK) + LENGTH(STACK);
"
    )
}
