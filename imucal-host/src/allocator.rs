//! The memory of a program.

use std::hint;

/// Bytes of the block that [`keep_freed_memory`] frees; the GNU allocator learns from blocks of up to 32 MiB.
const FREED: usize = 31 << 20;

/// Lets a program have the memory again that it has freed. For the whole process: a program calls it as it starts, the library never.
///
/// The GNU allocator returns freed memory to the system above a threshold, 256 KiB at first, and takes it again page by
/// page. A freed block raises that threshold to twice its own size. The block is never written, so that it costs nothing;
/// other allocators ignore it. `benches/recordings.rs` shows the time and the memory.
pub fn keep_freed_memory() {
    drop(hint::black_box(Vec::<u8>::with_capacity(FREED)));
}
