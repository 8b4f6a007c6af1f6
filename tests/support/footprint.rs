//! What an image takes of a board's memory.

use object::elf::{SHF_ALLOC, SHF_WRITE};
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags};

use crate::firmware::{Board, build};

/// Sizes of an image, bytes.
#[derive(Clone, Copy, Debug)]
pub struct Footprint {
    /// Code, constants, and the initial values of variables.
    pub flash: u64,
    /// Variables, the stack apart.
    pub ram: u64,
}

impl Footprint {
    /// Of an image, which is built for this.
    ///
    /// # Panics
    ///
    /// Where it does not build.
    pub fn of(board: Board, image: &str) -> Self {
        let bytes = elf(board, image);
        let file = object::File::parse(&*bytes).expect("an ELF file");
        let mut footprint = Self { flash: 0, ram: 0 };
        for section in file.sections() {
            let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
                panic!("not an ELF file");
            };
            let (kept, written) = (sh_flags.0 & SHF_ALLOC.0 != 0, sh_flags.0 & SHF_WRITE.0 != 0);
            if !kept {
                continue;
            }
            if written {
                footprint.ram += section.size();
            }
            let (_, in_file) = section.file_range().unwrap_or_default();
            footprint.flash += in_file;
        }
        footprint
    }
}

/// The stack that an image has room for, bytes.
///
/// # Panics
///
/// Where it does not build, or does not say.
pub fn stack(board: Board, image: &str) -> u32 {
    let bytes = elf(board, image);
    let file = object::File::parse(&*bytes).expect("an ELF file");
    let at = |name| file.symbol_by_name(name).expect("build.rs defines it").address();
    u32::try_from(at("_stack_start") - at("_stack_end")).expect("32 bits")
}

/// The ELF file of an image, which is built for this.
///
/// # Panics
///
/// Where it does not build.
pub fn elf(board: Board, image: &str) -> Vec<u8> {
    let path = build(board, image, &[]).unwrap_or_else(|refusal| panic!("{refusal}"));
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}
