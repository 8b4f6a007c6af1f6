//! The memory map, and the linker scripts that go with it.
//!
//! Link arguments are given here rather than in `.cargo/config.toml`, because a RUSTFLAGS in the environment would
//! silently take the place of those.

use std::{env, fs, path::PathBuf};

/// The machines that stand for boards: cfg, start of the target's name, flash and RAM, KiB. True of the machines, and no
/// more than the nRF52840 and the micro:bit have beside the record's pages.
const MACHINES: [(&str, &str, u32, u32); 2] =
    [("mps2", "thumbv7em", 1008, 256), ("microbit", "thumbv6m", 252, 16)];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-check-cfg=cfg(mps2, microbit)");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let target = env::var("TARGET").expect("cargo sets TARGET");
    let machine = MACHINES.into_iter().find(|(_, start, ..)| target.starts_with(start));
    let (cfg, _, flash, ram) = machine.expect("a target that a machine stands for");
    println!("cargo:rustc-cfg={cfg}");
    let memory = format!(
        "MEMORY
{{
  FLASH : ORIGIN = 0x00000000, LENGTH = {flash}K
  RAM   : ORIGIN = 0x20000000, LENGTH = {ram}K
}}
"
    );
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::write(out.join("memory.x"), memory).expect("OUT_DIR is writable");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=--nmagic");
    if env::var_os("CARGO_FEATURE_LOG").is_some() {
        println!("cargo:rustc-link-arg-bin=log=-Tdefmt.x");
    }
}
